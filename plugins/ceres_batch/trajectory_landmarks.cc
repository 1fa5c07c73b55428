// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/src/landmark_forms.h"
#include "trajectory.h"

/// The landmarks of a Trajectory: how they enter it, where they are, what they tell of the states.
namespace alidade::ceres_batch {
namespace {

/// The value of the camera's role `position`; null where the sensor has none.
const double* CameraOf(const SensorBinding& sensor, const State& state) {
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    if (sensor.model.roles()[i].name == "position") return state.value(sensor.roles[i].block);
  }
  return nullptr;
}

/// The prior of the inverse distance that the filter gave a landmark in this frame, 1/m.
double PriorOf(std::int64_t id, const SensorBinding& sensor, const LandmarkOptions::Prior& prior,
               const Estimator& filter) {
  if (prior.from_map == 0) return prior.inverse_distance;
  const std::vector<LandmarkEstimate> map = filter.landmarks();
  const auto found = std::ranges::find(map, id, &LandmarkEstimate::id);
  const double* const camera = CameraOf(sensor, filter.state());
  if (found == map.end() || camera == nullptr) return prior.inverse_distance;
  if (!std::isnan(found->inverse_distance)) return found->inverse_distance;
  return 1.0 / (found->position - Eigen::Map<const Eigen::Vector3d>(camera)).norm();
}

}  // namespace

/// What no filter has to say: landmarks known beforehand, and which rows of a state sensors read.
void Trajectory::AddKnown() {
  std::vector<bool> reads(static_cast<std::size_t>(initial_.covariance().size()), false);
  for (const SensorBinding& sensor : system_.sensors) {
    for (const RoleBinding& role : sensor.roles) {
      if (role.block < 0 || !initial_.layout()[role.block].has_covariance()) continue;
      const Block& block = initial_.layout()[role.block];
      std::fill_n(reads.begin() + block.tangent_offset, block.geometry().tangent, true);
    }
  }
  for (std::size_t i = 0; i < reads.size(); ++i) {
    if (reads[i]) read_.push_back(static_cast<int>(i));
  }
  for (const KnownLandmark& known : system_.landmarks->known) {
    current_[known.id] = static_cast<int>(landmarks_.size());
    MapLandmark& landmark = landmarks_.emplace_back();
    landmark.id = known.id;
    landmark.sigma = known.sigma;
    landmark.mean.assign(known.position.begin(), known.position.end());
    landmark.from = Eigen::VectorXd::Zero(known.sigma > 0.0 ? 3 : 0);
  }
}

/// The sights of a frame. A landmark begins with the one that the filter began it with; what the
/// filter had no landmark for, or could not predict, is left out.
void Trajectory::AddLandmarks(const UpdateReport& report, const Estimator& filter, Epoch& epoch) {
  epoch.counts.initialised = report.landmarks.initialised;
  epoch.counts.deleted = report.landmarks.deleted;
  std::vector<std::size_t> begin;
  for (std::size_t i = 0; i < epoch.factors.size(); ++i) {
    Factor& factor = epoch.factors[i];
    if (!SensorOf(factor).model.has_landmark()) continue;
    if (factor.outcome == Outcome::kInitialised) begin.push_back(i);
    if (factor.outcome != Outcome::kAccepted) continue;
    const Outcome told = report.measurements()[i].outcome;
    const auto current = current_.find(factor.measurement.landmark);
    const bool lost = told == Outcome::kNotReady || told == Outcome::kOutOfDomain ||
                      told == Outcome::kInvalid || told == Outcome::kFailed;
    if (lost || current == current_.end()) {
      factor.outcome = lost ? told : Outcome::kNotReady;
      continue;
    }
    factor.landmark = current->second;
    landmarks_[static_cast<std::size_t>(current->second)].sights.push_back({epochs_.size(), i});
  }
  for (const std::size_t i : begin) {
    Begin(epoch.factors[i], i, filter);
    epoch.factors[i].landmark = static_cast<int>(landmarks_.size()) - 1;
  }
}

