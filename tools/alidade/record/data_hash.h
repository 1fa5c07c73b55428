// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/source.h"
#include "alidade/io/sha256.h"

namespace alidade::internal {

/// SHA-256 of the data of a run's source. It depends on the values only, not on their text or
/// simulator.
///
///   measurements   timestamp of each frame; stream, landmark, values and covariance of each of its
///                  measurements, sorted by the name of the stream
///   truth          timestamp, name and values of each known truth of a frame
///
/// A number contributes 8 bytes, the lowest first. 0 and -0 are equal, and so are all NaNs.
class DataHash {
 public:
  DataHash(std::vector<StreamInfo> streams, std::vector<StreamInfo> truths);

  void Add(const SourceFrame& frame);
  /// Returns the hash of the measurements so far, 64 hexadecimal digits.
  std::string measurements() const { return measurements_.Digest(); }
  /// Returns the hash of the truths so far; "" if no frame had a truth.
  std::string truth() const { return has_truth_ ? truth_.Digest() : ""; }

 private:
  std::vector<StreamInfo> streams_, truths_;
  Sha256Stream measurements_, truth_;
  bool has_truth_ = false;
  std::string bytes_;  ///< bytes of one frame; a member to reuse its memory
};

}  // namespace alidade::internal
