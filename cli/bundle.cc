// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <charconv>
#include <cstdio>
#include <memory>
#include <optional>

#include "alidade/base/text.h"
#include "alidade/bundle/bundle_folder.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kBundleFooter = R"(Examples:
  alidade bundle problem-16-22106-pre.txt -o runs/bal
  bzcat problem-16-22106-pre.txt.bz2 | alidade bundle - --loss huber=1.5
  alidade bundle bundle.out --fix intrinsics -o runs/bundler
  alidade bundle sparse/0 -o runs/colmap
  alidade bundle data/tracks.csv --camera data/calibration.yaml --start run/trajectory.tum -o runs/a

PROBLEM is a file in the format BAL, Bundler v0.3 or libmv, which is detected from the first bytes,
a COLMAP folder of text files, or a file of tracks that `alidade simulate` wrote. Ctrl-C stops after
the current iteration; the result of this iteration is kept. Exit code 0: converged; 1: the maximum
number of iterations was reached; 75: a signal stopped the solver; 79: the solver failed.)";

struct BundleArguments {
  std::string problem, folder, loss;
  std::vector<std::string> fixed;
  BundleTracks tracks;
  std::vector<std::string> plugin_paths;
  int iterations = BundleOptions().max_iterations;
  double tolerance = BundleOptions().function_tolerance;
  bool force = false, quiet = false;
};

std::string Short(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// Parses a loss such as `huber` or `cauchy=2`. Returns false if `text` is not valid.
bool ParseLoss(const std::string& text, RobustLoss& loss) {
  const std::size_t equals = std::min(text.find('='), text.size());
  const std::string name = text.substr(0, equals);
  for (std::size_t i = 0; i < kLosses.size(); ++i) {
    if (name == kLosses[i].name) loss.kind = static_cast<LossKind>(i);
  }
  if (name != ToString(loss.kind)) return false;
  if (equals == text.size()) return true;
  if (loss.kind == LossKind::kNone) return false;
  const char* const end = text.data() + text.size();
  const auto [parsed_end, error] = std::from_chars(text.data() + equals + 1, end, loss.scale);
  return error == std::errc() && parsed_end == end;
}

std::string IsLoss(const std::string& text) {
  RobustLoss loss;
  if (ParseLoss(text, loss)) {
    if (loss.scale >= kBundleLossScaleMin && loss.scale <= kBundleLossScaleMax) return {};
    return "the scale of '" + text + "' is out of bounds; expected " + Short(kBundleLossScaleMin) +
           " to " + Short(kBundleLossScaleMax) + " standard deviations";
  }
  return "'" + text + "' is not a loss; expected " + internal::Join(internal::NamesOf(kLosses)) +
         ", or NAME=SCALE with the scale in standard deviations";
}

/// Splits a text such as `k1,k2` at its commas.
std::vector<std::string> SplitNames(const std::string& text) {
  std::vector<std::string> names(1);
  for (const char c : text) {
    if (c == ',') {
      names.emplace_back();
    } else {
      names.back() += c;
    }
  }
  return names;
}

std::string AreNames(const std::string& text) {
  const std::vector<std::string> names = SplitNames(text);
  if (std::ranges::find(names, "") == names.end()) return {};
  return "'" + text + "' has an empty name; expected comma-separated names, such as k1,k2";
}

BundleFile Read(const BundleArguments& arguments, const PluginHost& host) {
  if (arguments.tracks.camera.empty() && arguments.tracks.start.empty())
    return ReadBundle(arguments.problem);
  BundleTracks tracks = arguments.tracks;
  tracks.tracks = arguments.problem;
  return ReadBundleTracks(tracks, host);
}

/// Returns true if the camera model of this format also projects points that are behind the camera.
bool IsProjective(BundleFormat format) {
  return format == BundleFormat::kBal || format == BundleFormat::kBundler;
}

std::string Describe(const BundleFile& file, int left_out) {
  const BundleProblem& problem = file.problem;
  std::string text = std::string(ToString(file.format)) + ": " +
                     std::to_string(problem.cameras.size()) + " cameras, " +
                     std::to_string(problem.points.size()) + " points, " +
                     std::to_string(problem.observations.size()) + " observations";
  if (left_out > 0) {
    text += "; excluded observations: " + std::to_string(left_out) + " of points " +
            (IsProjective(file.format) ? "in the plane of the camera" : "behind the camera") +
            ", with residuals that are undefined or not finite at the start";
  }
  if (file.invalid_observations > 0)
    text += "; invalid observations: " + std::to_string(file.invalid_observations) +
            ", for example outside the image";
  if (file.frames_left_out > 0)
    text += "; excluded frames without a pose: " + std::to_string(file.frames_left_out);
  if (file.points_left_out > 0)
    text += "; excluded points without parallax: " + std::to_string(file.points_left_out);
  if (file.unplaced_observations > 0)
    text += "; excluded observations of these frames and points: " +
            std::to_string(file.unplaced_observations);
  return text;
}

ExitCode CodeOf(BundleEnd end) {
  switch (end) {
    case BundleEnd::kConverged:
      return ExitCode::kOk;
    case BundleEnd::kStopped:
      return ExitCode::kStopped;
    case BundleEnd::kOutOfIterations:
      return ExitCode::kFound;
    case BundleEnd::kFailed:
      break;
  }
  return ExitCode::kDiverged;
}

ExitCode RunBundle(const BundleArguments& arguments) {
  ProtectInputs(arguments.folder, {arguments.problem, arguments.tracks.camera.string(),
                                   arguments.tracks.start.string()});
  const PluginHost host(Absolute(arguments.plugin_paths));
  StopOnSignals();
  std::optional<BundleFolder> folder;
  if (!arguments.folder.empty()) folder.emplace(arguments.folder, arguments.force);
  BundleFile file = Read(arguments, host);
  const SharedSensor sensor = BundleSensor(host, file.problem);
  const int left_out = ExcludeUndefined(*sensor, file.problem);
  if (left_out == std::ssize(file.problem.observations)) {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{arguments.problem}, {}, "no observation can be used",
                          IsProjective(file.format) ? "points outside the plane of their camera"
                                                    : "points in front of their camera") +
                    "\n  " + Describe(file, left_out));
  }
  const BundleProblem start = file.problem;

  Progress progress("iterations", arguments.quiet);
  BundleOptions options;
  options.max_iterations = arguments.iterations;
  options.function_tolerance = arguments.tolerance;
  for (const std::string& list : arguments.fixed)
    for (const std::string& name : SplitNames(list)) options.fixed.push_back(name);
  options.stop = StopRequested;
  options.progress = [&](int iteration) { progress.Show(iteration, -1); };
  if (!arguments.loss.empty()) ParseLoss(arguments.loss, options.loss);
  const BundleResult result = AdjustBundle(*sensor, file.problem, options);
  progress.Clear();

  std::string text = Describe(file, left_out) + '\n';
  text += "rms " + Short(BundleRms(*sensor, start)) + " px -> " +
          Short(BundleRms(*sensor, file.problem)) + " px, " + ToString(result.end) + " after " +
          std::to_string(result.iterations) + " iterations, " + std::to_string(result.residuals) +
          " residuals, " + std::to_string(result.unknowns) + " unknowns\n";
  for (const std::string& line : DescribeUndetermined(file.problem, *sensor, result))
    text += line + '\n';
  if (folder && result.end != BundleEnd::kFailed) {
    folder->Save(file, start, *sensor, result);
    text += ReportLine(arguments.folder);
  }
  if (!arguments.quiet) PrintText(text);
  if (result.end == BundleEnd::kFailed) PrintErrors(arguments.problem + ": " + result.message);
  if (result.end == BundleEnd::kOutOfIterations)
    PrintNote("the adjustment has not converged: " + result.message +
              " (options: --max-iterations, --tolerance)");
  return CodeOf(result.end);
}

}  // namespace

