// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/ukf.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alidade/base/number_text.h"
#include "alidade/filter/ekf_snapshot.h"
#include "alidade/filter/factorise.h"
#include "alidade/filter/filter_options.h"

namespace alidade {
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

/// moments = w f f' + centre m m'
void MomentsOf(double w, const Eigen::Ref<const Eigen::MatrixXd>& f, double centre,
               const Eigen::Ref<const Eigen::VectorXd>& m, Workspace::Matrix& moments) {
  moments.noalias() = f * f.transpose();
  moments *= w;
  for (Eigen::Index i = 0; i < m.size(); ++i) moments.col(i) += centre * m[i] * m;
}

}  // namespace

Ukf::Ukf(System system, const UkfOptions& options, const std::vector<StreamInfo>& streams)
    : Ekf(std::move(system), internal::WithoutRecovery(options.filter), streams,
          Steps::kOverridden),
      spread_(options),
      guarded_(system_.sensors.size() + 1, false) {
  ALIDADE_EXPECTS(!FindUnsupported(system_, kSupport));
  ALIDADE_EXPECTS(spread_.alpha >= UkfOptions::kLeastAlpha && spread_.alpha <= 1.0 &&
                  spread_.beta >= 0.0 && spread_.kappa >= 0.0);
}

struct Ukf::Kept : Ekf::Kept {
  explicit Kept(const Ukf& ukf)
      : Ekf::Kept(ukf),
        root(ukf.root_),
        root_is_current(ukf.root_is_current_),
        held(ukf.held_),
        guarded(ukf.guarded_) {}

  Eigen::MatrixXd root;
  bool root_is_current;
  Eigen::MatrixXd held;
  std::vector<bool> guarded;
};

std::unique_ptr<Estimator::Snapshot> Ukf::Save() const { return std::make_unique<Kept>(*this); }

void Ukf::Restore(const Snapshot& snapshot) {
  Ekf::Restore(snapshot);
  const auto& kept = dynamic_cast<const Kept&>(snapshot);
  root_ = kept.root;
  root_is_current_ = kept.root_is_current;
  held_ = kept.held;
  guarded_ = kept.guarded;
}

Ukf::Transform Ukf::TransformOf(Eigen::Index directions, int halvings) const {
  const double alpha = std::ldexp(spread_.alpha, -halvings);
  if (directions == 0) return {0.0, 0.0, spread_.beta - alpha * alpha};  // no point but the centre
  const double c2 = alpha * alpha * (static_cast<double>(directions) + spread_.kappa);
  return {std::sqrt(c2), 0.5 / c2, spread_.beta - alpha * alpha};
}

/// Whether the spread may be halved once more, and still keeps its digits.
bool Ukf::MayHalve(int halvings) const {
  return std::ldexp(spread_.alpha, -halvings - 1) >= UkfOptions::kLeastAlpha;
}

/// A with P = A A'; repairs P where it is not positive semi-definite.
const Eigen::MatrixXd& Ukf::Root() {
  constexpr double kRounding = 1e-12;
  if (root_is_current_) return root_;
  root_is_current_ = true;
  Covariance& p = state_.covariance();
  const Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>> lower(
      p.data(), p.size(), p.size(), Eigen::OuterStride<>(p.stride()));
  const double defect = internal::SquareRootOf(lower, ldlt_, root_);
  if (defect < -kRounding) {
    interval_steps_ = 0;
    p.SetBlock(0, 0, root_ * root_.transpose());
    Note("repaired", "the covariance has no square root: a pivot is " +
                         internal::RoundedText(defect, 3) +
                         " of its largest variance; negative pivots count as zero");
  }
  return root_;
}

/// B with P - M M' = B B', the covariance of x given the noise that is held. M M' is a part of P: a
/// negative pivot is rounding.
const Eigen::MatrixXd& Ukf::RootWithoutHeld() {
  const Covariance& p = state_.covariance();
  rest_ = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>(
      p.data(), p.size(), p.size(), Eigen::OuterStride<>(p.stride()));  // its lower triangle
  rest_.noalias() -= held_ * held_.transpose();
  internal::SquareRootOf(rest_, ldlt_, root_of_rest_);
  return root_of_rest_;
}

