// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade::internal {

/// Check and normalisation of every frame of a source before any other use. It normalises
/// quaternions and directions of measurements, control inputs and truth. It selects the sign of
/// quaternions by ChooseSign, so the output of a run does not depend on the signs that the source
/// chose.
class FrameCheck {
 public:
  using Counts = std::map<std::string, std::int64_t>;

  /// For each stream and truth, `normalised` counts the values whose length differed from 1 by more
  /// than 1e-9.
  FrameCheck(const Experiment& experiment, Counts& normalised);

  /// Checks and normalises a frame. Errors: ContractViolation if the frame contradicts
  /// Source::streams() or truths(), because later code relies on their indices and sizes; kBadData
  /// if a length differs from 1 by more than 1e-3.
  void operator()(SourceFrame& frame);
  /// Selects the sign of each true quaternion so that it is nearer to the previous true quaternion.
  /// Frames must be passed in the order of time.
  void ChooseTruthSigns(SourceFrame& frame);

 private:
  /// Stream or truth, with its geometry.
  struct Channel {
    StreamInfo info;
    Geometry geometry;                  ///< geometry of the values; a vector if it is unknown
    std::vector<double> previous = {};  ///< previous value, if this is a truth
  };

  void Check(const SourceFrame& frame) const;
  void Normalise(Channel& channel, std::vector<double>& value);

  const Source& source_;
  std::vector<Channel> streams_, truths_;
  Counts& normalised_;
};

}  // namespace alidade::internal
