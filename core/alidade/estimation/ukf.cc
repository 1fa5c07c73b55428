// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/ukf.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/estimation/digits_lost.h"
#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/stacked_measurements.h"
#include "alidade/estimation/update_method.h"
#include "alidade/state/dense_algebra.h"
#include "alidade/state/tiles.h"

namespace alidade {
namespace internal {
namespace {

/// Computes the mean of `centre` and the columns y_i of `points`. Writes f_i = (y_i (-) mean) -
/// (centre (-) mean) to `f` (tangent x 2N), and computes m = w sum f_i. The iteration has converged
/// if its step is at most 16 eps (1 + 2 N w) max(1, max_j |centre_j|), the rounding error. Returns
/// false if the iteration does not converge, because the points are too far apart.
bool MeanOf(const Geometry& geometry, const double* centre,
            const Eigen::Ref<const Eigen::MatrixXd>& points, double w, Workspace& work,
            double* mean, Eigen::Ref<Eigen::MatrixXd> f, Eigen::Ref<Eigen::VectorXd> m) {
  constexpr int kMaxIterations = 200;
  constexpr double kRounding = 16.0 * std::numeric_limits<double>::epsilon();
  const Workspace::Use use(work);
  const Eigen::Map<const Eigen::VectorXd> x(centre, geometry.ambient);
  const double tolerance = kRounding * (1.0 + w * static_cast<double>(points.cols())) *
                           std::max(1.0, x.lpNorm<Eigen::Infinity>());
  std::copy_n(centre, geometry.ambient, mean);
  Workspace::Vector from_mean = work.Take(geometry.tangent);
  for (int k = 0; k < kMaxIterations; ++k) {
    geometry.Minus(centre, mean, from_mean.data());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      geometry.Minus(points.col(i).data(), mean, f.col(i).data());
      f.col(i) -= from_mean;
    }
    m = w * f.rowwise().sum();
    if (geometry.is_vector()) {
      geometry.Plus(centre, m.data(), mean);
      return true;
    }
    from_mean += m;
    if (k > 0 && from_mean.norm() <= tolerance) return true;
    geometry.Plus(mean, from_mean.data(), mean);
  }
  return false;
}

/// Spread and weights of the transform with a centre and 2N other sigma points.
struct Transform {
  double c, w;
  double centre;  ///< weight of m m': beta - alpha^2
};

/// Computes moments = w f f' + centre m m'.
void MomentsOf(const Transform& transform, const Eigen::Ref<const Eigen::MatrixXd>& f,
               const Eigen::Ref<const Eigen::VectorXd>& m, Workspace::Matrix& moments) {
  moments.setZero();
  AddOuterProduct(moments, f, 1.0);
  moments *= transform.w;
  moments.triangularView<Eigen::StrictlyUpper>() = moments.transpose();
  for (Eigen::Index i = 0; i < m.size(); ++i) moments.col(i) += transform.centre * m[i] * m;
}

/// Equations of the unscented Kalman filter (Ukf). They use sigma points instead of Jacobians.
class UkfEquations : public UpdateMethod {
 public:
  explicit UkfEquations(const UkfOptions& options) : options_(options) {}

  std::unique_ptr<UpdateMethod> Clone() const override {
    return std::make_unique<UkfEquations>(*this);
  }
  void Begin(FilterState& f) override {
    is_guarded_.resize(f.problem_index->sensor_places.size() + 1, false);
    is_nonlinear_.resize(f.problem_index->sensor_places.size(), false);
    root_is_current_ = false;
  }
  StepError Step(FilterState& f, double dt_s) override;
  Outcome Predict(FilterState& f, PendingMeasurement& pending) override;
  double ComputeNis(FilterState& f, PendingMeasurement& pending) override;
  Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) override;

 private:
  /// Prediction of one measurement by sigma points.
  struct SigmaPrediction {
    int halvings = 0;                       ///< number of times that the spread was halved
    std::vector<double> centre;             ///< h(x0)
    std::vector<double> h, innovation;      ///< mean of h, and z minus this mean
    std::vector<double> deviations, shift;  ///< f_i (tangent x 2n, column by column), and m

    Workspace::Matrix f() {
      return {deviations.data(), std::ssize(shift), std::ssize(deviations) / std::ssize(shift)};
    }
    Workspace::Vector m() { return {shift.data(), std::ssize(shift)}; }
  };

