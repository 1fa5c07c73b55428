// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace alidade {

/// How the measurements of one timestamp are put into updates.
enum class Fuse {
  kJoint,           ///< one stacked update
  kPerSensor,       ///< one update for each sensor, in the order of the config
  kPerMeasurement,  ///< one update for each measurement, in the order of the sensors
};

/// What happens after `rejection_recovery_after` consecutive rejections of one sensor.
enum class RejectionRecovery {
  kReset,    ///< re-initialise its blocks from the measurement where it can, else inflate
  kInflate,  ///< multiply the covariance of its blocks by 100
  kNone,
};

/// Where H is taken for the blocks of stationary motion models (`constant`) [Huang2010].
enum class JacobianPolicy {
  kLatest,         ///< their estimate
  kFirstEstimate,  ///< what they started from: the prior's mean, or what a measurement implied
};

/// What the Kalman filters have in common to choose.
struct EkfOptions {
  /// Probability with which a measurement that fits passes the gate; 1: no gate (`gate: none`).
  double gate = 1.0;
  Fuse fuse = Fuse::kJoint;
  JacobianPolicy jacobian = JacobianPolicy::kLatest;
  RejectionRecovery rejection_recovery = RejectionRecovery::kReset;
  int rejection_recovery_after = 20;  ///< consecutive rejections of one sensor
  int max_covariance_repairs = 10;    ///< of one that is not positive definite; then it ends
  /// Longer gaps are stepped in equal parts of at most this, to whole ns, and at least 1 ns.
  double max_dt_s = std::numeric_limits<double>::infinity();
};

namespace internal {

inline EkfOptions WithoutRecovery(EkfOptions options) {
  options.rejection_recovery = RejectionRecovery::kNone;
  return options;
}

}  // namespace internal
}  // namespace alidade
