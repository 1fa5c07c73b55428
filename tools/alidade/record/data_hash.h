// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/source.h"
#include "alidade/io/sha256.h"

namespace alidade::internal {

/// SHA-256 of what the source of a run gave: of the values, whatever text or simulator they came
/// from.
///
///   measurements   of each frame its timestamp, and of each of its measurements stream, landmark,
///                  values and own covariance; those of one frame by the name of their stream
///   truth          of each truth that a frame knows its timestamp, name and values
///
/// Numbers go in as 8 bytes, the lowest first; 0 and -0 are the same, and so is every NaN.
class DataHash {
 public:
  DataHash(std::vector<StreamInfo> streams, std::vector<StreamInfo> truths);

  void Add(const SourceFrame& frame);
  /// 64 hexadecimal digits of all frames so far.
  std::string measurements() const { return measurements_.Digest(); }
  /// Likewise; "" where no frame had a truth.
  std::string truth() const { return has_truth_ ? truth_.Digest() : ""; }

 private:
  std::vector<StreamInfo> streams_, truths_;
  Sha256Stream measurements_, truth_;
  bool has_truth_ = false;
  std::string bytes_;  ///< of one frame; kept for its memory
};

}  // namespace alidade::internal
