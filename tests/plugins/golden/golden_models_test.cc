// SPDX-License-Identifier: Apache-2.0
//
// Compares plugins that were built with plugin ABI 1.0 with the formulas in
// tests/plugins/golden/1.0. This file is also compiled into a host of a later minor version
// (grown_host.cc).
#include <array>
#include <cmath>

#include "alidade/plugin/plugin_models.h"
#include "golden_fixture.h"

namespace alidade {
namespace {

constexpr double kTight = 1e-12;
constexpr const char* kLine = "{gain: 1.5, height_m: 2.5, sigma_m: 0.1, side: left, max_m: 20}";

using GoldenModels = GoldenTest;

TEST_P(GoldenModels, LineIsItsClosedForm) {
  const SharedSensor line = Sensor("golden_line", kLine);
  const double x = 1.0, b = 0.75, k = 4.0;
  const double* roles[] = {&x, &b};
  double z = 0.0, by_x = 0.0, by_b = 0.0;
  double* jacobians[] = {&by_x, &by_b};
  const int strides[] = {1, 1};
  ASSERT_EQ(line->Linearise(roles, &z, jacobians, strides, &k), Status::kOk);
  const double r = std::sqrt(9.0 + 6.25);
  EXPECT_NEAR(z, 1.5 * r + b, kTight);
  EXPECT_NEAR(by_x, 1.5 * (x - k) / r, kTight);
  EXPECT_NEAR(by_b, 1.0, kTight);
  double l = 0.0;
  ASSERT_EQ(line->SqrtNoise(roles, &z, &l, &k), Status::kOk);
  EXPECT_EQ(l, 0.1);
  const double short_one = 20.0, long_one = 20.5;
  EXPECT_EQ(line->Valid({&short_one, &k}), Status::kOk);
  EXPECT_EQ(line->Valid({&long_one, &k}), Status::kInvalid);
  // Outside its domain, the sensor writes no output.
  const double there = 4.0;
  const double* nowhere[] = {&there, &b};
  double untouched = 7.0;
  EXPECT_EQ(line->Predict(nowhere, &untouched, &k), Status::kOutOfDomain);
  EXPECT_EQ(untouched, 7.0);
}

TEST_P(GoldenModels, LineInverts) {
  const SharedSensor line = Sensor("golden_line", kLine);
  ASSERT_EQ(line->inverse().role, 0);
  ASSERT_EQ(line->inverse().prior_size, 0);
  const double b = 0.75, k = 4.0, z = 7.5;
  const double* roles[] = {nullptr, &b};
  double x = 0.0, by_b = 0.0, by_z = 0.0;
  double* jx[] = {nullptr, &by_b};
  ASSERT_EQ(line->Initialise(roles, {&z, &k}, nullptr, {.y = &x, .jx = jx, .jz = &by_z}),
            Status::kOk);
  const double r = (z - b) / 1.5, along = std::sqrt(r * r - 6.25);
  EXPECT_NEAR(x, k - along, kTight);
  EXPECT_NEAR(by_z, -r / along / 1.5, kTight);
  EXPECT_NEAR(by_b, r / along / 1.5, kTight);
  const double too_short = 4.0;
  EXPECT_EQ(line->Initialise(roles, {&too_short, &k}, nullptr, {.y = &x, .jx = jx, .jz = &by_z}),
            Status::kOutOfDomain);
}

TEST_P(GoldenModels, ParametersOfEveryKindAreRead) {
  // All parameters have their defaults: the side is right, the height is 2 m, any length is valid.
  const SharedSensor line = Sensor("golden_line", "{gain: 1, sigma_m: 0.1, noise_model: relative}");
  const double x = 3.0, b = 0.0, k = 1.0, far = 1e6;
  const double* roles[] = {&x, &b};
  double z = 0.0, l = 0.0;
  ASSERT_EQ(line->Predict(roles, &z, &k), Status::kOk);
  EXPECT_NEAR(z, std::sqrt(8.0), kTight);
  EXPECT_EQ(line->Valid({&far, &k}), Status::kOk);
  ASSERT_EQ(line->SqrtNoise(roles, &z, &l, &k), Status::kOk);
  EXPECT_NEAR(l, 0.1 * std::sqrt(8.0), kTight);
  ExpectError(ExitCode::kBadConfig, {"side", "is neither right nor left"},
              [&] { Sensor("golden_line", "{gain: 1, sigma_m: 1, side: above}"); });
  ExpectError(ExitCode::kBadConfig, {"gain", "sigma_m: missing", "noise_model"},
              [&] { Sensor("golden_line", "{gain: -1, noise_model: other}"); });
  ExpectError(ExitCode::kBadConfig, {"sigma_m", "needs one number, or one for each axis"},
              [&] { Sensor("golden_fix", "{sigma_m: [1, 2, 3], sigma_rad: 1}"); });
  ExpectError(ExitCode::kBadConfig, {"averaged", "coupled", "declination_rad"}, [&] {
    Sensor("golden_fix", "{sigma_m: 1, sigma_rad: 1, averaged: 0, coupled: 2, declination_rad: 4}");
  });
}

TEST_P(GoldenModels, FixIsItsClosedForm) {
  const SharedSensor fix = Sensor("golden_fix",
                                  "{antenna_m: [0.5, -0.25], sigma_m: [0.2, 0.4], sigma_rad: 0.1, "
                                  "declination_rad: -0.5, averaged: 4, coupled: true}");
  EXPECT_EQ(fix->measurement().geometry,
            Geometry::Product({Geometry::Vector(2), Geometry::Angle()}));
  const double p[] = {1.0, -2.0}, h = 3.0;
  const double* roles[] = {p, &h};
  std::array<double, 3> z{};
  std::array<double, 12> by_p;  // 4 elements per row
  std::array<double, 6> by_h;   // 2 elements per row
  by_p.fill(9.0);
  by_h.fill(9.0);
  double* jacobians[] = {by_p.data(), by_h.data()};
  const int strides[] = {4, 2};
  ASSERT_EQ(fix->Linearise(roles, z.data(), jacobians, strides), Status::kOk);
  const double x = std::cos(h) * 0.5 + std::sin(h) * 0.25;
  const double y = std::sin(h) * 0.5 - std::cos(h) * 0.25;
  EXPECT_NEAR(z[0], p[0] + x, kTight);
  EXPECT_NEAR(z[1], p[1] + y, kTight);
  EXPECT_NEAR(z[2], 3.5 - 2.0 * std::acos(-1.0), kTight);
  const double expected_by_p[] = {1, 0, 9, 9, 0, 1, 9, 9, 0, 0, 9, 9};
  const double expected_by_h[] = {-y, 9, x, 9, 1, 9};
  for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(by_p[i], expected_by_p[i], kTight) << i;
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(by_h[i], expected_by_h[i], kTight) << i;
  std::array<double, 9> l{};
  ASSERT_EQ(fix->SqrtNoise(roles, z.data(), l.data()), Status::kOk);
  const double expected_l[] = {0.1, 0, 0, 0.1, 0.2, 0, 0, 0, 0.05};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(l[i], expected_l[i], kTight) << i;
}

TEST_P(GoldenModels, DirectionIsItsClosedForm) {
  const SharedSensor direction = Sensor("golden_direction", "{field: [3, 0, -4], sigma_rad: 0.2}");
  // After the two rotations about x, the direction is below and above the equator. The basis has a
  // different sign in the two cases.
  for (const double angle : {0.8, -2.5}) {
    const double q[] = {std::cos(0.5 * angle), std::sin(0.5 * angle), 0.0, 0.0};
    const double* roles[] = {q};
    std::array<double, 3> z{};
    std::array<double, 6> j{};
    double* jacobians[] = {j.data()};
    const int strides[] = {3};
    ASSERT_EQ(direction->Linearise(roles, z.data(), jacobians, strides), Status::kOk);
    const double c = std::cos(angle), s = std::sin(angle);
    EXPECT_NEAR(z[0], 0.6, kTight);
    EXPECT_NEAR(z[1], -0.8 * s, kTight);
    EXPECT_NEAR(z[2], -0.8 * c, kTight);
    // The expected Jacobian is B(z)' (z x), with the basis that plugin_abi.h defines.
    const double sign = z[2] < 0.0 ? -1.0 : 1.0, a = -1.0 / (sign + z[2]);
    const double basis[3][2] = {{1.0 + sign * z[0] * z[0] * a, z[0] * z[1] * a},
                                {sign * z[0] * z[1] * a, sign + z[1] * z[1] * a},
                                {-sign * z[0], -z[1]}};
    const double cross[3][3] = {{0.0, -z[2], z[1]}, {z[2], 0.0, -z[0]}, {-z[1], z[0], 0.0}};
    for (std::size_t row = 0; row < 2; ++row) {
      for (std::size_t column = 0; column < 3; ++column) {
        double expected = 0.0;
        for (std::size_t i = 0; i < 3; ++i) expected += basis[i][row] * cross[i][column];
        EXPECT_NEAR(j[3 * row + column], expected, kTight) << row << ' ' << column;
      }
    }
    std::array<double, 4> l{};
    ASSERT_EQ(direction->SqrtNoise(roles, z.data(), l.data()), Status::kOk);
    EXPECT_EQ(l, (std::array<double, 4>{0.2, 0.0, 0.0, 0.2}));
  }
}

TEST_P(GoldenModels, CartIsItsClosedForm) {
  const SharedMotion cart = Cart();
  ASSERT_EQ(cart->noise_size(), 2);
  ASSERT_EQ(cart->tangent_size(), 3);
  ASSERT_TRUE(cart->has_input());
  EXPECT_TRUE(cart->discrete_noise());
  const double p[] = {1.0, 2.0}, h = 2.5, u[] = {3.0, 0.5}, w[] = {-1.0, 1.5}, dt = 0.75;
  const double* blocks[] = {p, &h};
  double p1[2] = {}, h1 = 0.0;
  double* next[] = {p1, &h1};
  std::array<double, 9> f{};
  std::array<double, 6> g{}, b{};
  ASSERT_EQ(cart->Step(blocks, u, w, dt, {next, f.data(), g.data()}), Status::kOk);
  const double v = 2.0, o = 2.0, a = 0.5 * o * dt, c = std::cos(h + a), s = std::sin(h + a);
  const double chord = v / o * 2.0 * std::sin(a), x = chord * c, y = chord * s;
  EXPECT_NEAR(p1[0], p[0] + x, kTight);
  EXPECT_NEAR(p1[1], p[1] + y, kTight);
  EXPECT_NEAR(h1, h + 2.0 * a - 2.0 * std::acos(-1.0), kTight);
  const double expected_f[] = {1, 0, -y, 0, 1, x, 0, 0, 1};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(f[i], expected_f[i], kTight) << i;
  const double k = v * dt * dt / 2.0, si = std::sin(a) / a, slope = (std::cos(a) - si) / a;
  const double by_rates[] = {
      chord / v * c, k * (slope * c - si * s), chord / v * s, k * (slope * s + si * c), 0.0, dt};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(g[i], by_rates[i], kTight) << i;
  // B = dx'/du. This host never requests B, so the test calls the function of the plugin directly.
  const AlidadeInstance& c_abi = dynamic_cast<const PluginMotion&>(*cart).instance().c();
  const double* inputs[] = {u};
  ASSERT_EQ(c_abi.motion->step(c_abi.self, blocks, inputs, w, dt, next, nullptr, 0, nullptr, 0,
                               b.data(), 2),
            ALIDADE_OK);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(b[i], by_rates[i], kTight) << i;
  std::array<double, 4> l{};
  ASSERT_EQ(cart->SqrtQ(blocks, u, dt, l.data()), Status::kOk);
  EXPECT_EQ(l, (std::array<double, 4>{0.25, 0.0, 0.0, 0.5}));
}

TEST_P(GoldenModels, DescribeThemselves) {
  const SharedSensor line = Sensor("golden_line", kLine);
  ASSERT_EQ(line->roles().size(), 2u);
  EXPECT_EQ(line->roles()[0].name, "position");
  EXPECT_EQ(line->roles()[0].unit, "m");
  EXPECT_EQ(line->roles()[1].flags, unsigned{ALIDADE_ROLE_OWNED});
  EXPECT_EQ(line->known().name, "anchor");
  EXPECT_EQ(line->known_size(), 1);
  const OwnedRole own = line->owned(1);
  EXPECT_EQ(own.mean, std::vector<double>{0.5});
  EXPECT_EQ(own.sqrt_prior, std::vector<double>{0.25});
  EXPECT_EQ(own.sqrt_density, std::vector<double>{0.125});
  EXPECT_EQ(own.dynamics, OwnedDynamics::kRandomWalk);
  const SharedSensor fix = Sensor("golden_fix", "{sigma_m: 1, sigma_rad: 1}");
  EXPECT_EQ(fix->measurement().elements,
            (std::vector<std::string>{"antenna.x", "antenna.y", "compass"}));
  const SharedMotion cart = Cart();
  EXPECT_EQ(cart->input().elements, (std::vector<std::string>{"speed", "turn_rate"}));
  const auto& entries = Host().entries();
  for (const char* name : {"golden_line", "golden_fix", "golden_direction", "golden_cart"}) {
    EXPECT_EQ(std::ranges::count(entries, name, &PluginEntry::name), 1) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Abi10, GoldenModels, ::testing::ValuesIn(kGolden),
                         [](const auto& one) { return std::string(one.param); });

}  // namespace
}  // namespace alidade
