// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade {

/// Metrics of one estimator, taken frame by frame.
///
///   rmse:BLOCK          sqrt(mean |e|^2),  e = x_true (-) x            unit of the block
///   lag_ms:BLOCK        delay after truth as Lag() has it, of the first 100 000 timestamps; > 0 is
///                       late.
///                       Scalar blocks, steps within 5 % of their mean, a truth that changes
///   coverage95:BLOCK    share of timestamps with |e| <= 1.96 sigma (scalar blocks)
///   implied.rmse:SENSOR     the same of what single measurements of the sensor imply, without a
///                           filter (ImpliedState): that of its block. All measurements count,
///                           those that were gated too
///   nees.mean:OWNER     mean of e' C^-1 e / dof over the owner's estimated blocks of known truth,
///                       jointly; timestamps where C is singular or not finite are left out
///   nees.low:OWNER, nees.high:OWNER  bounds: nees.mean of a consistent filter lies between
///                       them with probability 0.95 [BarShalom2001, sec. 5.4]. Errors of a run are
///                       correlated over time: n timestamps count as n / tau independent samples,
///                       tau the integrated autocorrelation time of the NEES; n is 10 000 at most
///   nees.dof:OWNER      elements that the NEES is taken over, mean over the timestamps
///   nees.within95:OWNER share of those timestamps with e' C^-1 e <= chi2(0.95, dof)
///   nis.mean:SENSOR     mean of r' S^-1 r / dof over accepted measurements
///   nis.low:SENSOR, nis.high:SENSOR  bounds, likewise: innovations are white, but those of one
///                       frame share the error of the prediction and count as one sample
///   final_error:BLOCK   |e| at the last timestamp
///   trajectory.sim3.rmse   of the position that landmarks are seen from, m, after the similarity
///                       that brings its trajectory nearest to the true one [Umeyama1991]
///   trajectory.sim3.scale  of that similarity; true = scale x estimate
///   reprojection:SENSOR     of landmarks, in the unit of the measurement: the rms of the
///                           innovations that a frame accepts, median of the run's last half
///   settling_frames:SENSOR  frames until that rms stays at this level, as SettlingOf() counts
///                           them; infinite where it never does
///
/// C = P + T is the covariance of e, T = diag(StreamInfo::sigma^2) that of the truth, which knows
/// nothing of the filter; sigma^2 is its diagonal. An exact truth has T = 0.
/// Over a segment the key ends in `@SEGMENT`: rmse, implied.rmse, coverage95, nees.mean,
/// nees.within95 and nis.mean. Counts are `OUTCOME:SENSOR`, of control inputs `inputs:ENTRY`, and
/// of landmarks `landmarks.initialised`, `.deleted`, `.converted`, `.negative`, `.hypotheses`,
/// `.rescued`. A truth is named like the block, `target.depth`, or like its last component where
/// that is unique.
/// A frame older than the state, as before `initial_time_s`, adds to the counts alone.
/// A metric without a timestamp to take it from is left out; an estimate that is not finite makes
/// its rmse infinite.
class Metrics {
 public:
  /// `truths` are those of the source, or the blocks of an estimator that stands for them.
  Metrics(const EstimatorSpec& spec, const std::vector<StreamInfo>& truths,
          const std::vector<Segment>& segments);
  ~Metrics();
  Metrics(Metrics&&) noexcept;

  /// Takes the state after `frame`; `in_segment[i]` says whether the frame lies in segment i.
  void Add(const SourceFrame& frame, const std::vector<bool>& in_segment, const State& state,
           const UpdateReport& report);
  /// The part of Add that needs no truth: counts and NIS.
  void AddReport(const std::vector<bool>& in_segment, const UpdateReport& report);
  /// The errors of an estimate from that of another estimator, which stands for the truth: rmse,
  /// lag_ms and final_error alone. How far the two may be apart P does not say, as they share their
  /// data. Both are values by block of their estimator's problem, empty where there is none.
  void AddDifference(Timestamp timestamp, const std::vector<std::vector<double>>& reference,
                     const std::vector<bool>& in_segment,
                     const std::vector<std::vector<double>>& estimate);
  /// `inconsistent`, once for each block element: truth is known and the error has been beyond 10
  /// sigma for 20 timestamps on end.
  const std::vector<Event>& events() const;
  /// Sensors, by index, whose measurements look as if they were in another unit: more than half of
  /// those that were accepted or gated are far off. That is sqrt(r' S^-1 r / dof) > 100; of angles,
  /// whose r is never beyond pi, |r| > 5 sqrt(S) with |r| > pi / 4 or |z| > 2 pi.
  std::vector<int> far_off() const;
  /// Blocks whose truth the source names, but that no frame had a truth of.
  std::vector<std::string> without_truth() const;
  std::map<std::string, double> Finish() const;
  const std::map<std::string, std::int64_t>& counts() const;
  /// Unit of each block with truth, where it has one: for EstimatorResult::units.
  const std::map<std::string, std::string>& units() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
