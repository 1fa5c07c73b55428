// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/estimator.h"

#include <algorithm>

namespace alidade {

MeasurementReports& MeasurementReports::operator=(const MeasurementReports& other) {
  if (this == &other) return *this;
  Clear();
  entries_ = other.entries_;
  constexpr Numbers MeasurementReport::*kParts[] = {
      &MeasurementReport::z, &MeasurementReport::h, &MeasurementReport::innovation,
      &MeasurementReport::s, &MeasurementReport::gain};
  std::size_t count = 0;
  for (const MeasurementReport& entry : entries_) {
    for (const auto part : kParts) count += (entry.*part).size();
  }
  double* destination = numbers_.emplace_back(count).data();
  for (MeasurementReport& entry : entries_) {
    for (const auto part : kParts) {
      Numbers& values = entry.*part;
      std::ranges::copy(values, destination);
      values = {destination, values.size()};
      destination += values.size();
    }
  }
  return *this;
}

Numbers MeasurementReports::Copy(Numbers values) {
  return numbers_.emplace_back(values.begin(), values.end());
}

}  // namespace alidade
