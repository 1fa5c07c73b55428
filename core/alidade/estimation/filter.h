// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "alidade/base/clone_ptr.h"
#include "alidade/estimation/estimator.h"
#include "alidade/estimation/problem.h"

namespace alidade {

/// Grouping of the measurements of one timestamp into updates.
enum class Fuse {
  kJoint,           ///< one stacked update
  kPerSensor,       ///< one update for each sensor, in the order of the config
  kPerMeasurement,  ///< one update for each measurement, in the order of the sensors
};

/// Reaction to `rejection_recovery_after` consecutive rejections of one sensor.
enum class RejectionRecovery {
  kReset,    ///< re-initialise its blocks from the measurement if possible, else inflate
  kInflate,  ///< multiply the covariance of its blocks by 100
  kNone,
};

/// Value at which H is evaluated for the blocks of stationary motion models (`constant`)
/// [Huang2010].
enum class JacobianPolicy {
  kLatest,         ///< the latest estimate
  kFirstEstimate,  ///< the initial value: the mean of the prior, or the value that z implied
};

/// Options common to all Kalman filters.
struct EkfOptions {
  /// Probability that a consistent measurement passes the gate; 1: no gate (`gate: none`).
  double gate = 1.0;
  Fuse fuse = Fuse::kJoint;
  JacobianPolicy jacobian = JacobianPolicy::kLatest;
  RejectionRecovery rejection_recovery = RejectionRecovery::kReset;
  int rejection_recovery_after = 20;  ///< consecutive rejections of one sensor
  int max_covariance_repairs = 10;    ///< the filter ends at the next one
  /// Longer gaps are divided into equal steps of at most this length, in whole ns, at least 1 ns.
  double max_dt_s = std::numeric_limits<double>::infinity();
};

namespace internal {

class FilterEngine;
class UpdateMethod;

inline EkfOptions WithoutRecovery(EkfOptions options) {
  options.rejection_recovery = RejectionRecovery::kNone;
  return options;
}

}  // namespace internal

/// One measurement of a sensor, or one control input of a state, for Filter::Push.
struct Reading {
  Reading(int stream_index, std::vector<double> z, std::int64_t landmark_id = -1,
          std::vector<double> r = {}, std::vector<double> known_numbers = {})
      : stream(stream_index),
        values(std::move(z)),
        landmark(landmark_id),
        covariance(std::move(r)),
        known(std::move(known_numbers)) {}
  Reading(const SensorHandle& sensor, std::vector<double> z, std::int64_t landmark_id = -1,
          std::vector<double> r = {}, std::vector<double> known_numbers = {})
      : Reading(sensor.stream, std::move(z), landmark_id, std::move(r), std::move(known_numbers)) {}
  /// The control input of a state.
  Reading(const StateHandle& state, std::vector<double> u) : Reading(state.input, std::move(u)) {}

  int stream;  ///< Filter::stream
  std::vector<double> values;
  std::int64_t landmark;
  std::vector<double> covariance;  ///< row-major, overrides the model's noise; empty: the model's
  std::vector<double> known;       ///< known numbers of the sensor model; mostly empty
};

/// Predicted measurement of a sensor.
struct Prediction {
  std::vector<double> z;  ///< h, ambient
  Eigen::MatrixXd s;      ///< S = H P H' + R, m x m
};

/// Recursive estimator for one problem: Ekf, Iekf, Ukf, SquareRootEkf. A copy is a snapshot and an
/// independent filter. A moved-from filter may only be assigned to or destroyed.
///
/// Each frame is processed in these stages:
///
///   step         propagate to its timestamp; divided if a control input changes or the gap is
///                longer than max_dt_s; discrete noise is constant until the next update
///   initialise   blocks that wait for one of its measurements
///   predict      h, r and S of each measurement, for all measurements of a group at one state
///   gate         compare r' S^-1 r of each measurement with chi-square; robust losses; consensus
///   correct      one stacked update by the accepted measurements
///   recover      repair a covariance that is not positive semi-definite; reset or inflate blocks
///                if a sensor was rejected too often in a row
///   landmarks    count, prune, convert and initialise
///
/// Control inputs of the frame act from its timestamp on. An update is atomic: if it would leave
/// the state not finite or not positive definite, it is rolled back and reported.
///
/// Live use: Push processes the readings of one timestamp. At returns the estimate at a later time,
/// and Expect the predicted measurement of a sensor. Neither changes the filter.
///
/// Frames have to be ordered by timestamp; an older one is `stale`. For late frames use Rollback.
///
/// Threads: as for values of the standard library. Several threads may call const members
/// concurrently while no thread calls a non-const member. Copies share only the problem and its
/// models. These do not change, and models may be called from several threads.
class Filter : public Estimator {
 public:
  // By frames.
  void Start(Timestamp timestamp) override;
  const UpdateReport& Process(const Frame& frame) override;
  std::unique_ptr<Estimator> Clone() const override { return std::make_unique<Filter>(*this); }
  const Filter* AsFilter() const override { return this; }
  const State& state() const override;
  std::vector<LandmarkEstimate> landmarks() const override;
  Timestamp timestamp() const override;
  bool diverged() const override;
  bool failed() const override;

