// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "alidade/estimation/filter.h"
#include "alidade/estimation/landmark_map.h"

namespace alidade::internal {

/// Why the landmarks of a system cannot be postponed exactly; empty where they can.
std::string WhyNotCompressed(const System& system);

/// Decides at the end of a frame which landmarks are postponed, and when the filter catches up with
/// them. A copy is a snapshot.
///
/// By operations, m rows a frame: a whole update takes m N^2, one of n active rows and a basis of k
///
///   m (n + k)^2,  and m (2 n')^2 if it had the n' alone that are measured
///
/// the difference is the excess e. Catching up takes C(k) = N k (N + 2 k). It is due after f
/// frames once e_1 + ... + e_f comes to C; or once the average cost of a frame, (e_1 + ... + e_f +
/// C) / f, will rise from then on as k and e grow: with C to the second order in f, at
///
///   f e_f - (e_1 + ... + e_f) + 2 N (k - k_0)^2 >= C(k_0)
class Compression {
 public:
  Compression(const System& system, const EkfOptions& options);
  /// After all else of a frame.
  void Apply(FilterState& f, const LandmarkMap& landmarks, std::span<const Row> rows);

 private:
  void Count(const FilterState& f, std::span<const Row> rows);
  bool IsDue(const State& state);
  void Begin(FilterState& f, const LandmarkMap& landmarks);

  CovarianceForm form_;
  /// Of the frame: m and n'.
  struct {
    double rows = 0.0, needed = 0.0;
  } frame_;
  /// Since the last catch-up.
  struct {
    double frames = 0.0, rows = 0.0, needed = 0.0, cost = 0.0, excess = 0.0;
    double basis = 0.0, catch_up = 0.0;  ///< k_0, C(k_0)
  } since_;
  int pause_ = 0;  ///< frames that `auto` stays full
  Scratch<std::vector<BlockId>> leaving_;
};

}  // namespace alidade::internal
