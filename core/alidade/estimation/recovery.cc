// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/recovery.h"

#include <algorithm>
#include <cmath>
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

/// Returns whether a sensor corrects the block of a role.
bool IsCorrected(const FilterState& f, const RoleBinding& role) {
  if (role.block < 0 || role.mode != RoleMode::kEstimate) return false;
  const Block& block = f.state.layout()[role.block];
  return block.has_covariance() && block.status == BlockStatus::kEstimated;
}

/// Multiplies the standard deviations of the blocks that a sensor corrects by 10. Returns false if
/// the sensor corrects no block.
bool Inflate(FilterState& f, const SensorBinding& sensor) {
  constexpr double kInflation = 10.0;
  bool is_changed = false;
  for (const RoleBinding& role : sensor.roles) {
    const auto first = std::ranges::find(sensor.roles, role.block, &RoleBinding::block);
    const bool is_repeated = &role != &*first;
    if (is_repeated || !IsCorrected(f, role)) continue;
    const Block& block = f.state.layout()[role.block];
    const int n = block.geometry().tangent;
    const RowMajor inflation = kInflation * RowMajor::Identity(n, n);
    std::vector<int> rows(static_cast<std::size_t>(n));
    std::iota(rows.begin(), rows.end(), block.tangent_offset);
    f.state.covariance().Propagate(rows, inflation.data());
    is_changed = true;
  }
  return is_changed;
}

/// Block whose error explains the innovation of a measurement best, and the correction that the
/// measurement requires of this block alone.
struct WrongBlock {
  BlockId id = -1;  ///< -1: no block explains the innovation
  Eigen::VectorXd correction;
};

/// Returns the block that explains the innovation best. The error d of a block reduces r' S^-1 r by
/// g' d, with H_b its columns of H, g = H_b' S^-1 r and H_b' S^-1 H_b d = g. If `preferred`
/// explains nearly as much as the best block, returns `preferred`.
WrongBlock FindWrongBlock(const FilterState& f, const PendingMeasurement& pending,
                          BlockId preferred) {
  constexpr double kNearly = 0.9;
  const SensorPlace& place = *pending.place;
  const Eigen::Index m = place.dof;
  Roles roles{};
  RolesAt(place, f.state.values().data(), f.state.values().data(), roles);
  std::vector<double> h(static_cast<std::size_t>(place.ambient));
  RowMajor jacobian(m, place.width), l(m, m), r(m, m);
  Eigen::VectorXd innovation(m);
  if (EvaluateAt(*pending.model, place, *pending.measurement, roles.data(),
                 {.h = h.data(), .jacobian = jacobian.data()}) != Outcome::kAccepted ||
      NoiseAt(*pending.model, place, *pending.measurement, roles.data(), l.data(), r.data()) !=
          Outcome::kAccepted) {
    return {};
  }
  pending.model->measurement().geometry.Minus(pending.measurement->values.data(), h.data(),
                                              innovation.data());
  const Eigen::MatrixXd p = f.state.covariance().Dense()(place.rows, place.rows);
  const Eigen::MatrixXd s = Congruence(jacobian, p) + r;
  WrongBlock best;
  double best_reduction = 0.0;
  for (std::size_t i = 0; i < place.columns.size(); ++i) {
    const RoleBinding& role = pending.binding->roles[i];
    if (place.columns[i] < 0 || !IsCorrected(f, role)) continue;
    const int n = f.state.layout()[role.block].geometry().tangent;
    const Eigen::MatrixXd columns = jacobian.middleCols(place.columns[i], n);
    const Eigen::MatrixXd weighted = SolveLeastNorm(s, columns);  // S^-1 H_b
    const Eigen::VectorXd gradient = weighted.transpose() * innovation;
    const Eigen::VectorXd correction =
        SolveLeastNorm(TransposedProduct(columns, weighted), gradient);
    const double reduction = gradient.dot(correction) / (role.block == preferred ? kNearly : 1.0);
    if (!(reduction > best_reduction)) continue;
    best_reduction = reduction;
    best = {role.block, correction};
  }
  return best;
}

/// Increases the covariance of a block by |d|^2 I, with d the correction that a measurement
/// requires. Later measurements then pass the gate and correct the block.
void Widen(FilterState& f, const WrongBlock& block) {
  const Block& place = f.state.layout()[block.id];
  const int row = place.tangent_offset, n = place.geometry().tangent;
  Eigen::MatrixXd covariance = f.state.covariance().Block(row, n, row, n);
  covariance.diagonal().array() += block.correction.squaredNorm();
  f.state.covariance().SetBlock(row, row, covariance);
}

