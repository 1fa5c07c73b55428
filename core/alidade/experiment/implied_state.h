// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "alidade/estimation/problem.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// State implied by one measurement without a filter: the x of one scalar block with h(x) = z, such
/// as f B / d for a disparity d. If the sensor can initialise the block from a measurement alone, x
/// is that initial value. Otherwise measurement and roles must be scalars; x is then the value of
/// the first role by Newton's method from truth, with the other roles at truth.
class ImpliedState {
 public:
  /// Returns nothing if the sensor does not imply a scalar: it has a landmark, known numbers, more
  /// elements, or roles without truth.
  static std::optional<ImpliedState> Of(const Problem& problem, const SensorBinding& binding,
                                        const std::vector<StreamInfo>& truths);

  BlockId block() const { return block_; }
  /// Returns whether the other roles are at truth.
  bool uses_true_roles() const { return uses_true_roles_; }
  /// Returns x, or nothing if z is invalid, a truth is unknown, or x does not exist.
  std::optional<double> From(const Truth& truth, const double* z) const;

 private:
  ImpliedState(SharedSensor model, BlockId block) : model_(std::move(model)), block_(block) {}

  SharedSensor model_;
  BlockId block_;
  bool uses_true_roles_ = false;
  std::vector<int> truths_;  ///< by role
};

/// Returns the index of the truth of each role; empty if a role is unbound or has no truth.
std::vector<int> TruthsOfRoles(const Problem& problem, const SensorBinding& binding,
                               const std::vector<StreamInfo>& truths);

/// Returns the true values of roles; empty if one is unknown.
std::vector<const double*> RolesAtTruth(const Truth& truth, const std::vector<int>& truths);

}  // namespace alidade::internal
