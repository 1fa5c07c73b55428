// SPDX-License-Identifier: Apache-2.0
#include "kkt_system.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

namespace alidade::ceres_batch {
namespace {

double MedianOfPositive(std::vector<double>& values) {
  std::erase_if(values, [](double v) { return !(v > 0.0); });
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

// Values.

Eigen::VectorXd KktSystem::Join(const Eigen::VectorXd& e) const {
  Eigen::VectorXd z = Eigen::VectorXd::Zero(inputs_);
  z.head(run_.inputs_) = e;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const MapLandmark& landmark = run_.landmarks_[i];
    const Eigen::VectorXd& l = landmark.l.size() > 0 ? landmark.l : landmark.from;
    z.segment(points_[i].column, l.size()) = l;
  }
  return z;
}

bool KktSystem::TakeLandmarks(const Eigen::VectorXd& z) {
  std::vector<Point> points;
  if (!run_.PointsOf(z.head(run_.inputs_), false, points)) return false;
  Inverse place;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    MapLandmark& landmark = run_.landmarks_[i];
    landmark.l = landmark.from = z.segment(points_[i].column, landmark.from.size());
    if (!run_.Place(landmark, landmark.l, points, place)) return false;
    landmark.y = landmark.in_state() ? run_.ValuesOf(landmark, points.front().x) : place.y;
  }
  return true;
}

std::optional<KktSystem::Frozen> KktSystem::Freeze(const Eigen::VectorXd& z) {
  const Eigen::VectorXd e = z.head(run_.inputs_);
  std::vector<Point> points;
  if (!TakeLandmarks(z)) return {};
  const std::optional<double> change = run_.Freeze(e);
  if (!change || !TakeLandmarks(z) || !run_.PointsOf(e, false, points)) return {};
  bool joined = false;
  std::vector<double> h;
  for (std::size_t k = 0; k < points.size(); ++k) {
    for (Factor& factor : run_.epochs_[k].factors) {
      const bool seen = factor.landmark >= 0 && factor.outcome == Outcome::kAccepted;
      if (!seen || (chosen_ && !factor.left_out)) continue;
      const MapLandmark& landmark = run_.landmarks_[static_cast<std::size_t>(factor.landmark)];
      const std::vector<double> x =
          factor.row < 0 ? WithLandmark(points[k].x, landmark.y) : points[k].x;
      factor.left_out =
          factor.l.size() == 0 || run_.See(factor, x, h, nullptr) != Outcome::kAccepted;
      joined = joined || (chosen_ && !factor.left_out);
    }
  }
  chosen_ = true;
  return Frozen{*change, joined};
}

bool KktSystem::Settle(Eigen::VectorXd& z, bool all, double left) {
  const double each = std::sqrt(left / std::max(1.0, static_cast<double>(points_.size())));
  const double within = std::max(CondensedRun::kSettledLandmark, each);
  using Undefined = CondensedRun::Undefined;
  std::vector<Point> points;
  if (!run_.PointsOf(z.head(run_.inputs_), false, points)) return false;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (edge_.holds(i)) continue;
    MapLandmark& landmark = run_.landmarks_[i];
    auto l = z.segment(points_[i].column, landmark.from.size());
    landmark.from = l;
    const Undefined undefined = all ? Undefined::kFails : Undefined::kSkipped;
    if (!run_.OptimiseLandmark(landmark, points, undefined, within)) {
      return false;
    }
    l = landmark.l;
  }
  return true;
}

std::optional<double> KktSystem::Cost(const Eigen::VectorXd& z) {
  std::vector<Point> points;
  double cost = 0.5 * z.squaredNorm();
  if (!run_.PointsOf(z.head(run_.inputs_), false, points) ||
      !run_.AddPlain(points, CondensedRun::Undefined::kFails, nullptr, cost)) {
    return {};
  }
  Inverse place;
  Eigen::VectorXd r;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const MapLandmark& landmark = run_.landmarks_[i];
    const Eigen::VectorXd l = z.segment(points_[i].column, landmark.from.size());
    if (!run_.Place(landmark, l, points, place)) return {};
    for (const auto& [epoch, index] : landmark.observations) {
      const Factor& factor = run_.epochs_[epoch].factors[index];
      if (factor.left_out) continue;
      if (!run_.Residual(factor, run_.Joined(points[epoch].x, place.y), r, nullptr)) return {};
      cost += Rho(run_.SensorOf(factor).loss, r.norm());
    }
  }
  return std::isfinite(cost) ? std::optional(cost) : std::nullopt;
}

// The system.

