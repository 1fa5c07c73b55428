// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/base/number_text.h"
#include "alidade/filter/ekf.h"
#include "alidade/filter/ekf_landmarks.h"
#include "alidade/filter/factorise.h"

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

/// After an update that left S not positive definite: where that is P's fault, makes P positive
/// semi-definite; ends the filter where it needed that too often.
void Ekf::RepairCovariance() {
  constexpr double kRounding = 1e-12;
  const auto is_not_pd = [this](const Row& row) { return EntryOf(row).outcome == Outcome::kNotPd; };
  if (std::ranges::none_of(rows(), is_not_pd)) return;
  Covariance& p = state_.covariance();
  Eigen::LDLT<Eigen::MatrixXd> ldlt;
  Eigen::MatrixXd root;
  const double defect = internal::SquareRootOf(p.Dense(), ldlt, root);
  if (!(defect < -kRounding)) return;
  const std::string text = "the covariance is not positive semi-definite: a pivot is " +
                           internal::RoundedText(defect, 3) + " of its largest variance";
  if (repairs_ == options_.max_covariance_repairs) {
    return GiveUp("not_pd", text + ", after " + std::to_string(repairs_) + " repairs");
  }
  ++repairs_;
  interval_steps_ = 0;
  p.SetBlock(0, 0, root * root.transpose());
  Note("repaired", text + "; negative pivots count as zero (repair " + std::to_string(repairs_) +
                       " of " + std::to_string(options_.max_covariance_repairs) + ")");
}

/// Counts rejections in a row for each sensor, and recovers one that was rejected too often.
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
    if (++rejections_[sensor] < options_.rejection_recovery_after) continue;
    if (options_.rejection_recovery == RejectionRecovery::kNone) continue;
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
                          std::to_string(options_.rejection_recovery_after) + " times in a row: ";
  const int role = binding.model.initialised_role();
  const RoleBinding* target = role < 0 ? nullptr : &binding.roles[static_cast<std::size_t>(role)];
  if (options_.rejection_recovery == RejectionRecovery::kReset && target != nullptr &&
      target->block >= 0 && target->mode == RoleMode::kEstimate &&
      state_.layout()[target->block].status == BlockStatus::kEstimated &&
      InitialiseBlock(row) == Outcome::kInitialised) {
    DropMotionOf(target->block);
    Note("rejection_recovery",
         why + "reset " + state_.layout()[target->block].name + " from its measurement");
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
  if (any) interval_steps_ = 0;
  Note("rejection_recovery",
       why + (any ? "inflated the covariance of its blocks" : "it corrects no block to inflate"));
}

/// Puts the blocks that one motion model moves together with `id` back to their prior covariance,
/// uncorrelated, with the values they have.
void Ekf::DropMotionOf(BlockId id) {
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
      state_.Add(prior.block, value.data(), prior.covariance);
    }
  }
  Bind();
}

}  // namespace alidade
