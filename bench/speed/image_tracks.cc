// SPDX-License-Identifier: Apache-2.0
//
// Measures the CPU time per frame of monocular SLAM from images. The times are relative to that of
// cv::calcOpticalFlowPyrLK, the optical flow of OpenCV, for the same features in the same images:
//
//   bench_image_tracks examples/25_slam_images
//
// This program draws the images of the example and stores them as files. The source `image_tracks`
// reads these files for the EKF of the example, with and without guidance by this EKF. The parts of
// the source are measured by separate calls. The remaining time is that of the alignment and of the
// search for new features.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/video/tracking.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/experiment/estimator_guide.h"
#include "alidade/experiment/experiment.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/io/read_file.h"
#include "bench/speed/interleaved.h"
#include "support/temporary_folder.h"

namespace alidade::bench {
namespace {

namespace fs = std::filesystem;

std::string FileOf(const fs::path& folder, int number) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d.pgm", number);
  return (folder / name).string();
}

/// Reads an image in the same way as the source `image_tracks`.
cv::Mat ReadImage(const std::string& name) {
  const std::string bytes = internal::ReadFile(
      name, [&](ExitCode code, int) { throw Error(code, name + ": cannot be read"); });
  return cv::imdecode(
      cv::Mat(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data())),
      cv::IMREAD_GRAYSCALE);
}

/// CPU times of one part, for each frame and round.
struct Part {
  std::map<int, std::vector<double>> ns = {};

  template <class Work>
  void Measure(int frame, const Work& work) {
    const double start = CpuNs();
    work();
    ns[frame].push_back(CpuNs() - start);
  }
  /// Returns the mean over all frames of the median time over all rounds. The times of frames
  /// differ, because some frames are not searched for features.
  double Mean() const {
    double sum = 0.0;
    for (const auto& [frame, times] : ns) {
      std::vector<double> sorted = times;
      std::ranges::sort(sorted);
      sum += sorted[sorted.size() / 2];
    }
    return sum / static_cast<double>(ns.size());
  }
};

/// CPU times of a frame, and of cv::calcOpticalFlowPyrLK on the features of the previous frame.
class Times {
 public:
  /// Processes the images of a folder once, frame by frame. Measures the time of each part
  /// separately.
  void Add(const Config& config, const PluginHost& host, const fs::path& folder) {
    Experiment experiment = BuildExperiment(config, host);
    is_guided_ = experiment.guide != nullptr;
    const internal::EstimatorGuide guide(experiment);
    Estimator& filter = *experiment.estimators[0].estimator;
    SourceFrame frame;
    std::vector<cv::Point2f> points, next_points, returned;
    std::vector<std::int64_t> ids;
    std::vector<unsigned char> found;
    std::vector<float> error;
    std::vector<cv::Mat> previous_pyramid, pyramid;
    cv::Mat previous_image, image;
    Timestamp step = 0;
    const auto size = static_cast<int>(experiment.source->size());
    for (int k = 0; k < size; ++k) {
      // The first image is omitted, because it has no features to track and its search for features
      // takes longer.
      Times unused;
      Times& times = k == 0 ? unused : *this;
      times.read_.Measure(k, [&] { image = ReadImage(FileOf(folder, k)); });
      if (!points.empty()) {
        times.lk_.Measure(k, [&] {
          cv::calcOpticalFlowPyrLK(previous_image, image, points, next_points, found, error);
        });
      }
      if (!is_guided_) {
        times.pyramid_.Measure(k, [&] {
          cv::buildOpticalFlowPyramid(image, pyramid, {21, 21}, 3, false);
        });
      }
      if (!points.empty() && is_guided_) {
        times.prediction_.Measure(k, [&] { guide.Expect(0, frame.timestamp + step, ids); });
      } else if (!points.empty()) {
        times.Flow(k, previous_pyramid, pyramid, points, next_points);
      }
      const Timestamp last = frame.timestamp;
      times.next_.Measure(k, [&] { experiment.source->Next(frame); });
      step = frame.timestamp - last;
      times.filter_.Measure(k, [&] { filter.Process(frame); });
      points.clear();
      ids.clear();
      for (const Measurement& m : frame.measurements) {
        points.emplace_back(static_cast<float>(m.values[0]), static_cast<float>(m.values[1]));
        ids.push_back(m.landmark);
      }
      ++times.frames_;
      times.features_ += static_cast<double>(points.size());
      std::swap(previous_image, image);
      std::swap(previous_pyramid, pyramid);
    }
  }

