// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <random>
#include <sstream>

#include "host_fixture.h"

namespace alidade {
namespace {

// With -march=x86-64-v3, a b + c is rounded only once. All plugins use the same libm. The results
// differ by a few ulp for each operation.
constexpr double kRelative = 1e-12;
constexpr int kPoints = 100;

std::vector<std::string> Variants() {
  std::vector<std::string> names;
  std::istringstream list(ALIDADE_MATRIX);
  for (std::string name; std::getline(list, name, ',');) names.push_back(name);
  return names;
}

void EvaluateSensor(const SharedSensor& sensor, const std::vector<double>& x,
                    std::vector<double>& out) {
  const double* roles[] = {&x[0], &x[4], &x[7]};
  double z[2], by_q[6], by_point[6], by_bias[2], l[4];
  double* jacobians[] = {by_q, by_point, by_bias};
  const int strides[] = {3, 3, 1};
  ASSERT_EQ(sensor->Linearise(roles, z, jacobians, strides), Status::kOk);
  ASSERT_EQ(sensor->SqrtNoise(roles, z, l), Status::kOk);
  out.insert(out.end(), z, z + 2);
  out.insert(out.end(), by_q, by_q + 6);
  out.insert(out.end(), by_point, by_point + 6);
  out.insert(out.end(), by_bias, by_bias + 2);
  out.insert(out.end(), l, l + 4);
}

void EvaluateMotion(const SharedMotion& motion, const std::vector<double>& x,
                    std::vector<double>& out) {
  const double* blocks[] = {&x[0], &x[4]};
  double q[4], rate[3], f[36], g[18], l[9];
  double* next[] = {q, rate};
  ASSERT_EQ(motion->Step(blocks, nullptr, &x[8], 0.1, {next, f, g}), Status::kOk);
  ASSERT_EQ(motion->SqrtQ(blocks, nullptr, 0.1, l), Status::kOk);
  out.insert(out.end(), q, q + 4);
  out.insert(out.end(), rate, rate + 3);
  out.insert(out.end(), f, f + 36);
  out.insert(out.end(), g, g + 18);
  out.insert(out.end(), l, l + 9);
}

/// Returns all results of both models at random points, which are the same in every call.
std::vector<double> Evaluate(const std::filesystem::path& plugin) {
  const PluginHost host({plugin});
  const Config config = Config::FromText("{gain: 1.7, tau_s: 0.6}", "matrix");
  const SharedSensor sensor = host.CreateSensor("matrix_sensor", config.root());
  const SharedMotion motion = host.CreateMotion("matrix_motion", config.root());
  std::mt19937_64 engine(7);
  std::vector<double> out;
  for (int i = 0; i < kPoints; ++i) {
    std::vector<double> x(11);
    for (double& element : x) element = static_cast<double>(engine() >> 11) * 0x1p-52 - 1.0;
    Geometry::UnitQuaternion().Normalise(x.data());
    EvaluateSensor(sensor, x, out);
    EvaluateMotion(motion, x, out);
  }
  return out;
}

class MatrixTest : public HostTest, public ::testing::WithParamInterface<std::string> {};

TEST_P(MatrixTest, AgreesWithTheBaseline) {
  const std::vector<double> expected = Evaluate(Built("matrix_baseline"));
  std::vector<double> actual;
  try {
    actual = Evaluate(Built(GetParam()));
  } catch (const Error& e) {
    if (std::string(e.what()).find("instruction set") == std::string::npos) throw;
    GTEST_SKIP() << e.what();
  }
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    ASSERT_NEAR(actual[i], expected[i], kRelative * (1.0 + std::abs(expected[i]))) << "value " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Builds, MatrixTest, ::testing::ValuesIn(Variants()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace alidade
