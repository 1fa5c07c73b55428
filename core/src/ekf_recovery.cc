// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/ekf.h"
#include "ekf_landmarks.h"

namespace alidade {
namespace {

/// A measurement that is itself not finite tells nothing of the filter.
bool Rejected(const MeasurementReport& entry) {
  switch (entry.outcome) {
    case Outcome::kGated:
    case Outcome::kOutOfDomain:
    case Outcome::kNotPd:
      return true;
    case Outcome::kNotFinite:
      return AllFinite(entry.z);
    default:
      return false;
  }
}

}  // namespace

/// Initialises the blocks that wait for one of these measurements, each using up its measurement;
/// what then still needs a block without a value is not ready.
void Ekf::InitialiseFromMeasurements() {
  const auto missing = [this](const RoleBinding& role) {
    return role.block >= 0 && !state_.layout()[role.block].present;
  };
  for (bool progress = true; progress;) {
    progress = false;
    for (Row& row : rows()) {
      Outcome& outcome = EntryOf(row).outcome;
      const SensorBinding& binding = BindingOf(row);
      const int role = binding.model.initialised_role();
      if (outcome != Outcome::kAccepted || role < 0) continue;
      const RoleBinding& target = binding.roles[static_cast<std::size_t>(role)];
      const auto waits = [&](const Prior& prior) {
        return prior.block == target.block && prior.from == binding.name;
      };
      if (std::count_if(binding.roles.begin(), binding.roles.end(), missing) != 1 ||
          !missing(target) || std::none_of(system_.priors.begin(), system_.priors.end(), waits)) {
        continue;
      }
      outcome = InitialiseBlock(row);
      progress = progress || outcome == Outcome::kInitialised;
    }
  }
  for (Row& row : rows()) {
    Outcome& outcome = EntryOf(row).outcome;
    if (outcome == Outcome::kAccepted && !PlanOf(row).ready) outcome = Outcome::kNotReady;
  }
}

/// Gives the block of the sensor's initialised role the value that the measurement implies, with
/// its covariance and correlations; a block that has a value loses it. kInitialised, or why not.
Outcome Ekf::InitialiseBlock(Row& row) {
  const SensorBinding& binding = BindingOf(row);
  const auto target = static_cast<std::size_t>(binding.model.initialised_role());
  const BlockId id = binding.roles[target].block;
  const int m = binding.model.measurement().geometry.tangent;
  const int k = state_.layout()[id].geometry().tangent;

  std::vector<const double*> roles(binding.roles.size(), nullptr);
  std::vector<RowMajor> jacobians(roles.size());
  std::vector<double*> jx(roles.size(), nullptr);
  std::vector<BlockId> from;
  std::vector<Eigen::MatrixXd> from_jacobians;
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (i == target || binding.roles[i].block < 0) continue;
    const BlockId other = binding.roles[i].block;
    roles[i] = state_.value(other);
    if (binding.roles[i].mode == RoleMode::kHold) continue;
    const int columns = state_.layout()[other].geometry().tangent;
    jacobians[i] = RowMajor::Constant(k, columns, std::nan(""));
    jx[i] = jacobians[i].data();
  }
  std::vector<double> y(static_cast<std::size_t>(state_.layout()[id].geometry().ambient));
  RowMajor jz = RowMajor::Constant(k, m, std::nan(""));
  const double* z = row.measurement->values.data();
  const Status status = binding.model.Initialise(roles.data(), z, y.data(), jx.data(), jz.data());
  roles[target] = y.data();
  const Outcome outcome = status == Status::kOk ? NoiseOf(row, roles.data()) : OutcomeOf(status);
  if (outcome == Outcome::kFailed) NotePluginFailure(binding);
  if (outcome != Outcome::kAccepted) {
    return outcome == Outcome::kFailed ? outcome : Outcome::kInvalid;
  }
  const Eigen::MatrixXd own = jz * Eigen::Map<const RowMajor>(row.r.data(), m, m) * jz.transpose();
  if (!own.allFinite() || !AllFinite(y)) return Outcome::kNotFinite;
  state_.layout()[id].geometry().Normalise(y.data());
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (jx[i] == nullptr) continue;
    if (!jacobians[i].allFinite()) return Outcome::kNotFinite;
    from.push_back(binding.roles[i].block);
    from_jacobians.emplace_back(jacobians[i]);
  }
  if (state_.layout()[id].present) state_.Marginalise(id);
  state_.Initialise(id, y.data(), from, from_jacobians, own);
  if (!first_.empty()) FirstEstimate(id).clear();
  Bind();
  return Outcome::kInitialised;
}

