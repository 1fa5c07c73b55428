// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "alidade/filter/filter_state.h"

namespace alidade::internal {

/// 1-point RANSAC [Civera2010]: which matches of a frame agree, where their sensors ask for it. A
/// hypothesis is what the state becomes by one match alone, and its support the matches that then
/// lie within their noise.
class Consensus {
 public:
  explicit Consensus(const System& system);

  /// Whether the sensor of any of the rows asks for it.
  static bool IsAsked(std::span<Row* const> rows);
  /// Puts those of the rows that support the best hypothesis, and those of which none is asked,
  /// into `agreed`, the others into `rest`. No match is tried twice, and the more support one has,
  /// the fewer are tried: log(1 - confidence) / log(1 - share of support). The same `seed` tries
  /// them in the same order.
  void Split(FilterState& f, std::span<Row* const> rows, std::uint64_t seed,
             std::vector<Row*>& agreed, std::vector<Row*>& rest) const;
  /// Whether a row outside the support is close enough to the state after the update by it.
  bool Rescues(const Row& row) const {
    return row.report->nis <= rescue_[static_cast<std::size_t>(row.sensor)];
  }

 private:
  std::vector<char> Support(FilterState& f, std::span<Row* const> matches,
                            std::uint64_t seed) const;
  void SupportOf(FilterState& f, std::size_t hypothesis, std::span<Row* const> matches,
                 std::vector<char>& agrees) const;

  std::vector<double> support_, rescue_;  ///< bounds on r' R^-1 r and NIS, by sensor
};

}  // namespace alidade::internal
