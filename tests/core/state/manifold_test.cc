// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/manifold.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "alidade/state/element_names.h"
#include "alidade/testing/manifold_invariants.h"

namespace alidade {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kPoints = 200;
// Tolerance for the rounding errors of a dozen operations on numbers up to 10.
constexpr double kTolerance = 2e-14;

using Values = std::array<double, 10>;

struct Case {
  const char* name;
  Geometry geometry;
  double largest;  ///< largest step for which law (2) holds
};

class GeometryLaws : public ::testing::TestWithParam<Case> {
 protected:
  Values Point() {
    Values x{};
    for (int i = 0; i < geometry_.ambient; ++i) x[i] = uniform_(engine_) * 3.0;
    geometry_.Normalise(x.data());
    return x;
  }
  Values Step(double length) {
    Values d{};
    double norm = 0.0;
    for (int i = 0; i < geometry_.tangent; ++i) norm = std::hypot(norm, d[i] = uniform_(engine_));
    for (double& element : d) element *= length / norm;
    return d;
  }
  Values Plus(const Values& x, const Values& d) const {
    Values y{};
    geometry_.Plus(x.data(), d.data(), y.data());
    return y;
  }
  Values Minus(const Values& y, const Values& x) const {
    Values d{};
    geometry_.Minus(y.data(), x.data(), d.data());
    return d;
  }
  std::vector<double> Ambient(const Values& x) const {
    return {x.begin(), x.begin() + geometry_.ambient};
  }
  std::vector<double> Tangent(const Values& d) const {
    return {d.begin(), d.begin() + geometry_.tangent};
  }

