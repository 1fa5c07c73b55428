// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "alidade/source.h"
#include "beside.h"
#include "number_rows.h"
#include "tracks_options.h"

namespace alidade {

inline constexpr const char* kTracksKeys =
    "path           rows frame,feature,dim,value: a file, a pipe, '-', or a folder of tracks.csv\n"
    "state          the state entry whose blocks the truth is named after; default cam";

/// Features that were followed through images, from rows `frame,feature,dim,value`.
///
///   dim   value                            frames come in order; a frame's rows in any order
///   0, 1  u, v, px                         a header line may stand first
///   2, 3  u_right, v_right, px; or 2: the depth, m
///
/// Beside the file are `timestamps.csv` (`frame,t_s`), which then says what frames there are, or
/// else frame_rate_hz gives frame k the time k / rate; and maybe `odometry.csv` (a header that
/// names frame, vx_m_s, vy_m_s, vz_m_s, wx_rad_s, wy_rad_s, wz_rad_s) and `groundtruth.tum` or
/// `truth.tum` (world_from_cam).
///
///   stream     size     values            when
///   tracks     2, 4, 3  as `measures`     a feature has all of them; the landmark is its id
///   odometry   6        vx vy vz wx wy wz there is a row of the frame
///
/// A feature without u or v is an error; one without what `measures` asks for besides is left out,
/// and so is one that a frame before `features_from` has. A frame is given out once the first row
/// of the next is there, or the end.
///
/// Keys         kTracksKeys.
/// Errors       kBadData with file, line and column of the first thing that is wrong;
///              kInputMissing; kIo where a file changes while it is read; kBadConfig.
class Tracks : public Source {
 public:
  explicit Tracks(const SourceArguments& arguments) : options_(arguments.params) {
    for (const char* key : {"path", "state"}) arguments.entry.Declare(key);
    Open(arguments.entry.At("path", "tracks"), arguments.folder);
    const auto state = arguments.entry.Find("state");
    NameAll(state ? state->Text() : "cam");
    Advance();
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  Place place() const override { return {rows_->name(), rows_->line(), 0}; }

  bool Next(Frame& frame) override {
    if (frames_ == options_.most || !NextFrame(frame.stamp)) return false;
    while (frame_ < options_.first_frame) {
      Collect();
      if (!NextFrame(frame.stamp)) return false;
    }
    frame.measurements.clear();
    for (const auto& [id, feature] : Collect()) Emit(id, feature, frame);
    if (odometry_) EmitOdometry(frame);
    frame.truth.assign(truths_.size(), {});
    auto pose = truth_ ? truth_->At(frame.stamp, options_.tolerance) : std::nullopt;
    if (truth_ && options_.world == TracksOptions::kFirstCamera) {
      if (frames_ == 0 && !pose) {
        rows_->FailLine("the world is to be the camera of frame " + std::to_string(frame_) +
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
  static constexpr std::size_t kDims = 4;
  static constexpr const char* kColumns = "frame,feature,dim,value";
  struct Row {
    std::int64_t frame = -1, feature = 0;
    std::size_t dim = 0;
    double value = 0.0;
    int line = 0;
  };
  struct Feature {
    std::array<double, kDims> values{};
    std::array<int, kDims> lines{};  ///< where they stand; 0: not there
  };

  void Open(const Node& path, const std::filesystem::path& folder) {
    std::filesystem::path file = path.Text();
    if (file.empty()) path.Fail("no path", "a file, a folder, or '-' for standard input");
    if (file != "-") file = folder / file;
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored)) file /= "tracks.csv";
    rows_.emplace(file, path.place(), path.path());
    const auto beside = [&](const char* name) -> std::optional<std::filesystem::path> {
      const std::filesystem::path other = file.parent_path() / name;
      const bool there = file != "-" && std::filesystem::exists(other, ignored);
      return there ? std::optional(other) : std::nullopt;
    };
    if (const auto times = beside("timestamps.csv"); times && options_.rate_hz == 0.0) {
      times_.emplace(*times, path.place(), path.path());
    } else if (options_.rate_hz == 0.0) {
      path.Fail("no timestamps.csv beside the tracks", "that file, or 'frame_rate_hz'");
    }
    if (const auto other = beside("odometry.csv");
        other && options_.odometry != TracksOptions::kNone) {
      odometry_.emplace(*other, path.place(), path.path());
    }
    auto truth = beside("groundtruth.tum");
    if (!truth) truth = beside("truth.tum");
    if (truth) truth_.emplace(*truth, path.place(), path.path());
  }

  void NameAll(const std::string& state) {
    constexpr int kSizes[] = {2, 4, 3};
    streams_ = {{"tracks", kSizes[options_.measures]}};
    if (odometry_) streams_.push_back({"odometry", 6});
    if (truth_) truths_ = {{state + ".position", 3}, {state + ".orientation", 4}};
  }

  /// Reads the next row into next_; none at the end.
  void Advance() {
    const bool first = !next_;
    if (!rows_->Next()) {
      if (first) rows_->FailLine("no rows", std::string("rows ") + kColumns);
      next_.reset();
      return;
    }
    if (first && rows_->text(0) == "frame") {
      rows_->ExpectColumns(kDims, kColumns);
      if (!rows_->Next()) rows_->FailLine("no rows", "a row below the header");
    }
    rows_->ExpectColumns(4, kColumns);
    Row row{rows_->Index(0, "frame"), rows_->Index(1, "feature"), 0, rows_->Number(3, "value"),
            rows_->line()};
    const std::int64_t dim = rows_->Index(2, "dim");
    if (dim >= static_cast<std::int64_t>(kDims)) {
      rows_->FailCell(2, "dim", "is unknown", "0 u, 1 v, 2 u_right or depth, 3 v_right");
    }
    row.dim = static_cast<std::size_t>(dim);
    if (!first && row.frame < next_->frame) {
      rows_->FailCell(0, "frame", "is before that of line " + std::to_string(next_->line),
                      "frames in order");
    }
    next_ = row;
  }

  /// Number and stamp of the next frame; false at the end.
  bool NextFrame(Stamp& stamp) {
    if (!times_) {
      if (!next_) return false;
      frame_ = next_->frame;
      const double t_s = static_cast<double>(frame_) / options_.rate_hz;
      if (!(t_s < 9.2e9)) {
        rows_->FailLine("frame " + std::to_string(frame_) + " is beyond 292 years",
                        "frames that count from 0, at frame_rate_hz");
      }
      stamp = StampFromSeconds(t_s);
      return true;
    }
    const bool more = times_->Next(frame_, stamp);
    if (next_ && (!more || next_->frame < frame_)) {
      rows_->FailLine("frame " + std::to_string(next_->frame) + " is not in " + times_->name(),
                      "a time for every frame");
    }
    return more;
  }

  /// The features of frame_ that are given out, by id.
  std::map<std::int64_t, Feature> Collect() {
    std::map<std::int64_t, Feature> features;
    while (next_ && next_->frame == frame_) {
      Feature& feature = features[next_->feature];
      int& line = feature.lines[next_->dim];
      if (line != 0) {
        rows_->FailLine("a second value of frame " + std::to_string(frame_) + ", feature " +
                            std::to_string(next_->feature) + ", dim " + std::to_string(next_->dim) +
                            "; the first is in line " + std::to_string(line),
                        "one");
      }
      line = next_->line;
      feature.values[next_->dim] = next_->value;
      Advance();
    }
    for (const auto& [id, feature] : features)
      if (frame_ < options_.features_from) left_out_.insert(id);
    std::erase_if(features, [&](const auto& f) { return left_out_.contains(f.first); });
    return features;
  }

  void Emit(std::int64_t id, const Feature& feature, Frame& frame) const {
    const auto size = static_cast<std::size_t>(streams_[0].size);
    for (std::size_t dim = 0; dim < size; ++dim) {
      if (feature.lines[dim] != 0) continue;
      if (dim >= 2) return;
      const int line = *std::max_element(feature.lines.begin(), feature.lines.end());
      throw Error(ExitCode::kBadData,
                  ErrorLine(Place{rows_->name(), line, 0}, {},
                            "feature " + std::to_string(id) + " of frame " +
                                std::to_string(frame_) + " has no dim " + std::to_string(dim),
                            "both 0 (u) and 1 (v)"));
    }
    Measurement measurement;
    measurement.stamp = frame.stamp;
    measurement.landmark = id;
    measurement.values.assign(feature.values.begin(),
                              feature.values.begin() + static_cast<std::ptrdiff_t>(size));
    frame.measurements.push_back(std::move(measurement));
  }

  void EmitOdometry(Frame& frame) {
    const auto values = odometry_->At(frame_);
    if (!values) return;
    Measurement measurement;
    measurement.stamp = frame.stamp;
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
  std::optional<NumberRows> rows_;
  std::optional<TimestampRows> times_;
  std::optional<OdometryRows> odometry_;
  std::optional<TumRows> truth_;
  std::optional<Row> next_;
};

inline std::unique_ptr<Source> CreateTracks(const SourceArguments& arguments) {
  return std::make_unique<Tracks>(arguments);
}

}  // namespace alidade
