// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "alidade/state/dense_algebra.h"
#include "condensed_run.h"

/// How the first frame of a CondensedRun becomes part of its prior.
namespace alidade::ceres_batch {

/// Of the inputs w up to the first frame, c of them, and of those of the landmarks that began in
/// it, with its residuals r(w^) and A = dr/dw, weighed:
///
///   [I; A] = Q U,   w ~ N(w^ + s, (U'U)^-1),   s = -(U'U)^-1 (w^ + A' r)
///   x      = x^ (+) (S s + S U^-1 n),   n ~ N(0, I)
///   L'     = triangle of U^-T S' = Q_L L',   e_0 = -Q_L' U s   is where x = x^
///
/// x are the state and the landmarks that go on, S = dx/dw. What has ended has no rows in S: that
/// it is left out of a covariance is that it is marginalised.
bool CondensedRun::MarginaliseFirst(Eigen::VectorXd& e, const std::vector<LandmarkEstimate>& map,
                                    Trajectory& about) {
  ALIDADE_EXPECTS(!epochs_.empty() && e.size() == inputs_);
  if (!epochs_.front().ends) {
    PassOnFirst(about);
    return true;
  }
  const Eigen::Index c = epochs_.size() > 1 ? epochs_[1].column : inputs_;
  std::vector<Point> first(1);
  Point& point = first.front();
  if (!Begin(e.data(), inputs_, point) || !Advance(0, e.data(), point)) return false;
  point.s = point.s.leftCols(c).eval();
  std::vector<Leaving> leaving;
  if (!FindLeaving(first, leaving)) return false;
  Eigen::Index columns = c;
  Eigen::VectorXd w = e.head(c);
  for (Leaving& one : leaving) {
    const Eigen::VectorXd& l = landmarks_[one.landmark].l;
    one.column = columns;
    columns += l.size();
    w.conservativeResize(columns);
    w.tail(l.size()) = l;
  }
  Eigen::MatrixXd j = Eigen::MatrixXd::Identity(columns, columns);
  if (!LineariseFirst(point, leaving, j, w)) return false;
  const internal::LeastSquares newest = internal::SolveLeastSquares(j, w);
  const Eigen::MatrixXd& u = newest.r;
  const Eigen::VectorXd step = -newest.x;
  if (!step.allFinite()) return Fail("the prior of the window is not finite");

  const std::vector<bool> goes_on = FindGoingOn(leaving, map);
  const Eigen::MatrixXd s = PutInState(point, leaving, goes_on, columns);
  const Eigen::Index n = s.rows();
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(std::max(columns, n), n);
  if (n > 0) y.topRows(columns) = u.transpose().triangularView<Eigen::Lower>().solve(s.transpose());
  Eigen::VectorXd e0 = Eigen::VectorXd::Zero(y.rows());
  e0.head(columns) = -u * step;
  const internal::LeastSquares of_y = internal::SolveLeastSquares(y, e0);
  d0_ = s * step;
  l0_ = of_y.r.transpose();
  Eigen::VectorXd moved(n + e.size() - c);
  moved << of_y.q_adjoint_b.head(n), e.tail(e.size() - c);
  e = std::move(moved);
  for (const FirstValue& value : epochs_.front().first_values) {
    prior_[static_cast<std::size_t>(value.block)] = true;
  }
  DropFirst(about);
  LetGo(goes_on);
  Shift(static_cast<int>(n - c));
  return true;
}

/// The landmarks with inputs that begin in the first frame, or are known and seen from it, at the
/// point of it.
bool CondensedRun::FindLeaving(const std::vector<Point>& first,
                               std::vector<Leaving>& leaving) const {
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const MapLandmark& landmark = landmarks_[i];
    const auto& seen = landmark.observations;
    const bool begins = landmark.first && landmark.first->epoch == 0;
    const bool known = !landmark.first && !seen.empty() && seen.front().epoch == 0;
    if (!begins && !known) continue;
    Leaving& one = leaving.emplace_back();
    one.landmark = i;
    if (!Place(landmark, landmark.l, first, one.place)) return false;
  }
  return true;
}