void KktSystem::Set(int i, int j, const Eigen::MatrixXd& value) {
  if (i < 0 || j < 0) return;
  if (i >= j) {
    ldl_.Block(block_of_.at(KeyOf(i, j))) = value;
  } else {
    ldl_.Block(block_of_.at(KeyOf(j, i))) = value.transpose();
  }
}

/// Adds J'J and -J'r of the next term, whose variables' columns lie in J side by side.
void KktSystem::Accumulate(const Eigen::MatrixXd& j, const Eigen::VectorXd& r) {
  const Term& term = terms_[term_++];
  std::size_t block = term.blocks;
  Eigen::Index column = 0;
  for (int a = 0; a < term.count; ++a) {
    const int v = variables_[term.variables + static_cast<std::size_t>(a)];
    const auto j_v = j.middleCols(column, ldl_.SizeOf(v));
    rhs_.segment(ldl_.RowOf(v), j_v.cols()).noalias() -= j_v.transpose() * r;
    Eigen::Index other = 0;
    for (int b = 0; b <= a; ++b) {
      const int u = variables_[term.variables + static_cast<std::size_t>(b)];
      const auto j_u = j.middleCols(other, ldl_.SizeOf(u));
      auto into = ldl_.Block(blocks_[block++]);
      if (v >= u) {
        into.noalias() += j_v.transpose() * j_u;
      } else {
        into.noalias() += j_u.transpose() * j_v;
      }
      other += j_u.cols();
    }
    column += j_v.cols();
  }
}

bool KktSystem::Linearise(const Eigen::VectorXd& z, double damping) {
  damping_ = damping;
  if (!LineariseStates(z, nullptr)) return false;
  if (!LineariseLandmarks(z, false)) return false;
  if (BuildAnew()) return Linearise(z, damping);
  ChooseScale();
  return std::isfinite(step_.cost);
}

/// Whether there are more ties than it was built with.
bool KktSystem::BuildAnew() {
  bool anew = false;
  for (Point3& point : points_) {
    anew = anew || point.ties != point.anchored;
    point.anchored = point.ties;
  }
  if (anew) Build();
  return anew;
}

bool KktSystem::LineariseAbout(const Trajectory& trajectory, Eigen::VectorXd& z) {
  damping_ = 0.0;
  // A constant is one variable: about one value.
  Trajectory about = trajectory;
  for (std::vector<double>& x : about) {
    for (const Block& block : run_.initial_.layout().blocks()) {
      const bool moves = std::ranges::find(rows_, block.tangent_offset) != rows_.end();
      if (!block.has_covariance() || moves) continue;
      std::copy_n(about.back().data() + block.value_offset, block.geometry().ambient,
                  x.data() + block.value_offset);
    }
  }
  if (!LineariseStates(z, &about) || !run_.FreezeLandmarks(at_)) return false;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    MapLandmark& landmark = run_.landmarks_[i];
    if (!run_.OptimiseLandmark(landmark, at_, CondensedRun::Undefined::kSkipped)) return false;
    z.segment(points_[i].column, landmark.l.size()) = landmark.l;
  }
  z_ = z;
  if (!LineariseLandmarks(z, true)) return false;
  return !BuildAnew() || LineariseAbout(trajectory, z);
}

/// The states of z, frame by frame, or those of `about` where it has them; the constraints, and
/// the measurements of no landmark.
bool KktSystem::LineariseStates(const Eigen::VectorXd& z, const Trajectory* about) {
  const auto n = Eigen::Index{run_.initial_.covariance().size()};
  const Eigen::VectorXd e = z.head(run_.inputs_);
  ldl_.SetZero();
  rhs_.setZero(ldl_.size());
  term_ = 0;
  alpha_ = next_alpha_;
  z_ = z;
  step_.cost = 0.5 * z.squaredNorm();
  at_.resize(run_.epochs_.size());
  Point point;
  if (!nodes_.empty() && !run_.Begin(e.data(), nodes_.front().columns, point)) return false;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const Node& node = nodes_[k];
    if (k > 0) {
      point.s.setZero(n, n + node.columns);
      point.s.leftCols(n).setIdentity();
      point.offset.setZero(n);
      point.before = node.column - static_cast<int>(n);
    }
    for (std::size_t i = node.first; i <= node.last; ++i) {
      if (about != nullptr) {
        if (!run_.FreezeEpoch(run_.epochs_[i], e.data(), point)) return false;
        if (i < about->size()) run_.PutAbout((*about)[i], point);
      } else if (!run_.Advance(i, e.data(), point)) {
        return false;
      }
      if (i < node.last) {
        at_[i] = point;
      } else {
        at_[i].x = point.x;
      }
    }
    PutConstraint(k, point, z);
    if (!LinearisePlain(node.last, about != nullptr)) return false;
  }
  return true;
}

