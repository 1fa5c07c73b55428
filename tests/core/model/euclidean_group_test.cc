// SPDX-License-Identifier: Apache-2.0
#include "alidade/model/euclidean_group.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "alidade/model/jet.h"

namespace alidade {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Tolerance of the rounding errors of a series of 40 products of matrices with elements up to 5.
constexpr double kTolerance = 1e-13;

Matrix3d Cross(const Vector3d& a) {
  return Matrix3d{{0.0, -a[2], a[1]}, {a[2], 0.0, -a[0]}, {-a[1], a[0], 0.0}};
}

/// Returns the sum of m^k / (k + first)!, which converges for every m.
MatrixXd Series(const MatrixXd& m, int first) {
  MatrixXd term = MatrixXd::Identity(m.rows(), m.cols()), sum = term;
  for (int k = 1; k <= 60; ++k) {
    term = term * m / (k + first);
    sum += term;
  }
  return sum;
}

/// Matrices of a group, written down from its definition: the tangent vector as an element of the
/// Lie algebra, an element as a matrix, and ad_xi.
template <class Group>
struct Matrices;

template <>
struct Matrices<Se2> {
  static MatrixXd Algebra(const double* xi) {
    return Matrix3d{{0.0, -xi[2], xi[0]}, {xi[2], 0.0, xi[1]}, {0.0, 0.0, 0.0}};
  }
  static MatrixXd Element(const double* x) {
    const double c = std::cos(x[2]), s = std::sin(x[2]);
    return Matrix3d{{c, -s, x[0]}, {s, c, x[1]}, {0.0, 0.0, 1.0}};
  }
  static MatrixXd SmallAdjoint(const double* xi) {
    return Matrix3d{{0.0, -xi[2], xi[1]}, {xi[2], 0.0, -xi[0]}, {0.0, 0.0, 0.0}};
  }
  static double& Angle(std::vector<double>& xi) { return xi[2]; }
};

template <int kVectors>
struct Matrices<detail::SpatialGroup<kVectors>> {
  static MatrixXd Algebra(const double* xi) {
    MatrixXd m = MatrixXd::Zero(3 + kVectors, 3 + kVectors);
    m.topLeftCorner(3, 3) = Cross(Vector3d(xi + 3));
    for (int k = 0; k < kVectors; ++k) m.block(0, 3 + k, 3, 1) = Vector3d(xi + 6 * k);
    return m;
  }
  static MatrixXd Element(const double* x) {
    MatrixXd m = MatrixXd::Identity(3 + kVectors, 3 + kVectors);
    const double w = x[3];
    const Vector3d v(x + 4);
    m.topLeftCorner(3, 3) = (w * w - v.squaredNorm()) * Matrix3d::Identity() +
                            2.0 * v * v.transpose() + 2.0 * w * Cross(v);
    for (int k = 0; k < kVectors; ++k) m.block(0, 3 + k, 3, 1) = Vector3d(x + 7 * k);
    return m;
  }
  static MatrixXd SmallAdjoint(const double* xi) {
    constexpr int n = 3 + 3 * kVectors;
    MatrixXd m = MatrixXd::Zero(n, n);
    for (int i = 0; i < n; i += 3) m.block(i, i, 3, 3) = Cross(Vector3d(xi + 3));
    for (int k = 0; k < kVectors; ++k) m.block(6 * k, 3, 3, 3) = Cross(Vector3d(xi + 6 * k));
    return m;
  }
};

template <class Group>
class EuclideanGroup : public ::testing::Test {
 protected:
  using M = Matrices<Group>;
  using Values = std::vector<double>;

