// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/estimation/pending_measurements.h"

namespace alidade::internal {

/// 1-point RANSAC [Civera2010]: which matches of a frame agree, where their sensors ask for it. A
/// hypothesis is what the state becomes by one match alone, and its support the matches that then
/// lie within their noise.
class Consensus {
 public:
  explicit Consensus(const Problem& problem);

  /// Whether the sensor of any of the rows asks for it.
  static bool IsAsked(std::span<PendingMeasurement* const> rows);
  /// Puts those of the rows that support the best hypothesis, and those of which none is asked,
  /// into `agreed`, in their order, the others into `rest`. No match is tried twice, and the more
  /// support one has, the fewer are tried: log(1 - confidence) / log(1 - share of support). The
  /// same `seed` tries them in the same order.
  void Split(FilterState& f, std::span<PendingMeasurement* const> rows, std::uint64_t seed,
             std::vector<PendingMeasurement*>& agreed, std::vector<PendingMeasurement*>& rest);
  /// Whether a row outside the support is close enough to the state after the update by it.
  bool Rescues(const PendingMeasurement& pending) const {
    return pending.report->nis <= rescue_[static_cast<std::size_t>(pending.sensor)];
  }

 private:
  void FindBest(FilterState& f, std::uint64_t seed);
  void FindSupport(FilterState& f, std::size_t hypothesis);

  std::vector<double> support_, rescue_;  ///< bounds on r' R^-1 r and NIS, by sensor

  // Memory.
  Scratch<std::vector<PendingMeasurement*>> matches_;  ///< rows of sensors that ask for it
  std::vector<std::size_t> order_;                     ///< in which they are tried
  std::vector<char> agrees_, best_;  ///< by match: whether it supports the hypothesis; the best
  std::vector<double> h_, r_;        ///< of one match
};

}  // namespace alidade::internal
