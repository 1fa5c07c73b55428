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

class FilterEngine;
class UpdateMethod;

inline EkfOptions WithoutRecovery(EkfOptions options) {
  options.rejection_recovery = RejectionRecovery::kNone;
  return options;
}

}  // namespace internal

/// A measurement of a sensor, or a control input of a state, as it comes.
struct Reading {
  Reading(int number, std::vector<double> numbers, std::int64_t of_landmark = -1,
          std::vector<double> r = {}, std::vector<double> knowing = {})
      : stream(number),
        values(std::move(numbers)),
        landmark(of_landmark),
        covariance(std::move(r)),
        known(std::move(knowing)) {}
  Reading(const SensorHandle& sensor, std::vector<double> z, std::int64_t of_landmark = -1,
          std::vector<double> r = {}, std::vector<double> knowing = {})
      : Reading(sensor.stream, std::move(z), of_landmark, std::move(r), std::move(knowing)) {}
  /// Of a state whose model takes a control input.
  Reading(const StateHandle& state, std::vector<double> u) : Reading(state.input, std::move(u)) {}

  int stream;  ///< Filter::stream
  std::vector<double> values;
  std::int64_t landmark;
  std::vector<double> covariance;  ///< row-major, overrides the model's noise; empty: none
  std::vector<double> known;       ///< as many as its sensors take; mostly none
};

/// What a sensor would measure.
struct Prediction {
  std::vector<double> z;  ///< h, ambient
  Eigen::MatrixXd s;      ///< S = H P H' + R, m x m
};

/// A recursive estimator over one problem: Ekf, Iekf, Ukf, SquareRootEkf. A copy of one is a
/// snapshot of it, and goes on by itself. What was moved from may be assigned to or destroyed, no
/// more.
///
/// What a frame goes through:
///
///   step         to its timestamp, in parts where a control input changes or a gap is longer than
///                max_dt_s; noise that a model holds is held up to the next update
///   initialise   blocks that wait for one of its measurements
///   predict      h, r and S of each measurement, all of a group at the same state
///   gate         each by itself: r' S^-1 r against chi-square; robust losses; consensus
///   correct      one stacked update by those that pass: all of it happens or nothing
///   recover      from a covariance that is not positive semi-definite, and from sensors that are
///                rejected again and again
///   landmarks    are counted, pruned, converted and initialised
///
/// Control inputs of the frame act from its timestamp on. An update is a transaction: what would
/// leave the state not finite or not positive definite is rolled back and reported.
///
/// Live use: Push measurements by the names of their streams as they come, ask At for the estimate
/// at any later time, and Expect for what a sensor will see then; neither changes the filter.
///
/// Frames come in the order of their timestamps; an older one is `stale`. Late ones: Rollback.
///
/// Threads: as a value of the standard library. Const members may be called from several threads at
/// once, while none calls another one; a copy belongs to whoever has it. What copies share, the
/// problem and its models, does not change, and models may be called from several threads.
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
  /// Index of a stream, for Reading::stream. Error kBadConfig where there is none.
  int stream(std::string_view name) const;
  /// Id of a block of the problem, `owner.block`. Error kBadConfig where there is none.
  BlockId block(std::string_view name) const;
  /// The readings of one timestamp as a frame. Errors: kBadData for a stream that is not there,
  /// values, a covariance or known numbers of another size than its sensors take, or a quaternion
  /// or direction whose length is off by more than 1e-3.
  Frame MakeFrame(Timestamp timestamp, const std::vector<Reading>& readings) const;
  /// Process of MakeFrame. The report is good until the next call. Errors: those of MakeFrame, and
  /// nothing has changed.
  const UpdateReport& Push(Timestamp timestamp, const std::vector<Reading>& readings);
  const UpdateReport& Push(Timestamp timestamp, const SensorHandle& sensor, double z) {
    return Push(timestamp, {Reading(sensor, {z})});
  }
  // A Timestamp is in nanoseconds: TimestampFromSeconds(t_s).
  template <std::floating_point Seconds, class... Rest>
  const UpdateReport& Push(Seconds t_s, const Rest&... rest) = delete;
  template <std::floating_point Seconds>
  const UpdateReport& Push(Seconds t_s, const std::vector<Reading>& readings) = delete;
  template <std::floating_point Seconds>
  State At(Seconds t_s) const = delete;
  template <std::floating_point Seconds, class... Rest>
  std::optional<Prediction> Expect(std::string_view sensor, Seconds t_s,
                                   const Rest&... rest) const = delete;
  /// The estimate of a block that has a value. ContractViolation if it has none yet.
  BlockEstimate Estimate(BlockId block) const;
  /// The state at `timestamp`, not before timestamp(), as a frame without measurements would leave
  /// it. Nothing is committed. Where it cannot be stepped to, it is that of the last step that can.
  State At(Timestamp timestamp) const;
  /// What the sensor of that name will measure at `timestamp`, of the landmark of that id where it
  /// measures landmarks, with `known` where it takes known numbers. Nothing where h is not defined
  /// or not finite there, S is not positive definite, or a block or the landmark has no value yet.
  /// Errors: kBadConfig where there is no such sensor, kBadData where it takes another number of
  /// known numbers.
  std::optional<Prediction> Expect(std::string_view sensor, Timestamp timestamp,
                                   std::int64_t landmark = -1,
                                   const std::vector<double>& known = {}) const;
  /// The same of each of the landmarks, of a sensor that takes no known numbers; the state is
  /// stepped once for all.
  std::vector<std::optional<Prediction>> ExpectEach(
      std::string_view sensor, Timestamp timestamp,
      const std::vector<std::int64_t>& landmarks) const;

 protected:
  /// @cond
  /// `streams` are the source's, in the order of Measurement::stream.
  Filter(Problem problem, const EkfOptions& options, const std::vector<StreamInfo>& streams,
         std::unique_ptr<internal::UpdateMethod> method);
  internal::FilterEngine& engine() { return *engine_; }
  const internal::FilterEngine& engine() const { return *engine_; }
  /// @endcond

 private:
  ClonePtr<internal::FilterEngine> engine_;
};

}  // namespace alidade
