// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade::internal {

/// What every frame of a source passes before anything else sees it. Quaternions and directions,
/// of measurements, control inputs and truth, are brought to unit length, and a quaternion to the
/// sign that ChooseSign has for it: the signs of a source are not seen in what a run writes.
class FrameCheck {
 public:
  using Counts = std::map<std::string, std::int64_t>;

  /// `normalised` counts, by stream or truth, values whose length was off by more than 1e-9.
  FrameCheck(const Experiment& experiment, Counts& normalised);

  /// Errors: ContractViolation for a frame that is not as Source::streams() and truths() say, as
  /// whatever takes it afterwards indexes by stream and reads as many values as these tell;
  /// kBadData for a length that is off by more than 1e-3.
  void operator()(SourceFrame& frame);
  /// Of the two signs of a true quaternion, that nearer to the one before. Takes frames in order.
  void FollowTruth(SourceFrame& frame);

 private:
  /// The values of one stream or truth.
  struct Kind {
    StreamInfo info;
    Geometry geometry;                ///< a vector where none is known
    std::vector<double> before = {};  ///< of a truth
  };

  void Check(const SourceFrame& frame) const;
  void Normalise(Kind& kind, std::vector<double>& value);

  const Source& source_;
  std::vector<Kind> streams_, truths_;
  Counts& normalised_;
};

}  // namespace alidade::internal
