// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/state/dense_algebra.h"
#include "condensed_run.h"

/// The landmarks of a CondensedRun: how they are initialised in it, and where they cost least.
namespace alidade::ceres_batch {
namespace {

/// The value of the camera's role `position`; null where the sensor has none.
const double* CameraOf(const SensorBinding& sensor, const State& state) {
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    const BlockId block = sensor.roles[i].block;
    if (sensor.model->roles()[i].name == "position" && block >= 0) return state.value(block);
  }
  return nullptr;
}

/// The prior of the inverse distance that the filter gave a landmark in this frame, 1/m.
double PriorOf(std::int64_t id, const SensorBinding& sensor, const LandmarkOptions::Prior& prior,
               const Estimator& filter) {
  if (prior.adapt_after == 0) return prior.inverse_distance;
  const std::vector<LandmarkEstimate> map = filter.landmarks();
  const auto found = std::ranges::find(map, id, &LandmarkEstimate::id);
  const double* const camera = CameraOf(sensor, filter.state());
  if (found == map.end() || camera == nullptr) return prior.inverse_distance;
  if (!std::isnan(found->inverse_distance)) return found->inverse_distance;
  return 1.0 / (found->position - Eigen::Map<const Eigen::Vector3d>(camera)).norm();
}

}  // namespace

/// What no filter has to say: landmarks known beforehand, and which rows of a state sensors read.
void CondensedRun::AddKnown() {
  std::vector<bool> reads(static_cast<std::size_t>(initial_.covariance().size()), false);
  for (const internal::SensorPlace& place : binding_.sensor_places) {
    for (const JacobianPart& part : place.parts) {
      std::fill_n(reads.begin() + part.offset, part.size, true);
    }
  }
  for (std::size_t i = 0; i < reads.size(); ++i) {
    if (reads[i]) read_.push_back(static_cast<int>(i));
  }
  for (const KnownLandmark& known : binding_.problem.landmarks->known) {
    current_[known.id] = {static_cast<int>(landmarks_.size()), 0};
    MapLandmark& landmark = landmarks_.emplace_back();
    landmark.id = known.id;
    landmark.sigma = known.sigma;
    landmark.mean.assign(known.position.begin(), known.position.end());
    landmark.y = landmark.mean;
    landmark.from = Eigen::VectorXd::Zero(known.sigma > 0.0 ? 3 : 0);
  }
}

/// The observations of a frame. A landmark begins with the one that the filter began it with; what
/// the filter had no landmark for, or could not predict, is left out.
void CondensedRun::AddLandmarks(const UpdateReport& report, const Estimator& filter, Epoch& epoch) {
  epoch.report.landmarks.initialised = report.landmarks.initialised;
  epoch.report.landmarks.deleted = report.landmarks.deleted;
  std::vector<std::size_t> begin;
  for (std::size_t i = 0; i < epoch.factors.size(); ++i) {
    Factor& factor = epoch.factors[i];
    if (!ObservesLandmarks(SensorOf(factor))) continue;
    if (factor.outcome == Outcome::kInitialised) begin.push_back(i);
    if (factor.outcome != Outcome::kAccepted) continue;
    const Outcome told = report.measurements()[i].outcome;
    const auto current = current_.find(factor.measurement.landmark);
    const bool lost = told == Outcome::kNotReady || told == Outcome::kOutOfDomain ||
                      told == Outcome::kInvalid || told == Outcome::kFailed ||
                      told == Outcome::kEnded;
    if (lost || current == current_.end() || current->second.landmark < 0) {
      factor.outcome = lost ? told : Outcome::kNotReady;
      continue;
    }
    factor.landmark = current->second.landmark;
    MapLandmark& landmark = landmarks_[static_cast<std::size_t>(factor.landmark)];
    ++landmark.observed;
    const bool known = !landmark.first && !landmark.in_state();
    if (known) landmark.xyz = SensorOf(factor).xyz != nullptr;  // known landmarks are points
    if (known) landmark.sensor = factor.sensor;
    factor.xyz = landmark.xyz;
    if (landmark.in_state()) {
      AddPart(factor);
    } else {
      landmark.observations.push_back({epochs_.size(), i});
    }
  }
  for (const std::size_t i : begin) {
    Begin(epoch.factors[i], i, filter);
    epoch.factors[i].landmark = static_cast<int>(landmarks_.size()) - 1;
  }
}