/// Puts the weighed residuals of the first frame, by (e, l), behind the rows of the prior.
bool CondensedRun::LineariseFirst(const Point& point, const std::vector<Leaving>& leaving,
                                  Eigen::MatrixXd& j, Eigen::VectorXd& r) const {
  const Eigen::Index n = initial_.covariance().size(), c = point.s.cols(), prior = j.rows();
  Eigen::Index rows = prior;
  for (const Factor& factor : epochs_.front().factors) {
    rows += ModelOf(factor).measurement().geometry.tangent;  // at most
  }
  j.conservativeResizeLike(Eigen::MatrixXd::Zero(rows, j.cols()));
  r.conservativeResizeLike(Eigen::VectorXd::Zero(rows));
  Eigen::Index row = prior;
  Eigen::VectorXd residual;
  Eigen::MatrixXd a;
  const auto add = [&](const Factor& factor, const std::vector<double>& x,
                       const Leaving* leaving_landmark) {
    if (factor.left_out) return true;
    if (!Residual(factor, x, residual, &a)) return false;
    const double root = std::sqrt(Weight(SensorOf(factor).loss, residual.norm()));
    Eigen::MatrixXd a_x = a.leftCols(n);
    if (leaving_landmark != nullptr) {
      const auto a_y = a.rightCols(a.cols() - n);
      a_x += a_y * leaving_landmark->place.by_x;
      j.block(row, leaving_landmark->column, a.rows(), leaving_landmark->place.by_d.cols()) =
          root * a_y * leaving_landmark->place.by_d;
    }
    j.block(row, 0, a.rows(), c) = root * a_x * point.s;
    r.segment(row, a.rows()) = root * residual;
    row += a.rows();
    return true;
  };
  for (const Factor& factor : epochs_.front().factors) {
    if (factor.row >= 0 && !add(factor, point.x, nullptr)) return false;
  }
  for (const Leaving& one : leaving) {
    const std::vector<double> x = WithLandmark(point.x, one.place.y);
    for (const auto& [epoch, index] : landmarks_[one.landmark].observations) {
      if (epoch == 0 && !add(epochs_.front().factors[index], x, &one)) return false;
    }
  }
  j.conservativeResize(row, Eigen::NoChange);
  r.conservativeResize(row);
  return true;
}

/// By landmark: a frame behind the first one sees it, or a filter has it, or it has not begun yet.
std::vector<bool> CondensedRun::FindGoingOn(const std::vector<Leaving>& leaving,
                                            const std::vector<LandmarkEstimate>& map) const {
  std::vector<bool> goes_on(landmarks_.size(), true);
  for (std::size_t i = 0; i < landmarks_.size(); ++i) goes_on[i] = !landmarks_[i].in_state();
  for (const Leaving& one : leaving) {
    goes_on[one.landmark] = landmarks_[one.landmark].l.size() == 0;  // known exactly
  }
  for (std::size_t k = 1; k < epochs_.size(); ++k) {
    for (const Factor& factor : epochs_[k].factors) {
      if (factor.landmark >= 0) goes_on[static_cast<std::size_t>(factor.landmark)] = true;
    }
  }
  for (const LandmarkEstimate& estimate : map) {
    const auto current = current_.find(estimate.id);
    if (current == current_.end() || current->second.landmark < 0) continue;
    if (current->second.generation != estimate.generation) continue;
    goes_on[static_cast<std::size_t>(current->second.landmark)] = true;
  }
  return goes_on;
}

/// The state becomes that of the point, with the landmarks that go on, and began in the first frame
/// or before, behind it: S = dx/dw.
Eigen::MatrixXd CondensedRun::PutInState(const Point& point, std::vector<Leaving>& leaving,
                                         const std::vector<bool>& goes_on, Eigen::Index columns) {
  const Eigen::Index c = point.s.cols();
  State state = Filled(binding_.initial);
  std::copy_n(point.x.begin(), state.values().size(), state.values().begin());
  std::vector<int> rows(static_cast<std::size_t>(state.covariance().size()));  // of those before
  std::iota(rows.begin(), rows.end(), 0);
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    MapLandmark& landmark = landmarks_[i];
    if (!landmark.in_state() || !goes_on[i]) continue;
    landmark.mean = ValuesOf(landmark, point.x);
    for (const BlockId id : landmark.blocks) {
      const Block& block = initial_.layout()[id];
      for (int k = 0; k < block.geometry().tangent; ++k) rows.push_back(block.tangent_offset + k);
    }
    AddBlocks(landmark, state);
  }
  Eigen::MatrixXd s = Eigen::MatrixXd::Zero(std::ssize(rows), columns);
  s.leftCols(c) = point.s(rows, Eigen::all);
  for (Leaving& one : leaving) {
    MapLandmark& landmark = landmarks_[one.landmark];
    if (landmark.l.size() == 0 || !goes_on[one.landmark]) continue;
    const Eigen::Index row = s.rows(), t = one.place.by_d.rows();
    s.conservativeResizeLike(Eigen::MatrixXd::Zero(row + t, columns));
    s.block(row, 0, t, c) = one.place.by_x * point.s;
    s.block(row, one.column, t, one.place.by_d.cols()) = one.place.by_d;
    landmark.mean = std::move(one.place.y);
    AddBlocks(landmark, state);
  }
  initial_ = std::move(state);
  PutPlaces();
  return s;
}

