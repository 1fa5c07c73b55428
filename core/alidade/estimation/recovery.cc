// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/recovery.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "alidade/base/number_text.h"
#include "alidade/estimation/delayed_initialisation.h"
#include "alidade/state/dense_algebra.h"

namespace alidade::internal {
namespace {

/// Returns A + (B - A)+, an upper bound of the covariances A and B. (.)+ is the positive part of a
/// matrix.
Eigen::MatrixXd UpperBound(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const SymmetricEigen difference = EigenOf(b - a);
  const Eigen::VectorXd positive = difference.values.cwiseMax(0.0);
  return a + ProductTransposed(difference.vectors * positive.asDiagonal(), difference.vectors);
}

/// Resets the covariance of all blocks that belong to the same motion model as block `id`. The new
/// covariance of a block is an upper bound of its prior and current covariance, without
/// correlations. The values are unchanged. The caller initialises block `id` afterwards.
void ResetMotionBlocks(FilterState& f, BlockId id) {
  for (const MotionBinding& motion : f.problem_index->problem.motions) {
    if (std::ranges::find(motion.blocks, id) == motion.blocks.end()) continue;
    for (const Prior& prior : f.problem_index->problem.priors) {
      const Block& block = f.state.layout()[prior.block];
      if (std::ranges::find(motion.blocks, prior.block) == motion.blocks.end() ||
          prior.covariance.size() == 0 || !block.has_covariance() ||
          block.status != BlockStatus::kEstimated) {
        continue;
      }
      const double* const value = f.state.value(prior.block);
      const std::vector<double> copy(value, value + block.geometry().ambient);
      const int row = block.tangent_offset, n = block.geometry().tangent;
      f.state.Add(prior.block, copy.data(),
                  UpperBound(prior.covariance, f.state.covariance().Block(row, n, row, n)));
    }
  }
}

/// Multiplies the standard deviations of the blocks that a sensor corrects by 10. Returns false if
/// the sensor corrects no block.
bool Inflate(FilterState& f, const SensorBinding& sensor) {
  constexpr double kInflation = 10.0;
  bool is_changed = false;
  for (const RoleBinding& role : sensor.roles) {
    const auto first = std::ranges::find(sensor.roles, role.block, &RoleBinding::block);
    const bool is_repeated = &role != &*first;
    if (role.block < 0 || role.mode != RoleMode::kEstimate || is_repeated) continue;
    const Block& block = f.state.layout()[role.block];
    if (!block.has_covariance() || block.status != BlockStatus::kEstimated) continue;
    const int n = block.geometry().tangent;
    const RowMajor inflation = kInflation * RowMajor::Identity(n, n);
    std::vector<int> rows(static_cast<std::size_t>(n));
    std::iota(rows.begin(), rows.end(), block.tangent_offset);
    f.state.covariance().Propagate(rows, inflation.data());
    is_changed = true;
  }
  if (is_changed) f.motions.EndInterval();
  return is_changed;
}

}  // namespace

[[gnu::noinline]] void Recovery::RepairCovariance(FilterState& f) {
  constexpr double kRounding = 1e-12;
  Covariance& p = f.state.covariance();
  Eigen::LDLT<Eigen::MatrixXd> ldlt;
  Eigen::MatrixXd root;
  const double defect = SquareRootOf(p.Dense(), ldlt, root);
  if (!(defect < -kRounding)) return;
  const std::string text = "the covariance is not positive semi-definite: a pivot is " +
                           RoundedText(defect, 3) + " times the largest variance";
  if (repairs_ == options_.max_covariance_repairs) {
    return End(f, EventKind::kNotPd,
               text + "; the limit of repairs is " + std::to_string(repairs_));
  }
  ++repairs_;
  f.motions.EndInterval();
  p.SetBlock(0, 0, ProductTransposed(root, root));
  AddEvent(f, EventKind::kRepaired,
           text + "; negative pivots were set to zero (repair " + std::to_string(repairs_) +
               " of " + std::to_string(options_.max_covariance_repairs) + ")");
}

[[gnu::noinline]] void Recovery::Recover(FilterState& f, PendingMeasurement& pending) {
  const SensorBinding& sensor = *pending.binding;
  const std::string reason = "sensor '" + sensor.name + "' was rejected " +
                             std::to_string(options_.rejection_recovery_after) +
                             " times in a row: ";
  const int role = sensor.model->inverse().role;
  InverseMeasurement inverse;
  const RoleBinding* target = role < 0 ? nullptr : &sensor.roles[static_cast<std::size_t>(role)];
  if (options_.rejection_recovery == RejectionRecovery::kReset && target != nullptr &&
      target->block >= 0 && target->mode == RoleMode::kEstimate &&
      f.state.layout()[target->block].status == BlockStatus::kEstimated &&
      Invert(f, pending, nullptr, inverse) == Outcome::kAccepted) {
    ResetMotionBlocks(f, target->block);
    Initialise(f, pending, inverse);
    AddEvent(f, EventKind::kRejectionRecovery,
             reason + "block '" + f.state.layout()[target->block].name +
                 "' was reset from the last measurement");
    return;
  }
  char& inflated = f.health.inflated[static_cast<std::size_t>(pending.sensor)];
  if (inflated != 0) return;
  inflated = 1;
  AddEvent(f, EventKind::kRejectionRecovery,
           reason + (Inflate(f, sensor) ? "the covariance of its blocks was inflated"
                                        : "the sensor has no estimated block to inflate"));
}

}  // namespace alidade::internal
