// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "alidade/source.h"
#include "alidade/state.h"
#include "alidade/system.h"

namespace alidade {

/// What became of one measurement.
enum class Outcome {
  kAccepted,
  kInitialised,  ///< used up to initialise a block
  kGated,
  kOutOfDomain,  ///< h is not defined at the prediction
  kInvalid,      ///< of no use: beyond the sensor's limits
  kNotFinite,    ///< the update would have been not finite, and was rolled back
  kNotPd,        ///< the update would have lost positive definiteness, and was rolled back
  kStale,        ///< older than the state
  kNotReady,     ///< a block it needs has no value yet
  kFailed,       ///< the plugin failed
};
const char* ToString(Outcome outcome);
/// What a model's status means for the measurement; kOk is kAccepted.
Outcome OutcomeOf(Status status);
bool AllFinite(const std::vector<double>& values);

/// Rows of the gain K that belong to one block: tangent size x m.
struct BlockGain {
  BlockId block;
  Eigen::MatrixXd k;
};

/// The complete record of one measurement. m = its tangent size.
struct MeasurementReport {
  int sensor = -1;  ///< index into System::sensors
  Outcome outcome = Outcome::kAccepted;
  std::int64_t landmark = -1;
  int dof = 0;
  double nis = 0.0;             ///< r' S^-1 r, not divided by dof
  std::vector<double> z, h;     ///< ambient
  Eigen::VectorXd innovation;   ///< r = z (-) h, tangent
  Eigen::MatrixXd s;            ///< S = H P H' + R, m x m; empty where it was not reached
  std::vector<BlockGain> gain;  ///< K by block; empty unless accepted
};

/// Something that happened to the filter, worth a line to its user.
struct Event {
  Stamp stamp = kNoStamp;
  std::string kind;  ///< one word: diverged, lockout, conditioning, not_finite, ...
  std::string text;
};

/// What one frame did.
struct UpdateReport {
  bool stale = false;  ///< the frame is older than the state, which stays as it was
  std::vector<MeasurementReport> measurements;
  std::vector<Event> events;
};

/// A recursive estimator over one system. It takes values and returns values: it neither reads
/// files nor prints nor exits.
class Estimator {
 public:
  virtual ~Estimator() = default;
  /// Sets the time of the initial state.
  virtual void Start(Stamp stamp) = 0;
  /// Steps to the frame's stamp and uses those of its measurements that a sensor is bound to.
  virtual UpdateReport Process(const Frame& frame) = 0;
  virtual const State& state() const = 0;
  virtual Stamp stamp() const = 0;
  /// True once the filter left the domain of its sensors or lost its numbers; see the events.
  virtual bool diverged() const = 0;
  /// True where there is nothing left to go on with (not finite, unrecoverable).
  virtual bool failed() const = 0;
};

}  // namespace alidade