  Transform TransformOf(Eigen::Index directions, int halvings) const;
  template <class Attempt>
  Outcome ReduceSpread(int& halvings, const Attempt& attempt) const;
  const Eigen::MatrixXd& RootOf(FilterState& f);
  const Eigen::MatrixXd& ConditionalRootOf(const FilterState& f);
  void UpdateNoiseCross(FilterState& f, const Workspace::Matrix& deviations, double c);
  Outcome StepPoints(FilterState& f, int halvings, double dt_s);
  Outcome StepPoint(FilterState& f, const double* point, const double* noise, double dt_s,
                    double* destination);
  Outcome PredictPoints(FilterState& f, PendingMeasurement& pending, int halvings);
  SigmaPrediction& PredictionOf(const FilterState& f, const PendingMeasurement& pending);
  Outcome StackPoints(FilterState& f, std::span<PendingMeasurement* const> rows, int halvings,
                      StackedMeasurements& stacked, Workspace::Vector& mean);
  void ReportGuard(FilterState& f, std::size_t index, int halvings, bool is_sufficient);
  void ReportNonlinearity(FilterState& f, const PendingMeasurement& pending,
                          SigmaPrediction& prediction);

  UkfOptions options_;
  Eigen::MatrixXd root_;  ///< A, with P = A A'
  bool root_is_current_ = false;
  Eigen::MatrixXd noise_cross_;               ///< M; used in an interval of discrete noise
  std::vector<SigmaPrediction> predictions_;  ///< by index of the measurement's report
  /// By sensor: whether a reduced spread was reported. The last element is for the motion models.
  std::vector<bool> is_guarded_;
  std::vector<bool> is_nonlinear_;  ///< by sensor: whether its nonlinearity was reported
  // Reused memory.
  Eigen::MatrixXd conditional_covariance_, conditional_root_;
  Scratch<Eigen::LDLT<Eigen::MatrixXd>> ldlt_;
  const MotionBinding* failed_motion_ = nullptr;  ///< last motion model that failed
};

Transform UkfEquations::TransformOf(Eigen::Index directions, int halvings) const {
  const double alpha = std::ldexp(options_.alpha, -halvings);
  if (directions == 0)
    return {0.0, 0.0, options_.beta - alpha * alpha};  // the centre is the only point
  const double c2 = alpha * alpha * (static_cast<double>(directions) + options_.kappa);
  return {std::sqrt(c2), 0.5 / c2, options_.beta - alpha * alpha};
}

/// Calls attempt(halvings) for halvings = 0, 1, ..., which halves the spread each time. Stops when
/// the outcome is not kOutOfDomain, or when alpha would fall below its minimum. Returns the last
/// outcome.
template <class Attempt>
Outcome UkfEquations::ReduceSpread(int& halvings, const Attempt& attempt) const {
  for (halvings = 0;; ++halvings) {
    const Outcome outcome = attempt(halvings);
    const bool is_last = !(std::ldexp(options_.alpha, -halvings - 1) >= UkfOptions::kMinAlpha);
    if (outcome != Outcome::kOutOfDomain || is_last) return outcome;
  }
}

/// Returns A with P = A A'. If P is not positive semi-definite, repairs it first.
const Eigen::MatrixXd& UkfEquations::RootOf(FilterState& f) {
  constexpr double kRounding = 1e-12;
  if (root_is_current_) return root_;
  root_is_current_ = true;
  Covariance& p = f.state.covariance();
  const double defect = SquareRootOf(p.lower(), ldlt_, root_);
  if (defect < -kRounding) {
    f.motions.EndInterval();
    p.SetBlock(0, 0, root_ * root_.transpose());
    AddEvent(f, EventKind::kRepaired,
             "the covariance has no square root: a pivot is " + RoundedText(defect, 3) +
                 " times the largest variance; negative pivots were set to zero");
  }
  return root_;
}

/// Returns B with B B' = P - M M', the covariance of x given the discrete noise. Negative pivots
/// can only be rounding errors, because P includes M M'.
const Eigen::MatrixXd& UkfEquations::ConditionalRootOf(const FilterState& f) {
  conditional_covariance_ = f.state.covariance().lower();  // only the lower triangle is used
  AddOuterProduct(conditional_covariance_, noise_cross_, -1.0);
  SquareRootOf(conditional_covariance_, ldlt_, conditional_root_);
  return conditional_root_;
}

/// Computes M from the deviations of the points. Column j is the difference between the deviations
/// at +c and -c along w_j, divided by 2 c.
void UkfEquations::UpdateNoiseCross(FilterState& f, const Workspace::Matrix& deviations, double c) {
  if (!f.motions.has_discrete_noise()) return;
  const Eigen::Index n = deviations.rows(), directions = deviations.cols() / 2;
  noise_cross_ =
      (deviations.middleCols(n, directions - n) - deviations.rightCols(directions - n)) / (2.0 * c);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < f.problem_index->motion_places.size(); ++i) {
    if (!f.motions.steps()[i].active) continue;
    const Eigen::Index inputs = f.problem_index->problem.motions[i].model->noise_size();
    if (!f.problem_index->motion_places[i].holds) noise_cross_.middleCols(column, inputs).setZero();
    column += inputs;
  }
}

