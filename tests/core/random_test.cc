// SPDX-License-Identifier: Apache-2.0
#include "alidade/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "alidade/error.h"

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

TEST(Random, GivesThePublishedOutputsOfXoshiro256PlusPlus) {
  // The test vector of the rand_xoshiro crate, from the authors' C code.
  Random random = Random::FromState({1, 2, 3, 4});
  for (const std::uint64_t expected :
       {41943041ull, 58720359ull, 3588806011781223ull, 3591011842654386ull, 9228616714210784205ull,
        9973669472204895162ull, 14011001112246962877ull, 12406186145184390807ull,
        15849039046786891736ull, 10450023813501588000ull}) {
    EXPECT_EQ(random.NextBits(), expected);
  }
}

TEST(Random, SeedsWithThePublishedOutputsOfSplitmix64) {
  Random seeded(1234567);
  Random from_state = Random::FromState({6457827717110365317ull, 3203168211198807973ull,
                                         9817491932198370423ull, 4593380528125082431ull});
  for (int i = 0; i < 100; ++i) ASSERT_EQ(seeded.NextBits(), from_state.NextBits());
}

TEST(Random, RefusesTheStateThatNeverLeavesZero) {
  EXPECT_THROW(Random::FromState({0, 0, 0, 0}), ContractViolation);
}

TEST(Random, SameSeedAndStreamGiveTheSameNumbers) {
  // Computed by an independent program; the logarithm of the C library may differ in the last bit.
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
  // Mean 1/2 +- 5 sqrt(1/12/N), and every tenth of the interval within 5 sigma of N/10.
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

TEST(Random, UniformNeverReachesOne) {
  // All bits set before the shift: s0 + s3 = 0 and s0 = -1 give rotl(0) + s0 = 2^64 - 1.
  Random random = Random::FromState({~0ull, 0, 0, 1});
  EXPECT_EQ(random.Uniform(), 1.0 - 0x1p-53);
}

TEST(Random, NormalHasTheMomentsOfTheNormalDistribution) {
  // Moments 0, 1, 0, 3, whose estimates vary by 1, 2, 15, 96 over N; 5 sigma.
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
  // Both of a pair come from one point of the disc.
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
