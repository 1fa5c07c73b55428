// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

namespace alidade::bench {

/// EKF of another library with 12 rows for the camera and 6 for each landmark in its covariance.
/// Its models are constants, which take no time: only its own arithmetic is measured.
class SlamPeer {
 public:
  virtual ~SlamPeer() = default;
  /// Runs a prediction, and an update by two numbers of each observed landmark.
  virtual void Frame() = 0;
};

// Built if the library is installed. Uses the faster one of its modes of updating.
std::unique_ptr<SlamPeer> MakeMrptSlam(int landmarks, int observed);

}  // namespace alidade::bench
