// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace alidade {

/// Random numbers that are the same with every compiler and standard library: xoshiro256++, its
/// 256-bit state filled by splitmix64 from a seed and the number of a stream.
///
/// Streams of one seed are independent: a source gives each of its noises a stream of its own, so
/// that drawing more from one never shifts another.
///
/// Source       [Blackman2021] xoshiro256++; [Steele2014] splitmix64; [Marsaglia1964] polar method.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  /// The next 64 bits, uniform.
  std::uint64_t NextBits();
  /// Uniform in [0, 1), a multiple of 2^-53.
  double Uniform() { return 0x1p-53 * static_cast<double>(NextBits() >> 11); }
  /// N(0, 1).
  double Normal();

 private:
  std::array<std::uint64_t, 4> state_;
  double spare_ = 0.0;  ///< second normal of the last pair
  bool has_spare_ = false;
};

}  // namespace alidade
