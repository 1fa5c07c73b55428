// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/evaluate/evaluate.h"
#include "alidade/io/text_cell.h"

namespace alidade {
namespace {

[[noreturn]] void FailMatching(const std::string& name, const std::string& what,
                               const std::string& expected) {
  throw Error(ExitCode::kBadData, ErrorLine({name}, {}, what, expected));
}

/// The nearest double: what a reader of decimal seconds has.
double DoubleSeconds(Timestamp timestamp) {
  return static_cast<double>(static_cast<long double>(timestamp) / 1e9L);
}

/// |a - b| of doubles: of a clock that counts from 1970 to 0.2 us. Where a timestamp lies in the
/// middle of two others, rounding decides, as it does in evo, whose figures would differ otherwise.
double Apart(Timestamp a, Timestamp b) { return std::abs(DoubleSeconds(a) - DoubleSeconds(b)); }

/// Index of the nearest timestamp, of several as near the first.
int NearestIndex(const std::vector<Timestamp>& timestamps, Timestamp to) {
  auto nearest = std::lower_bound(timestamps.begin(), timestamps.end(), to);
  const auto before = [&] {
    if (nearest == timestamps.begin()) return false;
    return nearest == timestamps.end() || Apart(*(nearest - 1), to) <= Apart(*nearest, to);
  };
  while (before()) --nearest;
  return static_cast<int>(nearest - timestamps.begin());
}

Matches ByRow(const Trajectory& reference, const Trajectory& estimate) {
  Matches matches;
  matches.by_row = true;
  matches.possible = reference.size();
  for (int i = 0; i < reference.size(); ++i) matches.reference.push_back(i);
  matches.estimate = matches.reference;
  if (reference.size() == estimate.size()) return matches;
  const bool of_reference = estimate.has_timestamps();
  const Trajectory& bare = of_reference ? reference : estimate;
  const Trajectory& other = of_reference ? estimate : reference;
  FailMatching(bare.name,
               std::to_string(bare.size()) + " poses for " + std::to_string(other.size()) + " of " +
                   other.name + ", and no timestamps",
               std::string("a row for each row of the ") +
                   (of_reference ? "estimate" : "reference") +
                   ", or timestamps in both (KITTI: NAME_times.txt next to NAME.txt)");
}

std::string Span(const Trajectory& trajectory) {
  return internal::SecondsText(trajectory.timestamps.front()) + " to " +
         internal::SecondsText(trajectory.timestamps.back());
}

}  // namespace

Matches Associate(const Trajectory& reference, const Trajectory& estimate, Timestamp max_diff,
                  Timestamp offset) {
  const bool both = reference.has_timestamps() && estimate.has_timestamps();
  const bool neither = !reference.has_timestamps() && !estimate.has_timestamps();
  const auto is_kitti = [](const Trajectory& t) { return t.format == TrajectoryFormat::kKitti; };
  if (neither || (!both && is_kitti(reference) && is_kitti(estimate))) {
    return ByRow(reference, estimate);
  }
  if (!both) {
    FailMatching((reference.has_timestamps() ? estimate : reference).name,
                 "poses without timestamps",
                 "times.txt next to them, as the other trajectory has timestamps");
  }
  const bool estimate_longer = estimate.size() > reference.size();
  const std::vector<Timestamp>& shorter = (estimate_longer ? reference : estimate).timestamps;
  const std::vector<Timestamp>& longer = (estimate_longer ? estimate : reference).timestamps;
  const Timestamp shift = estimate_longer ? -offset : offset;  // of the shorter
  for (const Timestamp end : {shorter.front(), shorter.back()}) {
    if (std::abs(Seconds(end) + Seconds(shift)) < cell::kTimeLimit) continue;
    throw Error(ExitCode::kBadData, ErrorLine({estimate.name}, "--t-offset",
                                              internal::SecondsText(offset) +
                                                  " added to its timestamps is beyond 292 years",
                                              "the time between the two clocks"));
  }
  Matches matches;
  matches.possible = static_cast<int>(shorter.size());
  std::vector<int>& of_shorter = estimate_longer ? matches.reference : matches.estimate;
  std::vector<int>& of_longer = estimate_longer ? matches.estimate : matches.reference;
  for (int i = 0; i < matches.possible; ++i) {
    const Timestamp at = shorter[static_cast<std::size_t>(i)] + shift;
    const int nearest = NearestIndex(longer, at);
    if (!(Apart(longer[static_cast<std::size_t>(nearest)], at) <= DoubleSeconds(max_diff)))
      continue;
    of_shorter.push_back(i);
    of_longer.push_back(nearest);
  }
  if (!matches.estimate.empty()) return matches;
  FailMatching(estimate.name,
               "no pose within " + internal::NumberText(Seconds(max_diff)) + " s of one of " +
                   reference.name + ": " + Span(estimate) + (offset == 0 ? "" : " and --t-offset") +
                   " compared with " + Span(reference),
               "the same clock; or --t-offset, which is added to the estimate's timestamps, or "
               "--t-max-diff");
}

}  // namespace alidade