  Geometry geometry_ = GetParam().geometry;
  std::mt19937_64 engine_{17};
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
};

TEST_P(GeometryLaws, HoldAtRandomPointsAndStepsOfEverySize) {
  for (int i = 0; i < kPoints; ++i) {
    const Values x = Point(), y = Point();
    for (const double length : {1e-300, 1e-15, 1e-8, 0.99e-6, 1.01e-6, 1e-3, 1.0, 3.0}) {
      if (length > GetParam().largest) continue;
      EXPECT_TRUE(testing::ManifoldInvariantsHold(geometry_, Ambient(x), Tangent(Step(length)),
                                                  Ambient(y), kTolerance));
    }
  }
}

TEST_P(GeometryLaws, SmallStepsKeepTheirDigits) {
  // The derivative must not jump when sin(d)/d changes to its series. So the relative error is
  // checked, not the absolute error.
  const Values x = [&] {
    Values identity{};
    std::ranges::copy(geometry_.Identity(), identity.begin());
    return identity;
  }();
  for (double length = 1e-12; length < 1e-3; length *= 1.7) {
    const Values d = Step(length), back = Minus(Plus(x, d), x);
    for (int i = 0; i < geometry_.tangent; ++i) EXPECT_NEAR(back[i], d[i], 1e-12 * length);
  }
}

TEST_P(GeometryLaws, PlusStaysOnTheManifoldAndMayWriteOverItsArgument) {
  Values x = Point();
  for (int i = 0; i < 100000; ++i) {
    const Values d = Step(0.1);
    geometry_.Plus(x.data(), d.data(), x.data());
  }
  EXPECT_LE(DistanceFrom(geometry_, x.data()), 1e-15);
}

TEST_P(GeometryLaws, TheJacobiansOfPlusAreItsDerivatives) {
  constexpr double kStep = 1e-6;
  const auto n = static_cast<std::size_t>(geometry_.tangent);
  for (int k = 0; k < kPoints; ++k) {
    const Values x = Point(), d = Step(k % 4 == 0 ? 1e-5 : 0.02 * k / 2.0);
    const Values y = Plus(x, d);
    std::vector<double> by_d(n * n), by_x(n * n);
    PlusJacobian(geometry_, x.data(), d.data(), by_d.data());
    PlusJacobianX(geometry_, x.data(), d.data(), by_x.data());
    // Expects column c of j to be the difference quotient of plus(e), e = (0, ..., e_c, ..., 0).
    const auto compare = [&](const std::vector<double>& j, std::size_t c, const auto& plus) {
      Values above{}, below{};
      above[c] = kStep;
      below[c] = -kStep;
      const Values up = Minus(plus(above), y), down = Minus(plus(below), y);
      for (std::size_t r = 0; r < n; ++r) {
        // The tolerance covers the rounding error, 1e-16 divided by the step, and the square of the
        // step.
        EXPECT_NEAR(j[r * n + c], (up[r] - down[r]) / (2.0 * kStep), 1e-8) << k;
      }
    };
    for (std::size_t c = 0; c < n; ++c) {
      compare(by_d, c, [&](Values e) {
        for (std::size_t i = 0; i < n; ++i) e[i] += d[i];
        return Plus(x, e);
      });
      compare(by_x, c, [&](const Values& e) { return Plus(Plus(x, e), d); });
    }
  }
}

TEST_P(GeometryLaws, TransportIsOrthogonalAndTheIdentityAtOnePoint) {
  constexpr double kTransport =
      // The tolerance is the rounding error / (1 + from . to). The smallest divisor here is 1e-4.
      1e-11;
  const int n = geometry_.tangent;
  for (int i = 0; i < kPoints; ++i) {
    const Values from = Point(), to = Point();
    std::array<double, 81> j{}, back{}, same{};
    geometry_.Transport(from.data(), to.data(), j.data());
    geometry_.Transport(to.data(), from.data(), back.data());
    geometry_.Transport(from.data(), from.data(), same.data());
    for (int r = 0; r < n; ++r) {
      for (int c = 0; c < n; ++c) {
        double jtj = 0.0;
        for (int k = 0; k < n; ++k) jtj += j[k * n + r] * j[k * n + c];
        EXPECT_NEAR(jtj, r == c, kTransport);
        EXPECT_NEAR(back[r * n + c], j[c * n + r], kTransport)
            << "the transport back must be the inverse";
        EXPECT_NEAR(same[r * n + c], r == c, 1e-15);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    AllKinds, GeometryLaws,
    ::testing::Values(
        Case{"vector", Geometry::Vector(5), 1e9}, Case{"angle", Geometry::Angle(), kPi},
        Case{"unit_quaternion", Geometry::UnitQuaternion(), kPi},
        Case{"unit_vector", Geometry::UnitVector(), kPi},
        Case{"se_2_left", Geometry(ALIDADE_SE_2_LEFT), kPi},
        Case{"se_2_right", Geometry(ALIDADE_SE_2_RIGHT), kPi},
        Case{"se_3_left", Geometry(ALIDADE_SE_3_LEFT), kPi},
        Case{"se_3_right", Geometry(ALIDADE_SE_3_RIGHT), kPi},
        Case{"se_2_3_left", Geometry(ALIDADE_SE_2_3_LEFT), kPi},
        Case{"se_2_3_right", Geometry(ALIDADE_SE_2_3_RIGHT), kPi},
        Case{"product",
             Geometry::Product({Geometry::Vector(2), Geometry::Angle(), Geometry::UnitVector()}),
             kPi}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Product, WrapsItsAnglesAndNothingElse) {
  const Geometry polar = Geometry::Product({Geometry::Vector(1), Geometry::Angle()});
  std::vector<double> z{7.0, 7.0};
  WrapAngles(polar, z.data());
  EXPECT_EQ(z[0], 7.0);
  EXPECT_DOUBLE_EQ(z[1], 7.0 - 2.0 * M_PI);
}

TEST(Product, IsItsPartsOneAfterTheOther) {
  const Geometry pose = Geometry::Product({Geometry::Vector(3), Geometry::UnitQuaternion()});
  EXPECT_EQ(pose.ambient, 7);
  EXPECT_EQ(pose.tangent, 6);
  EXPECT_EQ(ToString(pose), "product(vector(3), unit_quaternion)");
  EXPECT_NE(pose, Geometry::Product({Geometry::UnitQuaternion(), Geometry::Vector(3)}));
  const std::vector<double> x{1, 2, 3, 0.6, 0, 0.8, 0}, d{0.1, 0.2, 0.3, 0.5, -0.4, 0.3};
  std::vector<double> y(7), back(6), j(36), part(9);
  pose.Plus(x.data(), d.data(), y.data());
  std::vector<double> q(4);
  Geometry::UnitQuaternion().Plus(&x[3], &d[3], q.data());
  EXPECT_EQ(y, (std::vector<double>{1.1, 2.2, 3.3, q[0], q[1], q[2], q[3]}));
  pose.Minus(y.data(), x.data(), back.data());
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(back[i], d[i], 1e-15);
  PlusJacobian(pose, x.data(), d.data(), j.data());
  PlusJacobian(Geometry::UnitQuaternion(), &x[3], &d[3], part.data());
  for (std::size_t r = 0; r < 6; ++r) {
    for (std::size_t c = 0; c < 6; ++c) {
      const bool rotation = r >= 3 && c >= 3;
      EXPECT_EQ(j[6 * r + c], rotation ? part[3 * (r - 3) + c - 3] : r == c) << r << ' ' << c;
    }
  }
  std::vector<double> off{1, 2, 3, 1.2, 0, 1.6, 0};
  EXPECT_NEAR(DistanceFrom(pose, off.data()), 1.0, 1e-15);
  pose.Normalise(off.data());
  EXPECT_EQ(off, x);
}

// Tests fault 84 of tests/faults/README.md.
TEST(Angle, WrapsAtPlusAndMinusPi) {
  const Geometry angle = Geometry::Angle();
  const auto plus = [&](double x, double d) {
    double y;
    angle.Plus(&x, &d, &y);
    return y;
  };
  const auto minus = [&](double y, double x) {
    double d;
    angle.Minus(&y, &x, &d);
    return d;
  };
  EXPECT_EQ(plus(kPi, 0.0), kPi);
  EXPECT_EQ(plus(-kPi, 0.0), kPi) << "angles lie in (-pi, pi], so -pi becomes pi";
  EXPECT_NEAR(plus(kPi, 1e-3), -kPi + 1e-3, 1e-15);
  EXPECT_NEAR(plus(-kPi, -1e-3), kPi - 1e-3, 1e-15);
  EXPECT_NEAR(plus(3.0, 20.0 * kPi), 3.0, 1e-13);
  EXPECT_NEAR(minus(-kPi + 0.01, kPi - 0.01), 0.02, 1e-15);
  EXPECT_NEAR(minus(kPi - 0.01, -kPi + 0.01), -0.02, 1e-15);
}

TEST(Angle, NeverLeavesItsIntervalByRounding) {
  const Geometry angle = Geometry::Angle();
  const double ulp_inside = std::nextafter(-kPi, 0.0), zero = 0.0;
  double y;
  angle.Plus(&ulp_inside, &zero, &y);
  EXPECT_EQ(y, ulp_inside);
  for (int turns = -50; turns <= 50; ++turns) {
    double x = (2 * turns + 1) * kPi;
    for (int i = 0; i < 10; ++i) x = std::nextafter(x, -1e9);
    for (int i = 0; i < 20; ++i, x = std::nextafter(x, 1e9)) {
      angle.Plus(&x, &zero, &y);
      EXPECT_GT(y, -kPi) << x;
      EXPECT_LE(y, kPi) << x;
    }
  }
}

TEST(UnitQuaternion, AndItsNegativeAreOneRotation) {
  const Geometry geometry = Geometry::UnitQuaternion();
  const double q[4] = {0.5, -0.5, 0.5, 0.5}, negative[4] = {-0.5, 0.5, -0.5, -0.5};
  double d[3];
  geometry.Minus(q, negative, d);
  for (const double element : d) EXPECT_NEAR(element, 0.0, 1e-15);
  const double step[3] = {0.1, -0.2, 0.3};
  double moved[4], from_q[3], from_negative[3];
  geometry.Plus(q, step, moved);
  geometry.Minus(moved, q, from_q);
  geometry.Minus(moved, negative, from_negative);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(from_q[i], from_negative[i], 1e-15);
}

TEST(UnitQuaternion, QuarterTurnAboutZ) {
  // Exp((0, 0, pi/2)) = (cos pi/4, 0, 0, sin pi/4)
  const double one[4] = {1, 0, 0, 0}, turn[3] = {0, 0, kPi / 2};
  double q[4];
  Geometry::UnitQuaternion().Plus(one, turn, q);
  EXPECT_NEAR(q[0], std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(q[3], std::sqrt(0.5), 1e-15);
}

/// Returns d/dt of x (+) t d at t = 1 in the tangent space at the end point. Uses central
/// differences.
std::array<double, 2> VelocityAtTheEnd(const double* x, const double* d) {
  const Geometry geometry = Geometry::UnitVector();
  constexpr double kStep = 1e-5;
  double end[3], ahead[3], behind[3], forth[2], back[2];
  const double d_ahead[2] = {d[0] * (1 + kStep), d[1] * (1 + kStep)};
  const double d_behind[2] = {d[0] * (1 - kStep), d[1] * (1 - kStep)};
  geometry.Plus(x, d, end);
  geometry.Plus(x, d_ahead, ahead);
  geometry.Plus(x, d_behind, behind);
  geometry.Minus(ahead, end, forth);
  geometry.Minus(behind, end, back);
  return {(forth[0] - back[0]) / (2 * kStep), (forth[1] - back[1]) / (2 * kStep)};
}

TEST(UnitVector, TransportCarriesTheVelocityOfAGeodesicAlongIt) {
  const Geometry geometry = Geometry::UnitVector();
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < kPoints; ++i) {
    double x[3] = {uniform(engine), uniform(engine), uniform(engine)};
    geometry.Normalise(x);
    const double d[2] = {2.0 * uniform(engine), 2.0 * uniform(engine)};
    double end[3], j[4], homeward[2];
    geometry.Plus(x, d, end);
    geometry.Transport(x, end, j);
    geometry.Minus(x, end, homeward);
    const auto velocity = VelocityAtTheEnd(x, d);
    for (int row = 0; row < 2; ++row) {
      const double carried = j[2 * row] * d[0] + j[2 * row + 1] * d[1];
      EXPECT_NEAR(carried, velocity[row],
                  1e-8);  // Central differences have errors of step^2 and of rounding error / step.
      EXPECT_NEAR(carried, -homeward[row], 1e-12);
    }
  }
}

TEST(UnitVector, TransportKeepsOrientation) {
  // An orthogonal J could still be a reflection. det J = 1 must hold everywhere, including across
  // the discontinuity of the basis.
  const Geometry geometry = Geometry::UnitVector();
  const double from[3] = {std::sqrt(1 - 1e-6), 0, 1e-3}, to[3] = {std::sqrt(1 - 1e-6), 0, -1e-3};
  double j[4];
  geometry.Transport(from, to, j);
  EXPECT_NEAR(j[0] * j[3] - j[1] * j[2], 1.0, 1e-12);
}

TEST(UnitVector, MinusIsTrueUpToTheAntipode) {
  const Geometry geometry = Geometry::UnitVector();
  const double x[3] = {0.6, 0.0, 0.8};
  for (const double short_of : {1e-3, 1.01e-6, 0.99e-6, 1e-8, 1e-12}) {
    const double angle = kPi - short_of, d[2] = {0.6 * angle, -0.8 * angle};
    double y[3], back[2];
    geometry.Plus(x, d, y);
    geometry.Minus(y, x, back);
    // The direction is computed from a vector of length `short_of`, which has rounding errors.
    const double tolerance = 2e-15 / short_of;
    EXPECT_NEAR(back[0], d[0], tolerance);
    EXPECT_NEAR(back[1], d[1], tolerance);
    EXPECT_NEAR(std::hypot(back[0], back[1]), angle, 1e-14);
  }
}

TEST(UnitVector, MinusToTheAntipodeIsHalfATurn) {
  const Geometry geometry = Geometry::UnitVector();
  const double x[3] = {0.0, 0.0, 1.0};
  for (const double sideways : {0.0, 1e-170, 1e-160}) {
    const double y[3] = {0.0, sideways, -1.0};
    double d[2], there[3];
    geometry.Minus(y, x, d);
    EXPECT_EQ(d[0], kPi);
    EXPECT_EQ(d[1], 0.0);
    geometry.Plus(x, d, there);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(there[i], y[i], 1e-15);
  }
}

TEST(UnitVector, TransportToTheAntipodeIsFiniteAndOrthogonal) {
  const double from[3] = {0.6, 0.0, 0.8}, to[3] = {-0.6, 0.0, -0.8};
  double j[4];
  Geometry::UnitVector().Transport(from, to, j);
  EXPECT_NEAR(std::abs(j[0] * j[3] - j[1] * j[2]), 1.0, 1e-12);
}

TEST(Geometry, NormaliseGivesTheNearestPoint) {
  double q[4] = {0.0, 3.0, 0.0, 4.0};
  EXPECT_DOUBLE_EQ(DistanceFrom(Geometry::UnitQuaternion(), q), 4.0);
  Geometry::UnitQuaternion().Normalise(q);
  EXPECT_DOUBLE_EQ(q[1], 0.6);
  EXPECT_DOUBLE_EQ(q[3], 0.8);
  double zero[3] = {0, 0, 0};
  Geometry::UnitVector().Normalise(zero);
  EXPECT_EQ(zero[2], 1.0) << "a zero vector becomes the neutral direction";
  double angle = 7.0;
  Geometry::Angle().Normalise(&angle);
  EXPECT_NEAR(angle, 7.0 - 2.0 * kPi, 1e-15);
}

TEST(Geometry, AVectorOfAnySizeHasNoAngles) {
  const Geometry geometry = Geometry::Vector(40);
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(geometry.IsAngular(i)) << i;
  EXPECT_FALSE(geometry.is_angular());
  EXPECT_TRUE(Geometry::UnitVector().is_angular());
}

TEST(Geometry, NormaliseDoesNotChangeAValueWhoseLengthIsNotFinite) {
  double far[3] = {1e200, 1e200, 0.0};
  Geometry::UnitVector().Normalise(far);
  EXPECT_EQ(far[0], 1e200);
}

TEST(GeometryTable, NamesAsManyElementsAsThereAre) {
  for (const GeometryRow* row : detail::kGeometryRows) {
    if (row->ambient == 0) continue;  // the model determines the size of this geometry
    SCOPED_TRACE(row->name);
    EXPECT_EQ(FindGeometry(row->number), row);
    const Geometry geometry(row->number);
    Space space;
    space.geometry = geometry;
    space.elements = internal::ElementsOf("", geometry);
    EXPECT_EQ(std::ssize(space.elements), row->ambient);
    EXPECT_EQ(std::ssize(internal::TangentNames("b", space)), row->tangent);
    EXPECT_LT(row->angular, 1U << row->tangent);
    EXPECT_EQ(DistanceFrom(geometry, geometry.Identity().data()), 0.0);
    std::vector<double> x = geometry.Identity();
    geometry.Normalise(x.data());
    EXPECT_EQ(x, geometry.Identity());
  }
  EXPECT_EQ(FindGeometry(99), nullptr);
}

// Compares with derivatives that are computed with dual numbers. Only rounding errors are allowed.
TEST(GeometryTable, DerivativesInClosedFormAreThoseOfPlus) {
  const auto visit = [&]<class G>(G) {
    const Geometry geometry = Geometry::Of<G>();
    std::vector<double> x = geometry.Identity();
    static_assert(detail::kMaxTangent <= 9);
    const double turn[9] = {0.4, -0.7, 0.2, 0.5, -0.1, 0.3, -0.8, 0.6, 0.1},
                 d[9] = {-0.3, 1.1, 0.6, -0.2, 0.4, 0.9, 0.7, -0.5, 0.2};
    geometry.Plus(x.data(), turn, x.data());
    std::array<double, detail::kMaxTangent * detail::kMaxTangent> closed{}, dual{};
    PlusJacobian(geometry, x.data(), d, closed.data());
    detail::DifferentiatePlus<G>(x.data(), d, dual.data());
    for (int i = 0; i < G::kTangent * G::kTangent; ++i) {
      EXPECT_NEAR(closed[static_cast<std::size_t>(i)], dual[static_cast<std::size_t>(i)], 1e-14)
          << geometry.name() << ", element " << i;
    }
  };
  for (const GeometryRow* row : detail::kGeometryRows) VisitGeometry(row->number, visit);
}

TEST(ColumnNames, AreTheBlockOrBlockAndElement) {
  Space space;
  space.elements = {""};
  EXPECT_EQ(ColumnNames("target.depth", space), std::vector<std::string>{"target.depth"});
  space.elements = {"x", "y"};
  const std::vector<std::string> expected{"cam.position.x", "cam.position.y"};
  EXPECT_EQ(ColumnNames("cam.position", space), expected);
}

}  // namespace
}  // namespace alidade
