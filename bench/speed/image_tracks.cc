// SPDX-License-Identifier: Apache-2.0
//
// CPU time of a frame of monocular SLAM from images, relative to the optical flow of OpenCV alone,
// cv::calcOpticalFlowPyrLK on the same features in the same images:
//
//   bench_image_tracks examples/25_slam_images
//
// The camera of the example goes past its discs, and past a textured wall that has a corner
// wherever one is looked for. Source `image_tracks` reads the images and gives its features to the
// EKF of the example, with the same number of features of either world.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>
#include <utility>
#include <vector>

#include "alidade/run/experiment.h"
#include "bench/speed/interleaved.h"
#include "support/temporary_folder.h"

namespace alidade::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 640, kHeight = 480;
constexpr double kFocalPx = 525.0;

/// White discs at the pixels, on black: as `alidade simulate --images` draws them.
cv::Mat Discs(const SourceFrame& frame) {
  constexpr int kShift = 8, kRadius = 4;  // bits behind the point; px
  cv::Mat image(kHeight, kWidth, CV_8UC1, cv::Scalar(0));
  for (const Measurement& m : frame.measurements) {
    const cv::Point centre(cvRound(m.values[0] * (1 << kShift)),
                           cvRound(m.values[1] * (1 << kShift)));
    cv::circle(image, centre, kRadius << kShift, cv::Scalar(255), cv::FILLED, cv::LINE_AA, kShift);
  }
  return image;
}

/// A wall 2.6 m in front of the first camera, 6 m wide, with structures of all sizes.
class Wall {
 public:
  Wall() : texture_(kSide, kSide, CV_32F, cv::Scalar(128.0)) {
    cv::RNG random(1);
    for (int size = 16; size <= kSide; size *= 2) {
      cv::Mat octave(size, size, CV_32F), scaled;
      random.fill(octave, cv::RNG::NORMAL, 0.0, 14.0);
      cv::resize(octave, scaled, texture_.size(), 0.0, 0.0, cv::INTER_CUBIC);
      texture_ += scaled;
    }
    cv::GaussianBlur(texture_, texture_, {}, 2.0);
  }

  /// As the camera sees it whose pose the frame has as its truth.
  cv::Mat Seen(const SourceFrame& frame) const {
    const auto& p = frame.truth[0];
    const auto& q = frame.truth[1];
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const cv::Matx33d world_from_cam(
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),  //
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y));
    const cv::Matx33d camera(kFocalPx, 0, kWidth / 2.0, 0, kFocalPx, kHeight / 2.0, 0, 0, 1);
    const double scale = kWide / kSide;
    // A pixel of the texture to a point of the wall, relative to the camera.
    const cv::Matx33d point(scale, 0, -kWide / 2.0 - p[0],  //
                            0, scale, -kWide / 2.0 - p[1],  //
                            0, 0, kAway - p[2]);
    cv::Mat seen, image;
    cv::warpPerspective(texture_, seen, camera * world_from_cam.t() * point, {kWidth, kHeight});
    seen.convertTo(image, CV_8U);
    return image;
  }

 private:
  static constexpr int kSide = 2048;
  static constexpr double kWide = 6.0, kAway = 2.6;  // m
  cv::Mat texture_;
};

std::string FileOf(const fs::path& folder, int number) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d.pgm", number);
  return (folder / name).string();
}

/// An image as source `image_tracks` reads it.
cv::Mat ReadImage(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  return cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
}

/// CPU times of one part of a frame, by frame.
struct Part {
  const char* name;
  std::vector<double> ns = {};

  template <class Work>
  void Take(const Work& work) {
    const double start = CpuNs();
    work();
    ns.push_back(CpuNs() - start);
  }
  double Median() const {
    std::vector<double> sorted = ns;
    std::ranges::sort(sorted);
    return sorted.empty() ? 0.0 : sorted[sorted.size() / 2];
  }
};

