// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "alidade/ekf.h"

namespace alidade {
namespace {

/// Cholesky factor of a symmetric matrix; false unless it is finite and positive definite.
/// (Eigen's own LLT reports success on NaN.)
bool Factorise(const Eigen::MatrixXd& s, Eigen::LLT<Eigen::MatrixXd>& llt) {
  if (!s.allFinite()) return false;
  llt.compute(s);
  return llt.info() == Eigen::Success && (llt.matrixLLT().diagonal().array() > 0.0).all();
}

/// r' S^-1 r; not a number where S, m x m, is not positive definite.
double SquaredMahalanobis(const std::vector<double>& s, const std::vector<double>& r) {
  const std::size_t m = r.size();
  if (m == 1) return s[0] > 0.0 ? r[0] * r[0] / s[0] : std::nan("");
  const auto size = static_cast<Eigen::Index>(m);
  Eigen::LLT<Eigen::MatrixXd> llt;
  if (!Factorise(Eigen::Map<const Eigen::MatrixXd>(s.data(), size, size), llt)) return std::nan("");
  return llt.matrixL().solve(Eigen::Map<const Eigen::VectorXd>(r.data(), size)).squaredNorm();
}

}  // namespace

/// Puts together the update of one group of measurements: linearises all at the same state, gates
/// each on its own, then one stacked update of those that passed.
void Ekf::Fuse(std::span<Row* const> group) {
  passed_.clear();
  for (Row* row : group) {
    Outcome& outcome = EntryOf(*row).outcome;
    outcome = Linearise(*row);
    if (outcome == Outcome::kAccepted) outcome = Gate(*row);
    if (outcome == Outcome::kAccepted) passed_.push_back(row);
  }
  if (passed_.empty()) return;
  const Outcome outcome = Apply(passed_);
  for (const Row* row : passed_) EntryOf(*row).outcome = outcome;
}

/// h, R, H and the innovation of one measurement at the state.
Outcome Ekf::Linearise(Row& row) {
  const SensorBinding& binding = BindingOf(row);
  const SensorPlan& plan = PlanOf(row);
  MeasurementReport& entry = EntryOf(row);
  const Geometry& geometry = binding.model.measurement().geometry;
  const auto m = static_cast<std::size_t>(geometry.tangent);
  if (row.zeroed != &plan) {
    row.h.assign(m * static_cast<std::size_t>(plan.width), 0.0);
    row.r.resize(m * m);
    row.l.resize(m * m);
    row.zeroed = &plan;
  }
  entry.h.resize(static_cast<std::size_t>(geometry.ambient), std::nan(""));
  Outcome outcome = plan.at_measurement ? EvaluateAtMeasurement(row, entry) : Evaluate(row, entry);
  if (outcome == Outcome::kOutOfDomain || outcome == Outcome::kFailed) entry.h.clear();
  if (outcome == Outcome::kAccepted) outcome = NoiseOf(row, plan.roles.data());
  if (outcome == Outcome::kAccepted) {
    entry.innovation.resize(m);
    geometry.Minus(entry.z.data(), entry.h.data(), entry.innovation.data());
    return outcome;
  }
  NoteRefusal(row, outcome);
  return outcome;
}

/// Tells why h could not be had; outside its domain, once until the sensor is accepted again.
void Ekf::NoteRefusal(const Row& row, Outcome outcome) {
  const SensorBinding& binding = BindingOf(row);
  if (outcome == Outcome::kFailed) NotePluginFailure(binding);
  if (outcome == Outcome::kOutOfDomain && rejections_[static_cast<std::size_t>(row.sensor)] == 0) {
    diverged_ = true;
    std::vector<BlockId> blocks;
    for (const RoleBinding& role : binding.roles) blocks.push_back(role.block);
    Note("diverged", "sensor '" + binding.name + "' is not defined at " + Describe(blocks));
  }
}

/// h and H, whose parts are not numbers until the model writes them.
Outcome Ekf::Evaluate(Row& row, MeasurementReport& entry) {
  const SensorPlan& plan = PlanOf(row);
  jacobians_.resize(plan.roles.size());
  for (std::size_t i = 0; i < plan.roles.size(); ++i) {
    jacobians_[i] = plan.columns[i] < 0 ? nullptr : row.h.data() + plan.columns[i];
  }
  for (const JacobianPart& part : plan.parts) {
    for (int i = 0; i < entry.dof; ++i) {
      std::fill_n(row.h.data() + i * plan.width + part.column, part.size, std::nan(""));
    }
  }
  return OutcomeOf(BindingOf(row).model.Linearise(plan.roles.data(), entry.h.data(),
                                                  jacobians_.data(), plan.strides.data()));
}

/// h at the prediction; H at the values that the measurement implies for the roles that ask for it.
Outcome Ekf::EvaluateAtMeasurement(Row& row, MeasurementReport& entry) {
  const SensorBinding& binding = BindingOf(row);
  SensorPlan& plan = plans_[static_cast<std::size_t>(row.sensor)];
  Outcome outcome = OutcomeOf(binding.model.Predict(plan.roles.data(), entry.h.data()));
  if (outcome != Outcome::kAccepted) return outcome;
  const std::vector<double> h = entry.h;
  const std::vector<const double*> predicted = plan.roles;
  std::vector<double> implied;  // one role at most can be implied
  for (std::size_t i = 0; i < binding.roles.size() && outcome == Outcome::kAccepted; ++i) {
    if (binding.roles[i].linearise_at != LineariseAt::kMeasurement) continue;
    implied.resize(static_cast<std::size_t>(binding.model.roles()[i].geometry.ambient));
    const Status status = binding.model.Initialise(predicted.data(), entry.z.data(), implied.data(),
                                                   nullptr, nullptr);
    // What z cannot have come from tells nothing of where to linearise.
    outcome = status == Status::kOutOfDomain ? Outcome::kInvalid : OutcomeOf(status);
    plan.roles[i] = implied.data();
  }
  if (outcome == Outcome::kAccepted) outcome = Evaluate(row, entry);
  plan.roles = predicted;
  entry.h = h;
  return outcome;
}

/// R at the roles, or as the measurement itself says.
Outcome Ekf::NoiseOf(Row& row, const double* const* roles) {
  const SensorModel& model = BindingOf(row).model;
  const auto m = static_cast<std::size_t>(model.measurement().geometry.tangent);
  const Measurement& measurement = *row.measurement;
  if (!measurement.covariance.empty()) {
    row.r.assign(measurement.covariance.begin(), measurement.covariance.end());
    return Outcome::kAccepted;
  }
  row.r.resize(m * m);
  row.l.assign(m * m, std::nan(""));
  const Outcome outcome =
      OutcomeOf(model.SqrtNoise(roles, measurement.values.data(), row.l.data()));
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (std::size_t k = 0; k < m; ++k) sum += row.l[i * m + k] * row.l[j * m + k];
      row.r[i * m + j] = row.r[j * m + i] = sum;
    }
  }
  return outcome;
}

