// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/simulate.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "alidade/experiment/source_plugin.h"
#include "alidade/io/csv_file.h"
#include "alidade/io/json.h"
#include "alidade/record/images.h"
#include "alidade/record/pose_file.h"
#include "alidade/state/element_names.h"

namespace alidade {
namespace {

using internal::CsvFile;
using internal::OutputFolder;

std::unique_ptr<Source> MakeSource(const Config& config, const PluginHost& host) {
  const Node entry = config.root().At("source", "the source of the measurements");
  std::uint64_t seed = 1;
  if (const auto node = entry.Find("seed")) {
    seed = static_cast<std::uint64_t>(node->Integer(0, INT64_MAX));
  }
  std::unique_ptr<Source> source = CreateSource(host, config, seed);
  entry.Declare("calibration");
  entry.RejectUnread();
  return source;
}

/// Returns the names of the columns with the values of a stream.
std::vector<std::string> ColumnsOf(const StreamInfo& stream) {
  if (stream.name == "odometry" && stream.size == 6) {  // names that source `tracks` expects
    return {"vx_m_s", "vy_m_s", "vz_m_s", "wx_rad_s", "wy_rad_s", "wz_rad_s"};
  }
  return internal::NumberedNames(stream.name, static_cast<std::size_t>(stream.size));
}

/// Writer of the data files of a simulation.
class DataFiles {
 public:
  DataFiles(const OutputFolder& folder, const Source& source) : folder_(folder), source_(source) {
    streams_.resize(source.streams().size());
    OpenCsv(times_, "timestamps.csv", {"frame", "t_s"});
    if (source.truths().empty()) return;
    std::vector<std::string> header{"t_s"};
    for (const StreamInfo& truth : source.truths()) {
      const auto names = internal::NumberedNames(truth.name, static_cast<std::size_t>(truth.size));
      header.insert(header.end(), names.begin(), names.end());
    }
    OpenCsv(truth_, "truth.csv", header);
    const std::optional<internal::PosePlace> pose = internal::FindPose(source.truths());
    if (!pose) return;
    tum_.emplace(folder, "truth.tum", *pose);
    names_.insert("truth.tum");
  }

  void Add(std::int64_t number, const SourceFrame& frame) {
    times_->Integer(number).Time(frame.timestamp).EndRow();
    for (const Measurement& measurement : frame.measurements) AddRow(number, measurement);
    if (!truth_) return;
    truth_->Time(frame.timestamp);
    for (std::size_t i = 0; i < source_.truths().size(); ++i) {
      const auto size = static_cast<std::size_t>(source_.truths()[i].size);
      const bool is_known = i < frame.truth.size() && !frame.truth[i].empty();
      truth_->Numbers(is_known ? frame.truth[i].data() : nullptr, is_known ? size : 0, size);
    }
    truth_->EndRow();
    if (tum_) tum_->AddTruth(frame);
  }

  void Close() {
    WriteMap();
    times_->Close();
    if (truth_) truth_->Close();
    if (tum_) tum_->Close();
    for (std::optional<CsvFile>& stream : streams_) {
      if (stream) stream->Close();
    }
  }

  const std::set<std::string>& names() const { return names_; }

 private:
  void OpenCsv(std::optional<CsvFile>& file, const std::string& name,
               const std::vector<std::string>& header) {
    file.emplace(folder_, name, header);
    names_.insert(name);
  }

  void AddRow(std::int64_t number, const Measurement& measurement) {
    const auto index = static_cast<std::size_t>(measurement.stream);
    const StreamInfo& stream = source_.streams()[index];
    const bool is_landmark = measurement.landmark >= 0;
    const auto rows = static_cast<std::size_t>(stream.covariance), covariance_width = rows * rows;
    const bool has_track_rows = is_landmark && (stream.name == "tracks" || stream.name == "known");
    std::optional<CsvFile>& file = streams_[index];
    if (!file) {
      std::vector<std::string> header{"frame", "feature", "dim", "value"};
      if (!has_track_rows) {
        header = {"frame", "t_s"};
        if (is_landmark) header.emplace_back("landmark");
        for (const std::string& name : ColumnsOf(stream)) header.push_back(name);
        for (int i = 0; i < stream.known; ++i) header.push_back("known" + std::to_string(i));
        for (std::size_t i = 0; i < covariance_width; ++i)
          header.push_back("R" + std::to_string(i));
      }
      OpenCsv(file, stream.name + ".csv", header);
    }
    if (is_landmark) measured_ids_.insert(measurement.landmark);
    if (!has_track_rows) {
      file->Integer(number).Time(measurement.timestamp);
      if (is_landmark) file->Landmark(measurement.landmark);
      file->Numbers(measurement.values.data(), measurement.values.size(),
                    measurement.values.size());
      file->Numbers(measurement.known.data(), measurement.known.size(), measurement.known.size());
      file->Numbers(measurement.covariance.data(), measurement.covariance.size(), covariance_width);
      return file->EndRow();
    }
    for (std::size_t dim = 0; dim < measurement.values.size(); ++dim) {
      file->Integer(number).Integer(measurement.landmark);
      file->Integer(static_cast<std::int64_t>(dim)).Number(measurement.values[dim]).EndRow();
    }
  }

  void WriteMap() {
    std::optional<CsvFile> map;
    for (const std::int64_t id : measured_ids_) {
      const auto position = source_.TrueLandmark(id);
      if (!position) continue;
      if (!map) OpenCsv(map, "map.csv", {"feature", "x", "y", "z"});
      map->Integer(id).Numbers(position->data(), 3, 3).EndRow();
    }
    if (map) map->Close();
  }

