// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/length_errors.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "alidade/base/error.h"
#include "alidade/evaluate/errors.h"

namespace alidade::internal {
namespace {

/// Returns the lengths 1, 2 and 5 times a power of ten up to `limit`, ascending.
std::vector<double> RoundLengths(double limit) {
  constexpr int kCount = 8;
  std::vector<double> lengths;
  for (int k = 3 * (static_cast<int>(std::floor(std::log10(limit))) + 1);
       std::ssize(lengths) < kCount; --k) {
    constexpr double kDigits[] = {1.0, 2.0, 5.0};
    const int decade = static_cast<int>(std::floor(k / 3.0));
    const double length = kDigits[k - 3 * decade] * std::pow(10.0, decade);
    if (length <= limit) lengths.push_back(length);
  }
  std::ranges::reverse(lengths);
  return lengths;
}

std::vector<double> Ascending(std::vector<double> values) {
  std::ranges::sort(values);
  return values;
}

/// Returns nothing if no two poses are `length` apart.
std::optional<LengthErrors> ErrorsOver(double length, const Trajectory& reference,
                                       const Trajectory& estimate) try {
  const auto pairs = PairsOf(
      estimate, {.delta = length, .unit = DeltaUnit::kMetres, .all = true, .tolerance = 0.1});
  std::vector<double> translations =
      RelativeErrors(PoseRelation::kTranslation, reference, estimate, pairs).errors;
  for (double& error : translations) error /= length;
  return LengthErrors{
      length, Ascending(std::move(translations)),
      Ascending(RelativeErrors(PoseRelation::kAngleDeg, reference, estimate, pairs).errors)};
} catch (const Error&) {
  return std::nullopt;
}

}  // namespace

std::vector<LengthErrors> ErrorsOverLengths(const Trajectory& reference,
                                            const Trajectory& estimate) {
  const double limit = estimate.size() > 1 ? 0.5 * estimate.Length(0, estimate.size() - 1) : 0.0;
  if (!(limit > 0.0) || !std::isfinite(limit)) return {};
  std::vector<LengthErrors> all;
  for (const double length : RoundLengths(limit)) {
    if (auto errors = ErrorsOver(length, reference, estimate)) all.push_back(*std::move(errors));
  }
  return all;
}

}  // namespace alidade::internal
