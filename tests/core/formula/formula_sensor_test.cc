// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "alidade/testing/jacobians.h"
#include "support/formula_models.h"

namespace alidade {
namespace {

using testing::Blocks;
using testing::FormulaSensorOf;
using testing::LargestDifference;
using testing::Message;
using testing::NamedSpace;
using testing::PredictionOf;
using testing::VectorSpace;

/// Expects that the Jacobians agree with finite differences, whose error is below 1e-9.
void ExpectJacobian(const SharedSensor& sensor, const Blocks& roles,
                    const double* known = nullptr) {
  EXPECT_LT(LargestDifference(testing::SensorJacobian(sensor, roles, known),
                              testing::NumericSensorJacobian(sensor, roles, known)),
            1e-9);
}

std::vector<double> SigmaOf(const SharedSensor& sensor, const Blocks& roles,
                            const double* known = nullptr) {
  const int m = sensor->measurement().geometry.tangent;
  std::vector<double> l(static_cast<std::size_t>(m * m)), sigma;
  EXPECT_EQ(sensor->SqrtNoise(testing::Pointers(roles).data(), nullptr, l.data(), known),
            Status::kOk);
  for (int i = 0; i < m; ++i) sigma.push_back(l[static_cast<std::size_t>(i * m + i)]);
  return sigma;
}

TEST(FormulaSensor, AnEquationOfEveryFunctionHasItsDerivatives) {
  const SharedSensor sensor = FormulaSensorOf(
      R"yaml(z:
  a: sqrt(x) + exp(y) * log(x) - abs(y)
  b: pow(x, y) + x^3 - x^-2 + min(x, y) + max(x, y)
  c: sin(x) * cos(y) + tan(x) / (1 + y^2)
  d: asin(x / 3) + acos(y / 3) + atan(x * y) + hypot(x, y)
  e: atan2(y, x) - y
  f: wrap(x + 3 * y)
  g: sinc(x) + sinc(y - 0.7) + sinc(0.01 * y)
  h: norm([x, y, 1]) + dot([x, y], [y, 2]) + cross([x, y, 1], [y, x, x])[2]
  i: unit([x, y, x * y])
  j: rotate(rotation([x, y, 0.3]), [y, 1, x])
  k: rotation([x - 1.3, y - 0.7, x - 1.3])
sigma: {a: 1, b: 1, c: 1, d: 1, e: 1, f: 1, g: 1, h: 1, i: 1, j: 1, k: 1}
)yaml",
      {NamedSpace("x", Geometry::Vector(1)), NamedSpace("y", Geometry::Vector(1))});
  ExpectJacobian(sensor, {{1.3}, {0.7}});
}

TEST(FormulaSensor, ItsRolesHaveTheirGeometry) {
  const SharedSensor sensor = FormulaSensorOf(
      R"yaml(constants: {arm: [0.3, 0, 1.2], north: [0, 1, 0]}
z: {fix: "p + rotate(q, arm)", body: "rotate_inverse(q, north)", ray: "unit(p)",
    star: "rotate(q, u)", turn: "multiply(conjugate(q), r)", heading: "h - 30deg"}
sigma: {fix: [0.02, 0.02, 0.04], body: 0.1, ray: 0.01, star: 0.02, turn: 0.03, heading: 1deg}
)yaml",
      {VectorSpace("p", 3), NamedSpace("q", Geometry::UnitQuaternion()),
       NamedSpace("u", Geometry::UnitVector()), NamedSpace("r", Geometry::UnitQuaternion()),
       NamedSpace("h", Geometry::Angle())});
  EXPECT_EQ(ToString(sensor->measurement().geometry),
            "product(vector(3), vector(3), unit_vector, unit_vector, unit_quaternion, angle)");
  const Blocks roles = {{1, 2, 3}, {0.5, -0.5, 0.5, 0.5}, {0, 0.6, -0.8}, {0.8, 0, 0.6, 0}, {-3}};
  ExpectJacobian(sensor, roles);
  EXPECT_EQ(SigmaOf(sensor, roles),
            (std::vector<double>{0.02, 0.02, 0.04, 0.1, 0.1, 0.1, 0.01, 0.01, 0.02, 0.02, 0.03,
                                 0.03, 0.03, std::numbers::pi / 180}));
  // -3 rad - 30 deg is below -pi.
  EXPECT_NEAR(PredictionOf(sensor, roles).back(), -3 - std::numbers::pi / 6 + 2 * std::numbers::pi,
              1e-15);
}

