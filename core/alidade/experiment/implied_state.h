// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "alidade/estimation/problem.h"
#include "alidade/experiment/source.h"

namespace alidade::internal {

/// The state that one measurement implies, without a filter: the x of one scalar block with
/// h(x) = z, as f B / d of a disparity d. A sensor that can initialise the block from a measurement
/// alone does so; of another whose measurement and roles are scalars, x is that of its first role
/// by Newton's method from truth, its other roles at truth.
class ImpliedState {
 public:
  /// None where the sensor implies no scalar: it has a landmark, known numbers, more elements, or
  /// roles whose truth the source does not name.
  static std::optional<ImpliedState> Of(const Problem& problem, const SensorBinding& binding,
                                        const std::vector<StreamInfo>& truths);

  BlockId block() const { return block_; }
  /// The other roles are at truth.
  bool rest_at_truth() const { return rest_at_truth_; }
  /// None where z is not valid, a truth is not known, or there is no such x.
  std::optional<double> From(const Truth& truth, const double* z) const;

 private:
  ImpliedState(SharedSensor model, BlockId block) : model_(std::move(model)), block_(block) {}

  SharedSensor model_;
  BlockId block_;
  bool rest_at_truth_ = false;
  std::vector<int> truths_;  ///< by role
};

/// The truth of each role of a sensor; empty where one is unbound or has none.
std::vector<int> TruthsOfRoles(const Problem& problem, const SensorBinding& binding,
                               const std::vector<StreamInfo>& truths);

/// The values of roles at truth; empty where one is not known.
std::vector<const double*> RolesAtTruth(const Truth& truth, const std::vector<int>& truths);

}  // namespace alidade::internal
