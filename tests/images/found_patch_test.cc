// SPDX-License-Identifier: Apache-2.0
#include "plugins/tracks/images/found_patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace alidade {
namespace {

constexpr int kSide = 21;
const cv::Point2f kMiddle(40.0F, 40.0F);

/// A sum of waves of 6 to 30 px, moved by `shift`, px; grey, not rounded.
cv::Mat Texture(cv::Point2f shift) {
  cv::Mat grey(80, 80, CV_32F, cv::Scalar(128.0));
  cv::RNG random(11);
  for (int wave = 0; wave < 40; ++wave) {
    const double direction = random.uniform(0.0, CV_PI), phase = random.uniform(0.0, 2.0 * CV_PI);
    const double per_px = 2.0 * CV_PI / random.uniform(6.0, 30.0);
    const cv::Point2d per(per_px * std::cos(direction), per_px * std::sin(direction));
    for (int y = 0; y < grey.rows; ++y) {
      for (int x = 0; x < grey.cols; ++x) {
        const double angle = per.dot(cv::Point2d(x, y) - cv::Point2d(shift)) + phase;
        grey.at<float>(y, x) += static_cast<float>(8.0 * std::sin(angle));
      }
    }
  }
  return grey;
}

cv::Mat Rounded(const cv::Mat& grey) {
  cv::Mat image;
  grey.convertTo(image, CV_8U);
  return image;
}

TEST(FoundPatch, ItsCovarianceIsThatOfThePlacesThatItFinds) {
  const cv::Mat texture = Texture({0.3F, -0.4F});
  const FoundPatch found(Rounded(Texture({})), kMiddle, kSide);
  cv::RNG random(3);
  Eigen::Matrix2f of_places = Eigen::Matrix2f::Zero(), told = Eigen::Matrix2f::Zero();
  constexpr int kDraws = 400;
  for (int i = 0; i < kDraws; ++i) {
    cv::Mat noise(texture.size(), CV_32F);
    random.fill(noise, cv::RNG::NORMAL, 0.0, 6.0);
    FoundPatch patch = found;
    cv::Point2f at = kMiddle;
    ASSERT_TRUE(patch.Align(Rounded(texture + noise), 0.0F, at));
    const Eigen::Vector2f off(at.x - kMiddle.x - 0.3F, at.y - kMiddle.y + 0.4F);
    of_places += off * off.transpose() / kDraws;
    told += patch.Covariance() / kDraws;
  }
  // The variance of 400 places is known to 7 %; twenty-five cells, of which six numbers are fitted,
  // tell a fifth too little.
  EXPECT_GT(of_places.trace(), 1e-4F);
  EXPECT_NEAR(told.trace() / of_places.trace(), 0.85F, 0.25F) << told << "\n\n" << of_places;
}

// An edge of depth: what is right of it goes another way.
TEST(FoundPatch, ItsCovarianceTellsOfAPatchThatMovesInParts) {
  const cv::Mat whole = Texture({0.5F, 0.0F});
  cv::Mat parted = whole.clone();
  Texture({2.0F, 0.0F}).colRange(41, 80).copyTo(parted.colRange(41, 80));
  const auto sigma_of = [&](const cv::Mat& grey) {
    FoundPatch patch(Rounded(Texture({})), kMiddle, kSide);
    cv::Point2f at = kMiddle;
    EXPECT_TRUE(patch.Align(Rounded(grey), 0.7F, at));
    return std::sqrt(patch.Covariance().trace());
  };
  EXPECT_LT(sigma_of(whole), 0.02F);
  EXPECT_GT(sigma_of(parted), 4.0F * sigma_of(whole));
}

}  // namespace
}  // namespace alidade