/// Counts rejections in a row for each sensor, and recovers one that is locked out.
void Ekf::CountRejections() {
  for (Row& row : rows()) {
    if (landmarks_ != nullptr && landmarks_->Has(row.sensor)) continue;  // no landmark locks it out
    const auto sensor = static_cast<std::size_t>(row.sensor);
    const MeasurementReport& entry = EntryOf(row);
    if (entry.outcome == Outcome::kAccepted || entry.outcome == Outcome::kInitialised) {
      rejections_[sensor] = 0;
      out_of_domain_[sensor] = inflated_[sensor] = false;
    }
    if (!Rejected(entry)) continue;
    if (++rejections_[sensor] < options_.lockout_after) continue;
    if (options_.lockout == Lockout::kNone) continue;
    rejections_[sensor] = 0;
    Recover(row);
  }
}

/// Resets what the sensor determines from its measurement, with the blocks that move with it at
/// their prior uncertainty; where that cannot be, inflates the blocks that it corrects, once
/// until it is accepted again.
void Ekf::Recover(Row& row) {
  const SensorBinding& binding = BindingOf(row);
  const std::string why = "sensor '" + binding.name + "' rejected " +
                          std::to_string(options_.lockout_after) + " times in a row: ";
  const int role = binding.model.initialised_role();
  const RoleBinding* target = role < 0 ? nullptr : &binding.roles[static_cast<std::size_t>(role)];
  if (options_.lockout == Lockout::kReset && target != nullptr && target->block >= 0 &&
      target->mode == RoleMode::kEstimate &&
      state_.layout()[target->block].status == BlockStatus::kEstimated &&
      InitialiseBlock(row) == Outcome::kInitialised) {
    ForgetMotionOf(target->block);
    Note("lockout", why + "reset " + state_.layout()[target->block].name + " from its measurement");
    return;
  }
  if (inflated_[static_cast<std::size_t>(row.sensor)]) return;
  inflated_[static_cast<std::size_t>(row.sensor)] = true;
  constexpr double kInflation = 10.0;
  bool any = false;
  for (const RoleBinding& bound : binding.roles) {
    if (bound.block < 0 || bound.mode != RoleMode::kEstimate) continue;
    const Block& block = state_.layout()[bound.block];
    if (!block.has_covariance() || block.status != BlockStatus::kEstimated) continue;
    const int n = block.geometry().tangent;
    any = true;
    state_.covariance().Transform(block.tangent_offset,
                                  kInflation * Eigen::MatrixXd::Identity(n, n));
  }
  Note("lockout",
       why + (any ? "inflated the covariance of its blocks" : "it corrects no block to inflate"));
}

/// Puts the blocks that one motion model moves together with `id` back to their prior covariance,
/// uncorrelated, with the values they have.
void Ekf::ForgetMotionOf(BlockId id) {
  for (const MotionBinding& motion : system_.motions) {
    if (std::find(motion.blocks.begin(), motion.blocks.end(), id) == motion.blocks.end()) continue;
    for (const Prior& prior : system_.priors) {
      const bool together =
          std::find(motion.blocks.begin(), motion.blocks.end(), prior.block) != motion.blocks.end();
      if (!together || prior.block == id || prior.covariance.size() == 0 ||
          !state_.layout()[prior.block].has_covariance() ||
          state_.layout()[prior.block].status != BlockStatus::kEstimated) {
        continue;
      }
      const std::vector<double> value(
          state_.value(prior.block),
          state_.value(prior.block) + state_.layout()[prior.block].geometry().ambient);
      state_.Marginalise(prior.block);
      state_.Add(prior.block, value.data(), prior.covariance);
    }
  }
  Bind();
}

}  // namespace alidade