void Trajectory::Begin(const Factor& factor, std::size_t index, const Estimator& filter) {
  const SensorBinding& sensor = SensorOf(factor);
  const std::int64_t id = factor.measurement.landmark;
  const auto before = current_.find(id);
  MapLandmark landmark;
  landmark.id = id;
  landmark.first = {epochs_.size(), index};
  if (before != current_.end()) {
    landmark.generation = landmarks_[static_cast<std::size_t>(before->second)].generation + 1;
  }
  if (sensor.model.prior_size() > 0) {
    landmark.prior = PriorOf(id, sensor, *system_.landmarks->prior, filter);
    landmark.sigma = system_.landmarks->prior->sigma;
  }
  landmark.from = Eigen::VectorXd::Zero(sensor.model.measurement().geometry.tangent +
                                        sensor.model.prior_size());
  current_[id] = static_cast<int>(landmarks_.size());
  landmarks_.push_back(std::move(landmark));
}

/// y at the inputs l, and in by_d its derivative by all of them.
bool Trajectory::Place(const MapLandmark& landmark, const Eigen::VectorXd& l,
                       const std::vector<Point>& points, Inverse& place) const {
  if (!landmark.first) {
    place.y = landmark.mean;
    for (Eigen::Index i = 0; i < l.size(); ++i) {
      place.y[static_cast<std::size_t>(i)] += landmark.sigma * l[i];
    }
    place.by_x = Eigen::MatrixXd::Zero(3, initial_.covariance().size());
    place.by_d = landmark.sigma * Eigen::MatrixXd::Identity(3, l.size());
    return true;
  }
  const auto [epoch, index] = *landmark.first;
  const Factor& factor = epochs_[epoch].factors[index];
  const int m = SensorOf(factor).model.measurement().geometry.tangent;
  const bool has_noise = factor.l.size() > 0;
  Eigen::VectorXd d = Eigen::VectorXd::Zero(m);
  if (has_noise) d = factor.l * l.head(m);
  const Eigen::VectorXd prior = landmark.prior + (landmark.sigma * l.tail(l.size() - m)).array();
  if (!Invert(factor, d, l.size() > m ? prior.data() : nullptr, points[epoch],
              "landmark " + std::to_string(landmark.id), place)) {
    return false;
  }
  Eigen::MatrixXd by_l = Eigen::MatrixXd::Zero(place.by_d.rows(), l.size());
  if (has_noise) by_l.leftCols(m) = place.by_d * factor.l;
  by_l.rightCols(l.size() - m) = landmark.sigma * place.by_prior;
  place.by_d = std::move(by_l);
  return true;
}

/// R of all sights of landmarks, these where they were found last. One that is not defined keeps
/// what it had.
bool Trajectory::FreezeLandmarks(const std::vector<Point>& points) {
  for (MapLandmark& landmark : landmarks_) {
    if (landmark.l.size() == 0) landmark.l = landmark.from;
    Inverse place;
    if (!Place(landmark, landmark.l, points, place)) return false;
    if (landmark.first) {
      const auto [epoch, index] = *landmark.first;
      if (!FreezeFactor(epochs_[epoch].factors[index], points[epoch], place.y) ||
          !Place(landmark, landmark.l, points, place)) {
        return false;
      }
    }
    for (const auto& [epoch, index] : landmark.sights) {
      Factor& factor = epochs_[epoch].factors[index];
      std::vector<double> h(factor.measurement.values.size());
      const std::vector<const double*> roles = RolesOf(factor, points[epoch], place.y);
      const bool defined = ModelOf(factor).Predict(roles.data(), h.data()) == Status::kOk;
      if (defined && !FreezeFactor(factor, points[epoch], place.y)) return false;
    }
  }
  return true;
}

/// The rows that sensors read.
Eigen::MatrixXd Trajectory::Packed(const Eigen::MatrixXd& rows) const {
  return rows(read_, Eigen::all);
}

