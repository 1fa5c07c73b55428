// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "alidade/estimation/problem.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// State that one measurement implies without a filter: the value x of one scalar block for which
/// h(x) = z, such as f B / d for a disparity d. If a single measurement can initialise the block, x
/// is this initial value. Otherwise the measurement and all roles must be scalars. Newton's method
/// then computes x for the first role. The method starts from the true value of this role, and all
/// other roles have their true values.
class ImpliedState {
 public:
  /// Returns the implied state of a sensor. Returns nullopt if its measurements do not imply a
  /// scalar, for example because the sensor has a landmark, known numbers, several measured
  /// elements, or roles without truth.
  static std::optional<ImpliedState> Of(const Problem& problem, const SensorBinding& binding,
                                        const std::vector<StreamInfo>& truths);

  BlockId block() const { return block_; }
  /// Returns whether x depends on the true values of the other roles.
  bool uses_true_roles() const { return uses_true_roles_; }
  /// Returns x, or nullopt if z is invalid, a truth is unknown, or x does not exist.
  std::optional<double> From(const Truth& truth, const double* z) const;

 private:
  ImpliedState(SharedSensor model, BlockId block) : model_(std::move(model)), block_(block) {}

  SharedSensor model_;
  BlockId block_;
  bool uses_true_roles_ = false;
  std::vector<int> truths_;  ///< index of the truth of each role
};

/// Returns the index of the truth of each role. Returns an empty list if a role is unbound or has
/// no truth.
std::vector<int> TruthsOfRoles(const Problem& problem, const SensorBinding& binding,
                               const std::vector<StreamInfo>& truths);

/// Returns the true values of the roles whose truths have the indices `truths`. Returns an empty
/// list if a true value is unknown.
std::vector<const double*> RolesAtTruth(const Truth& truth, const std::vector<int>& truths);

}  // namespace alidade::internal
