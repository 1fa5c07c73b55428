// SPDX-License-Identifier: Apache-2.0
#include "tracks.h"

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "alidade/model/geometry.h"
#include "feature_rows.h"
#include "plugins/common/calibration_file.h"
#include "plugins/common/companion_files.h"
#include "tracks_options.h"

namespace alidade {
namespace {

class Tracks : public Source {
 public:
  explicit Tracks(const SourceArguments& arguments) : options_(arguments.params) {
    for (const char* key : {"path", "state_entry"}) arguments.entry.Declare(key);
    Open(arguments.entry.At("path", "tracks"), arguments.folder);
    const auto state = arguments.entry.Find("state_entry");
    NameAll(state ? state->Text() : "cam");
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  Place place() const override { return tracks_->place(); }
  std::optional<Config> Calibration() const override {
    if (!calibration_) return std::nullopt;
    return ReadCalibrationFile(*calibration_);
  }

  bool Next(SourceFrame& frame) override {
    if (frames_ == options_.most || !NextFrame(frame.timestamp)) return false;
    while (frame_ < options_.start_frame) {
      EmitTracks(nullptr);
      const std::string last = std::to_string(frame_);
      if (NextFrame(frame.timestamp)) continue;
      tracks_->FailLine("the last frame is " + last + ", before start_frame " +
                            std::to_string(options_.start_frame),
                        "start_frame at most " + last);
    }
    frame.measurements.clear();
    EmitTracks(&frame);
    if (odometry_) EmitOdometry(frame);
    if (known_) EmitKnown(frame);
    frame.truth.assign(truths_.size(), {});
    auto pose = truth_ ? truth_->At(frame.timestamp, options_.tolerance) : std::nullopt;
    if (truth_ && options_.world == TracksOptions::kFirstCamera) {
      if (frames_ == 0 && !pose) {
        tracks_->FailLine("the world is to be the camera of frame " + std::to_string(frame_) +
                              ", which has no true pose",
                          "one within truth_tolerance_s of it, or world: file");
      }
      if (frames_ == 0) {
        first_pose_ = *pose;
        Normalise<UnitQuaternion>(first_pose_.orientation.data());
      }
      if (pose) pose = pose->In(first_pose_);
    }
    if (pose) {
      frame.truth = {{pose->position.begin(), pose->position.end()},
                     {pose->orientation.begin(), pose->orientation.end()}};
    }
    ++frames_;
    return true;
  }

 private:
  void Open(const Node& path, const std::filesystem::path& folder) {
    std::filesystem::path file = path.Text();
    if (file.empty()) path.Fail("no path", "a file, a folder, or '-' for standard input");
    if (file != "-") file = folder / file;
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored)) file /= "tracks.csv";
    tracks_.emplace(file, path.place(), path.path());
    const auto beside = [&](const char* name) -> std::optional<std::filesystem::path> {
      const std::filesystem::path other = file.parent_path() / name;
      const bool there = file != "-" && std::filesystem::exists(other, ignored);
      return there ? std::optional(other) : std::nullopt;
    };
    if (const auto times = beside("timestamps.csv"); times && options_.rate_hz == 0.0) {
      times_.emplace(*times, path.place(), path.path());
    } else if (options_.rate_hz == 0.0) {
      path.Fail("no timestamps.csv next to the tracks", "that file, or 'rate_hz'");
    }
    if (const auto other = beside("odometry.csv");
        other && options_.odometry != TracksOptions::kNone) {
      odometry_.emplace(*other, path.place(), path.path());
    }
    if (const auto other = beside("known.csv")) {
      known_.emplace(*other, path.place(), path.path());
    }
    calibration_ = beside("calibration.yaml");
    auto truth = beside("groundtruth.tum");
    if (!truth) truth = beside("truth.tum");
    if (truth) truth_.emplace(*truth, path.place(), path.path());
  }