TEST(FormulaSensor, ItsNoiseMayDependOnTheStateAndOnKnownNumbers) {
  const SharedSensor sensor = FormulaSensorOf(
      R"yaml(known: {anchor: [x, y], quality: number}
let: {d: norm(p - anchor)}
z: {range: d}
units: {range: m}
sigma: {range: quality + 0.01 * d}
)yaml",
      {VectorSpace("p", 2)});
  EXPECT_EQ(sensor->known_size(), 3);
  EXPECT_EQ(sensor->measurement().unit, "m");
  EXPECT_EQ(sensor->known().elements,
            (std::vector<std::string>{"anchor.x", "anchor.y", "quality"}));
  const std::array<double, 3> known = {1, 2, 0.5};
  const Blocks roles = {{4, 6}};
  EXPECT_DOUBLE_EQ(PredictionOf(sensor, roles, known.data())[0], 5);
  EXPECT_DOUBLE_EQ(SigmaOf(sensor, roles, known.data())[0], 0.55);
  ExpectJacobian(sensor, roles, known.data());
}

TEST(FormulaSensor, HasADomain) {
  const auto status_at = [](const std::string& keys, double x) {
    const SharedSensor sensor =
        FormulaSensorOf(keys + "\nsigma: {a: 1}\n", {NamedSpace("x", Geometry::Vector(1))});
    const double* roles = &x;
    double h = -7.0, slope = -7.0;
    double* jacobian = &slope;
    const int stride = 1;
    const Status status = sensor->Predict(&roles, &h);
    EXPECT_EQ(sensor->Linearise(&roles, &h, &jacobian, &stride), status) << keys << ' ' << x;
    EXPECT_TRUE(status == Status::kOk || h == -7.0) << "a failure must not change the outputs";
    return status;
  };
  constexpr Status kOk = Status::kOk, kOut = Status::kOutOfDomain;
  for (const char* expression : {"sqrt(x)", "log(x)", "1 / x", "x^0.5", "x^-1", "hypot(x, 0)",
                                 "atan2(0, x)", "norm([x, 0, 0])"}) {
    const std::string z = "z: {a: '" + std::string(expression) + "'}";
    EXPECT_EQ(status_at(z, 0.0), kOut) << expression;
    EXPECT_EQ(status_at(z, 2.0), kOk) << expression;
  }
  EXPECT_EQ(status_at("z: {a: asin(x)}", 1.0), kOut);
  EXPECT_EQ(status_at("z: {a: exp(x)}", 1e4), kOut);
  EXPECT_EQ(status_at("z: {a: x}\ndomain: x > 1", 1.0), kOut);
  EXPECT_EQ(status_at("z: {a: x}\ndomain: x >= 1", 1.0), kOk);
  EXPECT_EQ(status_at("z: {a: x}\ndomain: 0 < x < 2 and x^2 < 3", 1.9), kOut);
  EXPECT_EQ(status_at("z: {a: x}\ndomain: 0 < x < 2 and x^2 < 3", 1.7), kOk);
  EXPECT_EQ(status_at("z: {a: x}\ndomain: [x > 0, x < 2]", 2.5), kOut);
}

TEST(FormulaSensor, RejectsMeasurementsByTheirValue) {
  const SharedSensor sensor = FormulaSensorOf(
      "z: {range: norm(p), height: p.y}\nsigma: {range: 1, height: 1}\n"
      "valid: 0.5 < z.range < 50 and z.height < z.range\n",
      {VectorSpace("p", 2)});
  const auto valid = [&](double range, double height) {
    const std::array z = {range, height};
    return sensor->Valid({z.data(), nullptr}) == Status::kOk;
  };
  EXPECT_TRUE(valid(10, 3));
  EXPECT_FALSE(valid(0.4, 0.1));
  EXPECT_FALSE(valid(51, 3));
  EXPECT_FALSE(valid(10, 11));
}

TEST(FormulaSensor, ReplacesItsNoiseByACovariance) {
  const SharedSensor sensor =
      FormulaSensorOf("z: {fix: p}\ncovariance: [[4, 2], [2, 2]]\n", {VectorSpace("p", 2)});
  std::vector<double> l(4);
  const Blocks roles = {{0, 0}};
  ASSERT_EQ(sensor->SqrtNoise(testing::Pointers(roles).data(), nullptr, l.data()), Status::kOk);
  EXPECT_EQ(l, (std::vector<double>{2, 0, 1, 1}));
}

TEST(FormulaSensor, OwnsModelParameterStates) {
  const SharedSensor sensor = FormulaSensorOf(
      "owns: {b: number}\nunits: {b: m}\nz: {height: p.y + b}\nsigma: {height: 1}\n",
      {VectorSpace("p", 2)});
  ASSERT_EQ(sensor->roles().size(), 2u);
  EXPECT_EQ(sensor->roles()[1].flags, static_cast<unsigned>(ALIDADE_ROLE_OWNED));
  EXPECT_EQ(sensor->roles()[1].unit, "m");
  ExpectJacobian(sensor, {{1, 2}, {0.5}});
}

