// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/similarity.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "alidade/record/estimate_series.h"

namespace alidade {
namespace {

using Eigen::Matrix3Xd;

std::optional<internal::SimilarityFit> FromSums(const Matrix3Xd& points, const Matrix3Xd& onto) {
  internal::TrajectoryAlignment alignment;
  for (Eigen::Index k = 0; k < points.cols(); ++k) alignment.Add(points.col(k), onto.col(k));
  return alignment.Result();
}

/// Returns 12 points on a line, in a plane or in space.
Matrix3Xd Points(int dimensions) {
  Matrix3Xd points = Matrix3Xd::Zero(3, 12);
  for (int k = 0; k < 12; ++k) {
    points(0, k) = 0.3 * k;
    if (dimensions > 1) points(1, k) = std::sin(k);
    if (dimensions > 2) points(2, k) = std::cos(2.0 * k);
  }
  return points;
}

TEST(AlignBySimilarity, AndTrajectoryAlignmentAreThatOfUmeyama) {
  for (const int dimensions : {1, 2, 3}) {
    const Matrix3Xd points = Points(dimensions);
    Matrix3Xd onto = 2.0 * points;
    for (int k = 0; k < 12; ++k) {
      onto.col(k) += 0.1 * Eigen::Vector3d(std::sin(37.0 * k), std::cos(11.0 * k), 5.0);
    }
    const Eigen::Matrix4d similarity = Eigen::umeyama(points, onto);
    const Matrix3Xd left = ((similarity.topLeftCorner<3, 3>() * points).colwise() +
                            similarity.topRightCorner<3, 1>().col(0)) -
                           onto;
    const double rmse = std::sqrt(left.squaredNorm() / 12.0);
    const double scale = similarity.topLeftCorner<3, 1>().norm();
    for (const auto& found : {internal::AlignBySimilarity(points, onto), FromSums(points, onto)}) {
      ASSERT_TRUE(found) << dimensions;
      EXPECT_NEAR(found->scale, scale, 1e-9) << dimensions;
      EXPECT_NEAR(found->rmse, rmse, 1e-7) << dimensions;
    }
  }
}

TEST(AlignBySimilarity, AndTrajectoryAlignmentRefuseTheSame) {
  const auto refused = [](const Matrix3Xd& points, const Matrix3Xd& onto) {
    const bool at_once = !internal::AlignBySimilarity(points, onto);
    EXPECT_EQ(at_once, !FromSums(points, onto));
    return at_once;
  };
  const Matrix3Xd points = Points(3);
  const Matrix3Xd still = Eigen::Vector3d(0.1, 0.2, 0.3).replicate(1, 12);
  EXPECT_FALSE(refused(points, points));
  EXPECT_FALSE(refused(Points(1), Points(1)));
  EXPECT_TRUE(refused(points.leftCols(2), points.leftCols(2)));
  EXPECT_TRUE(refused(points, still));
  EXPECT_TRUE(refused(still, points));
  // The deviations of the two sets of points are uncorrelated except for rounding.
  Matrix3Xd one = still, other = still;
  for (int k = 0; k < 12; ++k) {
    one(0, k) += k % 2 == 0 ? 1.0 : -1.0;
    other(0, k) += k % 4 < 2 ? 1.0 : -1.0;
  }
  EXPECT_TRUE(refused(one, other));
}

/// Returns a trajectory of 40 points on a curve.
std::vector<Eigen::Vector3d> TurningPath() {
  std::vector<Eigen::Vector3d> path;
  for (int k = 0; k < 40; ++k) {
    const double t = 0.2 * k;
    path.emplace_back(100.0 + t, std::sin(t), std::cos(2.0 * t));
  }
  return path;
}

TEST(TrajectoryAlignment, FindsASimilarity) {
  const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, -2, 3).normalized());
  internal::TrajectoryAlignment alignment;
  for (const Eigen::Vector3d& p : TurningPath()) {
    alignment.Add(p, 2.0 * (turn * p) + Eigen::Vector3d(1.0, -2.0, 0.5));
  }
  const auto aligned = alignment.Result();
  ASSERT_TRUE(aligned);
  EXPECT_NEAR(aligned->scale, 2.0, 1e-12);
  EXPECT_LT(aligned->rmse, 1e-6);
}

// Compares with umeyama of Eigen, which needs all points at once. For a mirrored trajectory the
// sign of D matters.
TEST(TrajectoryAlignment, AgreesWithUmeyamaOnNoisyAndMirroredPaths) {
  for (const double mirror : {1.0, -1.0}) {
    const std::vector<Eigen::Vector3d> path = TurningPath();
    Eigen::Matrix3Xd points(3, 40), onto = points;
    internal::TrajectoryAlignment alignment;
    for (Eigen::Index k = 0; k < 40; ++k) {
      points.col(k) = path[static_cast<std::size_t>(k)];
      const auto t = static_cast<double>(k);
      const Eigen::Vector3d noise(std::sin(37.0 * t), std::cos(11.0 * t), std::sin(5.0 * t));
      onto.col(k) = points.col(k) + 0.1 * noise;
      onto(2, k) *= mirror;
      alignment.Add(points.col(k), onto.col(k));
    }
    const auto expected = internal::AlignBySimilarity(points, onto);
    const auto aligned = alignment.Result();
    ASSERT_TRUE(expected && aligned);
    EXPECT_NEAR(aligned->rmse, expected->rmse, 1e-9 * expected->rmse) << mirror;
    EXPECT_NEAR(aligned->scale, expected->scale, 1e-9) << mirror;
  }
}

TEST(TrajectoryAlignment, OfAPointThereIsNone) {
  internal::TrajectoryAlignment alignment;
  for (int k = 0; k < 5; ++k) alignment.Add({1, 2, 3}, {1, 2, 3});
  EXPECT_FALSE(alignment.Result());
}

}  // namespace
}  // namespace alidade