JacobianRows Ekf::JacobianOf(const Row& row) const {
  const SensorPlan& plan = PlanOf(row);
  const int m = BindingOf(row).model.measurement().geometry.tangent;
  return {row.h.data(), m, plan.width, plan.parts};
}

/// P H' and S = H P H' + R of one measurement by itself.
void Ekf::Project(Row& row) {
  MeasurementReport& entry = EntryOf(row);
  const auto n = static_cast<std::size_t>(state_.covariance().size());
  row.pht.resize(n * static_cast<std::size_t>(entry.dof));
  entry.s.assign(row.r.begin(), row.r.end());
  state_.covariance().Project(JacobianOf(row), row.pht.data(), entry.s.data());
}

/// S and NIS of one measurement by itself, and whether it passes the gate.
Outcome Ekf::Gate(Row& row) {
  MeasurementReport& entry = EntryOf(row);
  Project(row);
  if (!AllFinite(entry.s) || !AllFinite(row.pht) || !AllFinite(entry.innovation)) {
    entry.s.clear();
    Note("not_finite",
         "sensor '" + BindingOf(row).name + "': h, H, R or the innovation is not finite");
    return Outcome::kNotFinite;
  }
  CheckConditioning(row);
  entry.nis = SquaredMahalanobis(entry.s, entry.innovation);
  if (std::isnan(entry.nis)) {
    entry.nis = 0.0;
    Note("not_pd", "sensor '" + BindingOf(row).name + "': S is not positive definite");
    return Outcome::kNotPd;
  }
  const bool passed = entry.nis <= gate_threshold_[static_cast<std::size_t>(row.sensor)];
  return passed ? Outcome::kAccepted : Outcome::kGated;
}