/// Reports once that the spread was reduced for a sensor or for the motion models. `index` is the
/// index of the sensor; the number of sensors denotes the motion models. `is_sufficient` is true if
/// the points with the reduced spread can be used.
void UkfEquations::ReportGuard(FilterState& f, std::size_t index, int halvings,
                               bool is_sufficient) {
  const bool is_guarded = halvings > 0 || !is_sufficient;
  if (is_guarded && !is_guarded_[index]) {
    const std::string subject =
        index < f.problem_index->sensor_places.size()
            ? "sensor '" + f.problem_index->problem.sensors[index].name + "'"
            : "motion models";
    AddEvent(f, EventKind::kGuarded,
             subject + ": sigma points are outside the domain or have no mean" +
                 (is_sufficient ? "" : ", even with the smallest spread") +
                 "; their spread is divided by " + std::to_string(1 << halvings));
  }
  is_guarded_[index] = is_guarded;
}

/// Reports once for each sensor that the curvature of h shifts the mean by more than the standard
/// deviation that the slope of h predicts. `pending` contains R.
void UkfEquations::ReportNonlinearity(FilterState& f, const PendingMeasurement& pending,
                                      SigmaPrediction& prediction) {
  constexpr double kLargestRatio = 1.0;
  const auto sensor = static_cast<std::size_t>(pending.sensor);
  // A reduced spread is reported by ReportGuard.
  if (is_nonlinear_[sensor] || prediction.halvings > 0) return;
  const Workspace::Matrix points = prediction.f();
  const Eigen::Index m = points.rows(), n = points.cols() / 2;
  const double w = TransformOf(n, prediction.halvings).w;
  double ratio = 0.0;
  for (Eigen::Index k = 0; k < m; ++k) {
    const auto plus = points.row(k).head(n), minus = points.row(k).tail(n);
    const double variance =
        0.5 * w * (plus - minus).squaredNorm() + pending.R[static_cast<std::size_t>(k * (m + 1))];
    ratio = std::max(ratio, w * std::abs((plus + minus).sum()) / std::sqrt(variance));
  }
  if (!(ratio > kLargestRatio)) return;
  is_nonlinear_[sensor] = true;
  AddEvent(f, EventKind::kNonlinear,
           "sensor '" + pending.binding->name +
               "': the curvature of h within the sigma points shifts the predicted mean by " +
               RoundedText(ratio, 3) +
               " times the standard deviation that the slope of h predicts; use iekf, a narrower "
               "prior or another alpha");
}

/// Propagates one sigma point by all active models with the noise w = `noise`, and writes x' to
/// `destination`.
Outcome UkfEquations::StepPoint(FilterState& f, const double* point, const double* noise,
                                double dt_s, double* destination) {
  const Workspace::Use use(f.work);
  const auto size = static_cast<Eigen::Index>(f.state.values().size());
  Workspace::Vector next = f.work.Take(size), w = f.work.Take(f.motions.noise_size());
  std::copy_n(point, size, destination);
  for (std::size_t i = 0; i < f.motions.steps().size(); ++i) {
    const Motions::Step& step = f.motions.steps()[i];
    if (!step.active) continue;
    const MotionBinding& motion = f.problem_index->problem.motions[i];
    const Eigen::Index inputs = motion.model->noise_size();
    const Eigen::Map<const RowMajor> l(step.l.data(), inputs, inputs);
    Workspace::Vector(w.data(), inputs).noalias() =
        l * Eigen::Map<const Eigen::VectorXd>(noise, inputs);
    const MotionPlace& place = f.problem_index->motion_places[i];
    const Outcome outcome =
        StepAt(motion, place, point, step.u.data(), w.data(), dt_s, {.next = next.data()});
    if (outcome == Outcome::kFailed) {
      failed_motion_ = &motion;
      return outcome;
    }
    if (outcome != Outcome::kAccepted) return Outcome::kOutOfDomain;
    TakeStep(place, next.data(), destination);
    noise += inputs;
  }
  return Outcome::kAccepted;
}