  /// Returns a tangent vector whose rotation has the angle `angle`.
  Values Tangent(double angle) {
    Values xi(Group::kTangent);
    for (double& element : xi) element = 3.0 * uniform_(engine_);
    const int first = Group::kTangent == 3 ? 2 : 3, last = Group::kTangent == 3 ? 3 : 6;
    double norm = 0.0;
    for (int i = first; i < last; ++i) norm = std::hypot(norm, xi[static_cast<std::size_t>(i)]);
    for (int i = first; i < last; ++i) xi[static_cast<std::size_t>(i)] *= angle / norm;
    return xi;
  }
  static Values Exp(const Values& xi) {
    Values x(Group::kAmbient);
    Group::Exp(xi.data(), x.data());
    return x;
  }
  static Values Log(const Values& x) {
    Values xi(Group::kTangent);
    Group::Log(x.data(), xi.data());
    return xi;
  }
  template <class Function>
  static MatrixXd Matrix(const Function& function, const Values& x) {
    RowMajor m(Group::kTangent, Group::kTangent);
    function(x.data(), m.data());
    return m;
  }
  static MatrixXd LeftJacobian(const Values& xi) {
    return Matrix([](const double* x, double* m) { Group::LeftJacobian(x, m); }, xi);
  }
  static MatrixXd RightJacobian(const Values& xi) {
    return Matrix([](const double* x, double* m) { Group::RightJacobian(x, m); }, xi);
  }
  static MatrixXd Adjoint(const Values& x) {
    return Matrix([](const double* y, double* m) { Group::Adjoint(y, m); }, x);
  }
  static double Distance(const MatrixXd& a, const MatrixXd& b) {
    return (a - b).cwiseAbs().maxCoeff();
  }

