// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "alidade/estimation/filter_engine.h"
#include "alidade/experiment/source.h"

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
///
/// Landmarks are set to truth as well, in the representation that they have, from where the camera
/// truly was. So that they start there, too, a problem with landmarks is given h at truth in place
/// of each valid measurement: no update moves the state, and a landmark is initialised with the
/// Jacobians at truth. A prior of the inverse distance gives its sigma; its mean does not count.
class CramerRaoBound {
 public:
  /// Where the landmark of an id truly is, m.
  using TrueLandmark = std::function<std::optional<std::array<double, 3>>(std::int64_t id)>;

  /// Why a problem has none here, in words that follow `no Cramer-Rao bound: `; "": it has one.
  static std::string WhyNone(const Problem& problem, const std::vector<StreamInfo>& truths);

  /// Of a problem that has one.
  CramerRaoBound(const Problem& problem, const std::vector<StreamInfo>& streams,
                 const std::vector<StreamInfo>& truths, TrueLandmark true_landmark = {});

  /// The frames of a run, in the order of time. False, and for good, where the truth of a block or
  /// landmark that is estimated is not known, a step failed, or a landmark could not start at
  /// truth: there is no bound from here on.
  bool Add(const SourceFrame& frame);
  /// P, and the truth.
  const State& state() const { return engine_.f.state; }

 private:
  bool MoveToTruth(const Truth& truth);
  bool MoveLandmarks(std::vector<double>& values);
  std::optional<std::vector<double>> AtTruth(const Block& block, const double* value,
                                             std::span<const Block* const> anchors) const;
  bool MeasureAtTruth(Frame& frame, bool& all) const;

  FilterEngine engine_;
  TrueLandmark true_landmark_;
  std::vector<int> sensors_;                              ///< by stream; -1: none
  std::map<std::string, std::vector<double>> landmarks_;  ///< true values, by block
  std::vector<int> truths_;                               ///< by block; -1: none
  bool lost_ = false;
};

}  // namespace alidade::internal
