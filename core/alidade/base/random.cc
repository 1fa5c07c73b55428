// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/random.h"

#include <bit>
#include <cmath>

namespace alidade {
namespace {

/// Finaliser of splitmix64: a bijection of 64 bits with Mix(0) = 0.
std::uint64_t Mix(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

}  // namespace

Random::Random(std::uint64_t seed, std::uint64_t stream) {
  std::uint64_t counter = seed + Mix(stream);
  for (std::uint64_t& word : state_) word = Mix(counter += 0x9E3779B97F4A7C15u);
}

std::uint64_t Random::NextBits() {
  auto& s = state_;
  const std::uint64_t bits = std::rotl(s[0] + s[3], 23) + s[0];
  const std::uint64_t shifted = s[1] << 17;
  s[2] ^= s[0];
  s[3] ^= s[1];
  s[1] ^= s[2];
  s[0] ^= s[3];
  s[2] ^= shifted;
  s[3] = std::rotl(s[3], 45);
  return bits;
}

double Random::Normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  for (;;) {  // draws points in a square until one lies in the unit disc (probability pi/4)
    const double u = 2.0 * Uniform() - 1.0;
    const double v = 2.0 * Uniform() - 1.0;
    const double square = u * u + v * v;
    if (square >= 1.0 || square == 0.0) continue;
    const double factor = std::sqrt(-2.0 * std::log(square) / square);
    spare_ = v * factor;
    has_spare_ = true;
    return u * factor;
  }
}

}  // namespace alidade
