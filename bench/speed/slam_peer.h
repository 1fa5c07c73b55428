// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

namespace alidade::bench {

/// EKF of another library. Its covariance has 12 rows for the camera and 6 rows for each landmark.
/// Its models return constants, so only the arithmetic of the library is measured.
class SlamPeer {
 public:
  virtual ~SlamPeer() = default;
  /// Runs a prediction, and an update with two numbers for each observed landmark.
  virtual void Frame() = 0;
};

// Creates the EKF of MRPT with the fastest update method of MRPT. This function is built if MRPT is
// installed.
std::unique_ptr<SlamPeer> MakeMrptSlam(int landmarks, int observed);

}  // namespace alidade::bench