void KktSystem::PutConstraint(std::size_t k, const Point& point, const Eigen::VectorXd& z) {
  struct Rows {
    int multiplier;
    const std::vector<int>* rows;
    Eigen::Index at;  ///< in B
  };
  Node& node = nodes_[k];
  std::vector<Rows> all;
  Eigen::Index count = 0;
  const auto put = [&](int multiplier, const std::vector<int>& rows) {
    if (rows.empty()) return;
    all.push_back({multiplier, &rows, count});
    count += std::ssize(rows);
  };
  put(node.multiplier, rows_);
  for (const std::size_t i : node.born) put(constants_[i].multiplier, constants_[i].rows);
  node.b.resize(count, node.columns);
  std::vector<Part> before;
  if (k > 0) before = PartsOf(k - 1);
  const double damped = 1.0 / (1.0 + damping_);
  const Eigen::VectorXd w = z.segment(node.column, node.columns);
  for (const auto& [multiplier, rows, at] : all) {
    const auto size = std::ssize(*rows);
    node.b.middleRows(at, size) = point.s(*rows, Eigen::lastN(node.columns));
    const auto b = node.b.middleRows(at, size);
    rhs_.segment(ldl_.RowOf(multiplier), size) = alpha_ * (point.offset(*rows) - damped * (b * w));
    for (const Part& part : before) {
      const auto found = block_of_.find(
          KeyOf(std::max(multiplier, part.variable), std::min(multiplier, part.variable)));
      if (found == block_of_.end()) continue;  // nothing of it is in these rows
      Set(multiplier, part.variable, -alpha_ * point.s(*rows, *part.rows));
    }
    for (const Rows& other : all) {
      if (other.at > at || !block_of_.contains(KeyOf(std::max(multiplier, other.multiplier),
                                                     std::min(multiplier, other.multiplier)))) {
        continue;
      }
      Set(multiplier, other.multiplier,
          -alpha_ * alpha_ * damped * b *
              node.b.middleRows(other.at, std::ssize(*other.rows)).transpose());
    }
  }
  const auto n = std::ssize(rows_), read = std::ssize(read_rows_);
  const Eigen::MatrixXd own = alpha_ * Eigen::MatrixXd::Identity(n, n);
  Set(node.multiplier, node.read, own.leftCols(read));
  Set(node.multiplier, node.rest, own.rightCols(n - read));
  for (const std::size_t i : node.born) {
    const auto size = std::ssize(constants_[i].rows);
    Set(constants_[i].multiplier, constants_[i].value,
        alpha_ * Eigen::MatrixXd::Identity(size, size));
  }
}

bool KktSystem::LinearisePlain(std::size_t k, bool about) {
  Eigen::VectorXd r;
  Eigen::MatrixXd a, j;
  for (Factor& factor : run_.epochs_[k].factors) {
    if (factor.row < 0) continue;
    // What is not defined about the filter tells nothing yet; it may be at the solution.
    const bool out = !about && factor.left_out;
    const bool frozen = !about || run_.FreezeFactor(factor, at_[k].x);
    if (out || !frozen || !run_.Residual(factor, at_[k].x, r, &a)) {
      if (!out && !about) return false;
      ++term_;
      continue;
    }
    const RobustLoss& loss = run_.SensorOf(factor).loss;
    const double d = r.norm(), root = std::sqrt(Weight(loss, d));
    step_.cost += Rho(loss, d);
    const Term& term = terms_[term_];
    j.resize(r.size(), 0);
    for (int i = 0; i < term.count; ++i) {
      const int v = variables_[term.variables + static_cast<std::size_t>(i)];
      const int constant = constant_of_[static_cast<std::size_t>(v)];
      const std::vector<int>* const rows =
          constant < 0 ? &read_rows_ : &constants_[static_cast<std::size_t>(constant)].rows;
      const Eigen::Index before = j.cols();
      j.conservativeResize(Eigen::NoChange, before + std::ssize(*rows));
      j.rightCols(std::ssize(*rows)) = a(Eigen::all, *rows);
    }
    Accumulate(root * j, root * r);
  }
  return true;
}

bool KktSystem::LineariseLandmarks(const Eigen::VectorXd& z, bool about) {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Eigen::VectorXd l = z.segment(points_[i].column, run_.landmarks_[i].from.size());
    if (!LineariseLandmark(i, l, about)) return false;
  }
  return true;
}

