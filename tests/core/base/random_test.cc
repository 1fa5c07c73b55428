// SPDX-License-Identifier: Apache-2.0
#include "alidade/base/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <vector>

namespace alidade {
namespace {

constexpr int kCount = 200000;

std::vector<double> Normals(Random random) {
  std::vector<double> values(kCount);
  for (double& value : values) value = random.Normal();
  return values;
}

double Correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum / static_cast<double>(a.size());
}

/// Reference implementation of xoshiro256++ by its authors [Blackman2021].
std::uint64_t Xoshiro(std::array<std::uint64_t, 4>& s) {
  const auto rotl = [](std::uint64_t x, int k) { return (x << k) | (x >> (64 - k)); };
  const std::uint64_t result = rotl(s[0] + s[3], 23) + s[0];
  const std::uint64_t t = s[1] << 17;
  s[2] ^= s[0];
  s[3] ^= s[1];
  s[1] ^= s[2];
  s[0] ^= s[3];
  s[2] ^= t;
  s[3] = rotl(s[3], 45);
  return result;
}

TEST(Random, IsXoshiro256PlusPlusSeededBySplitmix64) {
  // The function above must reproduce the test vector of the rand_xoshiro crate, which comes from
  // the authors' C code. The state below is the published output of splitmix64 for the seed
  // 1234567.
  std::array<std::uint64_t, 4> state = {1, 2, 3, 4};
  for (const std::uint64_t expected :
       {41943041ull, 58720359ull, 3588806011781223ull, 3591011842654386ull, 9228616714210784205ull,
        9973669472204895162ull, 14011001112246962877ull, 12406186145184390807ull,
        15849039046786891736ull, 10450023813501588000ull}) {
    ASSERT_EQ(Xoshiro(state), expected);
  }
  state = {6457827717110365317ull, 3203168211198807973ull, 9817491932198370423ull,
           4593380528125082431ull};
  Random random(1234567);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(random.NextBits(), Xoshiro(state));
}

TEST(Random, SameSeedAndStreamGiveTheSameNumbers) {
  // The expected values come from an independent program. The C library may compute a logarithm
  // that differs in the last bit.
  Random zero(2017), one(2017, 1);
  for (const double expected : {1.028508934778973, 0.2839764101068146, -0.8565249074654515}) {
    EXPECT_NEAR(zero.Normal(), expected, 1e-15);
  }
  for (const double expected : {0.19330410316319138, -0.471597321368865, 0.22931459623182956}) {
    EXPECT_NEAR(one.Normal(), expected, 1e-15);
  }
  EXPECT_EQ(Random(2017, 1).NextBits(), 12501543394404904023ull);
}

TEST(Random, UniformFillsItsInterval) {
  // The mean must be 1/2 +- 5 sqrt(1/12/N). Each tenth of the interval must have N/10 values, with
  // a tolerance of 5 sigma.
  Random random(3);
  double sum = 0.0;
  std::vector<int> histogram(10);
  for (int i = 0; i < kCount; ++i) {
    const double u = random.Uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    sum += u;
    ++histogram[static_cast<std::size_t>(10.0 * u)];
  }
  EXPECT_NEAR(sum / kCount, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / kCount));
  for (const int count : histogram) {
    EXPECT_NEAR(count, kCount / 10, 5.0 * std::sqrt(0.1 * 0.9 * kCount));
  }
}

TEST(Random, NormalHasTheMomentsOfTheNormalDistribution) {
  // The moments are 0, 1, 0 and 3. The estimates of the moments have the variances 1, 2, 15 and 96,
  // each divided by N. The tolerance is 5 sigma.
  double m1 = 0.0, m2 = 0.0, m3 = 0.0, m4 = 0.0;
  int beyond = 0;
  for (const double x : Normals(Random(11))) {
    m1 += x / kCount;
    m2 += x * x / kCount;
    m3 += x * x * x / kCount;
    m4 += x * x * x * x / kCount;
    beyond += std::abs(x) > 1.959963984540054 ? 1 : 0;
  }
  EXPECT_NEAR(m1, 0.0, 5.0 * std::sqrt(1.0 / kCount));
  EXPECT_NEAR(m2, 1.0, 5.0 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(m3, 0.0, 5.0 * std::sqrt(15.0 / kCount));
  EXPECT_NEAR(m4, 3.0, 5.0 * std::sqrt(96.0 / kCount));
  EXPECT_NEAR(beyond, 0.05 * kCount, 5.0 * std::sqrt(0.05 * 0.95 * kCount));
}

TEST(Random, NeighbouringNormalsAreIndependent) {
  // Normal numbers are computed in pairs: both numbers of a pair come from the same point in the
  // unit disc.
  const std::vector<double> values = Normals(Random(12));
  const std::vector<double> later(values.begin() + 1, values.end());
  EXPECT_NEAR(Correlation(later, values), 0.0, 5.0 / std::sqrt(kCount));
}

TEST(Random, StreamsAndSeedsAreIndependent) {
  const std::vector<double> first = Normals(Random(1, 0));
  for (const Random& other : {Random(1, 1), Random(1, 2), Random(2, 0), Random(2, 1)}) {
    EXPECT_NEAR(Correlation(first, Normals(other)), 0.0, 5.0 / std::sqrt(kCount));
  }
}

TEST(Random, StreamsOfNeighbouringSeedsDiffer) {
  std::set<std::uint64_t> starts;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    for (std::uint64_t stream = 0; stream < 100; ++stream) {
      starts.insert(Random(seed, stream).NextBits());
    }
  }
  EXPECT_EQ(starts.size(), 10000u);
}

}  // namespace
}  // namespace alidade
