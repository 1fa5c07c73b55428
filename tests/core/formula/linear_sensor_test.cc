// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "alidade/estimation/direct_models.h"
#include "sensors/position.h"
#include "support/formula_models.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::LargestDifference;
using testing::LinearSensorOf;
using testing::Message;
using testing::VectorSpace;

TEST(LinearSensor, OfAPositionIsTheModelPosition) {
  const SharedSensor sensor = MakeSensor(Position<2>({0.3, 0.4}));
  const SharedSensor twin = LinearSensorOf(R"yaml(z: {position: [x, y]}
H: {position: [[1, 0], [0, 1]]}
sigma: {position: [0.3, 0.4]}
)yaml",
                                           {VectorSpace("position", 2)});
  const Blocks position = {{5, -7}};
  const Blocks roles = {{5, -7}, {0}, {0, 0}};  // also the attitude and the lever arm
  EXPECT_EQ(testing::PredictionOf(twin, position), testing::PredictionOf(sensor, roles));
  const std::vector<double> h = testing::SensorJacobian(sensor, roles);
  EXPECT_LT(LargestDifference(testing::SensorJacobian(twin, position), {h[0], h[1], h[5], h[6]}),
            1e-12);
  std::array<double, 4> l{}, twin_l{};
  EXPECT_EQ(sensor->SqrtNoise(testing::Pointers(roles).data(), nullptr, l.data()), Status::kOk);
  EXPECT_EQ(twin->SqrtNoise(testing::Pointers(position).data(), nullptr, twin_l.data()),
            Status::kOk);
  EXPECT_EQ(twin_l, l);
}

constexpr const char* kTwoParts = R"yaml(owns: {bias: number}
constants: {scale: 2}
z: {sum: [a, b], speed: number}
units: {sum: m, speed: m/s}
H:
  p: [[scale, 1], [0, -1], [0, 0]]
  v: [[0, 0], [3, 0], [0, 0.5]]
  bias: [1, 0, 1]
offset: [10, 20, 30]
covariance: [[4, 2, 0], [2, 5, 0], [0, 0, 9]]
)yaml";

TEST(LinearSensor, IsASumOverItsRoles) {
  const SharedSensor sensor = LinearSensorOf(kTwoParts, {VectorSpace("p", 2), VectorSpace("v", 2)});
  const Blocks roles = {{1, 2}, {3, 4}, {100}};
  // (2 * 1 + 2 + 100 + 10, -2 + 3 * 3 + 20, 0.5 * 4 + 100 + 30)
  EXPECT_EQ(testing::PredictionOf(sensor, roles), (std::vector<double>{114, 27, 132}));
  EXPECT_LT(LargestDifference(testing::SensorJacobian(sensor, roles),
                              testing::NumericSensorJacobian(sensor, roles)),
            1e-7);
  std::array<double, 9> l{};
  EXPECT_EQ(sensor->SqrtNoise(testing::Pointers(roles).data(), nullptr, l.data()), Status::kOk);
  EXPECT_EQ(l, (std::array<double, 9>{2, 0, 0, 1, 2, 0, 0, 0, 3}));
  EXPECT_EQ(sensor->measurement().elements, (std::vector<std::string>{"sum.a", "sum.b", "speed"}));
  EXPECT_EQ(sensor->measurement().doc,
            "sum.a = 2 p.x + p.y + bias + 10, sum.b = -p.y + 3 v.x + 20; "
            "speed = 0.5 v.y + bias + 30");
  EXPECT_EQ(sensor->measurement().parts, (std::vector<std::string>{"sum", "speed"}));
  EXPECT_EQ(sensor->measurement().part_units, (std::vector<std::string>{"m", "m/s"}));
}

TEST(LinearSensor, ReportsWrongMatrices) {
  const auto message = [](const std::string& yaml) {
    return Message(
        [&] { LinearSensorOf("z: {position: [x, y]}\n" + yaml, {VectorSpace("p", 3)}); });
  };
  const std::string h = "H: {p: [[1, 0, 0], [0, 1, 0]]}\n";
  EXPECT_EQ(
      message("H: {p: [[1, 0], [0, 1]]}\n"),
      "f.yaml:2:9 H.p[0]: a row of the matrix H.p has 2 numbers; expected 2 rows of 3 numbers");
  EXPECT_NE(message("H: {q: [[1, 0], [0, 1]]}\n").find("missing key, needed by role 'p'"),
            std::string::npos);
  EXPECT_NE(message("H: {p: [[1, 0, 0], [0, 1, 0]], q: 1}\n").find("H.q"), std::string::npos);
  EXPECT_EQ(message(h + "offset: [1]\n"),
            "f.yaml:3:9 offset: the matrix offset has 1 row; expected 2 rows of 1 number");
  EXPECT_EQ(message(h + "sigma: {position: [1, 0]}\n"),
            "f.yaml:3:19 sigma.position: the standard deviation is not > 0");
  EXPECT_EQ(message(h + "sigma: {position: 1}\nlet: {a: cc}\n"),
            "f.yaml:4:10 let.a: the name 'cc' does not exist; expected a");
  EXPECT_NE(message(h + "covariance: [[1]]\n").find("2 rows of 2 numbers"), std::string::npos);
  EXPECT_NE(message(h).find("sigma"), std::string::npos);
}

}  // namespace
}  // namespace alidade