namespace {

/// `left` = (of the first camera, of the constants) to columns of j that are, from `column` on, the
/// constants and then empty: a term is in the order q, the camera here, the first one, constants.
void PutFirstCamera(const Eigen::MatrixXd& left, Eigen::Index column, Eigen::Index read,
                    Eigen::MatrixXd& j) {
  const Eigen::Index constants = left.cols() - read;
  const Eigen::MatrixXd here = j.middleCols(column, constants);
  j.middleCols(column, read) = left.leftCols(read);
  j.middleCols(column + read, constants) = here + left.rightCols(constants);
}

}  // namespace

/// Of l, with so many rows of x_f.
void KktSystem::AccumulatePrior(std::size_t i, Eigen::Index rows, const Eigen::VectorXd& l) {
  if (l.size() == 0) {
    ++term_;
    return;
  }
  const double root_mu = std::sqrt(1.0 + damping_);
  Eigen::MatrixXd prior(l.size(), l.size() + rows);
  prior.setIdentity();
  if (rows > 0) prior.rightCols(rows) = -points_[i].c;
  const Eigen::VectorXd& n = edge_.normal(i);
  const Eigen::VectorXd free = edge_.holds(i) ? l - n * n.dot(l) : l;
  Accumulate(root_mu * prior, free / root_mu);
}

bool KktSystem::LineariseLandmark(std::size_t i, const Eigen::VectorXd& l, bool about) {
  constexpr double kTied = 1e-7;  // of what the camera moves the point by
  const MapLandmark& landmark = run_.landmarks_[i];
  Point3& point = points_[i];
  Inverse& place = point.place;
  if (!run_.Place(landmark, l, at_, place)) return false;
  const bool held = edge_.holds(i);
  if (held) place.by_d -= place.by_d * edge_.normal(i) * edge_.normal(i).transpose();
  const auto n = Eigen::Index{run_.initial_.covariance().size()};
  std::vector<int> rows = read_rows_;  // of x_f
  for (const int constant : landmark_constants_) {
    const std::vector<int>& more = constants_[static_cast<std::size_t>(constant)].rows;
    rows.insert(rows.end(), more.begin(), more.end());
  }
  const Eigen::Index inputs = l.size(), read = std::ssize(read_rows_), all = std::ssize(rows);
  point.c = run_.FollowOf(landmark, place, static_cast<int>(inputs))(Eigen::all, rows);
  if (held) point.c.setZero();
  place.by_x = place.by_x(Eigen::all, rows).eval();
  const Eigen::MatrixXd rest = place.by_x - place.by_d * point.c;  // what is left to the camera
  AccumulatePrior(i, landmark.first ? all : 0, l);
  Eigen::VectorXd r;
  Eigen::MatrixXd a, j;
  for (const auto& [epoch, index] : landmark.observations) {
    const Factor& factor = run_.epochs_[epoch].factors[index];
    const bool out = !about && factor.left_out;
    if (out || !run_.Residual(factor, run_.Joined(at_[epoch].x, place.y), r, &a)) {
      if (!out && !about) return false;
      ++term_;
      continue;
    }
    const RobustLoss& loss = run_.SensorOf(factor).loss;
    const double d = r.norm(), root = std::sqrt(Weight(loss, d));
    step_.cost += Rho(loss, d);
    const auto a_y = a.rightCols(a.cols() - n);
    const bool here = landmark.first && landmark.first->epoch == epoch;
    const bool tied = point.anchored && !here && read > 0;
    j.resize(r.size(), inputs + all + (tied ? read : 0));
    j.leftCols(inputs).noalias() = a_y * place.by_d;
    j.middleCols(inputs, all) = a(Eigen::all, rows);
    if (landmark.first) {
      const Eigen::MatrixXd left = a_y * rest;
      if (here) {
        j.middleCols(inputs, all) += left;
      } else if (tied) {
        PutFirstCamera(left, inputs + read, read, j);
      } else {
        point.ties = point.ties || left.norm() > kTied * (a_y * place.by_x).norm();
      }
    }
    j *= root;
    r *= root;
    Accumulate(j, r);
  }
  return true;
}

/// alpha for the next time.
void KktSystem::ChooseScale() {
  std::vector<double> h, q;
  for (const Node& node : nodes_) {
    for (Eigen::Index i = 0; i < node.b.rows(); ++i) q.push_back(node.b.row(i).squaredNorm());
    if (node.read < 0) continue;
    const auto found = block_of_.find(KeyOf(node.read, node.read));
    if (found == block_of_.end()) continue;
    const Eigen::VectorXd diagonal = ldl_.Block(found->second).diagonal();
    h.insert(h.end(), diagonal.begin(), diagonal.end());
  }
  const double of_h = MedianOfPositive(h), of_q = MedianOfPositive(q);
  next_alpha_ = of_h > 0.0 && of_q > 0.0 ? std::sqrt(of_h / of_q) : 1.0;
}