  void Print() const {
    const double lk = lk_.Mean(), front_end = next_.Mean() - read_.Mean();
    const double total = front_end + filter_.Mean();
    const char* const name = is_guided_ ? "guided" : "not guided";
    std::printf("%s, %.0f features per frame\n", name, features_ / frames_);
    std::printf("%-40s %8s %8s\n", "CPU time per frame", "ms", "to LK");
    const auto line = [lk](const char* part, double ns) {
      std::printf("%-40s %8.3f %8.2f\n", part, 1e-6 * ns, ns / lk);
    };
    line("calcOpticalFlowPyrLK alone", lk);
    line("read and decode, PGM", read_.Mean());
    line("front end", front_end);
    double remaining_ns = front_end;
    const auto part = [&](const char* label, const Part& times) {
      line(label, times.Mean());
      remaining_ns -= times.Mean();
    };
    if (is_guided_) {
      part("  predictions of the filter", prediction_);
    } else {
      part("  pyramid", pyramid_);
      part("  track forward", forward_);
      part("  track backward", back_);
    }
    line("  align, check, search for new features", remaining_ns);
    line("filter", filter_.Mean());
    line("front end and filter", total);
    const std::string prefix = is_guided_ ? "guided_" : "";
    std::printf("ratio %sfront_end/lk %.3f\n", prefix.c_str(), front_end / lk);
    std::printf("ratio %sfilter/lk %.3f\n", prefix.c_str(), filter_.Mean() / lk);
    std::printf("ratio %sfront_end_and_filter/lk %.3f\n", prefix.c_str(), total / lk);
  }

 private:
  /// Measures the parts of the optical flow, which this function computes in the same way as
  /// PyramidFlow.
  void Flow(int k, const std::vector<cv::Mat>& last, const std::vector<cv::Mat>& next,
            const std::vector<cv::Point2f>& start, std::vector<cv::Point2f>& end) {
    const cv::TermCriteria stop{cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.01};
    std::vector<cv::Point2f> half, returned = start;
    std::vector<unsigned char> found;
    std::vector<float> error;
    for (const cv::Point2f& point : start) half.push_back(0.5F * point);
    end = half;
    forward_.Measure(k, [&] {
      cv::calcOpticalFlowPyrLK(std::vector(last.begin() + 1, last.end()),
                               std::vector(next.begin() + 1, next.end()), half, end, found, error,
                               {21, 21}, 2, stop, cv::OPTFLOW_USE_INITIAL_FLOW);
    });
    for (cv::Point2f& point : end) point *= 2.0F;
    back_.Measure(k, [&] {
      cv::calcOpticalFlowPyrLK(next, last, end, returned, found, error, {21, 21}, 0, stop,
                               cv::OPTFLOW_USE_INITIAL_FLOW);
    });
  }

  bool is_guided_ = false;
  Part read_, lk_, pyramid_, forward_, back_, prediction_, next_, filter_;
  double features_ = 0.0, frames_ = 0.0;
};

int Main(int argc, char** argv) {
  CLI::App app("Time per frame of SLAM from images, relative to the optical flow of OpenCV");
  std::string example;
  std::vector<std::string> settings;
  int rounds = 5;
  app.add_option("example", example, "folder examples/25_slam_images")->required();
  app.add_option("--set", settings, "setting KEY=VALUE of the config");
  app.add_option("--rounds", rounds, "number of passes over the images")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);

  const testing::TemporaryFolder temporary;
  const PluginHost host;
  const auto scene = CreateSource(host, Config::FromFile(example + "/scene.yaml"), 1);
  SourceFrame frame;
  for (int k = 0; scene->Next(frame); ++k) {
    GreyImage grey_image = scene->Draw(0);
    const cv::Mat image(grey_image.height, grey_image.width, CV_8UC1, grey_image.pixels.data());
    if (!cv::imwrite(FileOf(temporary.path(), k), image))
      throw std::runtime_error("cannot write an image of the example");
  }
  Config config = Config::FromFile(example + "/config.yaml");
  config.Set("source.path", temporary.path().string(), "bench");
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == setting.npos) throw std::runtime_error("--set expects KEY=VALUE");
    config.Set(setting.substr(0, equals), setting.substr(equals + 1), "--set");
  }
  for (const char* guide : {"ekf", "none"}) {
    config.Set("source.guide", guide, "bench");
    Times times;
    for (int round = 0; round < rounds; ++round) times.Add(config, host, temporary.path());
    times.Print();
  }
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