void CondensedRun::Begin(const Factor& factor, std::size_t index, const Estimator& filter) {
  const SensorBinding& sensor = SensorOf(factor);
  const std::int64_t id = factor.measurement.landmark;
  const auto before = current_.find(id);
  MapLandmark landmark;
  landmark.id = id;
  landmark.sensor = factor.sensor;
  landmark.first = {epochs_.size(), index};
  if (before != current_.end()) landmark.generation = before->second.generation + 1;
  if (sensor.model->inverse().prior_size > 0) {
    landmark.prior = PriorOf(id, sensor, *binding_.problem.landmarks->prior, filter);
    landmark.sigma = binding_.problem.landmarks->prior->sigma;
  }
  landmark.from = Eigen::VectorXd::Zero(sensor.model->measurement().geometry.tangent +
                                        sensor.model->inverse().prior_size);
  current_[id] = {static_cast<int>(landmarks_.size()), landmark.generation};
  landmarks_.push_back(std::move(landmark));
}

/// y at the inputs l, and in by_d its derivative by all of them.
bool CondensedRun::Place(const MapLandmark& landmark, const Eigen::VectorXd& l,
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
  const int m = SensorOf(factor).model->measurement().geometry.tangent;
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

/// C with which q = dl + C dx_f moves the point as l does, and the camera alone does not: the least
/// one with  M C = N,
///
///   M = J_l, N = J_x           where y = g(x_f, l) has no more numbers than l
///   M = J_p J_l, N = J_p J_x   where it is a point p(y)
///   C = 0                      else
Eigen::MatrixXd CondensedRun::FollowOf(const MapLandmark& landmark, const Inverse& place,
                                       int inputs) const {
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(inputs, place.by_x.cols());
  if (!landmark.first) return none;
  Eigen::MatrixXd m = place.by_d, n = place.by_x;
  if (m.rows() > inputs) {
    const auto point = PointOf(landmark, place.y);
    if (!point || inputs < 3) return none;
    m = internal::Product(point->jacobian, m);
    n = internal::Product(point->jacobian, n);
  }
  Eigen::MatrixXd c =
      m.rows() == inputs ? internal::SolveSquare(m, n) : internal::SolveLeastNorm(m, n);
  return c.allFinite() ? c : none;
}

/// R of all observations of landmarks, these where they were found last. One that is not defined
/// keeps what it had.
bool CondensedRun::FreezeLandmarks(const std::vector<Point>& points) {
  for (MapLandmark& landmark : landmarks_) {
    if (landmark.l.size() == 0) landmark.l = landmark.from;
    Inverse place;
    if (!Place(landmark, landmark.l, points, place)) return false;
    if (landmark.first) {
      const auto [epoch, index] = *landmark.first;
      if (!FreezeFactor(epochs_[epoch].factors[index], WithLandmark(points[epoch].x, place.y)) ||
          !Place(landmark, landmark.l, points, place)) {
        return false;
      }
    }
    for (const auto& [epoch, index] : landmark.observations) {
      Factor& factor = epochs_[epoch].factors[index];
      std::vector<double> h;
      const std::vector<double> x = WithLandmark(points[epoch].x, place.y);
      const bool defined = See(factor, x, h, nullptr) == Outcome::kAccepted;
      if (defined && !FreezeFactor(factor, x)) return false;
    }
  }
  return true;
}

/// The rows that sensors read.
Eigen::MatrixXd CondensedRun::Packed(const Eigen::MatrixXd& rows) const {
  return rows(read_, Eigen::all);
}

/// One observation: J_x = a_x at its frame, a_y J_y_x at the first observation's, J_l = a_y J_y_l.
bool CondensedRun::AddObservation(const Factor& factor, std::size_t epoch,
                                  const MapLandmark& landmark, const Inverse& place,
                                  const Point& point, Normal& normal,
                                  Information* information) const {
  if (factor.left_out) return true;
  const int n = initial_.covariance().size();
  const auto d = std::ssize(read_);
  Eigen::VectorXd r;
  Eigen::MatrixXd a;
  if (!Residual(factor, Joined(point.x, place.y), r, &a)) return false;
  const RobustLoss& loss = SensorOf(factor).loss;
  normal.cost += Rho(loss, r.norm());
  const double root = std::sqrt(Weight(loss, r.norm()));
  r *= root;
  a *= root;
  const Eigen::MatrixXd a_y = a.rightCols(a.cols() - n), a_l = internal::Product(a_y, place.by_d);
  normal.c += internal::TransposedProduct(a_l, a_l);
  normal.b += internal::TransposedProduct(a_l, r);
  if (information == nullptr) return true;
  Eigen::MatrixXd a_x = Packed(a.leftCols(n).transpose()), a_first;
  if (landmark.first) {
    a_first = Packed(internal::Product(a_y, place.by_x).transpose());
    if (landmark.first->epoch == epoch) {
      a_x += a_first;
      a_first.resize(0, 0);
    }
  }
  const auto here = d * static_cast<Eigen::Index>(epoch);
  const bool of_states = information->h.size() > 0;
  if (of_states) {
    information->h.block(here, here, d, d) += internal::ProductTransposed(a_x, a_x);
    information->g.segment(here, d) += internal::Product(a_x, r);
  }
  if (normal.epochs.empty() || normal.epochs.back() != epoch) {
    normal.epochs.push_back(epoch);
    normal.ties.emplace_back(Eigen::MatrixXd::Zero(d, normal.b.size()));
  }
  normal.ties.back() += internal::Product(a_x, a_l);
  if (a_first.size() == 0) return true;
  if (of_states) {
    const auto first = d * static_cast<Eigen::Index>(landmark.first->epoch);
    information->h.block(first, first, d, d) += internal::ProductTransposed(a_first, a_first);
    information->h.block(here, first, d, d) += internal::ProductTransposed(a_x, a_first);
    information->g.segment(first, d) += internal::Product(a_first, r);
  }
  normal.ties.front() += internal::Product(a_first, a_l);
  return true;
}

/// The normal equations of a landmark at the inputs l; into `information`, unless null, what its
/// observations tell of the states, l apart; with one that is empty only the ties to them.
bool CondensedRun::NormalOf(const MapLandmark& landmark, const Eigen::VectorXd& l,
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
  for (const auto& [epoch, index] : landmark.observations) {
    const Factor& factor = epochs_[epoch].factors[index];
    const bool added =
        AddObservation(factor, epoch, landmark, place, points[epoch], normal, information);
    if (!added && undefined == Undefined::kFails) return false;
  }
  return true;
}

/// Puts the landmark where it costs least, seen from the points, to `within` sigma: Gauss-Newton
/// steps, halved until the cost falls. One that the cost cannot show is taken as it is.
bool CondensedRun::OptimiseLandmark(MapLandmark& landmark, const std::vector<Point>& points,
                                    Undefined undefined, double within) const {
  constexpr int kMostSteps = 50, kMostHalvings = 20;
  constexpr double kRounding = 1e-14;  // of the cost
  Normal now, next;
  landmark.l = landmark.from;
  if (!NormalOf(landmark, landmark.l, points, undefined, now, nullptr)) {
    landmark.l.setZero();
    if (!NormalOf(landmark, landmark.l, points, undefined, now, nullptr)) return false;
  }
  double before = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMostSteps && landmark.l.size() > 0; ++i) {
    Eigen::VectorXd step = -internal::SolvePositive(now.c, now.b);
    const double decrement = -step.dot(now.b), rounding = kRounding * (1.0 + now.cost);
    const bool unseen = decrement <= rounding;
    if (!(decrement > within * within) || (unseen && decrement > 0.5 * before)) break;
    before = decrement;
    bool fell = false;
    for (int k = 0; k < (unseen ? 1 : kMostHalvings) && !fell; ++k, step *= 0.5) {
      fell = NormalOf(landmark, landmark.l + step, points, undefined, next, nullptr) &&
             (next.cost < now.cost || (unseen && next.cost <= now.cost + rounding));
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

}  // namespace alidade::ceres_batch