/// One sight: J_x = a_x at its frame, a_y J_y_x at the first sight's, J_l = a_y J_y_l.
bool Trajectory::AddSight(const Factor& factor, std::size_t epoch, const MapLandmark& landmark,
                          const Inverse& place, const Point& point, Normal& normal,
                          Information* information) const {
  const int n = initial_.covariance().size();
  const auto d = std::ssize(read_);
  Eigen::VectorXd r;
  Eigen::MatrixXd a;
  if (!Residual(factor, point, place.y, r, &a)) return false;
  const RobustLoss& loss = SensorOf(factor).loss;
  normal.cost += Rho(loss, r.norm());
  const double root = std::sqrt(Weight(loss, r.norm()));
  r *= root;
  a *= root;
  const Eigen::MatrixXd a_y = a.rightCols(a.cols() - n), a_l = a_y * place.by_d;
  normal.c.noalias() += a_l.transpose() * a_l;
  normal.b.noalias() += a_l.transpose() * r;
  if (information == nullptr) return true;
  Eigen::MatrixXd a_x = Packed(a.leftCols(n).transpose()), a_first;
  if (landmark.first) {
    a_first = Packed((a_y * place.by_x).transpose());
    if (landmark.first->epoch == epoch) {
      a_x += a_first;
      a_first.resize(0, 0);
    }
  }
  const auto here = d * static_cast<Eigen::Index>(epoch);
  information->h.block(here, here, d, d).noalias() += a_x * a_x.transpose();
  information->g.segment(here, d).noalias() += a_x * r;
  if (normal.epochs.empty() || normal.epochs.back() != epoch) {
    normal.epochs.push_back(epoch);
    normal.ties.emplace_back(Eigen::MatrixXd::Zero(d, normal.b.size()));
  }
  normal.ties.back().noalias() += a_x * a_l;
  if (a_first.size() == 0) return true;
  const auto first = d * static_cast<Eigen::Index>(landmark.first->epoch);
  information->h.block(first, first, d, d).noalias() += a_first * a_first.transpose();
  information->h.block(here, first, d, d).noalias() += a_x * a_first.transpose();
  information->g.segment(first, d).noalias() += a_first * r;
  normal.ties.front().noalias() += a_first * a_l;
  return true;
}

/// The normal equations of a landmark at the inputs l; into `information`, unless null, what its
/// sights tell of the states, l apart.
bool Trajectory::NormalOf(const MapLandmark& landmark, const Eigen::VectorXd& l,
                          const std::vector<Point>& points, Undefined undefined, Normal& normal,
                          Information* information) const {
  Inverse place;
  if (!Place(landmark, l, points, place)) return false;
  normal.cost = 0.5 * l.squaredNorm();
  normal.c = Eigen::MatrixXd::Identity(l.size(), l.size());
  normal.b = l;
  normal.epochs.clear();
  normal.ties.clear();
  if (landmark.first && information != nullptr) {
    normal.epochs.push_back(landmark.first->epoch);
    normal.ties.emplace_back(Eigen::MatrixXd::Zero(std::ssize(read_), l.size()));
  }
  for (const auto& [epoch, index] : landmark.sights) {
    const Factor& factor = epochs_[epoch].factors[index];
    const bool added = AddSight(factor, epoch, landmark, place, points[epoch], normal, information);
    if (!added && undefined == Undefined::kFails) return false;
  }
  return true;
}

/// Puts the landmark where it costs least, seen from the points: Gauss-Newton steps, halved until
/// the cost falls.
bool Trajectory::Settle(MapLandmark& landmark, const std::vector<Point>& points,
                        Undefined undefined) const {
  constexpr int kMostSteps = 50, kMostHalvings = 20;
  constexpr double kSettled = 1e-10;  // sigma of what is left to go
  Normal now, next;
  landmark.l = landmark.from;
  if (!NormalOf(landmark, landmark.l, points, undefined, now, nullptr)) {
    landmark.l.setZero();
    if (!NormalOf(landmark, landmark.l, points, undefined, now, nullptr)) return false;
  }
  for (int i = 0; i < kMostSteps && landmark.l.size() > 0; ++i) {
    Eigen::VectorXd step = -now.c.llt().solve(now.b);
    if (!(-step.dot(now.b) > kSettled * kSettled)) break;
    bool fell = false;
    for (int k = 0; k < kMostHalvings && !fell; ++k, step *= 0.5) {
      fell = NormalOf(landmark, landmark.l + step, points, undefined, next, nullptr) &&
             next.cost < now.cost;
      if (fell) landmark.l += step;
    }
    if (!fell) break;
    std::swap(now, next);
  }
  Inverse place;
  if (!Place(landmark, landmark.l, points, place)) return false;
  landmark.y = place.y;
  return true;
}

/// The points of e, by frame.
bool Trajectory::PointsOf(const double* e, bool sensitivity, std::vector<Point>& points) const {
  Point point;
  if (!Begin(e, sensitivity, point)) return false;
  for (std::size_t k = 0; k < epochs_.size(); ++k) {
    if (!Advance(k, e, point)) return false;
    points.push_back(point);
  }
  return true;
}

bool Trajectory::Reduce(const double* e, bool derivatives, Reduced& reduced) {
  std::vector<Point> points;
  return PointsOf(e, derivatives, points) &&
         Project(e, points, Undefined::kFails, derivatives, reduced);
}

