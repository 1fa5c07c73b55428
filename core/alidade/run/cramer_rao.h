// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/filter/frame_loop.h"

namespace alidade::internal {

/// The Cramer-Rao bound of a filter: no unbiased estimate from the same data has a smaller
/// covariance, for the true path that the run has (the parametric bound of [Bergman1999], ch. 4).
/// With F, G, Q, H, R at the true state x_k of each timestamp, and P_0 that of the prior,
///
///   P- = F P F' + G Q G',   P = (P-^-1 + H' R^-1 H)^-1
///
/// which are the equations of Ekf, so that is what is run: it has no gate and no loss, and its
/// state is set to truth before and after each of its steps. What measurements say decides nothing
/// but which of them are valid, and, at the measured values, the covariance of blocks that start
/// from one.
class CramerRaoBound {
 public:
  /// Why a system has none here, in words that follow `no Cramer-Rao bound: `; "": it has one.
  static std::string WhyNone(const System& system, const std::vector<StreamInfo>& truths);

  /// Of a system that has one.
  CramerRaoBound(const System& system, const std::vector<StreamInfo>& streams,
                 const std::vector<StreamInfo>& truths);

  /// The frames of a run, in the order of time. False, and for good, where the truth of a block
  /// that is estimated is not known or a step failed: there is no bound from here on.
  bool Add(const SourceFrame& frame);
  /// P, and the truth.
  const State& state() const { return loop_.f.state; }

 private:
  bool MoveToTruth(const Truth& truth);

  FrameLoop loop_;
  std::vector<int> truths_;  ///< by block; -1: none
  bool lost_ = false;
};

}  // namespace alidade::internal