/// Of the rows of B.
Eigen::VectorXd KktSystem::Multipliers(const Node& node) const {
  Eigen::VectorXd lambda(node.b.rows());
  Eigen::Index offset = 0;
  const auto put = [&](int variable) {
    if (variable < 0) return;
    const int size = ldl_.SizeOf(variable);
    lambda.segment(offset, size) = solution_.segment(ldl_.RowOf(variable), size);
    offset += size;
  };
  put(node.multiplier);
  for (const std::size_t i : node.born) put(constants_[i].multiplier);
  return lambda;
}

bool KktSystem::Solve() {
  constexpr int kRefinements = 1;
  if (!ldl_.Factorise()) return run_.Fail("the batch has a singular pivot");
  solution_ = ldl_.Solve(rhs_, kRefinements);
  if (!solution_.allFinite()) return run_.Fail("the step of the batch is not finite");
  step_.dz.resize(inputs_);
  Eigen::VectorXd states = solution_;  // and no multipliers
  const auto drop = [&](int variable) {
    if (variable >= 0) states.segment(ldl_.RowOf(variable), ldl_.SizeOf(variable)).setZero();
  };
  for (const Node& node : nodes_) {
    const auto w = z_.segment(node.column, node.columns);
    step_.dz.segment(node.column, node.columns) =
        (alpha_ * (node.b.transpose() * Multipliers(node)) - w) / (1.0 + damping_);
    drop(node.multiplier);
  }
  for (const Constant& constant : constants_) drop(constant.multiplier);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Point3& point = points_[i];
    if (point.variable < 0) continue;
    const int size = ldl_.SizeOf(point.variable);
    auto l = step_.dz.segment(point.column, size);
    l = solution_.segment(ldl_.RowOf(point.variable), size);
    const MapLandmark& landmark = run_.landmarks_[i];
    if (landmark.first) l -= point.c * CameraOf(landmark, solution_);
  }
  // dz' (A + mu I) dz: that of e, and in the states that of r and l.
  step_.decrement = (1.0 + damping_) * step_.dz.head(run_.inputs_).squaredNorm() +
                    states.dot(ldl_.Multiply(states));
  return true;
}

/// The part of x_f that a landmark follows.
Eigen::VectorXd KktSystem::CameraOf(const MapLandmark& landmark,
                                    const Eigen::VectorXd& from) const {
  std::vector<int> variables{nodes_[node_of_[landmark.first->epoch]].read};
  for (const int i : landmark_constants_) {
    variables.push_back(constants_[static_cast<std::size_t>(i)].value);
  }
  Eigen::VectorXd camera;
  for (const int v : variables) {
    if (v < 0) continue;
    const Eigen::Index before = camera.size();
    camera.conservativeResize(before + ldl_.SizeOf(v));
    camera.tail(ldl_.SizeOf(v)) = from.segment(ldl_.RowOf(v), ldl_.SizeOf(v));
  }
  return camera;
}

void KktSystem::Move(Trajectory& trajectory) const {
  const auto n = Eigen::Index{run_.initial_.covariance().size()};
  trajectory.resize(at_.size());
  Eigen::VectorXd before = Eigen::VectorXd::Zero(n), now;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const Node& node = nodes_[k];
    now.setZero(n);
    for (const Part& part : PartsOf(k)) {
      now(*part.rows) = solution_.segment(ldl_.RowOf(part.variable), ldl_.SizeOf(part.variable));
    }
    for (const Constant& constant : constants_) {
      if (!constant.of_landmark) continue;
      now(constant.rows) =
          solution_.segment(ldl_.RowOf(constant.value), ldl_.SizeOf(constant.value));
    }
    const auto w = step_.dz.segment(node.column, node.columns);
    for (std::size_t i = node.first; i <= node.last; ++i) {
      Eigen::VectorXd d = now;
      if (i < node.last) {
        d = at_[i].offset + at_[i].s.rightCols(node.columns) * w;
        if (k > 0) d += at_[i].s.leftCols(n) * before;
      }
      trajectory[i] = at_[i].x;
      for (const Block& block : run_.initial_.layout().blocks()) {
        if (!block.has_covariance()) continue;
        double* const x = trajectory[i].data() + block.value_offset;
        block.geometry().Plus(x, d.data() + block.tangent_offset, x);
      }
    }
    before = now;
  }
}

}  // namespace alidade::ceres_batch
