// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

#include "alidade/estimation/ekf.h"

namespace alidade::ceres_batch {

/// The EKF without gate that goes along: it gives a CondensedRun values to start from, and says
/// which measurements give blocks their first values.
class InitialisingFilter {
 public:
  InitialisingFilter(const Problem& problem, double max_dt_s,
                     const std::vector<StreamInfo>& streams)
      : filter_(problem, {.rejection_recovery = RejectionRecovery::kNone, .max_dt_s = max_dt_s},
                streams) {}

  Ekf& filter() { return filter_; }
  const Ekf& filter() const { return filter_; }
  /// Its report of a frame.
  const UpdateReport& Process(const Frame& frame) {
    had_failed_ = filter_.failed();
    return filter_.Process(frame);
  }
  /// Adds what the last report tells of the data, and, once, why the filter ended.
  void AddReport(Timestamp timestamp, const UpdateReport& report,
                 std::vector<Event>& events) const {
    std::ranges::copy_if(report.events, std::back_inserter(events), TellsOfTheData);
    if (!filter_.failed() || had_failed_) return;
    const auto cause = std::ranges::find(report.events, true, &Event::divergence);
    events.push_back({timestamp, EventKind::kInitialEstimate,
                      "the filter that the batch starts from, and that gives blocks their first "
                      "values, ended" +
                          (cause == report.events.end() ? "" : ": " + cause->text)});
  }

 private:
  static bool TellsOfTheData(const Event& event) {
    return event.kind == EventKind::kInputStale || event.kind == EventKind::kInputRefused ||
           event.kind == EventKind::kSubsteps;
  }

  Ekf filter_;
  bool had_failed_ = false;
};

}  // namespace alidade::ceres_batch