  void NameAll(const std::string& state) {
    constexpr int kSizes[] = {2, 4, 3};
    streams_ = {{"tracks", kSizes[options_.measures]}};
    if (odometry_) streams_.push_back({"odometry", 6});
    if (known_) streams_.push_back({"known", 3});
    if (truth_) truths_ = {{state + ".position", 3}, {state + ".orientation", 4}};
  }

  /// Number and timestamp of the next frame; false at the end.
  bool NextFrame(Timestamp& timestamp) {
    const std::optional<std::int64_t> next = tracks_->next_frame();
    if (!times_) {
      if (!next) return false;
      frame_ = *next;
      const double t_s = static_cast<double>(frame_) / options_.rate_hz;
      if (!(t_s < 9.2e9)) {
        tracks_->FailLine("frame " + std::to_string(frame_) + " is beyond 292 years",
                          "frames that count from 0, at rate_hz");
      }
      timestamp = TimestampFromSeconds(t_s);
      return true;
    }
    const bool more = times_->Next(frame_, timestamp);
    if (next && (!more || *next < frame_)) {
      tracks_->FailLine("frame " + std::to_string(*next) + " is not in " + times_->name(),
                        "a time for every frame");
    }
    return more;
  }

  /// Puts those features of frame_ into `frame`, if any, that are not left out.
  void EmitTracks(Frame* frame) {
    const auto features = tracks_->Take(frame_);
    for (const auto& [id, feature] : features) {
      if (frame_ < options_.features_from) left_out_.insert(id);
      if (frame != nullptr && !left_out_.contains(id)) Emit(*tracks_, 0, id, feature, *frame);
    }
  }

  /// The observations of frame_ that tell depth; those of frames not given out are dropped.
  void EmitKnown(Frame& frame) {
    for (auto next = known_->next_frame(); next && *next <= frame_; next = known_->next_frame()) {
      const auto features = known_->Take(*next);
      if (*next < frame_) continue;
      for (const auto& [id, feature] : features) {
        Emit(*known_, streams_.size() - 1, id, feature, frame);
      }
    }
  }

  void Emit(const FeatureRows& rows, std::size_t stream, std::int64_t id,
            const FeatureRows::Feature& feature, Frame& frame) const {
    const auto size = static_cast<std::size_t>(streams_[stream].size);
    auto values = rows.Values(frame_, id, feature, size);
    if (!values) return;
    Measurement measurement;
    measurement.timestamp = frame.timestamp;
    measurement.stream = static_cast<int>(stream);
    measurement.landmark = id;
    measurement.values = std::move(*values);
    frame.measurements.push_back(std::move(measurement));
  }

  void EmitOdometry(Frame& frame) {
    const auto values = odometry_->At(frame_);
    if (!values) return;
    Measurement measurement;
    measurement.timestamp = frame.timestamp;
    measurement.stream = 1;
    measurement.values.assign(values->begin(), values->end());
    const auto next =
        options_.odometry == TracksOptions::kMean ? odometry_->Following() : std::nullopt;
    for (std::size_t i = 0; next && i < next->size(); ++i) {
      measurement.values[i] = 0.5 * ((*values)[i] + (*next)[i]);
    }
    frame.measurements.push_back(std::move(measurement));
  }

  std::vector<StreamInfo> streams_, truths_;
  TracksOptions options_;
  std::int64_t frames_ = 0, frame_ = -1;
  std::set<std::int64_t> left_out_;  ///< features of the frames before features_from
  Pose first_pose_{};
  std::optional<std::filesystem::path> calibration_;
  std::optional<FeatureRows> tracks_, known_;
  std::optional<TimestampRows> times_;
  std::optional<OdometryRows> odometry_;
  std::optional<TumRows> truth_;
};

}  // namespace

std::unique_ptr<Source> CreateTracks(const SourceArguments& arguments) {
  return std::make_unique<Tracks>(arguments);
}

}  // namespace alidade
