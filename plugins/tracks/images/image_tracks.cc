// SPDX-License-Identifier: Apache-2.0
#include "image_tracks.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/core/utils/logger.hpp>
#include <optional>
#include <string>
#include <vector>

#include "alidade/io/number_rows.h"
#include "feature_tracker.h"
#include "plugins/common/calibration_file.h"
#include "plugins/common/companion_files.h"
#include "plugins/common/images/camera_size.h"
#include "plugins/common/images/grey_image.h"
#include "plugins/common/images/image_reader.h"
#include "plugins/common/images/image_times.h"
#include "plugins/common/images/start_frame.h"

namespace alidade {
namespace {

class ImageTracks : public Source {
 public:
  explicit ImageTracks(const SourceArguments& arguments)
      : tracker_(TrackerOptions(arguments.params)), start_(arguments.params, arguments.entry) {
    Params& p = arguments.params;
    rate_hz_ = p.Number("rate_hz", "Hz",
                        "images a second, where there is no table of times; 0: there is, or the "
                        "video says",
                        {0.0, 1e6}, 0.0);
    most_ = p.Integer("max_frames", "images at most; 0: all", 0, 1 << 30, 0);
    tolerance_ = TimestampFromSeconds(
        p.Number("truth_tolerance_s", "s",
                 "the true pose of an image is at most so far off in time; of the layout of TUM "
                 "default 5e-3",
                 {0.0, 1e3}, 1e-3));
    estimate_noise_ =
        p.Flag("estimate_noise",
               "each measurement brings its covariance; false: that of the sensors", false);
    systematic_px_ = p.Positive(
        "sigma_systematic_px", "px",
        "with estimate_noise: what no residual tells, of each coordinate, 1 sigma", 0.15);
    for (const char* key : {"path", "images", "known", "guide", "state_entry"}) {
      arguments.entry.Declare(key);
    }
    const auto text = [&](const char* key, const char* fallback) {
      const auto node = arguments.entry.Find(key);
      return node ? node->Text() : fallback;
    };
    Open(arguments.entry.At("path", "images"), text("images", ""), arguments.folder);
    start_.Check(*images_);
    times_->Check(*images_, start_.number(), most_);
    if (is_tum_ && !arguments.entry.Find("truth_tolerance_s")) tolerance_ = kTumTolerance;
    if (const auto known = arguments.entry.Find("known")) {
      ReadKnown(arguments.folder / known->Text(), *known);
    }
    guided_by_ = text("guide", "none");
    if (guided_by_ == "none") guided_by_.clear();
    const std::string state = text("state_entry", "cam");
    if (truth_) truths_ = {{state + ".position", 3}, {state + ".orientation", 4}};
    camera_ = CameraSize(arguments, *this);
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  Place place() const override { return images_->place(); }
  std::int64_t size() const override {
    if (images_->size() <= 0) return most_ > 0 ? most_ : -1;  // a camera, or a video that is silent
    const std::int64_t remaining = start_.Remaining(images_->size());
    return most_ > 0 ? std::min(most_, remaining) : remaining;
  }
  bool measures_images() const override { return true; }
  MeasuredImage LastImage() const override { return {ToGreyImage(image_)}; }
  std::optional<Config> Calibration() const override {
    if (!calibration_) return std::nullopt;
    return ReadCalibrationFile(*calibration_);
  }

  std::string guide_name() const override { return guided_by_; }
  void SetGuide(const Guide* guide) override { guide_ = guide; }

  bool Next(SourceFrame& frame) override {
    if (frames_ == most_ && most_ > 0) return false;
    do {
      if (!images_->Next(image_)) {
        start_.Check(images_->number() + 1);
        times_->End(images_->number() + 1);
        return false;
      }
    } while (images_->number() < start_.number());
    if (frames_ == 0) CheckSize();
    frame.timestamp = times_->At(images_->number(), images_->name(images_->number()));
    frame.measurements.clear();
    if (frames_ == 0 && !known_.empty()) GiveKnown();
    for (const FeatureTracker::Feature& feature :
         tracker_.Track(image_, ExpectedAt(frame.timestamp))) {
      const bool known = frames_ == 0 && feature.id < std::ssize(known_);
      Measurement& one = frame.measurements.emplace_back();
      one.timestamp = frame.timestamp;
      one.stream = known ? 1 : 0;
      one.landmark = feature.id;
      one.values = {feature.at.x, feature.at.y};
      if (known) one.values.push_back(known_[static_cast<std::size_t>(feature.id)].depth_m);
      if (estimate_noise_ && !known) one.covariance = CovarianceOf(feature);
    }
    frame.truth.assign(truths_.size(), {});
    if (truth_) {
      if (const auto pose = truth_->At(frame.timestamp, tolerance_)) {
        frame.truth = {{pose->position.begin(), pose->position.end()},
                       {pose->orientation.begin(), pose->orientation.end()}};
      }
    }
    ++frames_;
    return true;
  }

 private:
  /// Of TUM's poses, 100 a second: half of what is between two.
  static constexpr Timestamp kTumTolerance = 5'000'000;

  /// The first image is as large as the camera, and has room for a feature.
  void CheckSize() const {
    camera_.Check(image_.size(), place());
    const int least = 2 * tracker_.margin() + 1;
    if (std::min(image_.cols, image_.rows) >= least) return;
    throw Error(ExitCode::kBadData,
                ErrorLine(place(), {},
                          SizeText(image_.size()) + ", smaller than the patch that is followed, " +
                              std::to_string(tracker_.window_px()) + " px, and its rim",
                          std::to_string(least) + " px or more, or a smaller source.window_px"));
  }

  /// Where the filter that guides expects each feature.
  FeatureTracker::Expectations ExpectedAt(Timestamp timestamp) const {
    if (guide_ == nullptr) return {};
    std::vector<std::int64_t> ids;
    for (const FeatureTracker::Feature& feature : tracker_.features()) ids.push_back(feature.id);
    FeatureTracker::Expectations expectations;
    for (const ExpectedMeasurement& one : guide_->Expect(0, timestamp, ids)) {
      std::optional<ExpectedPoint>& point = expectations.emplace_back();
      if (one.z.size() != 2) continue;
      point = {cv::Point2f(cv::Point2d(one.z[0], one.z[1])),
               cv::Matx22d(one.s[0], one.s[1], one.s[2], one.s[3])};
    }
    return expectations;
  }

  /// R, row-major.
  std::vector<double> CovarianceOf(const FeatureTracker::Feature& feature) const {
    const double own = systematic_px_ * systematic_px_;
    const Eigen::Matrix2d c = feature.found.Covariance().cast<double>();
    const double cross = 0.5 * (c(0, 1) + c(1, 0));  // rounded each for itself
    return {c(0, 0) + own, cross, cross, c(1, 1) + own};
  }

  struct Known {
    cv::Point2f at;
    double depth_m;
    int line;
  };

  /// `u,v,depth_m` of each point; a header may stand first.
  void ReadKnown(const std::filesystem::path& file, const Node& key) {
    NumberRows rows(file, key.place(), key.path());
    known_file_ = rows.name();
    while (rows.Next()) {
      if (rows.line() == 1 && rows.text(0) == "u") continue;
      rows.ExpectColumns(3, "u,v,depth_m");
      const auto u = static_cast<float>(rows.Number(0, "u"));
      const auto v = static_cast<float>(rows.Number(1, "v"));
      const double depth_m = rows.Number(2, "depth_m");
      if (!(depth_m > 0.0)) rows.FailCell(2, "depth_m", "is not positive", "m, > 0");
      known_.push_back({{u, v}, depth_m, rows.line()});
    }
    if (known_.empty()) rows.FailLine("no rows", "u,v,depth_m of a point in the first image");
    streams_.push_back({"known", 3});
  }

  void GiveKnown() {
    const auto margin = static_cast<float>(tracker_.margin());
    const cv::Rect2f inside(margin, margin, static_cast<float>(image_.cols) - 2.0F * margin,
                            static_cast<float>(image_.rows) - 2.0F * margin);
    std::vector<cv::Point2f> points;
    for (const Known& one : known_) {
      if (!inside.contains(one.at)) {
        throw Error(ExitCode::kBadData, ErrorLine({known_file_, one.line}, {},
                                                  "the point is not on the image, or less "
                                                  "than half of window_px from its rim",
                                                  "points inside of the first image"));
      }
      points.push_back(one.at);
    }
    tracker_.Add(points);
  }

  void Open(const Node& key, const std::string& names, const std::filesystem::path& folder) {
    if (key.Text().empty()) {
      key.Fail("no path", "a folder of images, a video, or a camera, as /dev/video0");
    }
    const std::filesystem::path path = folder / key.Text();
    images_.emplace(path, names, key);
    const std::filesystem::path home = images_->is_video() ? path.parent_path() : path;
    // Of the layouts: beside the folder of images.
    std::error_code ignored;
    const std::filesystem::path above =
        images_->is_video() ? home : std::filesystem::weakly_canonical(home, ignored).parent_path();
    const auto first_of = [&](std::initializer_list<std::filesystem::path> files)
        -> std::optional<std::filesystem::path> {
      for (const std::filesystem::path& file : files) {
        if (std::filesystem::exists(file, ignored)) return file;
      }
      return std::nullopt;
    };
    if (rate_hz_ == 0.0 && !images_->is_live()) {
      times_ = ImageTimes::FindNextTo(home, /*by_layout=*/!images_->is_video(), key);
      if (!times_) rate_hz_ = images_->rate_hz();
      if (!times_ && !(rate_hz_ > 0.0)) {
        key.Fail("no timestamps.csv next to the images",
                 "that file, a table of EuRoC, TUM or KITTI beside the folder, or 'rate_hz'");
      }
    }
    if (!times_) times_ = rate_hz_ > 0.0 ? ImageTimes(rate_hz_) : ImageTimes();
    if (images_->is_live()) return;
    calibration_ = first_of({home / "calibration.yaml", above / "sensor.yaml"});
    const auto truth =
        first_of({home / "groundtruth.tum", home / "truth.tum", above / "groundtruth.txt"});
    if (truth) truth_.emplace(*truth, key.place(), key.path());
    is_tum_ = truth && truth->filename() == "groundtruth.txt";
  }

  FeatureTracker tracker_;
  StartFrame start_;
  CameraSize camera_;
  double rate_hz_ = 0.0, systematic_px_ = 0.0;
  bool estimate_noise_ = false, is_tum_ = false;
  std::int64_t most_ = 0, frames_ = 0;
  Timestamp tolerance_ = 0;
  std::vector<StreamInfo> streams_ = {{"tracks", 2}}, truths_;
  std::vector<Known> known_;
  std::string known_file_, guided_by_;
  const Guide* guide_ = nullptr;
  std::optional<ImageReader> images_;
  std::optional<ImageTimes> times_;
  std::optional<TumRows> truth_;
  std::optional<std::filesystem::path> calibration_;
  cv::Mat image_;
};

}  // namespace

std::unique_ptr<Source> CreateImageTracks(const SourceArguments& arguments) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  return std::make_unique<ImageTracks>(arguments);
}

}  // namespace alidade
