// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "alidade/evaluate/evaluation_page.h"
#include "alidade/evaluate/report.h"
#include "alidade/io/text_cell.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kEvalFooter = R"(Examples:
  alidade eval runs/slam                           compare a run's estimators with its truth
  alidade eval truth.tum estimate.tum -a           ATE and RPE after se3 alignment
  alidade eval truth.tum mono.tum -as              also align the scale, for a single camera
  alidade eval KITTI_00_gt.txt KITTI_00_orb.txt -a -d 100 -u m --all-pairs
  alidade eval truth.tum a.tum b.tum -a --markdown
  alidade eval truth.tum a.tum -a -o errors.html   write an interactive page

Files: TUM (8 columns, or 20 with covariances), KITTI (12, and times.txt), EuRoC (csv, also of
VINS-Mono and Kimera). A folder is a run, an estimator of a run, or an EuRoC sequence. Warnings are
printed on standard error.
Options have the names of evo; underscores, as in --t_max_diff, are accepted.)";

enum class OutputFormat { kText, kJson, kMarkdown, kLatex };

struct EvalArguments {
  std::string reference;
  std::vector<std::string> estimates;
  TrajectoryFormat format = TrajectoryFormat::kDetect;
  bool skip_nan = false;
  EvaluateOptions options;
  bool se3 = false, scale = false, origin = false;
  double max_diff_s = 0.01, offset_s = 0.0;
  std::string start_s, end_s;  ///< texts, because a double is not exact to the ns
  OutputFormat output_format = OutputFormat::kText;
  std::string page;  ///< path of the page; "": no page
};

/// Returns a validator for CLI11 that accepts the names of `values`, and replaces a name by the
/// number of its value.
template <class T>
CLI::Validator OneOf(std::initializer_list<T> values) {
  const auto choose = [choices = std::vector<T>(values)](std::string& text) -> std::string {
    std::string names;
    for (const T value : choices) {
      if (text == ToString(value)) {
        text = std::to_string(static_cast<int>(value));
        return {};
      }
      names += (names.empty() ? "" : ", ") + std::string(ToString(value));
    }
    return "'" + text + "' is not one of " + names;
  };
  return {choose, ""};
}

/// Returns the alignment that -a, -s, --align-origin and --align-mode select.
Alignment SelectedAlignment(const EvalArguments& arguments) {
  if (arguments.origin) return Alignment::kOrigin;
  if (arguments.se3) return arguments.scale ? Alignment::kSim3 : Alignment::kSe3;
  return arguments.scale ? Alignment::kScale : arguments.options.alignment;
}

void LogWarnings(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) Log(LogLevel::kWarning, warning);
}

Trajectory ReadFile(const TrajectoryFile& file, const EvalArguments& arguments) {
  return ReadTrajectory(file.file, arguments.format,
                        arguments.skip_nan ? NonFiniteRows::kSkip : NonFiniteRows::kRefuse);
}

Evaluation EvaluateFile(const Trajectory& reference, const TrajectoryFile& file,
                        const EvaluateOptions& options, const EvalArguments& arguments) {
  const Trajectory estimate = ReadFile(file, arguments);
  Evaluation evaluation = Evaluate(reference, estimate, options);
  evaluation.label = file.label;
  evaluation.warnings.insert(evaluation.warnings.begin(), estimate.warnings.begin(),
                             estimate.warnings.end());
  if (!file.innovations.empty()) evaluation.innovations = ReadInnovations(file.innovations);
  return evaluation;
}

std::string Text(const std::vector<Evaluation>& evaluations, OutputFormat output_format) {
  switch (output_format) {
    case OutputFormat::kJson:
      return EvaluationJson(evaluations);
    case OutputFormat::kMarkdown:
      return EvaluationMarkdown(evaluations);
    case OutputFormat::kLatex:
      return EvaluationLatex(evaluations);
    case OutputFormat::kText:
      break;
  }
  return EvaluationText(evaluations, OutputWidth());
}