/// M from the deviations of the points: along w_j alone they are those at +c and -c.
void Ukf::TakeHeld(const Workspace::Matrix& f, double c) {
  if (!holds_) return;
  const Eigen::Index n = f.rows(), all = f.cols() / 2;
  held_ = (f.middleCols(n, all - n) - f.rightCols(all - n)) / (2.0 * c);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (!motions_[i].active) continue;
    const Eigen::Index inputs = system_.motions[i].model.noise_size();
    if (!motions_[i].holds) held_.middleCols(column, inputs).setZero();
    column += inputs;
  }
}

/// Of sensor `index`, or of the motion, where that is beyond them; `narrow_enough`: the points at
/// this spread are of use.
void Ukf::NoteGuard(std::size_t index, int halvings, bool narrow_enough) {
  const bool guarded = halvings > 0 || !narrow_enough;
  if (guarded && !guarded_[index]) {
    const std::string who =
        index < system_.sensors.size() ? "sensor '" + system_.sensors[index].name + "'" : "motion";
    Note("guarded", who + ": sigma points leave its domain or have no mean" +
                        (narrow_enough ? "" : ", and their spread can be narrowed no further") +
                        "; their spread is divided by " + std::to_string(1 << halvings));
  }
  guarded_[index] = guarded;
}

/// The model's x' at the values `from`, with `noise` (over all active models) in w, in `to`.
Status Ukf::StepPoint(const double* from, const double* noise, double dt_s, double* to) {
  const Workspace::Use use(work_);
  const auto size = static_cast<Eigen::Index>(state_.values().size());
  Workspace::Vector unused = work_.Take(size), w = work_.Take(NoiseSize());
  std::copy_n(from, size, to);
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (!motions_[i].active) continue;
    const MotionBinding& motion = system_.motions[i];
    x_.clear();
    stepped_.clear();
    for (const BlockId id : motion.blocks) {
      const Block& block = state_.layout()[id];
      const bool constant = block.status == BlockStatus::kConstant;
      x_.push_back(from + block.value_offset);
      stepped_.push_back((constant ? unused.data() : to) + block.value_offset);
    }
    const Eigen::Index inputs = motion.model.noise_size();
    const Eigen::Map<const RowMajor> l(motions_[i].l.data(), inputs, inputs);
    Workspace::Vector(w.data(), inputs).noalias() =
        l * Eigen::Map<const Eigen::VectorXd>(noise, inputs);
    const Status status = motion.model.Step(x_.data(), motions_[i].u, w.data(), dt_s,
                                            stepped_.data(), nullptr, nullptr);
    if (status != Status::kOk) return status;
    noise += inputs;
  }
  return AllFinite({to, state_.values().size()}) ? Status::kOk : Status::kOutOfDomain;
}

/// Moves state and covariance, which stay as they are where a point is out of its domain.
Status Ukf::StepPoints(int halvings, double dt_s) {
  const Workspace::Use use(work_);
  const bool goes_on = InInterval();
  const Eigen::MatrixXd& root = goes_on ? RootWithoutHeld() : Root();
  const auto size = static_cast<Eigen::Index>(state_.values().size());
  const Eigen::Index n = root.cols(), noises = NoiseSize(), all = n + noises;
  const Transform transform = TransformOf(all, halvings);
  Workspace::Vector centre = work_.Take(size), dx = work_.Take(n), noise = work_.Take(noises);
  Workspace::Matrix points = work_.Take(size, 2 * all), f = work_.Take(n, 2 * all);
  noise.setZero();
  Status status = StepPoint(state_.values().data(), noise.data(), dt_s, centre.data());
  for (Eigen::Index i = 0; i < 2 * all && status == Status::kOk; ++i) {
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
    state_.Retract(dx.data(), moved_);
    status = StepPoint(moved_.data(), noise.data(), dt_s, points.col(i).data());
  }
  if (status != Status::kOk) return status;
  Workspace::Vector mean = work_.Take(size), m = work_.Take(n);
  Workspace::Matrix p = work_.Take(n, n);
  mean = centre;
  f.setZero();
  m.setZero();
  for (const Block& block : state_.layout().blocks()) {
    if (!block.has_covariance()) continue;
    const Geometry& geometry = block.geometry();
    if (!MeanOf(geometry, centre.data() + block.value_offset,
                points.middleRows(block.value_offset, geometry.ambient), transform.w, work_,
                mean.data() + block.value_offset,
                f.middleRows(block.tangent_offset, geometry.tangent),
                m.segment(block.tangent_offset, geometry.tangent))) {
      return Status::kOutOfDomain;
    }
  }
  MomentsOf(transform.w, f, transform.centre, m, p);
  if (!mean.allFinite() || !p.allFinite()) return Status::kOutOfDomain;
  std::copy_n(mean.data(), size, state_.values().data());
  SetCovariance(p);
  TakeHeld(f, transform.c);
  root_is_current_ = false;
  return Status::kOk;
}

