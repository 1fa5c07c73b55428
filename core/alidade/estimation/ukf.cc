// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/ukf.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/estimation/filter_engine.h"
#include "alidade/estimation/stacked_measurements.h"
#include "alidade/estimation/update_method.h"
#include "alidade/state/dense_algebra.h"
#include "alidade/state/tiles.h"

namespace alidade {
namespace internal {
namespace {

/// Mean of the points that `centre` and the columns of `points` are, and f_i = (y_i (-) mean) -
/// (centre (-) mean): `f` (tangent x 2N) and m = w sum f_i. The mean is found where the step to the
/// next one is rounding: each of the 2N f_i, and the centre in all of them, may be 16 eps off.
/// False where the iteration does not settle, the points being too far apart.
bool MeanOf(const Geometry& geometry, const double* centre,
            const Eigen::Ref<const Eigen::MatrixXd>& points, double w, Workspace& work,
            double* mean, Eigen::Ref<Eigen::MatrixXd> f, Eigen::Ref<Eigen::VectorXd> m) {
  constexpr int kMostIterations = 200;
  constexpr double kRounding = 16.0 * std::numeric_limits<double>::epsilon();
  const Workspace::Use use(work);
  const Eigen::Map<const Eigen::VectorXd> x(centre, geometry.ambient);
  const double settled = kRounding * (1.0 + w * static_cast<double>(points.cols())) *
                         std::max(1.0, x.lpNorm<Eigen::Infinity>());
  std::copy_n(centre, geometry.ambient, mean);
  Workspace::Vector from_mean = work.Take(geometry.tangent);
  for (int k = 0; k < kMostIterations; ++k) {
    geometry.Minus(centre, mean, from_mean.data());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      geometry.Minus(points.col(i).data(), mean, f.col(i).data());
      f.col(i) -= from_mean;
    }
    m = w * f.rowwise().sum();
    if (geometry.kind == GeometryKind::kVector) {
      geometry.Plus(centre, m.data(), mean);
      return true;
    }
    from_mean += m;
    if (k > 0 && from_mean.norm() <= settled) return true;
    geometry.Plus(mean, from_mean.data(), mean);
  }
  return false;
}

/// Weights of the transform with 2N sigma points besides the centre.
struct Transform {
  double c, w;
  double centre;  ///< beta - alpha^2
};

/// moments = w f f' + centre m m'
void MomentsOf(const Transform& transform, const Eigen::Ref<const Eigen::MatrixXd>& f,
               const Eigen::Ref<const Eigen::VectorXd>& m, Workspace::Matrix& moments) {
  moments.setZero();
  AddOuterProduct(moments, f, 1.0);
  moments *= transform.w;
  moments.triangularView<Eigen::StrictlyUpper>() = moments.transpose();
  for (Eigen::Index i = 0; i < m.size(); ++i) moments.col(i) += transform.centre * m[i] * m;
}

/// By sigma points, in place of Jacobians.
class UkfEquations : public UpdateMethod {
 public:
  explicit UkfEquations(const UkfOptions& options) : spread_(options) {}

  std::unique_ptr<UpdateMethod> Clone() const override {
    return std::make_unique<UkfEquations>(*this);
  }
  void Begin(FilterState& f) override {
    guarded_.assign(f.problem_index->sensor_places.size() + 1, false);
  }
  StepError Step(FilterState& f, double dt_s) override;
  Outcome Predict(FilterState& f, PendingMeasurement& pending) override;
  double ComputeNis(FilterState& f, PendingMeasurement& pending) override;
  Outcome Correct(FilterState& f, std::span<PendingMeasurement* const> rows) override;

 private:
  /// What the sigma points make of one measurement.
  struct Predicted {
    int halvings = 0;                       ///< of the spread
    std::vector<double> centre;             ///< h(x0)
    std::vector<double> h, innovation;      ///< the mean, and z (-) h
    std::vector<double> deviations, shift;  ///< f_i, tangent x 2n by columns, and m

    Workspace::Matrix f() {
      return {deviations.data(), std::ssize(shift), std::ssize(deviations) / std::ssize(shift)};
    }
    Workspace::Vector m() { return {shift.data(), std::ssize(shift)}; }
  };