/// The measurements of no landmark.
bool Trajectory::AddPlain(const std::vector<Point>& points, Undefined undefined,
                          Information* information, double& cost) const {
  const int n = initial_.covariance().size();
  const auto d = std::ssize(read_);
  Eigen::VectorXd r;
  Eigen::MatrixXd a;
  for (std::size_t k = 0; k < points.size(); ++k) {
    for (const Factor& factor : epochs_[k].factors) {
      if (factor.row < 0) continue;
      if (!Residual(factor, points[k], {}, r, information != nullptr ? &a : nullptr)) {
        if (undefined == Undefined::kFails) return false;
        continue;
      }
      const RobustLoss& loss = SensorOf(factor).loss;
      cost += Rho(loss, r.norm());
      if (information == nullptr) continue;
      const double w = Weight(loss, r.norm());
      const Eigen::MatrixXd a_x = Packed(a.leftCols(n).transpose());
      const auto here = d * static_cast<Eigen::Index>(k);
      information->h.block(here, here, d, d).noalias() += w * a_x * a_x.transpose();
      information->g.segment(here, d).noalias() += w * a_x * r;
    }
  }
  return true;
}

/// phi and its derivatives at the points, from the landmarks settled there.
bool Trajectory::Project(const double* e, const std::vector<Point>& points, Undefined undefined,
                         bool derivatives, Reduced& reduced) {
  const auto d = std::ssize(read_), size = d * std::ssize(points);
  Information information;
  if (derivatives) {
    information.h = Eigen::MatrixXd::Zero(size, size);
    information.g = Eigen::VectorXd::Zero(size);
    information.first.resize(points.size());
    std::iota(information.first.begin(), information.first.end(), std::size_t{0});
  }
  Information* const into = derivatives ? &information : nullptr;
  reduced.cost = 0.5 * Eigen::Map<const Eigen::VectorXd>(e, inputs_).squaredNorm();
  if (!AddPlain(points, undefined, into, reduced.cost)) return false;
  Normal normal;
  for (MapLandmark& landmark : landmarks_) {
    if (!Settle(landmark, points, undefined) ||
        !NormalOf(landmark, landmark.l, points, undefined, normal, into)) {
      return false;
    }
    reduced.cost += normal.cost;
    if (!derivatives || normal.b.size() == 0) continue;
    // H -= B C^-1 B', g -= B C^-1 b
    const Eigen::LLT<Eigen::MatrixXd> c(normal.c);
    for (std::size_t i = 0; i < normal.epochs.size(); ++i) {
      const auto row = d * static_cast<Eigen::Index>(normal.epochs[i]);
      const Eigen::MatrixXd gain = c.solve(normal.ties[i].transpose()).transpose();
      information.g.segment(row, d).noalias() -= gain * normal.b;
      std::size_t& earliest = information.first[normal.epochs[i]];
      earliest = std::min(earliest, normal.epochs.front());
      for (std::size_t k = 0; k <= i; ++k) {
        const auto column = d * static_cast<Eigen::Index>(normal.epochs[k]);
        information.h.block(row, column, d, d).noalias() -= gain * normal.ties[k].transpose();
      }
    }
  }
  if (!derivatives) return true;
  for (MapLandmark& landmark : landmarks_) landmark.from = landmark.l;
  Assemble(e, points, information, reduced);
  return reduced.g.allFinite() && reduced.a.allFinite();
}

/// A = I + S' H S, g = e + S' (g_x + H offset), for S of all points, which is lower triangular by
/// frames: no state depends on a later input.
void Trajectory::Assemble(const double* e, const std::vector<Point>& points,
                          const Information& information, Reduced& reduced) const {
  const auto d = std::ssize(read_), size = d * std::ssize(points);
  const Eigen::MatrixXd& h = information.h;
  Eigen::MatrixXd s(size, inputs_), hs = Eigen::MatrixXd::Zero(size, inputs_);
  Eigen::VectorXd offset(size);
  const auto begin = [&](std::size_t k) {
    return k < points.size() ? Eigen::Index{epochs_[k].column} : Eigen::Index{inputs_};
  };
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto row = d * static_cast<Eigen::Index>(k);
    s.middleRows(row, d) = Packed(points[k].s);
    offset.segment(row, d) = points[k].offset(read_);
  }
  for (std::size_t k = 0; k < points.size(); ++k) {  // H S, H = L + L' by blocks
    const auto row = d * static_cast<Eigen::Index>(k);
    const auto first = d * static_cast<Eigen::Index>(information.first[k]);
    const Eigen::MatrixXd own = h.block(row, row, d, d).selfadjointView<Eigen::Lower>();
    const auto before = h.block(row, first, d, row - first);
    const auto here = s.block(row, 0, d, begin(k + 1));
    hs.block(row, 0, d, here.cols()).noalias() += own * here;
    hs.block(row, 0, d, begin(k)).noalias() += before * s.block(first, 0, row - first, begin(k));
    hs.block(first, 0, row - first, here.cols()).noalias() += before.transpose() * here;
  }
  reduced.a = Eigen::MatrixXd::Identity(inputs_, inputs_);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto row = d * static_cast<Eigen::Index>(k), from = begin(k), to = begin(k + 1);
    reduced.a.block(from, 0, to - from, to).noalias() +=
        s.block(row, from, size - row, to - from).transpose() * hs.block(row, 0, size - row, to);
  }
  const Eigen::VectorXd g = information.g + h.selfadjointView<Eigen::Lower>() * offset;
  reduced.g = Eigen::Map<const Eigen::VectorXd>(e, inputs_) + s.transpose() * g;
}