/// Returns the last `count` parts of a path without its extension.
std::string LastParts(const std::filesystem::path& path, int count) {
  std::filesystem::path label = path.stem(), folder = path.parent_path();
  for (; count > 1 && folder.has_filename(); --count, folder = folder.parent_path()) {
    label = folder.filename() / label;
  }
  return label.string();
}

/// Replaces the labels that several estimates have by the shortest ends of their paths that differ.
void MakeUnique(std::vector<Evaluation>& evaluations) {
  constexpr int kMaxParts = 20;
  const auto is_repeated = [&](const std::string& label) {
    return std::ranges::count(evaluations, label, &Evaluation::label) > 1;
  };
  std::vector<Evaluation*> repeated;
  for (Evaluation& evaluation : evaluations) {
    if (is_repeated(evaluation.label)) repeated.push_back(&evaluation);
  }
  for (int parts = 1; parts <= kMaxParts; ++parts) {
    const bool is_done = std::ranges::none_of(
        repeated, [&](const Evaluation* evaluation) { return is_repeated(evaluation->label); });
    if (is_done) return;
    for (Evaluation* const evaluation : repeated) {
      evaluation->label = LastParts(evaluation->estimate.name, parts);
    }
  }
}

/// Returns an evaluation without metrics, for the row of a failed estimate.
Evaluation Failed(const Trajectory& reference, const TrajectoryFile& file,
                  const EvaluateOptions& options, const Error& error) {
  Evaluation failed;
  failed.label = file.label;
  failed.options = options;
  failed.reference.name = reference.name;
  failed.estimate.name = file.file.string();
  failed.error = error.what();
  return failed;
}

/// Returns true if the only argument is a run. The estimates of this run are then compared with the
/// truth of the run.
bool IsSingleRun(const EvalArguments& arguments) { return arguments.estimates.empty(); }

std::vector<TrajectoryFile> FilesOf(const EvalArguments& arguments) {
  std::vector<std::string> paths = arguments.estimates;
  if (IsSingleRun(arguments)) paths = {arguments.reference};
  std::vector<TrajectoryFile> files;
  for (const std::string& path : paths) {
    const std::vector<TrajectoryFile> found = EstimatesAt(path);
    files.insert(files.end(), found.begin(), found.end());
  }
  return files;
}

/// Returns the timestamp of an option, or nullopt if the option is not used.
std::optional<Timestamp> TimeOf(const std::string& text) {
  double t_s = 0.0;
  if (cell::ParseNumber(text, t_s) != nullptr) return std::nullopt;
  return cell::ParseTimestamp(text, t_s, 9);
}

/// Evaluates all estimates. If one of several fails, the others are still evaluated, and the exit
/// code is that of the first failure.
ExitCode RunEval(const EvalArguments& arguments) {
  EvaluateOptions options = arguments.options;
  options.alignment = SelectedAlignment(arguments);
  options.max_diff = TimestampFromSeconds(arguments.max_diff_s);
  options.offset = TimestampFromSeconds(arguments.offset_s);
  options.range = {TimeOf(arguments.start_s), TimeOf(arguments.end_s)};
  const TrajectoryFile truth =
      IsSingleRun(arguments) ? TruthOf(arguments.reference) : ReferenceAt(arguments.reference);
  const std::vector<TrajectoryFile> files = FilesOf(arguments);
  const Trajectory reference = ReadFile(truth, arguments);
  LogWarnings(reference.warnings);
  std::vector<Evaluation> evaluations;
  ExitCode code = ExitCode::kOk;
  for (const TrajectoryFile& file : files) {
    try {
      evaluations.push_back(EvaluateFile(reference, file, options, arguments));
      std::vector<std::string>& warnings = evaluations.back().warnings;
      LogWarnings(warnings);
      warnings.insert(warnings.begin(), reference.warnings.begin(), reference.warnings.end());
    } catch (const Error& error) {
      if (files.size() == 1) throw;
      PrintErrors(error.what());
      evaluations.push_back(Failed(reference, file, options, error));
      if (code == ExitCode::kOk) code = error.code();
    }
  }
  MakeUnique(evaluations);
  const std::string text = Text(evaluations, arguments.output_format);
  arguments.output_format == OutputFormat::kText ? PrintText(text) : Print(text);
  if (!arguments.page.empty()) {
    WritePageFile(arguments.page, EvaluationPage(evaluations));
    if (arguments.output_format == OutputFormat::kText) Print(ReportLine(arguments.page));
  }
  return code;
}