/// Propagates the state and the covariance. If the outcome is not kAccepted, state and covariance
/// are unchanged.
Outcome UkfEquations::StepPoints(FilterState& f, int halvings, double dt_s) {
  const Workspace::Use use(f.work);
  const bool continues_interval = f.motions.in_interval();
  const Eigen::MatrixXd& root = continues_interval ? ConditionalRootOf(f) : RootOf(f);
  const auto size = static_cast<Eigen::Index>(f.state.values().size());
  const Eigen::Index n = root.cols(), noises = f.motions.noise_size(), directions = n + noises;
  const Transform transform = TransformOf(directions, halvings);
  Workspace::Vector centre = f.work.Take(size), dx = f.work.Take(n), noise = f.work.Take(noises);
  Workspace::Matrix points = f.work.Take(size, 2 * directions),
                    deviations = f.work.Take(n, 2 * directions);
  noise.setZero();
  Outcome outcome = StepPoint(f, f.state.values().data(), noise.data(), dt_s, centre.data());
  for (Eigen::Index i = 0; i < 2 * directions && outcome == Outcome::kAccepted; ++i) {
    const double c = i < directions ? transform.c : -transform.c;
    const Eigen::Index direction = i % directions;
    dx.setZero();
    noise.setZero();
    if (direction < n) {
      dx = c * root.col(direction);
    } else {
      noise[direction - n] = c;
      if (continues_interval) dx = c * noise_cross_.col(direction - n);
    }
    f.state.Retract(dx.data(), f.moved);
    outcome = StepPoint(f, f.moved.data(), noise.data(), dt_s, points.col(i).data());
  }
  if (outcome != Outcome::kAccepted) return outcome;
  Workspace::Vector mean = f.work.Take(size), m = f.work.Take(n);
  Workspace::Matrix p = f.work.Take(n, n);
  mean = centre;
  deviations.setZero();
  m.setZero();
  for (const Block& block : f.state.layout().blocks()) {
    if (!block.has_covariance()) continue;
    const Geometry& geometry = block.geometry();
    if (!MeanOf(geometry, centre.data() + block.value_offset,
                points.middleRows(block.value_offset, geometry.ambient), transform.w, f.work,
                mean.data() + block.value_offset,
                deviations.middleRows(block.tangent_offset, geometry.tangent),
                m.segment(block.tangent_offset, geometry.tangent))) {
      return Outcome::kOutOfDomain;
    }
  }
  MomentsOf(transform, deviations, m, p);
  if (!mean.allFinite() || !p.allFinite()) return Outcome::kOutOfDomain;
  std::copy_n(mean.data(), size, f.state.values().data());
  f.state.covariance().SetBlock(0, 0, p);
  UpdateNoiseCross(f, deviations, transform.c);
  root_is_current_ = false;
  return Outcome::kAccepted;
}

StepError UkfEquations::Step(FilterState& f, double dt_s) {
  if (std::ranges::none_of(f.motions.steps(), &Motions::Step::active)) return {};
  // Computes x' of the centre and Lq.
  if (StepError error = f.motions.Evaluate(f.state, dt_s, /*derivatives=*/false)) return error;
  int halvings = 0;
  const Outcome outcome = ReduceSpread(halvings, [&](int k) { return StepPoints(f, k, dt_s); });
  if (outcome == Outcome::kAccepted) {
    ReportGuard(f, is_guarded_.size() - 1, halvings, true);
    return {};
  }
  if (outcome == Outcome::kFailed) {
    return {EventKind::kPluginFailed,
            "the motion model of '" + failed_motion_->name +
                "' failed at a sigma point: " + failed_motion_->model->error_text()};
  }
  return {EventKind::kDiverged,
          "the motion models cannot predict the sigma points, even if their spread is divided by " +
              std::to_string(1 << halvings)};
}