/// A landmark moves with e by M = J (J_y_x S_k - J_y_l C^-1 B' S), and by its own inputs besides:
/// P = M Cov(e) M' + J J_y_l C^-1 J_y_l' J', with J = dp/dy.
bool Trajectory::PutMap(const double* e, const Eigen::MatrixXd& u,
                        std::vector<LandmarkEstimate>& map) {
  std::vector<Point> points;
  if (!PointsOf(e, true, points)) return false;
  const auto size = std::ssize(read_) * std::ssize(points);
  Information unused{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), {}};
  for (LandmarkEstimate& estimate : map) {
    const auto found = std::ranges::find_if(landmarks_, [&](const MapLandmark& landmark) {
      return landmark.id == estimate.id && landmark.generation == estimate.generation;
    });
    if (found == landmarks_.end() || found->l.size() == 0) continue;  // known exactly
    Inverse place;
    Normal normal;
    if (!Place(*found, found->l, points, place) ||
        !NormalOf(*found, found->l, points, Undefined::kSkipped, normal, &unused)) {
      return false;
    }
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(normal.b.size(), inputs_);
    for (std::size_t i = 0; i < normal.epochs.size(); ++i) {
      m.noalias() += normal.ties[i].transpose() * Packed(points[normal.epochs[i]].s);
    }
    const Eigen::LLT<Eigen::MatrixXd> c(normal.c);
    m = -place.by_d * c.solve(m);
    if (found->first) m += place.by_x * points[found->first->epoch].s;
    const Eigen::MatrixXd y = u.transpose().triangularView<Eigen::Lower>().solve(m.transpose());
    const Eigen::MatrixXd p =
        y.transpose() * y + place.by_d * c.solve(Eigen::MatrixXd(place.by_d.transpose()));
    Describe(*found, p, estimate);
  }
  return true;
}

/// Place and covariance of a landmark whose blocks have the covariance p.
void Trajectory::Describe(const MapLandmark& landmark, const Eigen::MatrixXd& p,
                          LandmarkEstimate& estimate) const {
  const std::optional<MapLandmark::Sight> any =
      landmark.first ? landmark.first
                     : (landmark.sights.empty() ? std::nullopt : std::optional(landmark.sights[0]));
  if (!any) return;
  const Factor& factor = epochs_[any->epoch].factors[any->factor];
  const std::vector<Space>& roles = ModelOf(factor).roles();
  estimate.form = FormOf(roles);
  estimate.tried = estimate.accepted = static_cast<int>(landmark.sights.size());
  if (!estimate.form) return;
  const auto last = p.rows() - 1;
  estimate.inverse_distance = IsXyz(*estimate.form) ? std::nan("") : landmark.y.back();
  estimate.sigma = IsXyz(*estimate.form) ? std::nan("") : std::sqrt(p(last, last));
  std::vector<const double*> blocks;
  const double* next = landmark.y.data();
  for (const Space& role : roles) {
    if (!role.landmark()) continue;
    blocks.push_back(next);
    next += role.geometry.ambient;
  }
  estimate.position.setConstant(std::nan(""));
  estimate.covariance.setConstant(std::nan(""));
  const auto point = internal::PointOf(*estimate.form, blocks.data());
  if (!point) return;
  estimate.position = point->position;
  estimate.covariance = point->jacobian * p * point->jacobian.transpose();
}

}  // namespace alidade::ceres_batch