/// Its value in x.
std::vector<double> CondensedRun::ValuesOf(const MapLandmark& landmark,
                                           const std::vector<double>& x) const {
  std::vector<double> values;
  for (const BlockId id : landmark.blocks) {
    const Block& block = initial_.layout()[id];
    const auto value = x.begin() + block.value_offset;
    values.insert(values.end(), value, value + block.geometry().ambient);
  }
  return values;
}

/// Puts a landmark behind the state, at its mean; it has no inputs any more.
void CondensedRun::AddBlocks(MapLandmark& landmark, State& state) const {
  const double* next = landmark.mean.data();
  landmark.blocks.clear();
  for (const Space& role : ModelOf(landmark.sensor, landmark.xyz).roles()) {
    if (!role.landmark()) continue;
    const std::string name = "landmarks." + std::to_string(landmark.id) + '.' +
                             std::to_string(landmark.generation) + '.' + role.name;
    const int t = role.geometry.tangent;
    landmark.blocks.push_back(state.Declare(name, "landmarks", role));
    state.Add(landmark.blocks.back(), next, Eigen::MatrixXd::Zero(t, t));
    next += role.geometry.ambient;
  }
  landmark.first.reset();
  landmark.from.resize(0);
  landmark.l.resize(0);
  landmark.places = binding_.sensor_places;
  for (std::size_t i = 0; i < landmark.places.size(); ++i) {
    const SensorBinding& sensor = binding_.problem.sensors[i];
    if (!ObservesLandmarks(sensor)) continue;
    const std::vector<Space>& roles =
        (landmark.xyz && sensor.xyz ? *sensor.xyz : *sensor.model).roles();
    const auto own = std::ranges::count_if(roles, &Space::landmark);
    landmark.places[i].PutLandmark(roles.size() - static_cast<std::size_t>(own), state.layout(),
                                   landmark.blocks);
  }
}

/// Forgets the landmarks that do not go on. Those that have come into the state are seen by factors
/// of it.
void CondensedRun::LetGo(const std::vector<bool>& goes_on) {
  std::vector<int> moved(landmarks_.size(), -1);
  std::vector<MapLandmark> left;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    MapLandmark& landmark = landmarks_[i];
    if (goes_on[i]) moved[i] = static_cast<int>(left.size());
    Current& current = current_.at(landmark.id);
    if (current.generation == landmark.generation) current.landmark = moved[i];
    if (landmark.in_state()) landmark.observations.clear();
    if (goes_on[i]) left.push_back(std::move(landmark));
  }
  landmarks_ = std::move(left);
  for (Epoch& epoch : epochs_) {
    for (Factor& factor : epoch.factors) {
      if (factor.landmark < 0) continue;
      factor.landmark = moved[static_cast<std::size_t>(factor.landmark)];
      if (landmarks_[static_cast<std::size_t>(factor.landmark)].in_state()) factor.row = 0;
    }
  }
}

/// Drops the first frame, which tells nothing; the steps to it lead to the next one.
void CondensedRun::PassOnFirst(Trajectory& about) {
  passed_on_.swap(epochs_.front().steps);
  DropFirst(about);
  if (epochs_.empty()) return;
  Epoch& next = epochs_.front();
  next.column = 0;
  next.steps.insert(next.steps.begin(), passed_on_.begin(), passed_on_.end());
  passed_on_.clear();
}

void CondensedRun::DropFirst(Trajectory& about) {
  epochs_.erase(epochs_.begin());
  for (MapLandmark& landmark : landmarks_) {
    std::erase_if(landmark.observations, [](const auto& seen) { return seen.epoch == 0; });
    for (MapLandmark::Observation& seen : landmark.observations) --seen.epoch;
    if (landmark.first) --landmark.first->epoch;
  }
  if (about.empty()) return;
  about.erase(about.begin());
  const auto size = std::ssize(binding_.initial.values());
  for (std::vector<double>& x : about) {
    x.resize(initial_.values().size());
    std::copy(initial_.values().begin() + size, initial_.values().end(), x.begin() + size);
  }
}

/// The places of inputs and residuals, once those of the first frame are gone.
void CondensedRun::Shift(int columns) {
  inputs_ += columns;
  for (int& column : held_) column += column < 0 ? 0 : columns;
  residuals_ = 0;
  parts_.clear();
  for (Epoch& epoch : epochs_) {
    epoch.column = &epoch == &epochs_.front() ? 0 : epoch.column + columns;
    for (Step& step : epoch.steps) {
      step.column += columns;
      step.columns += columns;
    }
    for (FirstValue& first : epoch.first_values) first.column += columns;
    for (Factor& factor : epoch.factors) {
      if (factor.row >= 0) AddPart(factor);
    }
  }
}

}  // namespace alidade::ceres_batch
