// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/estimator.h"

#include <algorithm>
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

MeasurementReports& MeasurementReports::operator=(const MeasurementReports& other) {
  if (this == &other) return *this;
  Clear();
  for (const MeasurementReport& from : other.entries_) {
    MeasurementReport& entry = entries_.emplace_back(from);
    for (auto* part : {&entry.z, &entry.h, &entry.innovation, &entry.s, &entry.gain}) {
      *part = Copy(*part);
    }
  }
  return *this;
}

Numbers MeasurementReports::Copy(Numbers values) {
  double* const copy = numbers_.Take(values.size());
  std::ranges::copy(values, copy);
  return {copy, values.size()};
}

}  // namespace alidade