/// What a frame takes, and cv::calcOpticalFlowPyrLK on what the frame before it had.
class Times {
 public:
  /// Goes through the images of a folder once: each part in turn, frame by frame.
  void Add(const Config& config, const PluginHost& host, const fs::path& folder) {
    Experiment experiment = BuildExperiment(config, host);
    Estimator& filter = *experiment.estimators[0].estimator;
    SourceFrame frame;
    std::vector<cv::Point2f> from, to, back;
    std::vector<unsigned char> found;
    std::vector<float> error;
    std::vector<cv::Mat> pyramid_before, pyramid;
    cv::Mat before, image;
    const auto size = static_cast<int>(experiment.source->size());
    for (int k = 0; k < size; ++k) {
      // The first image has nothing to follow: it is left out.
      Times unused;
      Times& times = k == 0 ? unused : *this;
      times.read_.Take([&] { image = ReadImage(FileOf(folder, k)); });
      if (!from.empty()) {
        times.lk_.Take([&] { cv::calcOpticalFlowPyrLK(before, image, from, to, found, error); });
      }
      times.pyramid_.Take([&] { cv::buildOpticalFlowPyramid(image, pyramid, {21, 21}, 3); });
      if (!from.empty()) {
        times.forward_.Take(
            [&] { cv::calcOpticalFlowPyrLK(pyramid_before, pyramid, from, to, found, error); });
        back = from;
        times.back_.Take([&] {
          cv::calcOpticalFlowPyrLK(pyramid, pyramid_before, to, back, found, error, {21, 21}, 0,
                                   {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.01},
                                   cv::OPTFLOW_USE_INITIAL_FLOW);
        });
      }
      times.next_.Take([&] { experiment.source->Next(frame); });
      times.filter_.Take([&] { filter.Process(frame); });
      from.clear();
      for (const Measurement& m : frame.measurements) {
        from.emplace_back(static_cast<float>(m.values[0]), static_cast<float>(m.values[1]));
      }
      times.features_ += static_cast<double>(from.size());
      std::swap(before, image);
      std::swap(pyramid_before, pyramid);
    }
  }

  void Print(const std::string& world) const {
    const double lk = lk_.Median(), front_end = next_.Median() - read_.Median();
    const auto line = [lk](const char* name, double ns) {
      std::printf("%-44s %8.3f %8.2f\n", name, 1e-6 * ns, ns / lk);
    };
    std::printf("%s, %.0f features a frame\n%-44s %8s %8s\n", world.c_str(),
                features_ / static_cast<double>(next_.ns.size()), "", "ms", "to LK");
    line("calcOpticalFlowPyrLK alone", lk);
    line("read and decode (PGM)", read_.Median());
    line("  pyramid", pyramid_.Median());
    line("  follow forward", forward_.Median());
    line("  follow back", back_.Median());
    line("  checks and refill: the rest",
         front_end - pyramid_.Median() - forward_.Median() - back_.Median());
    line("front end", front_end);
    line("filter", filter_.Median());
    line("front end and filter", front_end + filter_.Median());
    std::printf("ratio front_end/lk:%s %.3f\n", world.c_str(), front_end / lk);
    std::printf("ratio front_end_and_filter/lk:%s %.3f\n", world.c_str(),
                (front_end + filter_.Median()) / lk);
  }

 private:
  Part read_{"read"}, lk_{"lk"}, pyramid_{"pyramid"}, forward_{"forward"}, back_{"back"},
      next_{"next"}, filter_{"filter"};
  double features_ = 0.0;
};

int Main(int argc, char** argv) {
  CLI::App app("A frame of SLAM from images, relative to the optical flow of OpenCV alone");
  std::string example;
  int rounds = 3;
  app.add_option("example", example, "the folder examples/25_slam_images")->required();
  app.add_option("--rounds", rounds, "times through the images")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);

  const testing::TemporaryFolder temporary;
  const PluginHost host;
  const auto scene = host.CreateSource(Config::FromFile(example + "/scene.yaml"), 1);
  for (const char* world : {"discs", "wall"}) fs::create_directory(temporary / world);
  const Wall wall;
  SourceFrame frame;
  for (int k = 0; scene->Next(frame); ++k) {
    cv::imwrite(FileOf(temporary / "discs", k), Discs(frame));
    cv::imwrite(FileOf(temporary / "wall", k), wall.Seen(frame));
  }
  std::vector<std::pair<std::string, Times>> worlds = {{"discs", {}}, {"wall", {}}};
  for (int round = 0; round < rounds; ++round) {
    for (auto& [world, times] : worlds) {
      Config config = Config::FromFile(example + "/config.yaml");
      config.Set("source.path", (temporary / world).string(), "bench");
      if (world == "wall") {  // corners as they are, not the middles of discs
        config.Set("source.corner_px", "5", "bench");
        config.Set("source.quality", "0.01", "bench");
      }
      times.Add(config, host, temporary / world);
    }
  }
  for (const auto& [world, times] : worlds) times.Print(world);
  return 0;
}

}  // namespace
}  // namespace alidade::bench

int main(int argc, char** argv) try {
  return alidade::bench::Main(argc, argv);
} catch (const std::exception& e) {
  std::cerr << "error: " << e.what() << '\n';
  return 1;
}