void AddBundle(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand(
      "bundle",
      "Adjust cameras and points to minimise the reprojection error: BAL, Bundler, libmv, COLMAP, "
      "tracks");
  const auto arguments = std::make_shared<BundleArguments>();
  command
      .add_option("PROBLEM", arguments->problem,
                  "file or COLMAP folder to solve; `-` for standard input")
      ->option_text(" ")
      ->required()
      ->check(IsNonEmpty);
  AddOutput(command, arguments->folder, "output folder; default: nothing is written");
  const auto add = [&](const char* name, auto& value, const char* text, const std::string& help) {
    return command.add_option(name, value, help)->option_text(text);
  };
  add("--loss", arguments->loss, "LOSS",
      internal::Join(internal::NamesOf(kLosses)) +
          "; NAME=SCALE sets the scale in standard deviations, such as huber=2; default none")
      ->check(IsLoss);
  add("--fix", arguments->fixed, "NAME,...",
      "keep these intrinsics constant: `intrinsics` for all, or elements such as k1,k2")
      ->check(AreNames)
      ->allow_extra_args(false);
  add("--max-iterations", arguments->iterations, "N", "maximum number of iterations; default 500")
      ->check(IsInteger(0, 1000000));
  add("--tolerance", arguments->tolerance, "X",
      "relative change of the cost per step below which the solver has converged; default 1e-8")
      ->check(IsNumber(0.0, 1.0));
  CLI::Option* const camera = add("--camera", arguments->tracks.camera, "FILE",
                                  "for tracks: calibration file of alidade, Kalibr, OpenCV, ROS, "
                                  "EuRoC, ORB-SLAM or VINS");
  CLI::Option* const start = add("--start", arguments->tracks.start, "FILE",
                                 "for tracks: file of the initial trajectory (TUM)");
  camera->needs(start);
  start->needs(camera);
  AddPluginPath(command, arguments->plugin_paths);
  command.add_flag("--force", arguments->force, "replace the folder if it exists");
  command.add_flag("--quiet", arguments->quiet, "print errors only");
  command.footer(kBundleFooter);
  command.callback(
      [&action, arguments] { action = [arguments] { return RunBundle(*arguments); }; });
}

}  // namespace alidade::cli
