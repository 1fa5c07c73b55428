// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace alidade {

/// Random number generator xoshiro256++. It produces the same numbers with every compiler and
/// standard library. splitmix64 computes the initial 256-bit state from a seed and the index of a
/// stream.
///
/// The streams of one seed are independent. A source uses a separate stream for each kind of noise,
/// so that additional draws from one stream do not change the numbers of another stream.
///
/// Source       [Blackman2021] xoshiro256++; [Steele2014] splitmix64; [Marsaglia1964] polar method.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  /// Returns the next 64 bits, uniformly distributed.
  std::uint64_t NextBits();
  /// Returns a sample that is uniform in [0, 1) and a multiple of 2^-53.
  double Uniform() { return 0x1p-53 * static_cast<double>(NextBits() >> 11); }
  /// Returns a sample of N(0, 1).
  double Normal();

 private:
  std::array<std::uint64_t, 4> state_;
  double spare_ = 0.0;  ///< second sample of the last normal pair
  bool has_spare_ = false;
};

}  // namespace alidade