/// Returns the block that the inverse measurement model of a sensor determines; -1 if the sensor
/// cannot reset a block.
BlockId DeterminedBlock(const FilterState& f, const SensorBinding& sensor) {
  const int role = sensor.model->inverse().role;
  if (role < 0) return -1;
  const RoleBinding& target = sensor.roles[static_cast<std::size_t>(role)];
  return IsCorrected(f, target) ? target.block : -1;
}

}  // namespace

[[gnu::noinline]] void Recovery::RepairCovariance(FilterState& f, UpdateMethod& method) {
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
  p.SetBlock(0, 0, ProductTransposed(root, root));
  f.motions.EndInterval();
  method.Begin(f);
  AddEvent(f, EventKind::kRepaired,
           text + "; negative pivots were set to zero (repair " + std::to_string(repairs_) +
               " of " + std::to_string(options_.max_covariance_repairs) + ")");
}

/// Counts a measurement that was not accepted. Measurements that are not finite do not count,
/// because h was not computed for them.
[[gnu::noinline]] void Recovery::CountRejection(FilterState& f, PendingMeasurement& pending,
                                                UpdateMethod& method) {
  const MeasurementReport& entry = *pending.report;
  if (!InfoOf(entry.outcome).is_rejection ||
      (entry.outcome == Outcome::kNotFinite && entry.h.empty())) {
    return;
  }
  Rejections& rejections = sensors_[static_cast<std::size_t>(pending.sensor)];
  if (rejections.count == 0) rejections.first = f.timestamp;
  if (++rejections.count == kMostlyRejected) {
    AddEvent(f, EventKind::kMostlyRejected,
             "sensor '" + pending.binding->name + "': the last " + std::to_string(kMostlyRejected) +
                 " measurements were rejected; until one is accepted, this sensor does not correct "
                 "the estimate");
  }
  if (options_.rejection_recovery == RejectionRecovery::kNone || !IsDue(f, rejections)) return;
  const std::string reason = "sensor '" + pending.binding->name + "' was rejected " +
                             std::to_string(rejections.count) +
                             (rejections.count == 1 ? " time" : " times in a row");
  if (++rejections.attempts > kMaxAttempts) {
    AddEvent(f, EventKind::kRecoveryFailed,
             reason + ", although the filter tried to recover " + std::to_string(kMaxAttempts) +
                 " times; there are no further attempts until a measurement is accepted");
    return;
  }
  const std::string action = Recover(f, pending);
  f.motions.EndInterval();
  method.Begin(f);
  AddEvent(f, EventKind::kRejectionRecovery, reason + ": " + action);
}

/// Returns whether an attempt is due.
bool Recovery::IsDue(const FilterState& f, const Rejections& rejections) const {
  if (rejections.attempts > kMaxAttempts) return false;
  const double factor = std::ldexp(1.0, rejections.attempts);
  const double rejected_s = Seconds(f.timestamp - rejections.first);
  return rejections.count >= factor * options_.rejection_recovery_after ||
         rejected_s >= factor * options_.rejection_recovery_after_s;
}

/// Resets or inflates blocks of the sensor of a rejected measurement. Returns the text of the
/// event.
std::string Recovery::Recover(FilterState& f, PendingMeasurement& pending) const {
  const SensorBinding& sensor = *pending.binding;
  if (options_.rejection_recovery == RejectionRecovery::kReset) {
    const BlockId determined = DeterminedBlock(f, sensor);
    const WrongBlock wrong = pending.report->outcome == Outcome::kGated
                                 ? FindWrongBlock(f, pending, determined)
                                 : WrongBlock();
    if (wrong.id >= 0 && wrong.id != determined) {
      Widen(f, wrong);
      return "the sigma of block '" + f.state.layout()[wrong.id].name +
             "', which explains the rejections best, was increased by the required correction of " +
             RoundedText(wrong.correction.norm(), 3);
    }
    InverseMeasurement inverse;
    if (determined >= 0 && Invert(f, pending, nullptr, inverse) == Outcome::kAccepted) {
      ResetMotionBlocks(f, determined);
      Initialise(f, pending, inverse);
      return "block '" + f.state.layout()[determined].name +
             "' was reset from the last measurement";
    }
  }
  return Inflate(f, sensor) ? "the sigmas of its blocks were multiplied by 10"
                            : "the sensor has no estimated block to inflate";
}

}  // namespace alidade::internal
