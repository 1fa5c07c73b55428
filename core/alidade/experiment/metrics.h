// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/diagnosis/verdict.h"
#include "alidade/experiment/run.h"

namespace alidade {

/// Metrics of one estimator, accumulated frame by frame. They are the entries of kMetrics except
/// the metrics of the map (MapMetrics) and of comparisons.
///
/// e = x_true (-) x is the error, in the tangent space at the estimate. C = P + T is the covariance
/// of e, and T = diag(StreamInfo::sigma^2) is the covariance of the truth, whose error does not
/// depend on the filter. An exact truth has T = 0. If C is singular or not finite at a timestamp,
/// the NEES is not computed for this timestamp.
///
/// The lag (see Lag()) is computed only for a scalar block whose truth changes and whose time steps
/// lie within 5 % of their mean. It uses at most the first 100 000 timestamps. The bounds of the
/// mean NEES allow for errors that are correlated over time: n timestamps, at most 10 000, count as
/// n / tau samples. tau is the integrated autocorrelation time of the NEES. Innovations are white,
/// but all innovations of one frame depend on the same prediction error, so they count as one
/// sample [BarShalom2001, sec. 5.4].
///
/// The keys of counts are `OUTCOME:SENSOR`, `inputs:ENTRY` for control inputs, and for landmarks
/// `landmarks.initialised`, `.deleted`, `.converted`, `.negative`, `.hypotheses`, `.rescued`. A
/// truth has the name of its block, `target.depth`, or the last component of that name if only one
/// block has it. A frame that is older than the state (for example before `initial_time_s`) changes
/// only the counts. A metric without samples is omitted.
class Metrics {
 public:
  /// `truths` are the truths of the source. If an estimator is the reference, `truths` are the
  /// blocks of this estimator.
  Metrics(const EstimatorSpec& spec, const std::vector<StreamInfo>& truths,
          const std::vector<Segment>& segments);
  ~Metrics();
  Metrics(Metrics&&) noexcept;

  /// Adds the state after `frame`. `in_segment[i]` is true if the frame belongs to segment i.
  void Add(const SourceFrame& frame, const std::vector<bool>& in_segment, const State& state,
           const UpdateReport& report);
  /// Adds the part of a frame that needs no truth: counts and NIS.
  void AddReport(const std::vector<bool>& in_segment, const UpdateReport& report);
  /// Adds the errors of an estimate relative to the reference estimator, which replaces the truth:
  /// rmse, lag_ms and final_error only. P does not bound these differences, because both estimators
  /// use the same data. `reference` and `estimate` contain one value for each block of the
  /// respective estimator's problem. The value is empty if the block has none.
  void AddDifference(Timestamp timestamp, const std::vector<std::vector<double>>& reference,
                     const std::vector<bool>& in_segment,
                     const std::vector<std::vector<double>>& estimate);
  /// Returns the events `lost`, at most one for each block element. Such an event means
  /// that the truth of the block is known, and the error of the element exceeded 10 sigma for 20
  /// timestamps in a row.
  const std::vector<Event>& events() const;
  /// Returns the names of the blocks whose truth the source declares, but which no frame contained.
  std::vector<std::string> blocks_without_truth() const;
  /// Returns the NEES of each owner of blocks with truth.
  std::vector<NeesSeries> nees() const;
  /// Returns all metrics by key.
  std::map<std::string, double> Finish() const;
  /// Returns all counts by key.
  const std::map<std::string, std::int64_t>& counts() const;
  /// Returns the units of the blocks that have truth and a unit, for EstimatorResult::units.
  const std::map<std::string, std::string>& units() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
