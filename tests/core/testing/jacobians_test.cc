// SPDX-License-Identifier: Apache-2.0
#include "alidade/testing/jacobians.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "alidade/estimation/direct_models.h"

namespace alidade::testing {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Measures z = b x y. The factor b is supplied with the measurement. The analytic dz/dy is
/// multiplied by kFault.
template <int kFault>
struct Scaled : Sensor<Vec<1>, Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}, Quantity{"y"}};
  static constexpr Quantity kMeasurement{"z"};
  using Known = Vec<1>;
  static constexpr Quantity kKnown{"factor"};
  template <class T>
  bool Predict(const T* x, const T* y, const double* b, T* z) const {
    z[0] = b[0] * x[0] * y[0];
    return x[0] > T(0.0);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const double*, T* l) const {
    l[0] = T(1.0);
  }
  void Jacobian(const double* x, const double* y, const double* b, MatrixRef jx,
                MatrixRef jy) const {
    if (jx) jx(0, 0) = b[0] * y[0];
    if (jy) jy(0, 0) = kFault * b[0] * x[0];
  }
};

// z = 2 x y at x = 3 and y = 5, so dz/dx = 10 and dz/dy = 6.
TEST(Jacobians, OfASensorAreThoseOfTheModelAndOfDifferences) {
  const double factor = 2.0;
  const SharedSensor right = MakeSensor(Scaled<1>()), wrong = MakeSensor(Scaled<2>());
  const Blocks roles{{3.0}, {5.0}};
  EXPECT_EQ(SensorJacobian(right, roles, &factor), (std::vector<double>{10.0, 6.0}));
  EXPECT_EQ(SensorJacobian(wrong, roles, &factor), (std::vector<double>{10.0, 12.0}));
  for (const SharedSensor& sensor : {right, wrong}) {
    const std::vector<double> numeric = NumericSensorJacobian(sensor, roles, &factor);
    EXPECT_LT(LargestDifference(numeric, {10.0, 6.0}),
              1e-11);  // The tolerance is the rounding error of 30, divided by 1e-3.
  }
  EXPECT_THROW(SensorJacobian(right, {{-1.0}, {5.0}}, &factor), ContractViolation);
  EXPECT_THROW(NumericSensorJacobian(right, {{1e-4}, {5.0}}, &factor), ContractViolation);
}

/// Motion model p1 = p + sin(h) dt + w0 h, h1 = h + u dt + w1.
struct Driven : Motion<2, Vec<1>, Angle> {
  static constexpr std::array kBlocks{Quantity{"p"}, Quantity{"h"}};
  using Input = Vec<1>;
  static constexpr Quantity kInput{"u"};
  template <class T>
  void Step(const T* p, const T* h, const T* u, const T* w, double dt_s, T* p1, T* h1) const {
    using std::sin;
    p1[0] = p[0] + sin(h[0]) * dt_s + w[0] * h[0];
    h1[0] = h[0] + u[0] * dt_s + w[1];
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = l(1, 1) = 1.0; }
};

TEST(Jacobians, OfAStepAreThoseOfTheModelAndOfDifferences) {
  const SharedMotion motion = MakeMotion(Driven());
  const double u = 0.5, w[] = {0.25, 0.0}, h = 3.0, dt_s = 0.4;
  const Blocks x{{1.0}, {h}};
  const std::vector<double> f{1.0, std::cos(h) * dt_s + w[0], 0.0, 1.0}, g{h, 0.0, 0.0, 1.0};
  const Blocks next{{1.0 + std::sin(h) * dt_s + w[0] * h},
                    {h + u * dt_s - 2.0 * std::acos(-1.0)}};  // h + u dt = 3.2 is beyond pi
  for (const StepResult& step :
       {StepWithJacobians(motion, x, &u, w, dt_s), NumericStep(motion, x, &u, w, dt_s)}) {
    for (std::size_t i = 0; i < next.size(); ++i) {
      EXPECT_NEAR(std::remainder(step.next[i][0] - next[i][0], 2.0 * std::acos(-1.0)), 0.0, 1e-15);
    }
    EXPECT_LT(LargestDifference(step.f, f), 1e-11);
    EXPECT_LT(LargestDifference(step.g, g), 1e-11);
  }
  const double zero[] = {0.0, 0.0};
  EXPECT_EQ(NumericStep(motion, x, &u, nullptr, dt_s).f, NumericStep(motion, x, &u, zero, dt_s).f);
}

TEST(LargestDifference, IsRelativeAndFindsWhatIsNotANumber) {
  EXPECT_DOUBLE_EQ(LargestDifference({1.0, 10.0}, {1.0, 9.0}), 0.1);
  EXPECT_EQ(LargestDifference({}, {}), 0.0);
  EXPECT_EQ(LargestDifference({1.0}, {1.0, 2.0}), kInfinity);
  EXPECT_EQ(LargestDifference({std::nan(""), 1.0}, {1.0, 1.0}), kInfinity);
  EXPECT_EQ(LargestDifference({1.0, 1.0}, {std::nan(""), 1.0}), kInfinity);
}

}  // namespace
}  // namespace alidade::testing