  Transform TransformOf(Eigen::Index directions, int halvings) const;
  template <class Attempt>
  Outcome Narrow(int& halvings, const Attempt& attempt) const;
  const Eigen::MatrixXd& RootOf(FilterState& f);
  const Eigen::MatrixXd& RootWithoutHeld(const FilterState& f);
  void TakeHeld(FilterState& f, const Workspace::Matrix& deviations, double c);
  Outcome StepPoints(FilterState& f, int halvings, double dt_s);
  Outcome StepPoint(FilterState& f, const double* from, const double* noise, double dt_s,
                    double* to);
  Outcome PredictPoints(FilterState& f, PendingMeasurement& pending, int halvings);
  Predicted& PredictedOf(const FilterState& f, const PendingMeasurement& pending);
  Outcome StackPoints(FilterState& f, std::span<PendingMeasurement* const> rows, int halvings,
                      Stacked& all, Workspace::Vector& mean);
  void NoteGuard(FilterState& f, std::size_t index, int halvings, bool narrow_enough);

  UkfOptions spread_;
  Eigen::MatrixXd root_;  ///< of P
  bool root_is_current_ = false;
  Eigen::MatrixXd held_;              ///< M, while an interval goes on
  std::vector<Predicted> predicted_;  ///< by report
  std::vector<bool> guarded_;         ///< by sensor; the last: the motion
  // Memory that is kept from step to step.
  Eigen::MatrixXd rest_, root_of_rest_;
  Scratch<Eigen::LDLT<Eigen::MatrixXd>> ldlt_;
  const MotionBinding* failed_ = nullptr;  ///< whose plugin failed last
};

Transform UkfEquations::TransformOf(Eigen::Index directions, int halvings) const {
  const double alpha = std::ldexp(spread_.alpha, -halvings);
  if (directions == 0) return {0.0, 0.0, spread_.beta - alpha * alpha};  // no point but the centre
  const double c2 = alpha * alpha * (static_cast<double>(directions) + spread_.kappa);
  return {std::sqrt(c2), 0.5 / c2, spread_.beta - alpha * alpha};
}

/// What `attempt` makes of the widest spread at which no point is out of its domain, or else of the
/// last that keeps its digits, after so many halvings.
template <class Attempt>
Outcome UkfEquations::Narrow(int& halvings, const Attempt& attempt) const {
  for (halvings = 0;; ++halvings) {
    const Outcome outcome = attempt(halvings);
    const bool last = !(std::ldexp(spread_.alpha, -halvings - 1) >= UkfOptions::kLeastAlpha);
    if (outcome != Outcome::kOutOfDomain || last) return outcome;
  }
}

/// A with P = A A'; repairs P where it is not positive semi-definite.
const Eigen::MatrixXd& UkfEquations::RootOf(FilterState& f) {
  constexpr double kRounding = 1e-12;
  if (root_is_current_) return root_;
  root_is_current_ = true;
  Covariance& p = f.state.covariance();
  const double defect = SquareRootOf(p.lower(), ldlt_, root_);
  if (defect < -kRounding) {
    f.motions.EndInterval();
    p.SetBlock(0, 0, root_ * root_.transpose());
    Note(f, "repaired",
         "the covariance has no square root: a pivot is " + RoundedText(defect, 3) +
             " of its largest variance; negative pivots count as zero");
  }
  return root_;
}

/// B with P - M M' = B B', the covariance of x given the noise that is held. M M' is a part of P: a
/// negative pivot is rounding.
const Eigen::MatrixXd& UkfEquations::RootWithoutHeld(const FilterState& f) {
  rest_ = f.state.covariance().lower();  // of which the lower triangle counts
  AddOuterProduct(rest_, held_, -1.0);
  SquareRootOf(rest_, ldlt_, root_of_rest_);
  return root_of_rest_;
}

/// M from the deviations of the points: along w_j alone they are those at +c and -c.
void UkfEquations::TakeHeld(FilterState& f, const Workspace::Matrix& deviations, double c) {
  if (!f.motions.holds()) return;
  const Eigen::Index n = deviations.rows(), all = deviations.cols() / 2;
  held_ = (deviations.middleCols(n, all - n) - deviations.rightCols(all - n)) / (2.0 * c);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < f.problem_index->motion_places.size(); ++i) {
    if (!f.motions.steps()[i].active) continue;
    const Eigen::Index inputs = f.problem_index->problem.motions[i].model->noise_size();
    if (!f.problem_index->motion_places[i].holds) held_.middleCols(column, inputs).setZero();
    column += inputs;
  }
}

/// Of sensor `index`, or of the motion, where that is beyond them; `narrow_enough`: the points at
/// this spread are of use.
void UkfEquations::NoteGuard(FilterState& f, std::size_t index, int halvings, bool narrow_enough) {
  const bool guarded = halvings > 0 || !narrow_enough;
  if (guarded && !guarded_[index]) {
    const std::string who = index < f.problem_index->sensor_places.size()
                                ? "sensor '" + f.problem_index->problem.sensors[index].name + "'"
                                : "motion";
    Note(f, "guarded",
         who + ": sigma points leave its domain or have no mean" +
             (narrow_enough ? "" : ", and their spread can be narrowed no further") +
             "; their spread is divided by " + std::to_string(1 << halvings));
  }
  guarded_[index] = guarded;
}

/// The model's x' at the values `from`, with `noise` (over all active models) in w, in `to`.
Outcome UkfEquations::StepPoint(FilterState& f, const double* from, const double* noise,
                                double dt_s, double* to) {
  const Workspace::Use use(f.work);
  const auto size = static_cast<Eigen::Index>(f.state.values().size());
  Workspace::Vector next = f.work.Take(size), w = f.work.Take(f.motions.noise_size());
  std::copy_n(from, size, to);
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
        StepAt(motion, place, from, step.u.data(), w.data(), dt_s, {.next = next.data()});
    if (outcome == Outcome::kFailed) {
      failed_ = &motion;
      return outcome;
    }
    if (outcome != Outcome::kAccepted) return Outcome::kOutOfDomain;
    TakeStep(place, next.data(), to);
    noise += inputs;
  }
  return Outcome::kAccepted;
}

