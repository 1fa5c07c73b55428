// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"

namespace alidade {

/// Metrics of one estimator, accumulated frame by frame: the entries of kMetrics, but for those of
/// the map (MapMetrics) and of comparisons.
///
/// e = x_true (-) x is the error, in the tangent at the estimate. C = P + T is its covariance, and
/// T = diag(StreamInfo::sigma^2) is that of the truth, which does not depend on the filter.
/// An exact truth has T = 0. Timestamps at which C is singular or not finite have no NEES.
///
/// The lag needs a scalar block, a truth that changes, and steps within 5 % of their mean. It uses
/// the first 100 000 timestamps (Lag). The bounds of the mean NEES allow for the correlation of the
/// errors over time: n timestamps, at most 10 000, count as n / tau samples. tau is the integrated
/// autocorrelation time of the NEES. Innovations are white, but those of one frame share the error
/// of the prediction and count as one sample [BarShalom2001, sec. 5.4].
///
/// Counts are `OUTCOME:SENSOR`, `inputs:ENTRY` for control inputs, and for landmarks
/// `landmarks.initialised`, `.deleted`, `.converted`, `.negative`, `.hypotheses`, `.rescued`.
/// A truth has the name of its block, `target.depth`, or the last component of that name if only
/// one block has it. A frame older than the state (before `initial_time_s`, say) changes only
/// the counts. A metric without samples is omitted.
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
