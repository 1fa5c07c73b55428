// SPDX-License-Identifier: Apache-2.0
#include "tracks.h"

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "alidade/experiment/calibration_file.h"
#include "alidade/model/geometry.h"
#include "feature_rows.h"
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
    DefineStreams(state ? state->Text() : "cam");
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  Place place() const override { return tracks_->place(); }
  std::optional<Config> Calibration() const override {
    if (!calibration_) return std::nullopt;
    return ReadCalibrationFile(*calibration_);
  }

  bool Next(SourceFrame& frame) override {
    if (frames_ == options_.max_frames || !NextFrame(frame.timestamp)) return false;
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
        tracks_->FailLine("frame " + std::to_string(frame_) +
                              " has no true pose, but its camera defines the world",
                          "a true pose within truth_tolerance_s, or world: file");
      }
      if (frames_ == 0) {
        first_pose_ = *pose;
        UnitQuaternion::Normalise(first_pose_.orientation.data());
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
    if (file.empty()) path.Fail("the path is empty", "a file, a folder, or '-' for standard input");
    if (file != "-") file = folder / file;
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored)) file /= "tracks.csv";
    tracks_.emplace(file, path.place(), path.path());
    const auto find_file = [&](const char* name) -> std::optional<std::filesystem::path> {
      const std::filesystem::path path_next_to = file.parent_path() / name;
      const bool exists = file != "-" && std::filesystem::exists(path_next_to, ignored);
      return exists ? std::optional(path_next_to) : std::nullopt;
    };
    if (const auto times = find_file("timestamps.csv"); times && options_.rate_hz == 0.0) {
      times_.emplace(*times, path.place(), path.path());
    } else if (options_.rate_hz == 0.0) {
      path.Fail("there is no timestamps.csv next to the tracks", "this file, or 'rate_hz'");
    }
    if (const auto path_next_to = find_file("odometry.csv");
        path_next_to && options_.odometry != TracksOptions::kNone) {
      odometry_.emplace(*path_next_to, path.place(), path.path());
    }
    if (const auto path_next_to = find_file("known.csv")) {
      known_.emplace(*path_next_to, path.place(), path.path());
    }
    calibration_ = find_file("calibration.yaml");
    auto truth = find_file("groundtruth.tum");
    if (!truth) truth = find_file("truth.tum");
    if (truth) truth_.emplace(*truth, path.place(), path.path());
  }

  void DefineStreams(const std::string& state) {
    constexpr int kSizes[] = {2, 4, 3};
    streams_ = {{"tracks", kSizes[options_.measures]}};
    if (odometry_) streams_.push_back({"odometry", 6});
    if (known_) streams_.push_back({"known", 3});
    if (truth_) truths_ = {{state + ".position", 3}, {state + ".orientation", 4}};
  }

  /// Reads the number and timestamp of the next frame. Returns false at the end.
  bool NextFrame(Timestamp& timestamp) {
    const std::optional<std::int64_t> next = tracks_->next_frame();
    if (!times_) {
      if (!next) return false;
      frame_ = *next;
      const double t_s = static_cast<double>(frame_) / options_.rate_hz;
      if (!(t_s < 9.2e9)) {
        tracks_->FailLine("the time of frame " + std::to_string(frame_) + " is beyond 292 years",
                          "frame numbers that start at 0");
      }
      timestamp = TimestampFromSeconds(t_s);
      return true;
    }
    const bool has_frame = times_->Next(frame_, timestamp);
    if (next && (!has_frame || *next < frame_)) {
      tracks_->FailLine("frame " + std::to_string(*next) + " is not in " + times_->name(),
                        "a time for every frame");
    }
    return has_frame;
  }

  /// Appends the features of frame_ that are not excluded to `frame`. If `frame` is null, skips
  /// these features.
  void EmitTracks(Frame* frame) {
    const auto features = tracks_->ReadFrame(frame_);
    for (const auto& [id, feature] : features) {
      if (frame_ < options_.features_from) excluded_ids_.insert(id);
      if (frame != nullptr && !excluded_ids_.contains(id)) Emit(*tracks_, 0, id, feature, *frame);
    }
  }

  /// Appends the observations of frame_ that determine depth to `frame`. Drops the observations of
  /// skipped frames.
  void EmitKnown(Frame& frame) {
    for (auto next = known_->next_frame(); next && *next <= frame_; next = known_->next_frame()) {
      const auto features = known_->ReadFrame(*next);
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
  std::set<std::int64_t> excluded_ids_;  ///< ids that occur in frames before features_from
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