/// Moves state and covariance, which stay as they are where a point is out of its domain.
Outcome UkfEquations::StepPoints(FilterState& f, int halvings, double dt_s) {
  const Workspace::Use use(f.work);
  const bool goes_on = f.motions.in_interval();
  const Eigen::MatrixXd& root = goes_on ? RootWithoutHeld(f) : RootOf(f);
  const auto size = static_cast<Eigen::Index>(f.state.values().size());
  const Eigen::Index n = root.cols(), noises = f.motions.noise_size(), all = n + noises;
  const Transform transform = TransformOf(all, halvings);
  Workspace::Vector centre = f.work.Take(size), dx = f.work.Take(n), noise = f.work.Take(noises);
  Workspace::Matrix points = f.work.Take(size, 2 * all), deviations = f.work.Take(n, 2 * all);
  noise.setZero();
  Outcome outcome = StepPoint(f, f.state.values().data(), noise.data(), dt_s, centre.data());
  for (Eigen::Index i = 0; i < 2 * all && outcome == Outcome::kAccepted; ++i) {
    const double c = i < all ? transform.c : -transform.c;
    const Eigen::Index direction = i % all;
    dx.setZero();
    noise.setZero();
    if (direction < n) {
      dx = c * root.col(direction);
    } else {
      noise[direction - n] = c;
      if (goes_on) dx = c * held_.col(direction - n);
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
  TakeHeld(f, deviations, transform.c);
  root_is_current_ = false;
  return Outcome::kAccepted;
}

StepError UkfEquations::Step(FilterState& f, double dt_s) {
  if (std::ranges::none_of(f.motions.steps(), &Motions::Step::active)) return {};
  // The centre, and Lq.
  if (StepError error = f.motions.Evaluate(f.state, dt_s, /*derivatives=*/false)) return error;
  int halvings = 0;
  const Outcome outcome = Narrow(halvings, [&](int k) { return StepPoints(f, k, dt_s); });
  if (outcome == Outcome::kAccepted) {
    NoteGuard(f, guarded_.size() - 1, halvings, true);
    return {};
  }
  if (outcome == Outcome::kFailed) {
    return {"plugin_failed", "motion model of '" + failed_->name +
                                 "' cannot step a sigma point: " + failed_->model->error_text()};
  }
  return {"diverged", "the sigma points cannot step, also with their spread divided by " +
                          std::to_string(1 << halvings)};
}

/// h at the sigma points of one measurement, where it is defined at the estimate.
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
  Predicted& predicted = PredictedOf(f, pending);
  predicted.halvings = halvings;
  predicted.h.resize(static_cast<std::size_t>(geometry.ambient));
  predicted.innovation.resize(static_cast<std::size_t>(geometry.tangent));
  predicted.deviations.resize(static_cast<std::size_t>(geometry.tangent * 2 * n));
  predicted.shift.resize(static_cast<std::size_t>(geometry.tangent));
  if (!MeanOf(geometry, predicted.centre.data(), points, transform.w, f.work, predicted.h.data(),
              predicted.f(), predicted.m())) {
    return Outcome::kOutOfDomain;
  }
  geometry.Minus(pending.z, predicted.h.data(), predicted.innovation.data());
  return Outcome::kAccepted;
}

Outcome UkfEquations::Predict(FilterState& f, PendingMeasurement& pending) {
  Predicted& predicted = PredictedOf(f, pending);
  predicted.centre.resize(static_cast<std::size_t>(pending.model->measurement().geometry.ambient));
  Outcome outcome = PredictAt(f, pending, f.state.values(), predicted.centre.data());
  bool too_wide = false;
  if (outcome == Outcome::kAccepted) {  // at the estimate itself
    int halvings = 0;
    outcome = Narrow(halvings, [&](int k) { return PredictPoints(f, pending, k); });
    too_wide = outcome == Outcome::kOutOfDomain;
    if (outcome == Outcome::kAccepted || too_wide) {
      NoteGuard(f, static_cast<std::size_t>(pending.sensor), halvings, !too_wide);
    }
  }
  if (outcome == Outcome::kAccepted) {
    outcome = NoiseAt(pending, RolesAt(f, pending, f.state.values()));
  }
  if (outcome == Outcome::kAccepted) {
    std::ranges::copy(predicted.h, pending.h);
    std::ranges::copy(predicted.innovation, pending.innovation);
    pending.report->h = {pending.h, predicted.h.size()};
    pending.report->innovation = {pending.innovation, predicted.innovation.size()};
    pending.H.clear();  // there is none
  } else if (!too_wide) {
    NoteRefusal(f, pending, outcome);
  }
  return outcome;
}

/// S = Cov(h) + R.
double UkfEquations::ComputeNis(FilterState& f, PendingMeasurement& pending) {
  Predicted& predicted = PredictedOf(f, pending);
  const Eigen::Index m = pending.report->dof;
  Workspace::Matrix s(pending.s, m, m);
  MomentsOf(TransformOf(RootOf(f).cols(), predicted.halvings), predicted.f(), predicted.m(), s);
  s += Eigen::Map<const RowMajor>(pending.R.data(), m, m);
  pending.report->s = {pending.s, pending.R.size()};
  return SquaredMahalanobis(pending.s, pending.innovation, pending.report->dof, f.work);
}

/// All rows at one spread, also those that the gate saw at a wider one: f in place of H, R,
/// innovation and m below one another.
Outcome UkfEquations::StackPoints(FilterState& f, std::span<PendingMeasurement* const> rows,
                                  int halvings, Stacked& all, Workspace::Vector& mean) {
  all.noise.setZero();
  Eigen::Index at = 0;
  for (PendingMeasurement* pending : rows) {
    Predicted& predicted = PredictedOf(f, *pending);
    if (predicted.halvings < halvings) {
      const Outcome outcome = PredictPoints(f, *pending, halvings);
      if (outcome != Outcome::kAccepted) {  // h is defined at the estimate: it does not diverge
        if (outcome == Outcome::kFailed) NotePluginFailure(f, *pending);
        pending->report->outcome = outcome;
        return Outcome::kNotFinite;
      }
    }
    const Eigen::Index k = pending->report->dof;
    all.h.middleRows(at, k) = predicted.f();
    all.noise.block(at, at, k, k) = Eigen::Map<const RowMajor>(pending->R.data(), k, k);
    all.innovation.segment(at, k) =
        Eigen::Map<const Eigen::VectorXd>(predicted.innovation.data(), k);
    mean.segment(at, k) = predicted.m();
    at += k;
  }
  return Outcome::kAccepted;
}

Outcome UkfEquations::Correct(FilterState& f, std::span<PendingMeasurement* const> rows) {
  const Workspace::Use use(f.work);
  const Eigen::MatrixXd& root = RootOf(f);
  const Eigen::Index n = root.cols(), m = TotalDof(rows);
  int halvings = 0;  // of the narrowest
  for (const PendingMeasurement* pending : rows) {
    halvings = std::max(halvings, PredictedOf(f, *pending).halvings);
  }
  Stacked all{f.work.Take(m, 2 * n), f.work.Take(m, m), f.work.Take(m)};
  Workspace::Vector mean = f.work.Take(m), centre = f.work.Take(n), step = f.work.Take(n);
  Workspace::Matrix s = f.work.Take(m, m), p = f.work.Take(n, n), rest = f.work.Take(n, 2 * n);
  Workspace::Matrix gain = f.work.Take(n, m), spread = f.work.Take(n, m);
  const Outcome stacked = StackPoints(f, rows, halvings, all, mean);
  if (stacked != Outcome::kAccepted) return stacked;
  const Transform transform = TransformOf(n, halvings);
  MomentsOf(transform, all.h, mean, s);
  s += all.noise;
  if (!Factorise(s)) return Outcome::kNotPd;
  if (n == 0) return Outcome::kAccepted;  // nothing to correct
  rest.leftCols(n) = transform.c * root;
  rest.rightCols(n) = -transform.c * root;
  gain.setZero();
  AddProductWithTransposed(gain, rest, all.h);
  gain *= transform.w;
  DivideByTransposed(s, gain);
  Divide(s, gain);
  AddProduct(rest, gain, all.h, -1.0);
  centre.noalias() = gain * mean;
  step.noalias() = gain * all.innovation;
  MomentsOf(transform, rest, centre, p);
  spread.setZero();
  AddProduct(spread, gain, all.noise);
  AddProductWithTransposed(p, spread, gain);
  if (!f.state.Retract(step.data(), f.moved) || !p.allFinite()) return Outcome::kNotFinite;
  f.state.covariance().SetBlock(0, 0, p);
  f.state.MoveTo(f.moved);
  root_is_current_ = false;
  RecordGain(f, rows, gain);
  return Outcome::kAccepted;
}

/// By the place of its report.
UkfEquations::Predicted& UkfEquations::PredictedOf(const FilterState& f,
                                                   const PendingMeasurement& pending) {
  const auto index = static_cast<std::size_t>(pending.report - f.report.measurements().data());
  if (predicted_.size() <= index) predicted_.resize(index + 1);
  return predicted_[index];
}

}  // namespace
}  // namespace internal

Ukf::Ukf(Problem problem, const UkfOptions& options, const std::vector<StreamInfo>& streams)
    : Filter(CheckedProblem(std::move(problem), "Ukf", kCapabilities),
             internal::WithoutRecovery(options.filter), streams,
             std::make_unique<internal::UkfEquations>(options)) {
  internal::ExpectOption(options.alpha >= UkfOptions::kLeastAlpha && options.alpha <= 1.0, "alpha",
                         options.alpha, "UkfOptions::kLeastAlpha to 1");
  internal::ExpectOption(options.beta >= 0.0, "beta", options.beta, "at least 0");
  internal::ExpectOption(options.kappa >= 0.0, "kappa", options.kappa, "at least 0");
}

}  // namespace alidade
