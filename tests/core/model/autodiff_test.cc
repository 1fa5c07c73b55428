// SPDX-License-Identifier: Apache-2.0
// Tests dual numbers, and the functions that wrap an author's model for the plugin ABI.
#include "alidade/model/autodiff.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::AbiSensor;
using testing::Blocks;
using testing::ExpectSame;
using testing::ExpectTrueJacobians;
using testing::Filled;
using testing::kNumeric;
using testing::kPoison;
using testing::NumericSensorJacobian;
using testing::Pointers;
using testing::SensorJacobian;
using testing::StepResult;
using testing::StepWithJacobians;

/// Returns true if a plugin call left its outputs unchanged.
bool NotWritten(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double x) { return x == kPoison; });
}

/// Motion model q' = q Exp((u + w) dt).
struct Turn : Motion<3, UnitQuaternion> {
  using Input = Vec<3>;
  static constexpr std::array kBlocks{Quantity{"orientation"}};
  static constexpr Quantity kInput{"rate", "rad/s", "angular velocity", "x,y,z"};
  explicit Turn(Params&) {}
  template <class T>
  bool Step(const T* q, const T* u, const T* w, double dt_s, T* next) const {
    if (!(q[0] * q[0] < T(4.0))) return false;
    T d[3];
    for (int i = 0; i < 3; ++i) d[i] = (u[i] + w[i]) * dt_s;
    UnitQuaternion::Plus(q, d, next);
    return true;
  }
  void SqrtQ(const double*, double dt_s, MatrixRef l) const {
    for (int i = 0; i < 3; ++i) l(i, i) = 0.1 / std::sqrt(dt_s);
  }
};

TEST(AutodiffMotion, TakesControlInputAndTurnsQuaternions) {
  const auto turn = AbiMotion<Turn>();
  EXPECT_TRUE(turn->has_input());
  EXPECT_EQ(turn->instance().space().name, "rate");
  const Blocks x{{0.5, -0.5, 0.5, 0.5}};
  const double rate[3] = {0.3, -1.0, 2.0};
  ExpectTrueJacobians(turn, x, rate, {0.05, 0.02, -0.1}, 0.1);
}

TEST(AutodiffMotion, GivesFOrGAlone) {
  const auto turn = AbiMotion<Turn>();
  const Blocks x{{0.5, -0.5, 0.5, 0.5}};
  const double rate[3] = {0.3, -1.0, 2.0};
  const StepResult both = StepWithJacobians(turn, x, rate, nullptr, 0.1);
  Blocks next = Filled(turn->blocks(), kPoison);
  std::vector<double> f(9, kPoison), g(9, kPoison);
  const auto blocks = Pointers(x);
  auto out = Pointers(next);
  ASSERT_EQ(turn->Step(blocks.data(), rate, nullptr, 0.1, {out.data(), f.data(), nullptr}),
            Status::kOk);
  ASSERT_EQ(turn->Step(blocks.data(), rate, nullptr, 0.1, {out.data(), nullptr, g.data()}),
            Status::kOk);
  EXPECT_EQ(f, both.f);
  EXPECT_EQ(g, both.g);
}

TEST(AutodiffMotion, OutOfDomainWritesNothing) {
  const auto turn = AbiMotion<Turn>();
  const Blocks x{{3.0, 0, 0, 0}};
  const double rate[3] = {0, 0, 0};
  Blocks next = Filled(turn->blocks(), kPoison);
  std::vector<double> f(9, kPoison), g(9, kPoison);
  for (double* jacobian : {f.data(), static_cast<double*>(nullptr)}) {
    EXPECT_EQ(
        turn->Step(Pointers(x).data(), rate, nullptr, 0.1,
                   {Pointers(next).data(), jacobian, jacobian == nullptr ? nullptr : g.data()}),
        Status::kOutOfDomain);
  }
  EXPECT_TRUE(NotWritten(next[0]));
  EXPECT_TRUE(NotWritten(f));
  EXPECT_TRUE(NotWritten(g));
}

TEST(AutodiffMotion, NullNoiseIsZeroInThePluginItself) {
  // The host of this project passes zeros. Another host may pass null, which the ABI allows.
  const auto turn = AbiMotion<Turn>();
  const AlidadeInstance& c = turn->instance().c();
  const Blocks x{{1, 0, 0, 0}};
  const double rate[3] = {0, 0, 1};
  const double* const inputs[] = {rate};
  Blocks next = Filled(turn->blocks(), kPoison);
  std::vector<double> f(9, kPoison), g(9, kPoison);
  EXPECT_EQ(c.motion->step(c.self, Pointers(x).data(), inputs, nullptr, 0.1, Pointers(next).data(),
                           f.data(), 3, g.data(), 3, nullptr, 0),
            ALIDADE_OK);
  EXPECT_NEAR(next[0][3], std::sin(0.05), 1e-16);
}

