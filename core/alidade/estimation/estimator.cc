// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/estimator.h"

#include <iterator>

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

const char* ToString(Outcome outcome) {
  constexpr const char* kNames[] = {"accepted",  "initialised", "gated",  "out_of_domain",
                                    "invalid",   "not_finite",  "not_pd", "stale",
                                    "not_ready", "failed",      "ended"};
  static_assert(std::size(kNames) == kOutcomes);
  return kNames[static_cast<int>(outcome)];
}

}  // namespace alidade