bool Ukf::StepOnce(double dt_s) {
  if (std::ranges::none_of(motions_, &MotionPlan::active)) return true;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (!motions_[i].active) continue;
    // The centre, and Lq.
    if (!StepModel(system_.motions[i], motions_[i], dt_s, /*derivatives=*/false)) return false;
  }
  int halvings = 0;
  Status status = StepPoints(halvings, dt_s);
  while (status == Status::kOutOfDomain && MayHalve(halvings)) {
    status = StepPoints(++halvings, dt_s);
  }
  if (status == Status::kOk) {
    NoteGuard(guarded_.size() - 1, halvings, true);
    return true;
  }
  GiveUp("diverged", "the sigma points cannot step, also with their spread divided by " +
                         std::to_string(1 << halvings));
  return false;
}

/// h at the sigma points of one measurement, where it is defined at the estimate: its mean, in the
/// report, and its deviations.
Outcome Ukf::Predict(Row& row, int halvings) {
  const Workspace::Use use(work_);
  const SensorBinding& binding = BindingOf(row);
  const Geometry& geometry = binding.model.measurement().geometry;
  const Eigen::MatrixXd& root = Root();
  const Eigen::Index n = root.cols();
  const Transform transform = TransformOf(n, halvings);
  Workspace::Vector dx = work_.Take(n);
  Workspace::Matrix points = work_.Take(geometry.ambient, 2 * n);
  for (Eigen::Index i = 0; i < 2 * n; ++i) {
    dx = (i < n ? transform.c : -transform.c) * root.col(i % n);
    state_.Retract(dx.data(), moved_);
    const Outcome outcome =
        OutcomeOf(binding.model.Predict(RolesAt(row, moved_), points.col(i).data()));
    if (outcome != Outcome::kAccepted) return outcome;
  }
  Predicted& predicted = predicted_[row.report];
  predicted.halvings = halvings;
  predicted.f.resize(static_cast<std::size_t>(geometry.tangent * 2 * n));
  predicted.m.resize(static_cast<std::size_t>(geometry.tangent));
  MeasurementReport& entry = EntryOf(row);
  entry.h.resize(static_cast<std::size_t>(geometry.ambient));
  const Moments moments = MomentsAt(row);
  if (!MeanOf(geometry, predicted.centre.data(), points, transform.w, work_, entry.h.data(),
              moments.f, moments.m)) {
    return Outcome::kOutOfDomain;
  }
  entry.innovation.resize(static_cast<std::size_t>(geometry.tangent));
  geometry.Minus(entry.z.data(), entry.h.data(), entry.innovation.data());
  return Outcome::kAccepted;
}

Ukf::Moments Ukf::MomentsAt(const Row& row) {
  Predicted& predicted = predicted_[row.report];
  const auto m = std::ssize(predicted.m);
  return {{predicted.f.data(), m, std::ssize(predicted.f) / m}, {predicted.m.data(), m}};
}

Outcome Ukf::Linearise(Row& row) {
  const SensorBinding& binding = BindingOf(row);
  const SensorPlan& plan = PlanOf(row);
  if (predicted_.size() <= row.report) predicted_.resize(row.report + 1);
  std::vector<double>& centre = predicted_[row.report].centre;
  centre.resize(static_cast<std::size_t>(binding.model.measurement().geometry.ambient));
  Outcome outcome = OutcomeOf(binding.model.Predict(plan.roles.data(), centre.data()));
  const bool defined = outcome == Outcome::kAccepted;  // at the estimate itself
  int halvings = 0;
  if (defined) outcome = Predict(row, halvings);
  while (defined && outcome == Outcome::kOutOfDomain && MayHalve(halvings)) {
    outcome = Predict(row, ++halvings);
  }
  const bool too_wide = defined && outcome == Outcome::kOutOfDomain;
  if (outcome == Outcome::kAccepted || too_wide) {
    NoteGuard(static_cast<std::size_t>(row.sensor), halvings, !too_wide);
  }
  if (outcome == Outcome::kAccepted) outcome = NoiseOf(row, plan.roles.data());
  if (outcome == Outcome::kAccepted) return outcome;
  EntryOf(row).h.clear();
  EntryOf(row).innovation.clear();
  if (!too_wide) NoteRefusal(row, outcome);
  return outcome;
}