TEST(AutodiffMotion, TheJacobianByTheControlInputIsThatOfDifferences) {
  const auto turn = AbiMotion<Turn>();
  const AlidadeInstance& c = turn->instance().c();
  const Blocks x{{0.8, 0.0, 0.6, 0.0}};
  const double rate[3] = {0.3, -0.2, 1.0}, h = 1e-6;
  const auto step = [&](const double* u, double* b) {
    const double* const inputs[] = {u};
    Blocks next = Filled(turn->blocks(), kPoison);
    EXPECT_EQ(c.motion->step(c.self, Pointers(x).data(), inputs, nullptr, 0.1,
                             Pointers(next).data(), nullptr, 0, nullptr, 0, b, 4),
              ALIDADE_OK);
    return next[0];
  };
  std::vector<double> b(12, kPoison);
  const std::vector<double> at = step(rate, b.data());
  for (int j = 0; j < 3; ++j) {
    double up[3], down[3], d_up[3], d_down[3];
    std::copy_n(rate, 3, up);
    std::copy_n(rate, 3, down);
    up[j] += h;
    down[j] -= h;
    UnitQuaternion::Minus(step(up, nullptr).data(), at.data(), d_up);
    UnitQuaternion::Minus(step(down, nullptr).data(), at.data(), d_down);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(b[static_cast<std::size_t>(4 * i + j)], (d_up[i] - d_down[i]) / (2.0 * h), 1e-9);
    }
  }
  EXPECT_EQ(b[3], kPoison) << "the memory between two rows must not be written";
}

/// Motion model x' = x + w. The analytic Jacobian writes its output and then throws.
struct Faulty : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  explicit Faulty(Params&) {}
  template <class T>
  void Step(const T* x, const T* w, double, T* next) const {
    next[0] = x[0] + w[0];
  }
  void StepJacobian(const double*, const double*, double, MatrixRef f, MatrixRef g) const {
    f(0, 0) = g(0, 0) = 1.0;
    throw std::runtime_error("faulty");
  }
  void SqrtQ(double, MatrixRef l) const {
    l(0, 0) = 1.0;
    throw std::runtime_error("faulty");
  }
};

TEST(AutodiffMotion, AnAnalyticJacobianThatThrowsWritesNothing) {
  const auto faulty = AbiMotion<Faulty>();
  const Blocks x{{1.0}};
  Blocks next = Filled(faulty->blocks(), kPoison);
  double f = kPoison, g = kPoison, l = kPoison;
  EXPECT_EQ(
      faulty->Step(Pointers(x).data(), nullptr, nullptr, 0.1, {Pointers(next).data(), &f, &g}),
      Status::kError);
  EXPECT_EQ(faulty->SqrtQ(Pointers(x).data(), nullptr, 0.1, &l), Status::kError);
  EXPECT_TRUE(NotWritten(next[0]));
  EXPECT_TRUE(NotWritten({f, g, l}));
}

/// Measures the bearing of a point from a pose. The role of the bias is optional.
struct Bearing : Sensor<Angle, Vec<2>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"point", "m", "", "x,y"},
                                     Quantity{"bias", "rad", "", "", ALIDADE_ROLE_OPTIONAL}};
  static constexpr Quantity kMeasurement{"bearing", "rad"};
  explicit Bearing(Params&) {}
  template <class T>
  bool Predict(const T* point, const T* bias, T* z) const {
    using std::atan2;
    if (point[0] == T(13.0)) throw std::runtime_error("unlucky");
    if (point[0] == T(14.0)) throw 14;
    z[0] = atan2(point[1], point[0]);
    if (bias != nullptr) z[0] = Angle::Wrap(T(z[0] + bias[0]));
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(0.01);
  }
};

TEST(AutodiffSensor, JacobianOfAnAngleIsTrueAcrossTheWrap) {
  const auto bearing = AbiSensor<Bearing>();
  for (const double y : {0.5, 1e-4, -1e-4}) {
    const Blocks roles{{-2.0, y}, {0.1}};
    ExpectSame(SensorJacobian(bearing, roles), NumericSensorJacobian(bearing, roles), kNumeric);
  }
}

TEST(AutodiffSensor, AnUnboundOptionalRoleIsSkipped) {
  const auto bearing = AbiSensor<Bearing>();
  const double point[2] = {3.0, 4.0};
  const double* roles[] = {point, nullptr};
  double z = kPoison, j[2] = {kPoison, kPoison};
  double* jacobians[] = {j, nullptr};
  const int strides[] = {2, 0};
  ASSERT_EQ(bearing->Linearise(roles, &z, jacobians, strides), Status::kOk);
  EXPECT_NEAR(j[0], -4.0 / 25.0, 1e-16);
  EXPECT_NEAR(j[1], 3.0 / 25.0, 1e-16);
  EXPECT_TRUE(bearing->roles()[1].optional());
}

