// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/evaluate/evaluate.h"
#include "alidade/evaluate/warnings.h"
#include "alidade/io/text_cell.h"

namespace alidade {
namespace {

[[noreturn]] void FailMatching(const std::string& name, const std::string& problem,
                               const std::string& expected) {
  throw Error(ExitCode::kBadData, ErrorLine({name}, {}, problem, expected));
}

/// Returns the double that is nearest to the timestamp in seconds. Parsing the decimal text of the
/// timestamp yields the same double.
double DoubleSeconds(Timestamp timestamp) {
  return static_cast<double>(static_cast<long double>(timestamp) / 1e9L);
}

/// Returns |a - b|, computed with doubles as in evo. The resolution is 0.2 us for a clock that
/// counts from 1970. If a timestamp lies midway between two others, rounding decides, as in evo.
double TimeDistance(Timestamp a, Timestamp b) {
  return std::abs(DoubleSeconds(a) - DoubleSeconds(b));
}

/// Returns the index of the timestamp nearest to `time`. If several are equally near, the first one
/// is used.
int NearestIndex(const std::vector<Timestamp>& timestamps, Timestamp time) {
  auto nearest = std::lower_bound(timestamps.begin(), timestamps.end(), time);
  const auto previous_is_nearer = [&] {
    if (nearest == timestamps.begin()) return false;
    return nearest == timestamps.end() ||
           TimeDistance(*(nearest - 1), time) <= TimeDistance(*nearest, time);
  };
  while (previous_is_nearer()) --nearest;
  return static_cast<int>(nearest - timestamps.begin());
}

Matches MatchByRow(const Trajectory& reference, const Trajectory& estimate) {
  Matches matches;
  matches.by_row = true;
  matches.possible = std::min(reference.size(), estimate.size());
  for (int i = 0; i < estimate.size(); ++i) {
    const int row = estimate.rows[static_cast<std::size_t>(i)];
    const auto same = std::ranges::lower_bound(reference.rows, row);
    if (same == reference.rows.end() || *same != row) continue;
    matches.reference.push_back(static_cast<int>(same - reference.rows.begin()));
    matches.estimate.push_back(i);
  }
  if (reference.row_count == estimate.row_count) {
    if (!matches.estimate.empty()) return matches;
    FailMatching(estimate.name, "has no row in common with " + reference.name,
                 "poses in the same rows");
  }
  const bool reference_is_untimed = estimate.has_timestamps();
  const Trajectory& untimed = reference_is_untimed ? reference : estimate;
  const Trajectory& counterpart = reference_is_untimed ? estimate : reference;
  FailMatching(untimed.name,
               "the file has " + std::to_string(untimed.row_count) +
                   " poses without timestamps, but " + counterpart.name + " has " +
                   std::to_string(counterpart.row_count) + " poses",
               std::string("a row for each row of the ") +
                   (reference_is_untimed ? "estimate" : "reference") +
                   ", or timestamps for both files (KITTI: NAME_times.txt next to NAME.txt)");
}

std::string Span(const Trajectory& trajectory) {
  return internal::SecondsText(trajectory.timestamps.front()) + " to " +
         internal::SecondsText(trajectory.timestamps.back());
}

}  // namespace

Matches Associate(const Trajectory& reference, const Trajectory& estimate, Timestamp max_diff,
                  Timestamp offset) {
  const bool both_timed = reference.has_timestamps() && estimate.has_timestamps();
  const bool none_timed = !reference.has_timestamps() && !estimate.has_timestamps();
  const auto is_kitti = [](const Trajectory& t) { return t.format == TrajectoryFormat::kKitti; };
  if (none_timed || (!both_timed && is_kitti(reference) && is_kitti(estimate))) {
    return MatchByRow(reference, estimate);
  }
  if (!both_timed) {
    FailMatching((reference.has_timestamps() ? estimate : reference).name,
                 "the poses have no timestamps",
                 "a file times.txt in the same folder, because the other file has timestamps");
  }
  const bool estimate_longer = estimate.size() > reference.size();
  const std::vector<Timestamp>& shorter = (estimate_longer ? reference : estimate).timestamps;
  const std::vector<Timestamp>& longer = (estimate_longer ? estimate : reference).timestamps;
  const Timestamp shift = estimate_longer ? -offset : offset;  // offset of the shorter trajectory
  for (const Timestamp end : {shorter.front(), shorter.back()}) {
    if (std::abs(Seconds(end) + Seconds(shift)) < cell::kTimeLimit) continue;
    throw Error(ExitCode::kBadData, ErrorLine({estimate.name}, "--t-offset",
                                              "a timestamp plus " + internal::SecondsText(offset) +
                                                  " is beyond 292 years",
                                              "the time between the two clocks"));
  }
  Matches matches;
  matches.possible = static_cast<int>(shorter.size());
  std::vector<int>& shorter_matches = estimate_longer ? matches.reference : matches.estimate;
  std::vector<int>& longer_matches = estimate_longer ? matches.estimate : matches.reference;
  for (int i = 0; i < matches.possible; ++i) {
    const Timestamp time = shorter[static_cast<std::size_t>(i)] + shift;
    const int nearest = NearestIndex(longer, time);
    if (!(TimeDistance(longer[static_cast<std::size_t>(nearest)], time) <= DoubleSeconds(max_diff)))
      continue;
    shorter_matches.push_back(i);
    longer_matches.push_back(nearest);
  }
  if (!matches.estimate.empty()) return matches;
  FailMatching(
      estimate.name,
      "no pose is within " + internal::NumberText(Seconds(max_diff)) + " s of a pose of " +
          reference.name + ": the timestamps are from " + Span(estimate) +
          (offset == 0 ? "" : " plus --t-offset") + ", those of the reference from " +
          Span(reference),
      internal::FrameNumberRemedy(reference, estimate) +
          "timestamps of the same clock; or --t-offset, which is added to the timestamps of the "
          "estimate; or a larger --t-max-diff");
}

}  // namespace alidade