TEST(FormulaSensor, InitialisesALandmarkByItsInverseModel) {
  const SharedSensor sensor = FormulaSensorOf(
      R"yaml(landmark: [x, y]
let: {d: landmark - p}
z: {range: norm(d), bearing: "wrap(atan2(d.y, d.x) - heading)"}
sigma: {range: 0.1, bearing: 1deg}
initialise:
  landmark: p + z.range * [cos(heading + z.bearing), sin(heading + z.bearing)]
)yaml",
      {VectorSpace("p", 2), NamedSpace("heading", Geometry::Angle())}, true);
  EXPECT_TRUE(sensor->has_landmark());
  ASSERT_EQ(sensor->inverse().role, 2);
  const Blocks roles = {{1, 2}, {0.4}, {4, 6}};
  const std::vector<double> z = PredictionOf(sensor, roles);
  const auto initialise = [&](const Blocks& x, const std::vector<double>& measured,
                              SensorModel::InverseOutput out) {
    return sensor->Initialise(testing::Pointers(x).data(), {measured.data(), nullptr}, nullptr,
                              out);
  };
  std::vector<double> y(2), jp(4), jh(2), jz(4);
  std::array<double*, 3> jx = {jp.data(), jh.data(), nullptr};
  ASSERT_EQ(initialise(roles, z, {y.data(), jx.data(), nullptr, jz.data(), nullptr}), Status::kOk);
  EXPECT_LT(LargestDifference(y, roles[2]), 1e-15);
  const std::vector<Space> landmark = {VectorSpace("landmark", 2)};
  std::vector<Space> inputs = {sensor->roles()[0], sensor->roles()[1], sensor->measurement()};
  const std::vector<double> numeric =
      testing::NumericJacobian(inputs, {roles[0], roles[1], z}, landmark, [&](const Blocks& x) {
        Blocks moved{std::vector<double>(2)};
        EXPECT_EQ(initialise({x[0], x[1], {}}, x[2], {moved[0].data()}), Status::kOk);
        return moved;
      });
  const std::vector<double> jacobian = {jp[0], jp[1], jh[0], jz[0], jz[1],
                                        jp[2], jp[3], jh[1], jz[2], jz[3]};
  EXPECT_LT(LargestDifference(jacobian, numeric), 1e-9);
}

TEST(FormulaSensor, HasUpTo64Inputs) {
  const std::string yaml = "let: {twice: 2 * p}\nz: {a: 'p[0]', b: 'p[63]'}\nsigma: {a: 1, b: 1}\n";
  const SharedSensor sensor = FormulaSensorOf(yaml, {VectorSpace("p", 64)});
  Blocks p = {std::vector<double>(64, 1.0)};
  p[0][63] = 7.0;
  EXPECT_EQ(PredictionOf(sensor, p), (std::vector<double>{1, 7}));
}

TEST(FormulaSensor, ErrorsNameTheKey) {
  const auto error = [](const std::string& yaml) {
    return Message([&] { FormulaSensorOf(yaml, {VectorSpace("p", 2)}); });
  };
  EXPECT_EQ(error("sigma: {range: 1}\n"),
            "f.yaml:1:1 z: missing key, needed by a sensor; expected z: {range: norm(p - "
            "anchor)}");
  EXPECT_NE(error("z: {range: p.x}\nsigma: {rnge: 1}\n").find("z.range"), std::string::npos);
  EXPECT_EQ(error("z: {range: p.x}\nsigma: {range: -1}\n"),
            "f.yaml:2:16 sigma.range: the standard deviation is not > 0");
  EXPECT_EQ(error("z: {fix: p}\nsigma: {fix: [1, 2, 3]}\n"),
            "f.yaml:2:14 sigma.fix: the list has 3 elements; expected 2, or one number for all "
            "elements");
  EXPECT_EQ(error("constants: {a: 1 / 0}\nz: {fix: p}\nsigma: {fix: 1}\n"),
            "f.yaml:1:16 constants.a: the constant has no finite value; expected a number, such as "
            "2 or 30deg");
  EXPECT_EQ(error("owns: {b: angel}\nz: {fix: p}\nsigma: {fix: 1}\n").substr(0, 44),
            "f.yaml:1:11 owns.b: 'angel' is not a geometr");
  EXPECT_EQ(Message([] {
              FormulaSensorOf(
                  "roles: {p: drone.p, z: drone.z}\nz: {height: z.x}\n"
                  "sigma: {height: 1}\n",
                  {VectorSpace("p", 2), VectorSpace("z", 2)});
            }),
            "f.yaml:1:24 roles.z: the name 'z' is already used; expected another name");
  EXPECT_NE(error("units: {fx: m}\nz: {fix: p}\nsigma: {fix: 1}\n").find("fx"), std::string::npos);
  EXPECT_NE(error("domian: p.x > 0\nz: {fix: p}\nsigma: {fix: 1}\n").find("did you mean 'domain'?"),
            std::string::npos);
  EXPECT_EQ(error("domain: p.x\nz: {fix: p}\nsigma: {fix: 1}\n"),
            "f.yaml:1:12 domain: the expression ends too early; expected a comparison: <, <=, > or "
            ">=");
}

}  // namespace
}  // namespace alidade
