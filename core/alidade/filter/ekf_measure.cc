// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/number_text.h"
#include "alidade/filter/ekf.h"
#include "alidade/filter/ekf_landmarks.h"
#include "alidade/state/small_kernels.h"

namespace alidade {

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
  if (landmarks_ != nullptr && landmarks_->FuseByConsensus(passed_)) return;
  for (Row* row : passed_) Weigh(*row);
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
  entry.h.assign(static_cast<std::size_t>(geometry.ambient), std::nan(""));
  Outcome outcome = plan.linearised_elsewhere ? EvaluateElsewhere(row, entry)
                                              : Evaluate(row, entry, plan.roles.data());
  if (outcome == Outcome::kOutOfDomain || outcome == Outcome::kFailed) entry.h.clear();
  if (outcome == Outcome::kAccepted) outcome = NoiseOf(row, plan.roles.data());
  if (outcome == Outcome::kAccepted) {
    if (geometry.kind == GeometryKind::kAngle) geometry.Normalise(entry.h.data());
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
  const auto sensor = static_cast<std::size_t>(row.sensor);
  // A landmark behind the camera, say, is no divergence.
  if (outcome == Outcome::kOutOfDomain && row.plan == nullptr && !out_of_domain_[sensor]) {
    out_of_domain_[sensor] = true;
    std::vector<BlockId> blocks;
    for (const RoleBinding& role : binding.roles) blocks.push_back(role.block);
    NoteDivergence("diverged",
                   "sensor '" + binding.name + "' is not defined at " + Describe(blocks));
  }
}

/// h and H at the values `roles`; the parts of H are not numbers until the model writes them.
Outcome Ekf::Evaluate(Row& row, MeasurementReport& entry, const double* const* roles) {
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
  return OutcomeOf(
      ModelOf(row).Linearise(roles, entry.h.data(), jacobians_.data(), plan.strides.data()));
}

/// h at the prediction; H at the first estimates, and at what the measurement implies for the role
/// that asks for it.
Outcome Ekf::EvaluateElsewhere(Row& row, MeasurementReport& entry) {
  const SensorModel& model = ModelOf(row);
  SensorPlan& plan = row.plan != nullptr ? *row.plan : plans_[static_cast<std::size_t>(row.sensor)];
  Outcome outcome = OutcomeOf(model.Predict(plan.roles.data(), entry.h.data()));
  if (outcome != Outcome::kAccepted) return outcome;
  if (!plan.implied.empty()) {
    const Status status =
        model.Initialise(plan.roles.data(), entry.z.data(), plan.implied.data(), nullptr, nullptr);
    // What z cannot have come from tells nothing of where to linearise.
    outcome = status == Status::kOutOfDomain ? Outcome::kInvalid : OutcomeOf(status);
    if (outcome != Outcome::kAccepted) return outcome;
  }
  predicted_.assign(entry.h.begin(), entry.h.end());
  outcome = Evaluate(row, entry, plan.linearised_at.data());
  entry.h.assign(predicted_.begin(), predicted_.end());
  for (std::size_t i = 0; i < plan.roles.size(); ++i) {
    const Geometry& geometry = model.roles()[i].geometry;
    if (plan.columns[i] < 0 || plan.linearised_at[i] == plan.roles[i] ||
        geometry.kind != GeometryKind::kUnitVector) {
      continue;
    }
    RowMajor j(geometry.tangent, geometry.tangent);
    geometry.Transport(plan.roles[i], plan.linearised_at[i], j.data());
    Chain(row, plan.columns[i], geometry.tangent, j.data());
  }
  return outcome;
}

/// H <- H J in the columns of one role, J size x size, row-major.
void Ekf::Chain(Row& row, int column, int size, const double* j) {
  const Workspace::Use use(work_);
  const int m = BindingOf(row).model.measurement().geometry.tangent;
  auto own = Eigen::Map<RowMajor>(row.h.data(), m, PlanOf(row).width).middleCols(column, size);
  Workspace::Matrix chained = work_.Take(m, size);
  chained.noalias() = own * Eigen::Map<const RowMajor>(j, size, size);
  own = chained;
}

const double* const* Ekf::RolesAt(const Row& row, const std::vector<double>& values) {
  const std::vector<RoleBinding>& bound = BindingOf(row).roles;
  roles_ = PlanOf(row).roles;
  for (std::size_t i = 0; i < roles_.size(); ++i) {
    const bool known = i < bound.size() && bound[i].mode == RoleMode::kKnown;
    if (roles_[i] == nullptr || known) continue;
    roles_[i] = values.data() + (roles_[i] - state_.values().data());
  }
  return roles_.data();
}

/// R at the roles, or as the measurement itself says.
Outcome Ekf::NoiseOf(Row& row, const double* const* roles) {
  const SensorModel& model = ModelOf(row);
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
  return {row.h.data(), m, plan.width, plan.parts, plan.whole};
}

/// P H' and S = H P H' + R of one measurement by itself.
void Ekf::Project(Row& row) {
  MeasurementReport& entry = EntryOf(row);
  const auto n = static_cast<std::size_t>(state_.covariance().size());
  row.pht.resize(n * static_cast<std::size_t>(entry.dof));
  entry.s.assign(row.r.begin(), row.r.end());
  state_.covariance().Project(JacobianOf(row), row.pht.data(), entry.s.data());
}

/// S, NIS and w of one measurement by itself, and whether it passes the gate. What lies so far out
/// that its R / w is not finite does not.
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
  const auto m = static_cast<std::size_t>(entry.dof);
  row.work.resize(m * (m + 1));
  entry.nis = internal::SquaredMahalanobis(entry.s.data(), entry.innovation.data(), entry.dof,
                                           row.work.data());
  if (std::isnan(entry.nis)) {
    entry.nis = 0.0;
    Note("not_pd", "sensor '" + BindingOf(row).name + "': S is not positive definite");
    return Outcome::kNotPd;
  }
  if (!(entry.nis <= gate_threshold_[static_cast<std::size_t>(row.sensor)])) return Outcome::kGated;
  row.weight = Weight(BindingOf(row).loss, std::sqrt(entry.nis));
  const double widest = *std::ranges::max_element(row.r) / row.weight;
  return std::isfinite(widest) ? Outcome::kAccepted : Outcome::kGated;
}

/// R <- R / w of the sensor's robust loss, in R and in S.
void Ekf::Weigh(Row& row) {
  MeasurementReport& entry = EntryOf(row);
  if (row.weight == 1.0) return;
  for (std::size_t i = 0; i < row.r.size(); ++i) {
    const double widened = row.r[i] / row.weight;
    entry.s[i] += widened - row.r[i];
    row.r[i] = widened;
  }
}

/// Warns once for each sensor whose noise vanishes compared with H P H'.
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
  Note("conditioning", "sensor '" + BindingOf(row).name + "': noise variance " +
                           internal::RoundedText(noise, 3) + " vanishes compared with H P H' = " +
                           internal::RoundedText(total - noise, 3) + "; S is badly conditioned");
}

}  // namespace alidade