  std::mt19937_64 engine_{5};
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
  // Both sides of the limit between series and closed form, small angles, and half a turn.
  static constexpr double kAngles[] = {0.0,  1e-12, 1e-8, 1e-6, 1e-3,
                                       0.99, 1.01,  2.0,  3.0,  std::numbers::pi - 1e-9};
};

using Groups = ::testing::Types<Se2, Se3, Se23>;
TYPED_TEST_SUITE(EuclideanGroup, Groups);

TYPED_TEST(EuclideanGroup, ExpIsTheExponentialOfTheMatrix) {
  for (const double angle : this->kAngles) {
    const auto xi = this->Tangent(angle);
    EXPECT_LT(this->Distance(TestFixture::M::Element(this->Exp(xi).data()),
                             Series(TestFixture::M::Algebra(xi.data()), 0)),
              kTolerance)
        << angle;
  }
}

TYPED_TEST(EuclideanGroup, LogInvertsExp) {
  for (const double angle : this->kAngles) {
    const auto xi = this->Tangent(angle), back = this->Log(this->Exp(xi));
    for (std::size_t i = 0; i < xi.size(); ++i) EXPECT_NEAR(back[i], xi[i], 1e-12) << angle;
  }
}

TYPED_TEST(EuclideanGroup, ExpInvertsLogAtHalfATurn) {
  const auto x = this->Exp(this->Tangent(std::numbers::pi)), y = this->Exp(this->Log(x));
  EXPECT_LT(this->Distance(TestFixture::M::Element(x.data()), TestFixture::M::Element(y.data())),
            kTolerance);
}

TYPED_TEST(EuclideanGroup, MultipliesLikeItsMatrices) {
  const auto x = this->Exp(this->Tangent(2.0)), y = this->Exp(this->Tangent(0.7));
  std::vector<double> product(x.size()), inverse(x.size()), between(x.size());
  TypeParam::Multiply(x.data(), y.data(), product.data());
  TypeParam::Inverse(x.data(), inverse.data());
  TypeParam::Between(x.data(), y.data(), between.data());
  const MatrixXd a = TestFixture::M::Element(x.data()), b = TestFixture::M::Element(y.data());
  EXPECT_LT(this->Distance(TestFixture::M::Element(product.data()), a * b), kTolerance);
  EXPECT_LT(this->Distance(a * TestFixture::M::Element(inverse.data()),
                           MatrixXd::Identity(a.rows(), a.cols())),
            kTolerance);
  EXPECT_LT(this->Distance(a * TestFixture::M::Element(between.data()), b), kTolerance);
}

TYPED_TEST(EuclideanGroup, TheAdjointMovesATangentVectorFromOneSideToTheOther) {
  for (const double angle : this->kAngles) {
    const auto x = this->Exp(this->Tangent(angle));
    const auto xi = this->Tangent(0.5);
    const MatrixXd moved = this->Adjoint(x) * Eigen::Map<const MatrixXd>(xi.data(), xi.size(), 1);
    const MatrixXd a = TestFixture::M::Element(x.data());
    EXPECT_LT(this->Distance(a * TestFixture::M::Algebra(xi.data()),
                             TestFixture::M::Algebra(moved.data()) * a),
              kTolerance)
        << angle;
  }
}

TYPED_TEST(EuclideanGroup, TheLeftJacobianIsTheSeriesOfTheSmallAdjoint) {
  for (const double angle : this->kAngles) {
    const auto xi = this->Tangent(angle);
    EXPECT_LT(
        this->Distance(this->LeftJacobian(xi), Series(TestFixture::M::SmallAdjoint(xi.data()), 1)),
        kTolerance)
        << angle;
  }
}

TYPED_TEST(EuclideanGroup, TheAdjointOfExpIsTheQuotientOfTheJacobians) {
  for (const double angle : this->kAngles) {
    const auto xi = this->Tangent(angle);
    EXPECT_LT(this->Distance(this->LeftJacobian(xi),
                             this->Adjoint(this->Exp(xi)) * this->RightJacobian(xi)),
              kTolerance)
        << angle;
  }
}

TYPED_TEST(EuclideanGroup, TheErrorOfASideIsInvariantToProductsOnThatSide) {
  const auto x = this->Exp(this->Tangent(2.0)), y = this->Exp(this->Tangent(1.0)),
             z = this->Exp(this->Tangent(2.5));
  const auto product = [](const auto& a, const auto& b) {
    std::vector<double> c(a.size());
    TypeParam::Multiply(a.data(), b.data(), c.data());
    return c;
  };
  std::vector<double> d(TypeParam::kTangent), moved = d;
  LeftInvariant<TypeParam>::Minus(y.data(), x.data(), d.data());
  LeftInvariant<TypeParam>::Minus(product(z, y).data(), product(z, x).data(), moved.data());
  for (std::size_t i = 0; i < d.size(); ++i) EXPECT_NEAR(moved[i], d[i], kTolerance);
  RightInvariant<TypeParam>::Minus(y.data(), x.data(), d.data());
  RightInvariant<TypeParam>::Minus(product(y, z).data(), product(x, z).data(), moved.data());
  for (std::size_t i = 0; i < d.size(); ++i) EXPECT_NEAR(moved[i], d[i], kTolerance);
}

// A quarter turn while moving by pi/2 along x is an arc of radius 1.
TEST(Se2, MovesAlongAnArc) {
  const double xi[3] = {std::numbers::pi / 2.0, 0.0, std::numbers::pi / 2.0};
  double x[3];
  Se2::Exp(xi, x);
  EXPECT_NEAR(x[0], 1.0, 1e-15);
  EXPECT_NEAR(x[1], 1.0, 1e-15);
  EXPECT_NEAR(x[2], std::numbers::pi / 2.0, 1e-15);
}

TEST(Rotation, InverseJacobiansInvertTheJacobians) {
  const Vector3d axis = Vector3d(1.0, -2.0, 0.5).normalized();
  for (const double angle : {0.0, 1e-9, 1e-4, 1.0, 1.999, 2.001, 3.0, std::numbers::pi, 6.0}) {
    const Vector3d d = angle * axis;
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> j, inverse;
    Rotation::LeftJacobian(d.data(), j.data());
    Rotation::LeftJacobianInverse(d.data(), inverse.data());
    EXPECT_LT((j * inverse - Matrix3d::Identity()).cwiseAbs().maxCoeff(), kTolerance) << angle;
    EXPECT_LT((j - Series(Cross(d), 1)).cwiseAbs().maxCoeff(), kTolerance) << angle;
    Rotation::RightJacobian(d.data(), j.data());
    Rotation::RightJacobianInverse(d.data(), inverse.data());
    EXPECT_LT((j * inverse - Matrix3d::Identity()).cwiseAbs().maxCoeff(), kTolerance) << angle;
    EXPECT_LT((j - Series(Cross(-d), 1)).cwiseAbs().maxCoeff(), kTolerance) << angle;
  }
}

TEST(StumpffFunctions, HaveNoJumpAndTheirDerivatives) {
  const StumpffFunctions<double> below(std::nextafter(1.0, 0.0)), above(1.0);
  EXPECT_NEAR(below.c0, above.c0, 1e-15);
  EXPECT_NEAR(below.c3, above.c3, 1e-15);
  EXPECT_NEAR(below.c5, above.c5, 1e-15);
  // d c_n / dx = (n c_(n+2) - c_(n+1)) / 2, so dc_2/dx = -1/24 and dc_3/dx = -1/120 at 0.
  using Dual = Jet<double, 1>;
  const StumpffFunctions<Dual> zero(Dual(0.0, 0));
  EXPECT_NEAR(zero.c2.v[0], -1.0 / 24.0, 1e-16);
  EXPECT_NEAR(zero.c3.v[0], -1.0 / 120.0, 1e-16);
}

}  // namespace
}  // namespace alidade