/// Warns once for each sensor whose noise vanishes beside H P H'.
void Ekf::CheckConditioning(const Row& row) {
  constexpr double kTiny = 1e-13;
  const auto sensor = static_cast<std::size_t>(row.sensor);
  if (warned_[sensor]) return;
  const MeasurementReport& entry = EntryOf(row);
  const auto m = static_cast<std::size_t>(entry.dof);
  double noise = 0.0, total = 0.0;
  bool tiny = false;
  for (std::size_t i = 0; i < m && !tiny; ++i) {
    noise = row.r[i * m + i];
    total = entry.s[i * m + i];
    tiny = noise <= kTiny * total || noise <= 0.0;
  }
  if (!tiny) return;
  warned_[sensor] = true;
  char text[160];
  std::snprintf(text, sizeof(text),
                ": noise variance %.3g vanishes beside H P H' = %.3g; S is badly conditioned",
                noise, total - noise);
  Note("conditioning", "sensor '" + BindingOf(row).name + "'" + text);
}

/// One stacked update with all rows: transactional, so either all of it happens or nothing.
Outcome Ekf::Apply(std::span<Row* const> rows) {
  int m = 0;
  bool considering = considering_;
  for (const Row* row : rows) {
    m += BindingOf(*row).model.measurement().geometry.tangent;
    const std::vector<bool>& considered = PlanOf(*row).considered;
    considering =
        considering || std::find(considered.begin(), considered.end(), true) != considered.end();
  }
  const bool small = state_.covariance().small() && m <= Covariance::kSmall && !considering;
  const Outcome outcome = small ? ApplySmall(rows, m) : ApplyLarge(rows, m);
  if (outcome == Outcome::kNotPd) {
    Note("not_pd", "the update would leave S or P not positive definite; rolled back");
  } else if (outcome == Outcome::kNotFinite) {
    Note("not_finite", "the update is not finite; rolled back");
  } else {
    const Row& last = *rows.back();
    last_used_.sensor = last.sensor;
    last_used_.stamp = last.measurement->stamp;
    last_used_.z.assign(last.measurement->values.begin(), last.measurement->values.end());
  }
  return outcome;
}

/// `gain` is n x m by columns, its rows as they lie in P.
void Ekf::RecordGain(MeasurementReport& entry, const double* gain) const {
  const auto n = static_cast<std::size_t>(state_.covariance().size());
  const auto m = static_cast<std::size_t>(entry.dof);
  if (order_.empty()) return entry.gain.assign(gain, gain + n * m);
  for (std::size_t j = 0; j < m; ++j) {
    for (const int row : order_) entry.gain.push_back(gain[j * n + static_cast<std::size_t>(row)]);
  }
}

/// Few states and few rows: nothing is allocated.
Outcome Ekf::ApplySmall(std::span<Row* const> rows, int m) {
  constexpr std::size_t kMost = Covariance::kSmall;
  std::array<double, kMost * kMost> pht, s, w, gain;
  std::array<double, kMost> innovation, inverse_d, dx;
  const auto n = static_cast<std::size_t>(state_.covariance().size());
  const auto all = static_cast<std::size_t>(m);
  std::size_t at = 0;
  for (const Row* row : rows) {
    const MeasurementReport& entry = EntryOf(*row);
    const JacobianRows h = JacobianOf(*row);
    const auto k = static_cast<std::size_t>(entry.dof);
    std::copy(row->pht.begin(), row->pht.end(), pht.begin() + at * n);
    std::copy(entry.innovation.begin(), entry.innovation.end(), innovation.begin() + at);
    for (std::size_t i = 0; i < k; ++i) {
      for (std::size_t j = 0; j < k; ++j) s[(at + i) * all + at + j] = entry.s[i * k + j];
      for (std::size_t j = 0; j < at; ++j) {  // H of this row times P H' of those before
        double sum = 0.0;
        for (const JacobianPart& part : h.parts) {
          for (int c = 0; c < part.size; ++c) {
            sum += h.data[i * static_cast<std::size_t>(h.stride) +
                          static_cast<std::size_t>(part.column + c)] *
                   pht[j * n + static_cast<std::size_t>(part.offset + c)];
          }
        }
        s[(at + i) * all + j] = s[j * all + at + i] = sum;
      }
    }
    at += k;
  }
  Covariance& p = state_.covariance();
  const Covariance::Solved solved = p.Solve(m, pht.data(), s.data(), innovation.data(), w.data(),
                                            inverse_d.data(), dx.data(), gain.data());
  if (solved == Covariance::Solved::kNotPd) return Outcome::kNotPd;
  if (solved == Covariance::Solved::kCancelled) return ApplyLarge(rows, m);
  state_.Retract(dx.data(), moved_);
  if (!AllFinite({dx.data(), n}) || !AllFinite(moved_)) return Outcome::kNotFinite;
  p.Downdate(m, w.data(), inverse_d.data());
  state_.MoveTo(moved_);  // last: P turns with the tangent planes
  at = 0;
  for (const Row* row : rows) {
    MeasurementReport& entry = EntryOf(*row);
    const auto k = static_cast<std::size_t>(entry.dof);
    RecordGain(entry, gain.data() + at * n);
    at += k;
  }
  return Outcome::kAccepted;
}