  const OutputFolder& folder_;
  const Source& source_;
  std::optional<CsvFile> times_, truth_;
  std::vector<std::optional<CsvFile>> streams_;
  std::optional<internal::PoseFile> tum_;
  std::set<std::int64_t> measured_ids_;
  std::set<std::string> names_;
};

/// Writer of the images of a simulation. The source draws the images. If the source cannot draw,
/// the images contain discs at the landmarks.
class ImageFiles {
 public:
  ImageFiles(const SimulateImages& names, const Config& config, const OutputFolder& folder,
             Source& source)
      : source_(source) {
    if (names.video.empty() && names.folder.empty()) return;
    int width = 0, height = 0;
    if (source.views() == 0) {
      constexpr int kMaxPixels = 16384;
      const Node camera = config.root().At("camera", "images of a simulation");
      width = static_cast<int>(camera.At("width").Integer(1, kMaxPixels));
      height = static_cast<int>(camera.At("height").Integer(1, kMaxPixels));
    }
    writers_.resize(static_cast<std::size_t>(std::max(1, source.views())));
    for (std::size_t view = 0; view < writers_.size(); ++view) {
      const std::string side = writers_.size() == 1 ? "" : view == 0 ? "left" : "right";
      const auto add = [&](ImageArguments::Form form, const std::filesystem::path& path,
                           const std::string& name) {
        writers_[view].push_back(OpenImageWriter({form, path, path.string(), width, height}));
        names_.push_back(name);
      };
      if (!names.video.empty()) {
        std::filesystem::path name = Inside(names.video, "--video");
        if (!side.empty()) name.replace_filename(name.stem().string() + "_" + side + ".avi");
        add(ImageArguments::Form::kVideo, folder.Add(name), name);
      }
      if (!names.folder.empty()) {
        std::filesystem::path name = Inside(names.folder, "--images");
        if (!side.empty()) name /= side;
        add(ImageArguments::Form::kImages, folder.Add(name / ""), name);
      }
    }
  }

  void Add(std::int64_t number, const Frame& frame) {
    for (std::size_t view = 0; view < writers_.size(); ++view) {
      if (source_.views() == 0) {
        FindPixels(frame);
        for (const auto& writer : writers_[view]) writer->Add(number, frame.timestamp, pixels_);
      } else {
        const GreyImage image = source_.Draw(static_cast<int>(view));
        for (const auto& writer : writers_[view]) writer->Add(number, frame.timestamp, image);
      }
    }
  }

  /// Returns the names of the outputs in the folder.
  const std::vector<std::string>& names() const { return names_; }
  void Close() {
    for (const auto& view : writers_) {
      for (const auto& writer : view) writer->Close();
    }
  }

 private:
  /// Converts `name` to a path. Throws if the path leaves the output folder. The folder is new, so
  /// it contains no links.
  static std::filesystem::path Inside(const std::string& name, const char* option) {
    const std::filesystem::path path = std::filesystem::path(name).lexically_normal();
    if (path.is_absolute() || *path.begin() == "..") {
      throw Error(ExitCode::kNotTrusted,
                  ErrorLine({}, option, "'" + name + "' is outside the output folder",
                            "a relative path inside this folder"));
    }
    return path;
  }
  void FindPixels(const Frame& frame) {
    pixels_.clear();
    for (const Measurement& measurement : frame.measurements) {
      if (measurement.landmark < 0 || measurement.values.size() < 2) continue;
      pixels_.push_back({measurement.values[0], measurement.values[1]});
    }
  }

  Source& source_;
  std::vector<std::vector<std::unique_ptr<ImageWriter>>> writers_;  ///< writers for each view
  std::vector<std::string> names_;
  std::vector<std::array<double, 2>> pixels_;
};

/// Returns section `camera` of the config as YAML. Returns "" if there is no such section.
std::string CameraYaml(const Config& config) {
  const bool source_reads_it = !config.root().HasUnread("camera");
  const auto camera = config.root().Find("camera");
  if (!camera) return {};
  if (source_reads_it) camera->RejectUnread();
  Config camera_config = Config::FromText("camera: {}", "calibration.yaml");
  for (const auto& [key, value] : camera->Entries()) {
    camera_config.Set("camera." + key, value.Text(), "calibration.yaml");
  }
  return camera_config.ToYaml();
}

/// Returns the text of simulate.json, which reports whether the data are complete.
std::string SimulateJson(const SimulateResult& result) {
  return internal::JsonText(
      {{"status", result.stopped ? "stopped" : "ok"}, {"frames", result.frames}});
}

}  // namespace

SimulateResult Simulate(const Config& config, const PluginHost& host,
                        const std::filesystem::path& folder, bool force,
                        const std::function<bool()>& stop, const SimulateImages& images) {
  const std::unique_ptr<Source> source = MakeSource(config, host);
  const std::string camera = CameraYaml(config);
  OutputFolder output(folder, force);
  DataFiles files(output, *source);
  ImageFiles image_files(images, config, output, *source);
  SimulateResult result;
  for (SourceFrame frame; !result.stopped && source->Next(frame);) {
    files.Add(result.frames, frame);
    image_files.Add(result.frames++, frame);
    result.stopped = stop && stop();
  }
  files.Close();
  image_files.Close();
  result.files.assign(files.names().begin(), files.names().end());
  std::ranges::copy(image_files.names(), std::back_inserter(result.files));
  if (!camera.empty()) {
    output.Write("calibration.yaml", camera);
    result.files.insert(result.files.begin(), "calibration.yaml");
  }
  output.Write("simulate.json", SimulateJson(result));
  result.files.push_back("simulate.json");
  output.Commit();
  return result;
}

}  // namespace alidade
