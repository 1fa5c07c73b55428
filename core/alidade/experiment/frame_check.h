// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade::internal {

/// Frame check: checks and normalises each frame of a source before the frame is used. Normalises
/// the quaternions and directions of measurements, control inputs and truth. ChooseSign selects the
/// signs of the quaternions, so the output of a run does not depend on the signs that the source
/// chose.
class FrameCheck {
 public:
  using Counts = std::map<std::string, std::int64_t>;

  /// For each stream and truth, `normalised` counts the values whose length differed from 1 by more
  /// than 1e-9.
  FrameCheck(const Experiment& experiment, Counts& normalised);

  /// Checks and normalises a frame. Errors: ContractViolation if the frame contradicts
  /// Source::streams() or truths(), because later code relies on their indices and sizes; kBadData
  /// if the length of a quaternion or direction differs from 1 by more than 1e-3.
  void operator()(SourceFrame& frame);
  /// Replaces each true quaternion q by -q if -q is nearer to the previous true quaternion. Frames
  /// must be passed in chronological order.
  void ChooseTruthSigns(SourceFrame& frame);

 private:
  /// Stream or truth, with its geometry.
  struct Channel {
    StreamInfo info;
    Geometry geometry;                  ///< geometry of the values; a vector if it is unknown
    std::vector<double> previous = {};  ///< previous quaternion of a truth; empty for a stream
  };

  void Check(const SourceFrame& frame) const;
  void Normalise(Channel& channel, std::vector<double>& value);

  const Source& source_;
  std::vector<Channel> streams_, truths_;
  Counts& normalised_;
};

}  // namespace alidade::internal
