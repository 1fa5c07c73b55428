// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade::internal {

/// Check and normalisation of every frame of a source, before any other use. Normalises quaternions
/// and directions of measurements, control inputs and truth. Selects the sign of quaternions by
/// ChooseSign, so that the output of a run does not depend on the signs of the source.
class FrameCheck {
 public:
  using Counts = std::map<std::string, std::int64_t>;

  /// `normalised` counts, by stream or truth, values whose length differed from 1 by more than
  /// 1e-9.
  FrameCheck(const Experiment& experiment, Counts& normalised);

  /// Checks and normalises a frame. Errors: ContractViolation for a frame that contradicts
  /// Source::streams() or truths(), as later code relies on their indices and sizes; kBadData for a
  /// length that differs from 1 by more than 1e-3.
  void operator()(SourceFrame& frame);
  /// Selects the sign of each true quaternion that is nearer to the previous one. Requires frames
  /// in the order of time.
  void ChooseTruthSigns(SourceFrame& frame);

 private:
  /// Stream or truth.
  struct Channel {
    StreamInfo info;
    Geometry geometry;                  ///< a vector if unknown
    std::vector<double> previous = {};  ///< value of a truth
  };

  void Check(const SourceFrame& frame) const;
  void Normalise(Channel& channel, std::vector<double>& value);

  const Source& source_;
  std::vector<Channel> streams_, truths_;
  Counts& normalised_;
};

}  // namespace alidade::internal
