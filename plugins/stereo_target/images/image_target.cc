// SPDX-License-Identifier: Apache-2.0
#include "image_target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <opencv2/core/utils/logger.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/model/camera.h"
#include "disparity.h"
#include "plugins/common/companion_files.h"
#include "plugins/common/images/camera_size.h"
#include "plugins/common/images/grey_image.h"
#include "plugins/common/images/image_reader.h"
#include "plugins/common/images/image_times.h"
#include "plugins/common/images/start_frame.h"
#include "rectification.h"
#include "target_tables.h"
#include "target_tracker.h"

namespace alidade {
namespace {

class ImageTarget : public Source {
 public:
  explicit ImageTarget(const SourceArguments& arguments)
      : options_(arguments.params),
        disparity_options_(arguments.params),
        start_(arguments.params, arguments.entry) {
    Params& p = arguments.params;
    const Node& entry = arguments.entry;
    rate_hz_ =
        p.Number("rate_hz", "Hz", "images per second; 0: defined by `timestamps` or the video",
                 {0.0, 1e6}, 0.0);
    max_frames_ = p.Integer("max_frames", "maximum number of images; 0: all", 0, 1 << 30, 0);
    tolerance_ = TimestampFromSeconds(p.Number(
        "truth_tolerance_s", "s", "maximum time from an image to a true value", {0.0, 1e3}, 1e-3));
    sigma_systematic_px_ =
        p.NonNegative("sigma_systematic_px", "px",
                      "systematic error of the disparity and of an edge of the target, which "
                      "the residuals do not contain, 1 sigma",
                      0.1);
    estimate_noise_ =
        p.Flag("estimate_noise",
               "true: each measurement has its own variance; false: that of the sensor", true);
    const std::array<double, 4> box = p.Vector<4>(
        "target", "px", "[x, y, width, height] of the target in image start_frame; or use `boxes`",
        kNonNegative, std::array<double, 4>{});
    for (const char* key : {"left", "right", "stereo", "boxes", "timestamps", "truth"}) {
      entry.Declare(key);
    }
    folder_ = arguments.folder;
    Open(entry);
    start_.Check(*left_);
    times_->Check(*left_, start_.number(), max_frames_);
    const bool has_target = entry.Find("target").has_value();
    if (has_target && !(box[2] >= 8.0 && box[3] >= 8.0)) {
      entry.At("target").Fail("the target is less than 8 px wide or high",
                              "[x, y, width, height], px");
    }
    if (!has_target && !boxes_) {
      entry.Fail("neither 'target' nor 'boxes' is given",
                 "target: [x, y, width, height], px, in the first image");
    }
    if (has_target) target_corners_ = BoxRows::FromBox(box[0], box[1], box[2], box[3]);
    std::optional<cv::Matx33d> intrinsics;
    if (options_.warp == Warp::kHomography && !entry.Find("stereo")) {
      const Camera camera(p);
      if (camera.model != CameraModel::kPinhole) {
        p.Fail("camera.model", "must be 'pinhole', because the images must have no distortion");
      }
      intrinsics = cv::Matx33d(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
    }
    if (const auto stereo = entry.Find("stereo")) {
      if (!right_) stereo->Fail("this key needs the key 'right'", "the images of both cameras");
      stereo_file_ = folder_ / stereo->Text();
      ReadPair();
      has_read_ = true;
      rectification_.emplace(stereo_file_, *stereo, image_[0].size());
      intrinsics = rectification_->intrinsics();
    }
    tracker_.emplace(options_, intrinsics);
    DefineStreams();
    camera_ = CameraSize(arguments, *this);
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  Place place() const override { return left_->place(); }
  std::int64_t size() const override {
    const std::int64_t remaining = start_.Remaining(left_->size());
    return max_frames_ > 0 ? std::min(max_frames_, remaining) : remaining;
  }
  bool measures_images() const override { return true; }
  MeasuredImage LastImage() const override {
    MeasuredImage measured_image{ToGreyImage(image_[0])};
    if (const auto corners = tracker_->outline()) {
      for (const cv::Point2f& corner : *corners)
        measured_image.outline.push_back({corner.x, corner.y});
    }
    return measured_image;
  }
  std::optional<Config> Calibration() const override {
    if (!rectification_) return std::nullopt;
    return rectification_->Calibration(stereo_file_.string());
  }

  bool Next(SourceFrame& frame) override {
    if (frames_ == max_frames_ && max_frames_ > 0) return false;
    if (!std::exchange(has_read_, false) && !ReadPair()) return false;
    frame.timestamp = times_->At(left_->number(), left_->name(left_->number()));
    frame.measurements.clear();
    frame.truth.clear();
    if (truth_) frame.truth = truth_->At(frame.timestamp, tolerance_);
    if (rectification_) {
      for (int view = 0; view < 2; ++view) {
        image_[view] = rectification_->Rectify(image_[view], view);
      }
    }
    if (frames_ == 0) camera_.Check(image_[0].size(), place());
    Measure(frame);
    ++frames_;
    return true;
  }

 private:
  void DefineStreams() {
    const int covariance = estimate_noise_ ? 1 : 0;
    if (right_) streams_.push_back({.name = "disparity", .covariance = covariance});
    streams_.push_back({.name = "inverse_scale", .covariance = covariance});
    if (!truth_) return;
    for (const std::string& name : truth_->names()) truths_.push_back({name, 1});
  }

  std::optional<std::filesystem::path> Find(const Node& entry, const char* key) const {
    const auto node = entry.Find(key);
    if (!node) return std::nullopt;
    if (node->Text().empty()) node->Fail("the path is empty");
    return folder_ / node->Text();
  }

  void Open(const Node& entry) {
    const auto open = [&](const char* key, std::optional<ImageReader>& reader) {
      const auto path = Find(entry, key);
      if (!path) return;
      const std::string name = path->filename().string();
      const bool is_pattern = name.find_first_of("*?[") != name.npos;
      reader.emplace(is_pattern ? path->parent_path() : *path, is_pattern ? name : "",
                     *entry.Find(key));
    };
    entry.At("left", "source stereo_target");
    open("left", left_);
    open("right", right_);
    if (right_ && !right_->is_video() && !left_->is_video() && right_->size() != left_->size()) {
      entry.At("right").Fail("'right' has " + std::to_string(right_->size()) +
                                 " images, but 'left' has " + std::to_string(left_->size()),
                             "a right image for each left image");
    }
    const auto table = [&](const char* key, auto& rows) {
      if (const auto path = Find(entry, key)) {
        const Node node = entry.At(key);
        rows.emplace(*path, node.place(), node.path());
      }
    };
    table("boxes", boxes_);
    table("truth", truth_);
    const auto table_of_times = Find(entry, "timestamps");
    if (table_of_times && rate_hz_ == 0.0) {
      times_.emplace(*table_of_times, entry.At("timestamps"));
    } else {
      if (rate_hz_ == 0.0) rate_hz_ = left_->rate_hz();
      if (!(rate_hz_ > 0.0)) {
        entry.Fail("the times of the images are not defined", "'timestamps' or 'rate_hz'");
      }
      times_.emplace(rate_hz_);
    }
  }

  /// Reads the next pair of images. Skips the pairs before `start_frame`.
  bool ReadPair() {
    do {
      if (!ReadOnePair()) return false;
    } while (left_->number() < start_.number());
    return true;
  }

  bool ReadOnePair() {
    if (!left_->Next(image_[0])) {
      start_.Check(left_->number() + 1);
      times_->End(left_->number() + 1);
      if (!has_started_) {
        throw Error(ExitCode::kBadData,
                    ErrorLine(place(), {}, "no image shows the target",
                              "a row of 'boxes' for an image that shows the target"));
      }
      return false;
    }
    if (!right_) return true;
    if (!right_->Next(image_[1])) {
      throw Error(ExitCode::kBadData,
                  ErrorLine(right_->place(), {}, "there is no right image after this one",
                            "as many right images as left images"));
    }
    if (image_[0].size() != image_[1].size()) {
      throw Error(ExitCode::kBadData,
                  ErrorLine(right_->place(), {},
                            "the size of the right image differs from that of the left image",
                            "images of the same size"));
    }
    return true;
  }

  void Measure(SourceFrame& frame) {
    std::optional<BoxRows::Corners> corners = std::exchange(target_corners_, std::nullopt);
    if (const auto row = boxes_ ? boxes_->At(left_->number()) : std::nullopt) {
      if (!row->corners) return;  // the table marks the target as not visible
      if (!corners) corners = row->corners;
    }
    if (corners && rectification_) {
      for (cv::Point2f& corner : *corners) corner = rectification_->Rectify(corner);
    }
    if (corners && !has_started_ && !IsInImage(*corners)) {
      throw Error(ExitCode::kBadData, ErrorLine(place(), {}, "the target is not inside this image",
                                                "a box inside the image, in 'target' or 'boxes'"));
    }
    const auto tracked = tracker_->Track(image_[0], corners);
    if (!tracked && !has_started_ && !boxes_) {
      throw Error(ExitCode::kBadData,
                  ErrorLine(place(), {}, "the target has no texture", "a target with texture"));
    }
    if (!tracked) return;
    has_started_ = true;
    if (right_) {
      if (const auto found = FindDisparity(image_[0], image_[1], tracked->box, tracked->middle,
                                           disparity_options_)) {
        Emit(0, found->value, found->variance + sigma_systematic_px_ * sigma_systematic_px_, frame);
      }
    }
    const double width_px = std::sqrt(tracked->box.area());
    const double systematic = 2.0 * sigma_systematic_px_ * tracked->inverse_scale / width_px;
    Emit(right_ ? 1 : 0, tracked->inverse_scale, tracked->variance + systematic * systematic,
         frame);
  }

  bool IsInImage(const BoxRows::Corners& corners) const {
    const cv::Rect2f image_area({-0.5F, -0.5F}, cv::Size2f(image_[0].size()));
    return std::ranges::all_of(corners,
                               [&](cv::Point2f corner) { return image_area.contains(corner); });
  }

  void Emit(int stream, double value, double variance, Frame& frame) const {
    Measurement measurement;
    measurement.timestamp = frame.timestamp;
    measurement.stream = stream;
    measurement.values = {value};
    if (estimate_noise_) measurement.covariance = {variance};
    frame.measurements.push_back(std::move(measurement));
  }

  TargetOptions options_;
  DisparityOptions disparity_options_;
  StartFrame start_;
  CameraSize camera_;
  double rate_hz_ = 0.0, sigma_systematic_px_ = 0.0;
  bool estimate_noise_ = true, has_read_ = false, has_started_ = false;
  std::int64_t max_frames_ = 0, frames_ = 0;
  Timestamp tolerance_ = 0;
  std::filesystem::path folder_, stereo_file_;
  std::vector<StreamInfo> streams_, truths_;
  std::optional<ImageReader> left_, right_;
  std::optional<BoxRows> boxes_;
  std::optional<ImageTimes> times_;
  std::optional<TruthRows> truth_;
  std::optional<BoxRows::Corners> target_corners_;  ///< `target` of the config, until it is used
  std::optional<Rectification> rectification_;
  std::optional<TargetTracker> tracker_;
  cv::Mat image_[2];
};

}  // namespace

std::unique_ptr<Source> CreateImageTarget(const SourceArguments& arguments) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  return std::make_unique<ImageTarget>(arguments);
}

}  // namespace alidade
