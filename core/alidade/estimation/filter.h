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

/// Division of the measurements of one timestamp into updates.
enum class Fuse {
  kJoint,           ///< one stacked update
  kPerSensor,       ///< one update for each sensor, in the order of the config
  kPerMeasurement,  ///< one update for each measurement, in the order of the sensors
};

/// Reaction to consecutive rejections of one sensor (Recovery).
enum class RejectionRecovery {
  /// Re-initialise the block that the measurement determines. If another block of the sensor
  /// explains the innovation better, increase the variance of that block by the square of the
  /// correction that the measurement requires. If neither is possible, inflate.
  kReset,
  kInflate,  ///< multiplies the covariance of the sensor's blocks by 100
  kNone,     ///< does nothing
};

/// Value at which H is evaluated for blocks of stationary motion models, such as `constant`
/// [Huang2010].
enum class JacobianPolicy {
  kLatest,  ///< the latest estimate
  /// The initial value: the mean of the prior, or the value that the first measurement implied.
  kFirstEstimate,
};

/// Options common to all Kalman filters.
struct EkfOptions {
  /// Probability that the gate accepts a measurement whose noise agrees with R. 1: no gate.
  double gate = 1.0;
  Fuse fuse = Fuse::kJoint;
  JacobianPolicy jacobian = JacobianPolicy::kLatest;
  RejectionRecovery rejection_recovery = RejectionRecovery::kReset;
  /// Number of consecutive rejections of one sensor before the first recovery. The next four follow
  /// after 2, 4, 8 and 16 times this number.
  int rejection_recovery_after = 20;
  /// Time since the first of consecutive rejections of one sensor, in s, before the first recovery.
  /// The next four follow after 2, 4, 8 and 16 times this time. It suits sensors of a low rate.
  double rejection_recovery_after_s = std::numeric_limits<double>::infinity();
  int max_covariance_repairs = 10;  ///< the filter ends if one more repair is needed
  /// A gap longer than this is divided into equal steps of at most this length. The length is
  /// rounded to whole ns and is at least 1 ns.
  double max_dt_s = std::numeric_limits<double>::infinity();
};

namespace internal {

class FilterEngine;
class UpdateMethod;

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
  /// Creates a control input of a state.
  Reading(const StateHandle& state, std::vector<double> u) : Reading(state.input, std::move(u)) {}

  int stream;  ///< index of the stream (Filter::stream)
  std::vector<double> values;
  std::int64_t landmark;
  /// R, row-major, which replaces the noise of the model. Empty: the noise of the model is used.
  std::vector<double> covariance;
  std::vector<double> known;  ///< known inputs of the sensor model; empty for most sensors
};

/// Predicted measurement of a sensor.
struct Prediction {
  std::vector<double> z;  ///< predicted measurement h, ambient
  Eigen::MatrixXd s;      ///< S = H P H' + R, m x m
};

/// Recursive estimator for one problem: Ekf, Iekf, Ukf, SquareRootEkf. A copy is a snapshot and an
/// independent filter. A moved-from filter may only be assigned to or destroyed.
///
/// Each frame is processed in these stages:
///
///   step         propagate the state to the timestamp of the frame, in several steps if a control
///                input changes or the gap is longer than max_dt_s
///   initialise   initialise the blocks that wait for one of the measurements
///   predict      compute h, r and S of all measurements of a group at the same state
///   gate         compare r' S^-1 r of each measurement with a chi-square quantile; compute robust
///                weights; reject outliers by RANSAC
///   correct      correct the state by one stacked update with the accepted measurements
///   recover      repair P if it is not positive semi-definite; reset or inflate blocks if a sensor
///                reached the limit of consecutive rejections
///   landmarks    count, prune, convert and initialise landmarks
///
/// The control inputs of a frame act from its timestamp on. An update is atomic: if the new state
/// would not be finite, or P not positive definite, the update is rolled back and reported.
///
/// In live use, Push processes the readings of one timestamp. At returns the predicted state at a
/// later time. Expect returns the predicted measurement of a sensor. At and Expect do not change
/// the filter.
///
/// Frames must be ordered by timestamp. A frame older than the state is reported as `stale` and not
/// used. Use Rollback to process late frames.
///
/// Thread safety is that of standard library types. Several threads may call const members
/// concurrently while no thread calls a non-const member. Copies share only the problem and its
/// models, which never change. Models may be called from several threads.
class Filter : public Estimator {
 public:
  // Functions of Estimator, which process frames.
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

  // Functions for live use, which process readings and compute predictions.
  /// Returns the index of a stream, for Reading::stream. Throws Error kBadConfig if the name is
  /// unknown.
  int stream(std::string_view name) const;
  /// Returns the id of a block of the problem. The name has the form `owner.block`. Throws Error
  /// kBadConfig if the name is unknown.
  BlockId block(std::string_view name) const;
  /// Converts the readings of one timestamp to a frame. Throws Error kBadData if a stream is
  /// unknown, if a reading has a wrong number of values, covariance elements or known numbers, or
  /// if the length of a quaternion or direction differs from 1 by more than 1e-3.
  Frame MakeFrame(Timestamp timestamp, const std::vector<Reading>& readings) const;
  /// Calls MakeFrame and Process. The report is valid until the next call. If MakeFrame throws, the
  /// filter is unchanged.
  const UpdateReport& Push(Timestamp timestamp, const std::vector<Reading>& readings);
  const UpdateReport& Push(Timestamp timestamp, const SensorHandle& sensor, double z) {
    return Push(timestamp, {Reading(sensor, {z})});
  }
  // Times in seconds do not compile. TimestampFromSeconds converts them to nanoseconds.
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
  /// Returns the predicted state at `timestamp`, which must not be before timestamp(). The filter
  /// is unchanged. If a step fails, returns the state before that step.
  State At(Timestamp timestamp) const;
  /// Predicts the measurement of a sensor at `timestamp`. `landmark` is the id of the landmark if
  /// the sensor measures landmarks. `known` are the known numbers of the sensor model. Returns
  /// nullopt if h is not defined or not finite, S is not positive definite, or a block or the
  /// landmark has no value yet. Throws Error kBadConfig if the sensor is unknown, and kBadData if
  /// `known` has a wrong size.
  std::optional<Prediction> Expect(std::string_view sensor, Timestamp timestamp,
                                   std::int64_t landmark = -1,
                                   const std::vector<double>& known = {}) const;
  /// Returns the result of Expect for each landmark, but propagates the state only once. The sensor
  /// model must not need known numbers.
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
