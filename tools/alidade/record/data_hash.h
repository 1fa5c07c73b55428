// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/source.h"
#include "alidade/io/sha256.h"

namespace alidade::internal {

/// SHA-256 of the data of a source. The hash does not depend on the text of a data file or on the
/// simulator, but only on these data:
///
///   measurements   timestamp of each frame; timestamp, stream, landmark, values, covariance and
///                  known numbers of each measurement. The measurements of a frame are sorted by
///                  the name of the stream.
///   truth          timestamp, name and values of each known true value of a frame
///
/// A number contributes 8 bytes, the lowest byte first. 0 and -0 contribute the same bytes. All
/// NaNs contribute the same bytes.
class DataHash {
 public:
  DataHash(std::vector<StreamInfo> streams, std::vector<StreamInfo> truths);

  void Add(const SourceFrame& frame);
  /// Returns the hash of all measurements so far, as 64 hexadecimal digits.
  std::string measurements() const { return measurements_.Digest(); }
  /// Returns the hash of all truths so far. Returns "" if no frame contained a truth.
  std::string truth() const { return has_truth_ ? truth_.Digest() : ""; }

 private:
  std::vector<StreamInfo> streams_, truths_;
  Sha256Stream measurements_, truth_;
  bool has_truth_ = false;
  std::string bytes_;  ///< bytes of one frame; a member, so that its memory is reused
};

}  // namespace alidade::internal