Outcome Ekf::ApplyLarge(std::span<Row* const> rows, int m) {
  const int n = state_.covariance().size();
  Eigen::MatrixXd pht(n, m), h = Eigen::MatrixXd::Zero(m, n), r = Eigen::MatrixXd::Zero(m, m);
  Eigen::VectorXd innovation(m);
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const MeasurementReport& entry = EntryOf(*row);
    const Eigen::Index k = entry.dof;
    pht.middleCols(at, k) = Eigen::Map<const Eigen::MatrixXd>(row->pht.data(), n, k);
    innovation.segment(at, k) = Eigen::Map<const Eigen::VectorXd>(entry.innovation.data(), k);
    r.block(at, at, k, k) = Eigen::Map<const RowMajor>(row->r.data(), k, k);
    const JacobianRows rows_of = JacobianOf(*row);
    const Eigen::Map<const RowMajor> compact(rows_of.data, k, rows_of.stride);
    for (const JacobianPart& part : rows_of.parts) {
      h.block(at, part.offset, k, part.size) += compact.middleCols(part.column, part.size);
    }
    at += k;
  }
  Eigen::MatrixXd s = r;
  at = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = EntryOf(*row).dof;
    for (const JacobianPart& part : PlanOf(*row).parts) {
      s.middleRows(at, k) +=
          h.block(at, part.offset, k, part.size) * pht.middleRows(part.offset, part.size);
    }
    at += k;
  }
  Eigen::LLT<Eigen::MatrixXd> llt;
  if (!Factorise(s, llt)) return Outcome::kNotPd;
  const Eigen::MatrixXd w = llt.matrixL().solve(pht.transpose()).transpose();
  Eigen::MatrixXd gain = llt.solve(pht.transpose()).transpose();
  const bool masked = MaskConsidered(rows, gain);
  const Eigen::VectorXd dx = gain * innovation;
  state_.Retract(dx.data(), moved_);
  if (!AllFinite(moved_) || !w.allFinite() || !gain.allFinite()) return Outcome::kNotFinite;
  if (!Correct(w, gain, masked, h, r)) return Outcome::kNotPd;
  state_.MoveTo(moved_);
  at = 0;
  for (const Row* row : rows) {
    MeasurementReport& entry = EntryOf(*row);
    RecordGain(entry, gain.data() + at * n);
    at += entry.dof;
  }
  return Outcome::kAccepted;
}

/// Zeroes the gain of considered blocks; true where that changed anything.
bool Ekf::MaskConsidered(std::span<Row* const> rows, Eigen::MatrixXd& gain) const {
  bool masked = false;
  for (const Block& block : state_.layout().blocks()) {
    if (!block.present || block.status != BlockStatus::kConsidered) continue;
    gain.middleRows(block.tangent_offset, block.geometry().tangent).setZero();
    masked = true;
  }
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const SensorPlan& plan = PlanOf(*row);
    const Eigen::Index k = BindingOf(*row).model.measurement().geometry.tangent;
    for (std::size_t i = 0; i < plan.parts.size(); ++i) {
      if (!plan.considered[i]) continue;
      gain.block(plan.parts[i].offset, at, plan.parts[i].size, k).setZero();
      masked = true;
    }
    at += k;
  }
  return masked;
}

/// P after the update: P -= W W' for the optimal gain, Joseph's form for any other and where the
/// difference would cancel to nothing. False, and P as it was, where P would not stay positive.
bool Ekf::Correct(const Eigen::MatrixXd& w, const Eigen::MatrixXd& gain, bool masked,
                  const Eigen::MatrixXd& h, const Eigen::MatrixXd& r) {
  constexpr double kCancelled = 1e-10;
  Covariance& p = state_.covariance();
  bool joseph = masked;
  for (int i = 0; i < p.size() && !joseph; ++i) {
    joseph = p.Variance(i) - w.row(i).squaredNorm() < kCancelled * p.Variance(i);
  }
  if (!joseph) {
    p.SubtractOuter(w);
    return true;
  }
  Covariance updated = p;
  updated.Joseph(gain, h, r);
  for (int i = 0; i < updated.size(); ++i) {
    if (!(updated.Variance(i) >= 0.0)) return false;
  }
  p = std::move(updated);
  return true;
}

}  // namespace alidade
