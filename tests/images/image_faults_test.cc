// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "support/program.h"

namespace alidade {
namespace {

using testing::Contains;
using testing::Outcome;

/// A camera with faults looks at a wall, and features are tracked in its images. The top left pixel
/// of image k shows the point (u, v) = shown_[k] of the wall. A point at p in image j is at p +
/// shown_[j] - shown_[k] in image k, so the true position of each feature is known.
class ImageFaults : public testing::ProgramTest {
 protected:
  static constexpr int kImages = 20, kFeatures = 40;
  static constexpr double kFalse = 0.5;  ///< error of a false track, in px; a correct track has
                                         ///< less than half of this error

  struct Seen {
    int feature;
    cv::Point2d at;
  };
  using ByImage = std::map<int, std::vector<Seen>>;

  void SetUp() override {
    ProgramTest::SetUp();
    before_ = "ulimit -t 60";  // CPU time in s; a run takes 1 s, and an endless run is killed
    Write("config.yaml", R"(alidade: 1
source: {type: image_tracks, path: images, rate_hz: 20, features: 40}
)");
    std::filesystem::create_directory(folder_ / "images");
    for (int size = 16; size <= 1024; size *= 2) {
      cv::Mat octave(size, size, CV_32F), scaled;
      cv::RNG(7).fill(octave, cv::RNG::NORMAL, 0.0, 16.0);
      cv::resize(octave, scaled, {1024, 1024}, 0.0, 0.0, cv::INTER_CUBIC);
      wall_ = wall_.empty() ? cv::Mat(scaled + 128.0) : cv::Mat(wall_ + scaled);
    }
    cv::GaussianBlur(wall_, wall_, {}, 1.5);
    for (int k = 0; k < kImages; ++k) shown_.push_back({100.0 + 2.3 * k, 80.0 + 1.1 * k});
  }

  void WriteImages() const {
    for (std::size_t k = 0; k < shown_.size(); ++k) {
      const cv::Matx23d to_wall(1, 0, shown_[k].x, 0, 1, shown_[k].y);
      cv::Mat seen, image;
      cv::warpAffine(wall_, seen, to_wall, {320, 240}, cv::INTER_CUBIC | cv::WARP_INVERSE_MAP);
      seen.convertTo(image, CV_8U);
      cv::imwrite(ImageFile(static_cast<int>(k)), image);
    }
  }
  std::string ImageFile(int k) const {
    char name[32];
    std::snprintf(name, sizeof name, "images/%06d.png", k);
    return (folder_ / name).string();
  }
  void Blacken(int k) const { cv::imwrite(ImageFile(k), cv::Mat::zeros(240, 320, CV_8UC1)); }

  Outcome Simulate(testing::Arguments more = {}) const {
    more.insert(more.begin(), {"simulate", "config.yaml", "-o", "found", "--force"});
    return Call(more);
  }
  /// Returns the tracks that the program found in the images.
  ByImage Track(const testing::Arguments& more = {}) const {
    const Outcome outcome = Simulate(more);
    EXPECT_EQ(outcome.signal, 0);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    ByImage found;
    std::istringstream rows(Read("found/tracks.csv"));
    std::string row;
    std::getline(rows, row);
    while (std::getline(rows, row)) {
      int image = 0, feature = 0, dim = 0;
      double value = 0.0;
      EXPECT_EQ(std::sscanf(row.c_str(), "%d,%d,%d,%lf", &image, &feature, &dim, &value), 4);
      std::vector<Seen>& seen = found[image];
      if (dim == 0) seen.push_back({feature, {}});
      (dim == 0 ? seen.back().at.x : seen.back().at.y) = value;
    }
    return found;
  }

  static std::set<int> IdsOf(const ByImage& found, int image) {
    std::set<int> ids;
    if (const auto at = found.find(image); at != found.end()) {
      for (const Seen& one : at->second) ids.insert(one.feature);
    }
    return ids;
  }
  static std::size_t Shared(const ByImage& found, int a, int b) {
    const std::set<int> before = IdsOf(found, a), after = IdsOf(found, b);
    return static_cast<std::size_t>(
        std::ranges::count_if(after, [&](int id) { return before.contains(id); }));
  }

  /// Checks three properties of each feature: it remains at its point of the wall, it has at most
  /// one measurement in an image, and it does not return after it has ended.
  void ExpectTrue(const ByImage& found) const {
    struct Life {
      cv::Point2d on_wall;
      int last;
    };
    std::map<int, Life> lives;
    for (const auto& [image, features] : found) {
      const cv::Point2d shown = shown_.at(static_cast<std::size_t>(image));
      for (const Seen& one : features) {
        const auto [life, is_new] = lives.try_emplace(one.feature, Life{one.at + shown, image});
        if (is_new) continue;
        EXPECT_EQ(life->second.last, image - 1) << "feature " << one.feature << " of image "
                                                << image << " had ended before, or occurs twice";
        EXPECT_LT(cv::norm(one.at + shown - life->second.on_wall), kFalse)
            << "feature " << one.feature << " of image " << image;
        life->second.last = image;
      }
    }
  }