/// Rejects invalid combinations of options.
void CheckCombinations(const EvalArguments& arguments) {
  const PairOptions& pairs = arguments.options.pairs;
  if (pairs.unit == DeltaUnit::kFrames && pairs.delta != std::floor(pairs.delta)) {
    throw CLI::ValidationError("--delta: a number of frames must be whole; expected an integer");
  }
  const auto start = TimeOf(arguments.start_s), end = TimeOf(arguments.end_s);
  if (start && end && *start > *end) {
    throw CLI::ValidationError("--t-start: '" + arguments.start_s + "' is after --t-end, '" +
                               arguments.end_s + "'; expected an earlier time");
  }
  const Alignment alignment = SelectedAlignment(arguments);
  if (arguments.options.align_poses > 0 &&
      (alignment == Alignment::kNone || alignment == Alignment::kOrigin)) {
    throw CLI::ValidationError("--n-to-align: alignment '" + std::string(ToString(alignment)) +
                               "' does not use N poses; expected -a, -s or --align-mode as well");
  }
}

void AddAlignment(CLI::App& command, EvalArguments& a) {
  CLI::Option* se3 = command.add_flag(
      "-a,--align", a.se3, "align by rotation and translation (se3); with -s also by scale (sim3)");
  CLI::Option* scale =
      command.add_flag("-s,--correct-scale", a.scale,
                       "align by scale; with -a, also by rotation and translation (sim3)");
  CLI::Option* origin =
      command.add_flag("--align-origin", a.origin, "align the first poses with each other");
  CLI::Option* mode =
      command
          .add_option("--align-mode", a.options.alignment,
                      "none (default), scale, origin, yaw (and translation), se3 or sim3")
          ->option_text("MODE")
          ->transform(OneOf({Alignment::kNone, Alignment::kScale, Alignment::kOrigin,
                             Alignment::kYaw, Alignment::kSe3, Alignment::kSim3}));
  mode->excludes(origin)->excludes(se3)->excludes(scale);
  origin->excludes(se3)->excludes(scale);
  command.add_option("--n-to-align", a.options.align_poses, "use only the first N poses to align")
      ->option_text("N")
      ->check(IsInteger(3, 1'000'000'000));
}

void AddErrors(CLI::App& command, EvalArguments& a) {
  command
      .add_option("-r,--pose-relation", a.options.relations,
                  "trans_part, rot_part, angle_deg, angle_rad, full or point_distance; may be "
                  "repeated; default trans_part and angle_deg")
      ->option_text("NAME")
      ->allow_extra_args(false)
      ->transform(
          OneOf({PoseRelation::kTranslation, PoseRelation::kRotation, PoseRelation::kAngleDeg,
                 PoseRelation::kAngleRad, PoseRelation::kFull, PoseRelation::kPointDistance}));
  command
      .add_option("-d,--delta", a.options.pairs.delta,
                  "RPE: distance between the two poses of a pair; default 1")
      ->option_text("X")
      ->check(IsNumber(1e-9, 1e9));
  command
      .add_option("-u,--delta-unit", a.options.pairs.unit,
                  "RPE: unit of --delta: f (poses, default), m (along the trajectory), s, d "
                  "(degrees) or r (rad)")
      ->option_text("UNIT")
      ->transform(OneOf({DeltaUnit::kFrames, DeltaUnit::kMetres, DeltaUnit::kSeconds,
                         DeltaUnit::kDegrees, DeltaUnit::kRadians}));
  command.add_flag("--all-pairs", a.options.pairs.all, "RPE: use overlapping pairs");
  command
      .add_option("-t,--delta-tol", a.options.pairs.tolerance,
                  "RPE: relative tolerance of --delta for --all-pairs; default 0.1")
      ->option_text("X")
      ->check(IsNumber(0.0, 1.0));
}

/// Adds the options that select poses, and the plane of the poses.
void AddSelection(CLI::App& command, EvalArguments& a) {
  command.add_option("--t-start", a.start_s, "first timestamp of the reference that is used")
      ->option_text("S")
      ->check(IsNumber(-9e9, 9e9));
  command.add_option("--t-end", a.end_s, "last timestamp of the reference that is used")
      ->option_text("S")
      ->check(IsNumber(-9e9, 9e9));
  command
      .add_option("--downsample", a.options.downsample,
                  "use only N poses of each file, equally spaced by index, before matching")
      ->option_text("N")
      ->check(IsInteger(1, 1'000'000'000));
  command
      .add_option("--project-to-plane", a.options.plane,
                  "project the poses to the plane xy, xz or yz, after the alignment")
      ->option_text("PLANE")
      ->transform(OneOf({Plane::kXy, Plane::kXz, Plane::kYz}));
  command.add_flag("--skip-nan", a.skip_nan, "leave out rows with nan or inf, such as lost frames");
}

void AddTimes(CLI::App& command, EvalArguments& a) {
  command
      .add_option("--t-max-diff", a.max_diff_s,
                  "largest time difference of matched poses in seconds; default 0.01")
      ->option_text("S")
      ->check(IsNumber(0.0, 1e9));
  command.add_option("--t-offset", a.offset_s, "seconds to add to the timestamps of the estimate")
      ->option_text("S")
      ->check(IsNumber(-9e9, 9e9));
  command
      .add_option("--format", a.format, "tum, kitti or euroc; default: detected from the first row")
      ->option_text("NAME")
      ->transform(
          OneOf({TrajectoryFormat::kTum, TrajectoryFormat::kKitti, TrajectoryFormat::kEuroc}));
}

void AddOutputFormats(CLI::App& command, EvalArguments& a) {
  const auto add = [&](const char* name, OutputFormat output_format, const char* help) {
    return command.add_flag_callback(
        name, [&a, output_format] { a.output_format = output_format; }, help);
  };
  CLI::Option* json = add("--json", OutputFormat::kJson, "print JSON");
  CLI::Option* markdown = add("--markdown", OutputFormat::kMarkdown, "print a Markdown table");
  CLI::Option* latex = add("--latex", OutputFormat::kLatex, "print a LaTeX table");
  json->excludes(markdown)->excludes(latex);
  markdown->excludes(latex);
  command.add_option("-o,--output", a.page, "also write an interactive page with map and errors")
      ->option_text("FILE")
      ->check(IsNonEmpty);
  command.add_flag("--quiet")->description("do not print warnings");
}

}  // namespace

void AddEval(CLI::App& program, Action& action) {
  CLI::App& command =
      *program.add_subcommand("eval", "Compare trajectories with a reference: ATE, RPE, NEES");
  const auto arguments = std::make_shared<EvalArguments>();
  command
      .add_option("REF", arguments->reference,
                  "the reference: a file or a run folder; without EST, the estimators of this run "
                  "folder are compared with the truth of the run")
      ->option_text(" ")
      ->required()
      ->check(IsNonEmpty);
  command.add_option("EST", arguments->estimates, "the estimates: files or run folders")
      ->option_text(" ")
      ->check(IsNonEmpty);
  AddAlignment(command, *arguments);
  AddErrors(command, *arguments);
  AddTimes(command, *arguments);
  AddSelection(command, *arguments);
  AddOutputFormats(command, *arguments);
  command.footer(kEvalFooter);
  command.callback([&action, arguments] {
    CheckCombinations(*arguments);
    action = [arguments] { return RunEval(*arguments); };
  });
}

}  // namespace alidade::cli