  const Problem& problem() const;

  // Live.
  /// Returns the index of a stream, for Reading::stream. Error kBadConfig for an unknown name.
  int stream(std::string_view name) const;
  /// Returns the id of a block of the problem, `owner.block`. Error kBadConfig for an unknown name.
  BlockId block(std::string_view name) const;
  /// Converts the readings of one timestamp to a frame. Throws Error kBadData for an unknown
  /// stream, or if the size of values, covariance or known numbers is not that of the stream. The
  /// length of a quaternion or direction may differ from 1 by at most 1e-3.
  Frame MakeFrame(Timestamp timestamp, const std::vector<Reading>& readings) const;
  /// Calls MakeFrame and Process. The report is valid until the next call. Errors: those of
  /// MakeFrame; the filter is then unchanged.
  const UpdateReport& Push(Timestamp timestamp, const std::vector<Reading>& readings);
  const UpdateReport& Push(Timestamp timestamp, const SensorHandle& sensor, double z) {
    return Push(timestamp, {Reading(sensor, {z})});
  }
  // A Timestamp is in nanoseconds: TimestampFromSeconds(t_s).
  template <std::floating_point Seconds, class... Arguments>
  const UpdateReport& Push(Seconds t_s, const Arguments&... arguments) = delete;
  template <std::floating_point Seconds>
  const UpdateReport& Push(Seconds t_s, const std::vector<Reading>& readings) = delete;
  template <std::floating_point Seconds>
  State At(Seconds t_s) const = delete;
  template <std::floating_point Seconds, class... Arguments>
  std::optional<Prediction> Expect(std::string_view sensor, Seconds t_s,
                                   const Arguments&... arguments) const = delete;
  /// Returns the estimate of a block. ContractViolation if the block has no value yet.
  BlockEstimate Estimate(BlockId block) const;
  /// Returns the state after a frame without measurements at `timestamp`, not before timestamp().
  /// The filter is unchanged. If a step fails, returns the state before that step.
  State At(Timestamp timestamp) const;
  /// Predicts the measurement of a sensor at `timestamp`. `landmark` is the id of the landmark, if
  /// the sensor measures landmarks; `known` are the known numbers of its model. Returns nullopt if
  /// h is not defined or not finite, S is not positive definite, or a block or the landmark has no
  /// value yet. Errors: kBadConfig for an unknown sensor, kBadData for a wrong size of `known`.
  std::optional<Prediction> Expect(std::string_view sensor, Timestamp timestamp,
                                   std::int64_t landmark = -1,
                                   const std::vector<double>& known = {}) const;
  /// Calls Expect for each of the landmarks, with a single step of the state. The sensor must not
  /// have known numbers.
  std::vector<std::optional<Prediction>> ExpectEach(
      std::string_view sensor, Timestamp timestamp,
      const std::vector<std::int64_t>& landmarks) const;

 protected:
  /// @cond
  /// `streams` are the streams of the source, in the order of Measurement::stream.
  Filter(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams,
         std::unique_ptr<internal::UpdateMethod> method);
  internal::FilterEngine& engine() { return *engine_; }
  const internal::FilterEngine& engine() const { return *engine_; }
  /// @endcond

 private:
  ClonePtr<internal::FilterEngine> engine_;
};

}  // namespace alidade