  cv::Mat wall_;
  std::vector<cv::Point2d> shown_;  ///< top left pixel of each image, in px of the wall
};

TEST_F(ImageFaults, WithoutAnyFeaturesLive) {
  WriteImages();
  const ByImage found = Track();
  ASSERT_EQ(found.size(), 20u);
  ExpectTrue(found);
  // The wall moves by 2.6 px from image to image, so some features leave the image.
  EXPECT_GT(Shared(found, 0, 10), 20u);
  for (const auto& [image, features] : found) EXPECT_GT(features.size(), 35u) << image;
}

TEST_F(ImageFaults, BlackImagesEndAllFeatures) {
  WriteImages();
  for (const int k : {0, 8, 9, 10}) Blacken(k);
  const ByImage found = Track();
  ExpectTrue(found);
  for (const int k : {0, 8, 9, 10}) EXPECT_FALSE(found.contains(k)) << k;
  EXPECT_EQ(Shared(found, 7, 11), 0u);
  // In the first image after the cut, new features are found in the whole image. Later images track
  // these features.
  for (const int k : {1, 11}) EXPECT_GT(IdsOf(found, k).size(), 35u) << k;
  EXPECT_GT(Shared(found, 11, 12), 35u);
}

TEST_F(ImageFaults, AFrozenImageMovesNothing) {
  for (int k = 9; k < 12; ++k) shown_[static_cast<std::size_t>(k)] = shown_[8];
  WriteImages();
  const ByImage found = Track();
  ExpectTrue(found);
  for (int k = 9; k < 12; ++k) {
    EXPECT_EQ(Shared(found, 8, k), IdsOf(found, 8).size()) << k;
    for (const Seen& one : found.at(k)) {
      for (const Seen& before : found.at(8)) {
        if (one.feature != before.feature) continue;
        EXPECT_LT(cv::norm(one.at - before.at), 0.02) << one.feature << " of image " << k;
      }
    }
  }
  // The wall moves by 10 px during the frozen images. The tracks continue across this motion.
  EXPECT_GT(Shared(found, 11, 12), 30u);
}

TEST_F(ImageFaults, DuplicatedImagesAreFollowedBackAndForth) {
  shown_[6] = shown_[5];  // images 5 and 7 are each sent twice
  shown_[8] = shown_[7];
  shown_[11] = shown_[9];  // images 9 and 10 are sent twice as a pair
  shown_[12] = shown_[10];
  WriteImages();
  const ByImage found = Track();
  ASSERT_EQ(found.size(), 20u);
  ExpectTrue(found);
  for (int k = 5; k < 13; ++k) EXPECT_GT(Shared(found, k, k + 1), 30u) << k;
}

// One image file is missing. The timestamps of the remaining images show the gap.
TEST_F(ImageFaults, ADroppedImageIsAGapInTime) {
  WriteImages();
  for (const int k : {9, 14, 15}) {
    std::filesystem::remove(ImageFile(k));
  }
  std::string rows = "frame,t_s\n";
  int frame = 0;
  std::vector<cv::Point2d> left;
  for (int k = 0; k < kImages; ++k) {
    if (k == 9 || k == 14 || k == 15) continue;
    char row[64];
    std::snprintf(row, sizeof row, "%d,%.9f\n", frame++, 0.05 * k);
    rows += row;
    left.push_back(shown_[static_cast<std::size_t>(k)]);
  }
  shown_ = left;
  Write("images/timestamps.csv", rows);
  const ByImage found = Track({"--set", "source.rate_hz=0"});
  ASSERT_EQ(found.size(), 17u);
  EXPECT_EQ(Read("found/timestamps.csv"), rows);
  ExpectTrue(found);
  EXPECT_GT(Shared(found, 8, 9), 30u);
  EXPECT_GT(Shared(found, 12, 13), 30u);
}

// The row numbers count the missing image, so they do not determine the timestamps of the images.
TEST_F(ImageFaults, AnImageWithoutATimeEndsTheRun) {
  WriteImages();
  std::filesystem::remove(ImageFile(9));
  std::string rows = "frame,t_s\n";
  for (int k = 0; k < kImages; ++k) {
    if (k != 9) rows += std::to_string(k) + "," + std::to_string(0.05 * k) + "\n";
  }
  Write("images/timestamps.csv", rows);
  const Outcome outcome = Simulate({"--set", "source.rate_hz=0"});
  EXPECT_EQ(outcome.code, 65) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "there is no time for image 9")) << outcome.err;
}

// The image jumps by half its size and back. No feature is tracked across the jump, and no two
// features are confused.
TEST_F(ImageFaults, AJumpEndsFeaturesThatItTakesTooFar) {
  for (int k = 8; k < 14; ++k) shown_[static_cast<std::size_t>(k)] += cv::Point2d(170.0, 130.0);
  WriteImages();
  const ByImage found = Track();
  ASSERT_EQ(found.size(), 20u);
  ExpectTrue(found);
  for (const int k : {8, 14}) {
    EXPECT_LT(Shared(found, k - 1, k), 3u) << k;
    EXPECT_GT(IdsOf(found, k).size(), 30u) << k;
    EXPECT_GT(Shared(found, k, k + 1), 30u) << k;
  }
}

}  // namespace
}  // namespace alidade
