// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/estimator.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace alidade {

Outcome OutcomeOf(Status status) {
  switch (status) {
    case Status::kOk:
      return Outcome::kAccepted;
    case Status::kOutOfDomain:
      return Outcome::kOutOfDomain;
    case Status::kInvalid:
      return Outcome::kInvalid;
    case Status::kError:
      break;
  }
  return Outcome::kFailed;
}

Timestamp StepParts(Timestamp elapsed, double max_dt_s) {
  constexpr double kBeyond = 9.2e18;  // what a Timestamp cannot hold
  const double ns = std::round(1e9 * max_dt_s);
  const Timestamp longest = ns < kBeyond ? std::max<Timestamp>(1, static_cast<Timestamp>(ns))
                                         : std::numeric_limits<Timestamp>::max();
  return (elapsed - 1) / longest + 1;
}

const char* ToString(Outcome outcome) {
  constexpr const char* kNames[] = {"accepted",  "initialised", "gated",  "out_of_domain",
                                    "invalid",   "not_finite",  "not_pd", "stale",
                                    "not_ready", "failed",      "ended"};
  static_assert(std::size(kNames) == kOutcomes);
  return kNames[static_cast<int>(outcome)];
}

}  // namespace alidade
