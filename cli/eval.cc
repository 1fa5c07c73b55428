// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "alidade/evaluate/report.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kEvalFooter = R"(Examples:
  alidade eval runs/slam                           all estimators of a run against its truth
  alidade eval truth.tum estimate.tum -a           ATE and RPE after se3 alignment
  alidade eval truth.tum mono.tum -as              and scale, as a single camera needs it
  alidade eval KITTI_00_gt.txt KITTI_00_orb.txt -a -d 100 -u m --all-pairs
  alidade eval truth.tum a.tum b.tum -a --markdown

Files: TUM (8 columns, or 20 with covariances), KITTI (12, and times.txt), EuRoC (csv). A folder
is a run, an estimator in one, or a sequence of EuRoC. Warnings go to standard error. Options have
the names of evo; underscores, as in --t_max_diff, mean the same.)";

enum class Form { kText, kJson, kMarkdown, kLatex };

struct EvalArguments {
  std::string reference;
  std::vector<std::string> estimates;
  TrajectoryFormat format = TrajectoryFormat::kDetect;
  EvaluateOptions options;
  bool se3 = false, scale = false, origin = false;
  double max_diff_s = 0.01, offset_s = 0.0;
  Form form = Form::kText;
};

/// An option takes the name of one of `values`.
template <class T>
CLI::Validator OneOf(std::initializer_list<T> values) {
  const auto choose = [all = std::vector<T>(values)](std::string& text) -> std::string {
    std::string names;
    for (const T value : all) {
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

/// What -a, -s and --align-origin mean for --align-mode.
Alignment Chosen(const EvalArguments& arguments) {
  if (arguments.origin) return Alignment::kOrigin;
  if (arguments.se3) return arguments.scale ? Alignment::kSim3 : Alignment::kSe3;
  return arguments.scale ? Alignment::kScale : arguments.options.alignment;
}

void WarnOf(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) Log(LogLevel::kWarning, warning);
}

Evaluation EvaluateFile(const Trajectory& reference, const TrajectoryFile& file,
                        const EvaluateOptions& options, TrajectoryFormat format) {
  const Trajectory estimate = ReadTrajectory(file.file, format);
  Evaluation evaluation = Evaluate(reference, estimate, options);
  evaluation.label = file.label;
  evaluation.warnings.insert(evaluation.warnings.begin(), estimate.warnings.begin(),
                             estimate.warnings.end());
  if (!file.innovations.empty()) evaluation.innovations = ReadInnovations(file.innovations);
  return evaluation;
}

std::string Text(const std::vector<Evaluation>& evaluations, Form form) {
  switch (form) {
    case Form::kJson:
      return EvaluationJson(evaluations);
    case Form::kMarkdown:
      return EvaluationMarkdown(evaluations);
    case Form::kLatex:
      return EvaluationLatex(evaluations);
    case Form::kText:
      break;
  }
  return EvaluationText(evaluations);
}

/// Labels that two estimates have, as of two runs, give way to the files.
void MakeUnique(std::vector<Evaluation>& evaluations) {
  std::map<std::string, int> times;
  for (const Evaluation& one : evaluations) ++times[one.label];
  for (Evaluation& one : evaluations) {
    if (times[one.label] > 1) one.label = one.estimate.name;
  }
}

/// An estimate without figures, for its row in the table.
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

/// A run that stands alone is compared with its own truth.
bool IsOfOneRun(const EvalArguments& arguments) { return arguments.estimates.empty(); }

std::vector<TrajectoryFile> FilesOf(const EvalArguments& arguments) {
  std::vector<std::string> paths = arguments.estimates;
  if (IsOfOneRun(arguments)) paths = {arguments.reference};
  std::vector<TrajectoryFile> files;
  for (const std::string& path : paths) {
    const std::vector<TrajectoryFile> more = EstimatesAt(path);
    files.insert(files.end(), more.begin(), more.end());
  }
  return files;
}

/// Of several estimates one that fails leaves the others theirs; the exit code is the first one's.
ExitCode RunEval(const EvalArguments& arguments) {
  EvaluateOptions options = arguments.options;
  options.alignment = Chosen(arguments);
  options.max_diff = TimestampFromSeconds(arguments.max_diff_s);
  options.offset = TimestampFromSeconds(arguments.offset_s);
  const TrajectoryFile truth =
      IsOfOneRun(arguments) ? TruthOf(arguments.reference) : ReferenceAt(arguments.reference);
  const std::vector<TrajectoryFile> files = FilesOf(arguments);
  const Trajectory reference = ReadTrajectory(truth.file, arguments.format);
  WarnOf(reference.warnings);
  std::vector<Evaluation> evaluations;
  ExitCode code = ExitCode::kOk;
  for (const TrajectoryFile& file : files) {
    try {
      evaluations.push_back(EvaluateFile(reference, file, options, arguments.format));
      std::vector<std::string>& warnings = evaluations.back().warnings;
      WarnOf(warnings);
      warnings.insert(warnings.begin(), reference.warnings.begin(), reference.warnings.end());
    } catch (const Error& error) {
      if (files.size() == 1) throw;
      PrintErrors(error.what());
      evaluations.push_back(Failed(reference, file, options, error));
      if (code == ExitCode::kOk) code = error.code();
    }
  }
  MakeUnique(evaluations);
  Print(Text(evaluations, arguments.form));
  return code;
}

/// Says what is wrong with options that fit one by one, but not together.
void CheckTogether(const EvalArguments& arguments) {
  const PairOptions& pairs = arguments.options.pairs;
  if (pairs.unit == DeltaUnit::kFrames && pairs.delta != std::floor(pairs.delta)) {
    throw CLI::ValidationError("--delta: frames are a whole number");
  }
  const Alignment chosen = Chosen(arguments);
  if (arguments.options.align_poses > 0 &&
      (chosen == Alignment::kNone || chosen == Alignment::kOrigin)) {
    throw CLI::ValidationError("--n-to-align: " + std::string(ToString(chosen)) +
                               " aligns no N poses; expected -a, -s or --align-mode too");
  }
}

void AddAlignment(CLI::App& command, EvalArguments& a) {
  CLI::Option* se3 = command.add_flag(
      "-a,--align", a.se3, "align by rotation and translation (se3); with -s by scale too (sim3)");
  CLI::Option* scale =
      command.add_flag("-s,--correct-scale", a.scale, "align by scale; with -a by sim3");
  CLI::Option* origin =
      command.add_flag("--align-origin", a.origin, "align so that the first poses are the same");
  CLI::Option* mode =
      command
          .add_option("--align-mode", a.options.alignment,
                      "none (default), scale, origin, yaw (and translation), se3 or sim3")
          ->option_text("MODE")
          ->transform(OneOf({Alignment::kNone, Alignment::kScale, Alignment::kOrigin,
                             Alignment::kYaw, Alignment::kSe3, Alignment::kSim3}));
  mode->excludes(origin)->excludes(se3)->excludes(scale);
  origin->excludes(se3)->excludes(scale);
  command.add_option("--n-to-align", a.options.align_poses, "align by the first N poses alone")
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
                  "RPE: f (poses, default), m (along the trajectory), s, d (degrees) or r (rad)")
      ->option_text("UNIT")
      ->transform(OneOf({DeltaUnit::kFrames, DeltaUnit::kMetres, DeltaUnit::kSeconds,
                         DeltaUnit::kDegrees, DeltaUnit::kRadians}));
  command.add_flag("--all-pairs", a.options.pairs.all, "RPE: use overlapping pairs");
  command
      .add_option("-t,--delta-tol", a.options.pairs.tolerance,
                  "RPE: tolerance of delta for --all-pairs, relative; default 0.1")
      ->option_text("X")
      ->check(IsNumber(0.0, 1.0));
}

void AddTimes(CLI::App& command, EvalArguments& a) {
  command
      .add_option("--t-max-diff", a.max_diff_s,
                  "largest time difference of two poses that match, s; default 0.01")
      ->option_text("S")
      ->check(IsNumber(0.0, 1e9));
  command.add_option("--t-offset", a.offset_s, "is added to the timestamps of the estimate, s")
      ->option_text("S")
      ->check(IsNumber(-9e9, 9e9));
  command
      .add_option("--format", a.format, "of files: tum, kitti, euroc; default: by their first row")
      ->option_text("NAME")
      ->transform(
          OneOf({TrajectoryFormat::kTum, TrajectoryFormat::kKitti, TrajectoryFormat::kEuroc}));
}

void AddForms(CLI::App& command, EvalArguments& a) {
  const auto add = [&](const char* name, Form form, const char* help) {
    return command.add_flag_callback(
        name, [&a, form] { a.form = form; }, help);
  };
  CLI::Option* json = add("--json", Form::kJson, "print JSON");
  CLI::Option* markdown = add("--markdown", Form::kMarkdown, "print a table of Markdown");
  CLI::Option* latex = add("--latex", Form::kLatex, "print a table of LaTeX");
  json->excludes(markdown)->excludes(latex);
  markdown->excludes(latex);
  command.add_flag("--quiet")->description("no warnings");
}

}  // namespace

void AddEval(CLI::App& program, Action& action) {
  CLI::App& command =
      *program.add_subcommand("eval", "Compare trajectories with a reference: ATE, RPE, NEES");
  const auto arguments = std::make_shared<EvalArguments>();
  command
      .add_option("REF", arguments->reference,
                  "the reference: a file, or the folder of a run; without EST a run, compared with "
                  "its truth")
      ->option_text(" ")
      ->required()
      ->check(IsNamed);
  command.add_option("EST", arguments->estimates, "the estimates: files, or folders of runs")
      ->option_text(" ")
      ->check(IsNamed);
  AddAlignment(command, *arguments);
  AddErrors(command, *arguments);
  AddTimes(command, *arguments);
  AddForms(command, *arguments);
  command.footer(kEvalFooter);
  command.callback([&action, arguments] {
    CheckTogether(*arguments);
    action = [arguments] { return RunEval(*arguments); };
  });
}

}  // namespace alidade::cli