TEST(AutodiffSensor, AnExceptionIsAnErrorWithItsText) {
  const auto bearing = AbiSensor<Bearing>();
  double z = kPoison;
  const double unlucky[2] = {13.0, 0}, unluckier[2] = {14.0, 0}, bias = 0.0;
  const double* roles[] = {unlucky, &bias};
  EXPECT_EQ(bearing->Predict(roles, &z), Status::kError);
  EXPECT_EQ(bearing->error_text(), "unlucky");
  roles[0] = unluckier;
  EXPECT_EQ(bearing->Predict(roles, &z), Status::kError);
  EXPECT_EQ(bearing->error_text(), "an exception of unknown type");
  EXPECT_TRUE(NotWritten({z}));
}

/// Measures z = x. If x < 0, the analytic Jacobian writes its output and then throws.
struct FaultySensor : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}, Quantity{"y"}};
  static constexpr Quantity kMeasurement{"z"};
  explicit FaultySensor(Params&) {}
  template <class T>
  bool Predict(const T* x, const T*, T* z) const {
    z[0] = x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = T(1.0);
  }
  void Jacobian(const double* x, const double*, MatrixRef by_x, MatrixRef) const {
    by_x(0, 0) = 1.0;
    if (x[0] < 0.0) throw std::runtime_error("faulty");
  }
};

TEST(AutodiffSensor, AnAnalyticJacobianThatThrowsWritesNothing) {
  const auto faulty = AbiSensor<FaultySensor>();
  const int strides[] = {1, 1};
  double x = -1.0, y = 0.0, z = kPoison, by_x = kPoison, by_y = kPoison;
  const double* roles[] = {&x, &y};
  double* jacobians[] = {&by_x, &by_y};
  EXPECT_EQ(faulty->Linearise(roles, &z, jacobians, strides), Status::kError);
  EXPECT_TRUE(NotWritten({z, by_x, by_y}));
  x = 2.0;
  jacobians[0] = nullptr;
  EXPECT_EQ(faulty->Linearise(roles, &z, jacobians, strides), Status::kOk);
  EXPECT_EQ(z, 2.0);
  EXPECT_EQ(by_y, 0.0);
}

/// Measures the displacement of a point from a camera. The sensor has an inverse measurement model
/// and roles of different sizes.
struct Displacement : Sensor<Vec<2>, Vec<2>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"point", "m", "", "x,y"},
                                     Quantity{"camera", "m", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "m", "", "x,y"};
  static constexpr int kInitialises = 0;
  explicit Displacement(Params&) {}
  template <class T>
  bool Predict(const T* point, const T* camera, T* z) const {
    for (int i = 0; i < 2; ++i) z[i] = (point[i] - camera[i]) / camera[2];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = l[3] = T(1.0);
  }
  template <class T>
  bool Initialise(const T* camera, const T* z, T* point) const {
    for (int i = 0; i < 2; ++i) point[i] = camera[i] + z[i] * camera[2];
    return true;
  }
};

/// Measures z = x. The analytic Jacobian is so large that it is copied as a whole.
struct Wide : Sensor<Vec<20>, Vec<20>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  template <class T>
  bool Predict(const T* x, T* z) const {
    std::copy_n(x, 20, z);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < 20; ++i) l[21 * i] = T(1.0);
  }
  void Jacobian(const double*, MatrixRef J_z_x) const {
    for (int r = 0; r < 20; ++r) {
      for (int c = 0; c < 20; ++c) J_z_x(r, c) = 100.0 * r + c;
    }
  }
};

TEST(AutodiffSensor, AWideAnalyticJacobianKeepsTheStride) {
  std::vector<double> x(20);
  std::iota(x.begin(), x.end(), 1.0);
  double z[20], j[20 * 25];
  std::fill_n(j, 20 * 25, kPoison);
  const double* const roles[] = {x.data()};
  double* const jacobians[] = {j};
  const int strides[] = {25};
  ASSERT_EQ(Evaluate(Wide(), roles, z, jacobians, strides), Status::kOk);
  for (int r = 0; r < 20; ++r) {
    EXPECT_EQ(z[r], x[static_cast<std::size_t>(r)]);
    for (int c = 0; c < 25; ++c) EXPECT_EQ(j[25 * r + c], c < 20 ? 100.0 * r + c : kPoison);
  }
}

TEST(AutodiffSensor, InitialisesWithDenseJacobians) {
  const auto sensor = AbiSensor<Displacement>();
  const double camera[3] = {1, 2, 4}, z[2] = {0.5, 0.25};
  const double* roles[] = {nullptr, camera};
  std::vector<double> point(2, kPoison), by_camera(6, kPoison), by_z(4, kPoison);
  double* jx[] = {nullptr, by_camera.data()};
  ASSERT_EQ(
      sensor->Initialise(roles, {z}, nullptr, {.y = point.data(), .jx = jx, .jz = by_z.data()}),
      Status::kOk);
  EXPECT_EQ(point, (std::vector<double>{3, 3}));
  EXPECT_EQ(by_camera, (std::vector<double>{1, 0, 0.5, 0, 1, 0.25}));
  EXPECT_EQ(by_z, (std::vector<double>{4, 0, 0, 4}));
}

}  // namespace
}  // namespace alidade