/// S = Cov(h) + R.
void Ukf::Project(Row& row) {
  const Workspace::Use use(work_);
  const Moments moments = MomentsAt(row);
  const Transform transform = TransformOf(Root().cols(), predicted_[row.report].halvings);
  const Eigen::Index m = moments.m.size();
  Workspace::Matrix s = work_.Take(m, m);
  MomentsOf(transform.w, moments.f, transform.centre, moments.m, s);
  s += Eigen::Map<const RowMajor>(row.r.data(), m, m);
  EntryOf(row).s.assign(s.data(), s.data() + s.size());
  row.pht.clear();
}

/// All rows at one spread: f in place of H, R, innovation and m below one another.
Outcome Ukf::StackPoints(std::span<Row* const> rows, int halvings, Stacked& all,
                         Workspace::Vector& mean) {
  all.noise.setZero();
  Eigen::Index at = 0;
  for (Row* row : rows) {
    MeasurementReport& entry = EntryOf(*row);
    const bool narrower = predicted_[row->report].halvings < halvings;
    if (narrower) {  // what the gate saw is what is reported
      reported_h_ = entry.h;
      reported_innovation_ = entry.innovation;
      const Outcome outcome = Predict(*row, halvings);
      if (outcome != Outcome::kAccepted) {
        entry.h.swap(reported_h_);
        entry.innovation.swap(reported_innovation_);
        return outcome;
      }
    }
    const Moments moments = MomentsAt(*row);
    const Eigen::Index k = moments.m.size();
    all.h.middleRows(at, k) = moments.f;
    all.noise.block(at, at, k, k) = Eigen::Map<const RowMajor>(row->r.data(), k, k);
    all.innovation.segment(at, k) = Eigen::Map<const Eigen::VectorXd>(entry.innovation.data(), k);
    mean.segment(at, k) = moments.m;
    if (narrower) {
      entry.h.swap(reported_h_);
      entry.innovation.swap(reported_innovation_);
    }
    at += k;
  }
  return Outcome::kAccepted;
}

Outcome Ukf::Apply(std::span<Row* const> rows) {
  const Workspace::Use use(work_);
  const Eigen::MatrixXd& root = Root();
  const Eigen::Index n = root.cols();
  Eigen::Index m = 0;
  int halvings = 0;  // of the narrowest
  for (const Row* row : rows) {
    m += EntryOf(*row).dof;
    halvings = std::max(halvings, predicted_[row->report].halvings);
  }
  Stacked all{work_.Take(m, 2 * n), work_.Take(m, m), work_.Take(m)};
  Workspace::Vector mean = work_.Take(m), centre = work_.Take(n), step = work_.Take(n);
  Workspace::Matrix s = work_.Take(m, m), p = work_.Take(n, n), rest = work_.Take(n, 2 * n);
  Workspace::Matrix gain = work_.Take(n, m), spread = work_.Take(n, m);
  const Outcome stacked = StackPoints(rows, halvings, all, mean);
  if (stacked != Outcome::kAccepted) return stacked;
  const Transform transform = TransformOf(n, halvings);
  MomentsOf(transform.w, all.h, transform.centre, mean, s);
  s += all.noise;
  if (!internal::Factorise(s)) {
    Note("not_pd", "the update would leave S not positive definite; rolled back");
    return Outcome::kNotPd;
  }
  rest.leftCols(n) = transform.c * root;
  rest.rightCols(n) = -transform.c * root;
  gain.noalias() = rest * all.h.transpose();
  gain *= transform.w;
  const auto l = s.triangularView<Eigen::Lower>();
  l.transpose().solveInPlace<Eigen::OnTheRight>(gain);
  l.solveInPlace<Eigen::OnTheRight>(gain);
  rest.noalias() -= gain * all.h;
  centre.noalias() = gain * mean;
  step.noalias() = gain * all.innovation;
  MomentsOf(transform.w, rest, transform.centre, centre, p);
  spread.noalias() = gain * all.noise;
  p.noalias() += spread * gain.transpose();
  state_.Retract(step.data(), moved_);
  if (!AllFinite(moved_) || !p.allFinite()) {
    Note("not_finite", "the update is not finite; rolled back");
    return Outcome::kNotFinite;
  }
  SetCovariance(p);
  state_.MoveTo(moved_);
  root_is_current_ = false;
  RecordUpdate(rows, gain.data());
  return Outcome::kAccepted;
}

}  // namespace alidade
