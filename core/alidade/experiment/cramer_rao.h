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

/// Cramer-Rao bound of a filter: no unbiased estimate from the same data has a smaller covariance.
/// The bound applies to the true trajectory of the run (the parametric bound of [Bergman1999], ch.
/// 4). The recursion starts from P_0 of the prior. F, G, Q, H and R are evaluated at the true state
/// x_k of each timestamp:
///
///   P- = F P F' + G Q G',   P = (P-^-1 + H' R^-1 H)^-1
///
/// These are the equations of Ekf. The class therefore runs an Ekf without gate and loss, and sets
/// the state of this filter to truth before and after each step. The measured values determine only
/// which measurements are valid, and the covariance of the blocks that are initialised from a
/// measurement.
///
/// Landmarks are also set to truth. The true positions of a landmark and of the camera determine
/// the values of its representation. In a problem with landmarks, the prediction h at truth
/// replaces each valid measurement. Updates then do not move the state, and landmarks are
/// initialised with the Jacobians at truth. If the inverse distance has a prior, only the sigma of
/// the prior has an effect.
class CramerRaoBound {
 public:
  /// Function that returns the true position of the landmark with this id, in m, or nullopt if the
  /// position is unknown.
  using TrueLandmark = std::function<std::optional<std::array<double, 3>>(std::int64_t id)>;

  /// Returns the reason why a problem has no bound, as the text after `no Cramer-Rao bound: `.
  /// Returns "" if the problem has a bound.
  static std::string WhyUnavailable(const Problem& problem, const std::vector<StreamInfo>& truths);

  /// Requires that WhyUnavailable() returns "" for the problem.
  CramerRaoBound(const Problem& problem, const std::vector<StreamInfo>& streams,
                 const std::vector<StreamInfo>& truths, TrueLandmark true_landmark = {});

  /// Processes the next frame of a run, in chronological order. Returns false if the bound does not
  /// exist for this frame, because the truth of an estimated block or landmark is unknown, a step
  /// failed, or a landmark could not start at truth. All later calls then also return false.
  bool Add(const SourceFrame& frame);
  /// Returns the true values with the bound P as covariance.
  const State& state() const { return engine_.f.state; }

 private:
  bool MoveToTruth(const Truth& truth);
  bool MoveLandmarks(std::vector<double>& values);
  std::optional<std::vector<double>> TrueValue(const Block& block, const double* value,
                                               std::span<const Block* const> anchors) const;
  bool ReplaceByPrediction(Frame& frame, bool& has_all) const;

  FilterEngine engine_;
  TrueLandmark true_landmark_;
  std::vector<int> sensors_;  ///< index of the sensor of each stream, or -1
  /// True values of each landmark block. The key is the name of the block.
  std::map<std::string, std::vector<double>> landmarks_;
  std::vector<int> truths_;  ///< index of the truth of each block, or -1
  bool is_lost_ = false;
};

}  // namespace alidade::internal