/// Computes h of one measurement at the sigma points. Requires that h is defined at the estimate.
Outcome UkfEquations::PredictPoints(FilterState& f, PendingMeasurement& pending, int halvings) {
  const Workspace::Use use(f.work);
  const Geometry& geometry = pending.model->measurement().geometry;
  const Eigen::MatrixXd& root = RootOf(f);
  const Eigen::Index n = root.cols();
  const Transform transform = TransformOf(n, halvings);
  Workspace::Vector dx = f.work.Take(n);
  Workspace::Matrix points = f.work.Take(geometry.ambient, 2 * n);
  for (Eigen::Index i = 0; i < 2 * n; ++i) {
    dx = (i < n ? transform.c : -transform.c) * root.col(i % n);
    f.state.Retract(dx.data(), f.moved);
    const Outcome outcome = PredictAt(f, pending, f.moved, points.col(i).data());
    if (outcome != Outcome::kAccepted) return outcome;
  }
  SigmaPrediction& prediction = PredictionOf(f, pending);
  prediction.halvings = halvings;
  prediction.h.resize(static_cast<std::size_t>(geometry.ambient));
  prediction.innovation.resize(static_cast<std::size_t>(geometry.tangent));
  prediction.deviations.resize(static_cast<std::size_t>(geometry.tangent * 2 * n));
  prediction.shift.resize(static_cast<std::size_t>(geometry.tangent));
  if (!MeanOf(geometry, prediction.centre.data(), points, transform.w, f.work, prediction.h.data(),
              prediction.f(), prediction.m())) {
    return Outcome::kOutOfDomain;
  }
  geometry.Minus(pending.z, prediction.h.data(), prediction.innovation.data());
  return Outcome::kAccepted;
}

Outcome UkfEquations::Predict(FilterState& f, PendingMeasurement& pending) {
  SigmaPrediction& prediction = PredictionOf(f, pending);
  prediction.centre.resize(static_cast<std::size_t>(pending.model->measurement().geometry.ambient));
  Outcome outcome = PredictAt(f, pending, f.state.values(), prediction.centre.data());
  bool is_too_wide = false;
  if (outcome == Outcome::kAccepted) {  // h is defined at the estimate
    int halvings = 0;
    outcome = ReduceSpread(halvings, [&](int k) { return PredictPoints(f, pending, k); });
    is_too_wide = outcome == Outcome::kOutOfDomain;
    if (outcome == Outcome::kAccepted || is_too_wide) {
      ReportGuard(f, static_cast<std::size_t>(pending.sensor), halvings, !is_too_wide);
    }
  }
  if (outcome == Outcome::kAccepted) {  // computes R; only CheckDigits uses H
    outcome = LineariseAt(pending, RolesAt(f, pending, f.state.values()));
  }
  if (outcome == Outcome::kAccepted) {
    ReportNonlinearity(f, pending, prediction);
    std::ranges::copy(prediction.h, pending.h);
    std::ranges::copy(prediction.innovation, pending.innovation);
    pending.report->h = {pending.h, prediction.h.size()};
    pending.report->innovation = {pending.innovation, prediction.innovation.size()};
  } else if (!is_too_wide) {
    pending.report->h = {};
    ReportRefusal(f, pending, outcome);
  }
  return outcome;
}

/// Computes S = Cov(h) + R.
double UkfEquations::ComputeNis(FilterState& f, PendingMeasurement& pending) {
  SigmaPrediction& prediction = PredictionOf(f, pending);
  const Eigen::Index m = pending.report->dof;
  Workspace::Matrix s(pending.s, m, m);
  MomentsOf(TransformOf(RootOf(f).cols(), prediction.halvings), prediction.f(), prediction.m(), s);
  s += Eigen::Map<const RowMajor>(pending.R.data(), m, m);
  pending.report->s = {pending.s, pending.R.size()};
  return SquaredMahalanobis(pending.s, pending.innovation, pending.report->dof, f.work);
}

/// Stacks the predictions of all measurements: f (in place of H), R, the innovation and m.
/// Predictions with a larger spread are computed again with the spread of `halvings`.
Outcome UkfEquations::StackPoints(FilterState& f, std::span<PendingMeasurement* const> rows,
                                  int halvings, StackedMeasurements& stacked,
                                  Workspace::Vector& mean) {
  stacked.noise.setZero();
  Eigen::Index offset = 0;
  for (PendingMeasurement* pending : rows) {
    SigmaPrediction& prediction = PredictionOf(f, *pending);
    if (prediction.halvings < halvings) {
      const Outcome outcome = PredictPoints(f, *pending, halvings);
      if (outcome != Outcome::kAccepted) {
        // This failure is not a divergence, because h is defined at the estimate.
        if (outcome == Outcome::kFailed) ReportPluginFailure(f, *pending);
        pending->report->outcome = outcome;
        return Outcome::kNotFinite;
      }
    }
    const Eigen::Index k = pending->report->dof;
    stacked.h.middleRows(offset, k) = prediction.f();
    stacked.noise.block(offset, offset, k, k) = Eigen::Map<const RowMajor>(pending->R.data(), k, k);
    stacked.innovation.segment(offset, k) =
        Eigen::Map<const Eigen::VectorXd>(prediction.innovation.data(), k);
    mean.segment(offset, k) = prediction.m();
    offset += k;
  }
  return Outcome::kAccepted;
}

