// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade {

/// Metrics of one estimator, accumulated frame by frame.
///
///   rmse:BLOCK          sqrt(mean |e|^2),  e = x_true (-) x            unit of the block
///   lag_ms:BLOCK        delay after truth as Lag() computes it; > 0 is late. Only for scalar
///                       blocks with a truth that changes and steps within 5 % of their mean. Uses
///                       the first 100 000 timestamps
///   coverage95:BLOCK    share of timestamps with |e| <= 1.96 sigma (scalar blocks)
///   implied.rmse:SENSOR     RMSE of the state that single measurements of the sensor imply without
///                           a filter (ImpliedState), unit of the block. All measurements count,
///                           including gated ones
///   nees.mean:OWNER     mean of e' C^-1 e / dof over the owner's estimated blocks of known truth,
///                       jointly; timestamps at which C is singular or not finite are omitted
///   nees.low:OWNER, nees.high:OWNER  bounds: nees.mean of a consistent filter lies between
///                       them with probability 0.95 [BarShalom2001, sec. 5.4]. Errors of a run are
///                       correlated over time: n timestamps count as n / tau independent samples,
///                       tau the integrated autocorrelation time of the NEES; n is 10 000 at most
///   nees.dof:OWNER      number of error elements in the NEES, mean over the timestamps
///   nees.within95:OWNER share of those timestamps with e' C^-1 e <= chi2(0.95, dof)
///   nis.mean:SENSOR     mean of r' S^-1 r / dof over accepted measurements
///   nis.low:SENSOR, nis.high:SENSOR  the same bounds for nis.mean. Innovations are white, but
///                       those of one frame share the error of the prediction and count as one
///                       sample
///   final_error:BLOCK   |e| at the last timestamp
///   trajectory.sim3.rmse   RMSE of the position from which landmarks are observed, m, after the
///                       similarity that minimises it [Umeyama1991]
///   trajectory.sim3.scale  scale of that similarity; true = scale x estimate
///   reprojection:SENSOR     for landmarks, in the unit of the measurement: the rms of the
///                           accepted innovations of a frame, median over the run's last half
///   settling_frames:SENSOR  number of frames until that rms stays at this level, as SettlingOf()
///                           counts them; infinite if it never stays there
///
/// C = P + T is the covariance of e, and T = diag(StreamInfo::sigma^2) is the covariance of the
/// truth, which is independent of the filter. sigma^2 is the diagonal of C. An exact truth has
/// T = 0.
/// The metrics rmse, implied.rmse, coverage95, nees.mean, nees.within95 and nis.mean are also
/// computed for each segment, with a key that ends in `@SEGMENT`. Counts are `OUTCOME:SENSOR`,
/// `inputs:ENTRY` for control inputs, and for landmarks `landmarks.initialised`, `.deleted`,
/// `.converted`, `.negative`, `.hypotheses`, `.rescued`. A truth has the name of its block,
/// `target.depth`, or the last component of that name if only one block has it.
/// A frame older than the state, for example before `initial_time_s`, changes only the counts.
/// A metric without samples is omitted. An estimate that is not finite makes its rmse infinite.
class Metrics {
 public:
  /// `truths` are the truths of the source, or the blocks of the reference estimator.
  Metrics(const EstimatorSpec& spec, const std::vector<StreamInfo>& truths,
          const std::vector<Segment>& segments);
  ~Metrics();
  Metrics(Metrics&&) noexcept;

  /// Adds the state after `frame`; `in_segment[i]` is true if the frame lies in segment i.
  void Add(const SourceFrame& frame, const std::vector<bool>& in_segment, const State& state,
           const UpdateReport& report);
  /// Adds the part of a frame that needs no truth: counts and NIS.
  void AddReport(const std::vector<bool>& in_segment, const UpdateReport& report);
  /// Adds the errors of an estimate relative to the reference estimator, which replaces the truth:
  /// rmse, lag_ms and final_error only. P does not bound these differences, because both estimators
  /// use the same data. `reference` and `estimate` have a value for each block of their
  /// estimator's problem, empty if the block has no value.
  void AddDifference(Timestamp timestamp, const std::vector<std::vector<double>>& reference,
                     const std::vector<bool>& in_segment,
                     const std::vector<std::vector<double>>& estimate);
  /// Returns the events `inconsistent`, at most one for each block element: its truth is known, and
  /// its error exceeded 10 sigma for 20 timestamps in a row.
  const std::vector<Event>& events() const;
  /// Returns the indices of the sensors whose measurements may be in another unit: more than half
  /// of the accepted and gated ones are far from their prediction. Far means
  /// sqrt(r' S^-1 r / dof) > 100. For angles, whose r never exceeds pi, it means |r| > 5 sqrt(S)
  /// with |r| > pi / 4 or |z| > 2 pi.
  std::vector<int> far_off_sensors() const;
  /// Returns the blocks whose truth the source names, but no frame provided.
  std::vector<std::string> blocks_without_truth() const;
  /// Returns all metrics by key.
  std::map<std::string, double> Finish() const;
  /// Returns all counts by key.
  const std::map<std::string, std::int64_t>& counts() const;
  /// Returns the unit of each block with truth that has a unit, for EstimatorResult::units.
  const std::map<std::string, std::string>& units() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
