// SPDX-License-Identifier: Apache-2.0
#include "image_tracks.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/core/utils/logger.hpp>
#include <optional>
#include <string>
#include <vector>

#include "alidade/experiment/calibration_file.h"
#include "alidade/io/number_rows.h"
#include "feature_tracker.h"
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
    rate_hz_ =
        p.Number("rate_hz", "Hz",
                 "images per second; 0: the times are read from a table next to the images, or "
                 "from the video",
                 {0.0, 1e6}, 0.0);
    max_frames_ = p.Integer("max_frames", "maximum number of images; 0: all", 0, 1 << 30, 0);
    tolerance_ = TimestampFromSeconds(
        p.Number("truth_tolerance_s", "s",
                 "maximum time from an image to its true pose; default for the layout of TUM: "
                 "5e-3",
                 {0.0, 1e3}, 1e-3));
    estimate_noise_ =
        p.Flag("estimate_noise",
               "true: each measurement has its own covariance; false: that of the sensor", false);
    systematic_px_ = p.Positive("sigma_systematic_px", "px",
                                "systematic error of a coordinate, which the residuals do not "
                                "contain, 1 sigma; used if estimate_noise is true",
                                0.15);
    for (const char* key : {"path", "images", "known", "guide", "state_entry"}) {
      arguments.entry.Declare(key);
    }
    const auto text = [&](const char* key, const char* fallback) {
      const auto node = arguments.entry.Find(key);
      return node ? node->Text() : fallback;
    };
    Open(arguments.entry.At("path", "images"), text("images", ""), arguments.folder);
    start_.Check(*images_);
    times_->Check(*images_, start_.number(), max_frames_);
    if (is_tum_ && !arguments.entry.Find("truth_tolerance_s")) tolerance_ = kTumTolerance;
    if (const auto known = arguments.entry.Find("known")) {
      ReadKnown(arguments.folder / known->Text(), *known);
    }
    if (estimate_noise_) streams_[0].covariance = 2;
    guide_name_ = text("guide", "none");
    if (guide_name_ == "none") guide_name_.clear();
    const std::string state = text("state_entry", "cam");
    if (truth_) truths_ = {{state + ".position", 3}, {state + ".orientation", 4}};
    camera_ = CameraSize(arguments, *this);
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  Place place() const override { return images_->place(); }
  std::int64_t size() const override {
    if (images_->size() <= 0)
      return max_frames_ > 0 ? max_frames_ : -1;  // -1: the number of images is unknown
    const std::int64_t remaining = start_.Remaining(images_->size());
    return max_frames_ > 0 ? std::min(max_frames_, remaining) : remaining;
  }
  bool measures_images() const override { return true; }
  MeasuredImage LastImage() const override { return {ToGreyImage(image_)}; }
  std::optional<Config> Calibration() const override {
    if (!calibration_) return std::nullopt;
    return ReadCalibrationFile(*calibration_);
  }

  std::string guide_name() const override { return guide_name_; }
  void SetGuide(const Guide* guide) override { guide_ = guide; }

  bool Next(SourceFrame& frame) override {
    if (frames_ == max_frames_ && max_frames_ > 0) return false;
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
    if (frames_ == 0 && !known_.empty()) AddKnownPoints();
    for (const FeatureTracker::Feature& feature :
         tracker_.Track(image_, ExpectedAt(frame.timestamp))) {
      const bool known = frames_ == 0 && feature.id < std::ssize(known_);
      Measurement& measurement = frame.measurements.emplace_back();
      measurement.timestamp = frame.timestamp;
      measurement.stream = known ? 1 : 0;
      measurement.landmark = feature.id;
      measurement.values = {feature.position.x, feature.position.y};
      if (known) measurement.values.push_back(known_[static_cast<std::size_t>(feature.id)].depth_m);
      if (estimate_noise_ && !known) measurement.covariance = CovarianceOf(feature);
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
  /// Half the interval between two poses of the TUM data sets, which have 100 poses per second.
  static constexpr Timestamp kTumTolerance = 5'000'000;

  /// Checks that the first image has the size that the camera requires, and is large enough for a
  /// feature.
  void CheckSize() const {
    camera_.Check(image_.size(), place());
    const int min_side = 2 * tracker_.margin() + 1;
    if (std::min(image_.cols, image_.rows) >= min_side) return;
    throw Error(ExitCode::kBadData,
                ErrorLine(place(), {},
                          "the image is " + SizeText(image_.size()) + ", but a tracked patch of " +
                              std::to_string(tracker_.window_px()) + " px with its rim is larger",
                          "at least " + std::to_string(min_side) +
                              " px on each side, or a smaller source.window_px"));
  }

  /// Returns the positions at which the filter `guide` expects the features.
  FeatureTracker::Expectations ExpectedAt(Timestamp timestamp) const {
    if (guide_ == nullptr) return {};
    std::vector<std::int64_t> ids;
    for (const FeatureTracker::Feature& feature : tracker_.features()) ids.push_back(feature.id);
    FeatureTracker::Expectations expectations;
    for (const ExpectedMeasurement& expected : guide_->Expect(0, timestamp, ids)) {
      std::optional<ExpectedPoint>& point = expectations.emplace_back();
      if (expected.z.size() != 2) continue;
      point = {cv::Point2f(cv::Point2d(expected.z[0], expected.z[1])),
               cv::Matx22d(expected.s[0], expected.s[1], expected.s[2], expected.s[3])};
    }
    return expectations;
  }

  /// Returns the covariance R of a measurement, row-major.
  std::vector<double> CovarianceOf(const FeatureTracker::Feature& feature) const {
    const double systematic = systematic_px_ * systematic_px_;
    const Eigen::Matrix2d c = feature.patch.Covariance().cast<double>();
    const double cross = 0.5 * (c(0, 1) + c(1, 0));  // c(0, 1) and c(1, 0) differ by rounding
    return {c(0, 0) + systematic, cross, cross, c(1, 1) + systematic};
  }

  struct Known {
    cv::Point2f position;
    double depth_m;
    int line;
  };

  /// Reads the table of known points, `u,v,depth_m`. A header is optional.
  void ReadKnown(const std::filesystem::path& file, const Node& key) {
    NumberRows rows(file, key.place(), key.path());
    known_file_ = rows.name();
    while (rows.Next()) {
      if (rows.line() == 1 && rows.text(0) == "u") continue;
      rows.ExpectColumns(3, "u,v,depth_m");
      const auto u = static_cast<float>(rows.Number(0, "u"));
      const auto v = static_cast<float>(rows.Number(1, "v"));
      const double depth_m = rows.Number(2, "depth_m");
      if (!(depth_m > 0.0)) rows.FailCell(2, "depth_m", "is not positive", "a depth above 0 m");
      known_.push_back({{u, v}, depth_m, rows.line()});
    }
    if (known_.empty()) {
      rows.FailLine("the file contains no rows", "u,v,depth_m of a point in the first image");
    }
    streams_.push_back({"known", 3});
  }

  void AddKnownPoints() {
    const auto margin = static_cast<float>(tracker_.margin());
    const cv::Rect2f inside(margin, margin, static_cast<float>(image_.cols) - 2.0F * margin,
                            static_cast<float>(image_.rows) - 2.0F * margin);
    std::vector<cv::Point2f> points;
    for (const Known& point : known_) {
      if (!inside.contains(point.position)) {
        throw Error(ExitCode::kBadData, ErrorLine({known_file_, point.line}, {},
                                                  "the point is outside the image, or less "
                                                  "than half of window_px from its rim",
                                                  "points inside the first image"));
      }
      points.push_back(point.position);
    }
    tracker_.Add(points);
  }

  void Open(const Node& key, const std::string& names, const std::filesystem::path& folder) {
    if (key.Text().empty()) {
      key.Fail("the path is empty", "a folder of images, a video, or a camera such as /dev/video0");
    }
    const std::filesystem::path path = folder / key.Text();
    images_.emplace(path, names, key);
    const std::filesystem::path image_folder = images_->is_video() ? path.parent_path() : path;
    // In the layouts of EuRoC and TUM, the calibration and the truth are in the parent of the
    // folder of images.
    std::error_code ignored;
    const std::filesystem::path parent_folder =
        images_->is_video()
            ? image_folder
            : std::filesystem::weakly_canonical(image_folder, ignored).parent_path();
    const auto first_of = [&](std::initializer_list<std::filesystem::path> files)
        -> std::optional<std::filesystem::path> {
      for (const std::filesystem::path& file : files) {
        if (std::filesystem::exists(file, ignored)) return file;
      }
      return std::nullopt;
    };
    if (rate_hz_ == 0.0 && !images_->is_live()) {
      times_ = ImageTimes::FindNextTo(image_folder, /*by_layout=*/!images_->is_video(), key);
      if (!times_) rate_hz_ = images_->rate_hz();
      if (!times_ && !(rate_hz_ > 0.0)) {
        key.Fail("there is no timestamps.csv next to the images",
                 "this file, a table of EuRoC, TUM or KITTI next to the folder, or 'rate_hz'");
      }
    }
    if (!times_) times_ = rate_hz_ > 0.0 ? ImageTimes(rate_hz_) : ImageTimes();
    if (images_->is_live()) return;
    calibration_ = first_of({image_folder / "calibration.yaml", parent_folder / "sensor.yaml"});
    const auto truth = first_of({image_folder / "groundtruth.tum", image_folder / "truth.tum",
                                 parent_folder / "groundtruth.txt"});
    if (truth) truth_.emplace(*truth, key.place(), key.path());
    is_tum_ = truth && truth->filename() == "groundtruth.txt";
  }

  FeatureTracker tracker_;
  StartFrame start_;
  CameraSize camera_;
  double rate_hz_ = 0.0, systematic_px_ = 0.0;
  bool estimate_noise_ = false, is_tum_ = false;
  std::int64_t max_frames_ = 0, frames_ = 0;
  Timestamp tolerance_ = 0;
  std::vector<StreamInfo> streams_ = {{"tracks", 2}}, truths_;
  std::vector<Known> known_;
  std::string known_file_, guide_name_;
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