Outcome UkfEquations::Correct(FilterState& f, std::span<PendingMeasurement* const> rows) {
  const Workspace::Use use(f.work);
  const Eigen::MatrixXd& root = RootOf(f);
  const Eigen::Index n = root.cols(), m = TotalDof(rows);
  int halvings = 0;  // number of halvings of the smallest spread
  for (const PendingMeasurement* pending : rows) {
    halvings = std::max(halvings, PredictionOf(f, *pending).halvings);
  }
  StackedMeasurements stacked{f.work.Take(m, 2 * n), f.work.Take(m, m), f.work.Take(m)};
  Workspace::Vector mean = f.work.Take(m), inverse_d = f.work.Take(m);
  Workspace::Vector centre = f.work.Take(n), step = f.work.Take(n);
  Workspace::Matrix s = f.work.Take(m, m), p = f.work.Take(n, n),
                    deviations = f.work.Take(n, 2 * n);  // first dx_i, later dx_i - K f_i
  Workspace::Matrix gain = f.work.Take(n, m), gain_noise = f.work.Take(n, m);  // K, K R
  const Outcome outcome = StackPoints(f, rows, halvings, stacked, mean);
  if (outcome != Outcome::kAccepted) return outcome;
  const Transform transform = TransformOf(n, halvings);
  MomentsOf(transform, stacked.h, mean, s);
  s += stacked.noise;
  if (!Factorise(s)) return Outcome::kNotPd;
  if (n == 0) return Outcome::kAccepted;  // there is no state to correct
  deviations.leftCols(n) = transform.c * root;
  deviations.rightCols(n) = -transform.c * root;
  gain.setZero();
  AddProductWithTransposed(gain, deviations, stacked.h);
  gain *= transform.w;
  DivideByTransposed(s, gain);
  Divide(s, gain);
  AddProduct(deviations, gain, stacked.h, -1.0);
  centre.noalias() = gain * mean;
  step.noalias() = gain * stacked.innovation;
  MomentsOf(transform, deviations, centre, p);
  gain_noise.setZero();
  AddProduct(gain_noise, gain, stacked.noise);
  AddProductWithTransposed(p, gain_noise, gain);
  if (!f.state.Retract(step.data(), f.moved) || !p.allFinite()) return Outcome::kNotFinite;
  f.state.covariance().SetBlock(0, 0, p);
  inverse_d = s.diagonal().array().square().inverse();
  Eigen::Index offset = 0;
  for (const PendingMeasurement* const pending : rows) {
    CheckDigits(f, *pending, inverse_d.data() + offset);
    offset += pending->report->dof;
  }
  f.state.MoveTo(f.moved);
  root_is_current_ = false;
  RecordGain(f, rows, gain);
  return Outcome::kAccepted;
}

/// Returns the stored prediction of a measurement.
UkfEquations::SigmaPrediction& UkfEquations::PredictionOf(const FilterState& f,
                                                          const PendingMeasurement& pending) {
  const auto index = static_cast<std::size_t>(pending.report - f.report.measurements().data());
  if (predictions_.size() <= index) predictions_.resize(index + 1);
  return predictions_[index];
}

}  // namespace
}  // namespace internal

Ukf::Ukf(Problem problem, const UkfOptions& options, const std::vector<StreamInfo>& streams)
    : Filter(CheckedProblem(std::move(problem), "Ukf", kCapabilities), options.filter, streams,
             std::make_unique<internal::UkfEquations>(options)) {
  internal::ExpectOption(options.alpha >= UkfOptions::kMinAlpha && options.alpha <= 1.0, "alpha",
                         options.alpha, "a number from UkfOptions::kMinAlpha to 1");
  internal::ExpectOption(options.beta >= 0.0, "beta", options.beta, "at least 0");
  internal::ExpectOption(options.kappa >= 0.0, "kappa", options.kappa, "at least 0");
}

}  // namespace alidade
