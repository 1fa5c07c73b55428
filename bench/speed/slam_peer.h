// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

namespace alidade::bench {

/// Another library's EKF with a camera of 12 and landmarks of 6 rows in its covariance. Its models
/// are constants, which cost nothing: what it takes is its own arithmetic.
class SlamPeer {
 public:
  virtual ~SlamPeer() = default;
  /// A prediction and an update by two numbers of each of the landmarks that are observed.
  virtual void Frame() = 0;
};

// Where the library is installed. The faster of its modes of updating.
std::unique_ptr<SlamPeer> MakeMrptSlam(int landmarks, int observed);

}  // namespace alidade::bench
