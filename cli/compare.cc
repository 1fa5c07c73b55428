// SPDX-License-Identifier: Apache-2.0
#include "alidade/compare/compare.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <system_error>

#include "alidade/base/number_text.h"
#include "alidade/record/recorder.h"
#include "alidade/replay/run_inputs.h"
#include "alidade/sweep/processors.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCompareFooter = R"(Examples:
  alidade compare config.yaml                      run the config and decompose a filter's error
  alidade compare config.yaml --runs 100           compare over seeds 1 to 100
  alidade compare config.yaml --runs 200 --budget 600   do as many runs as 10 min allow
  alidade compare config.yaml --full-information always
  alidade compare config.yaml --no-decomposition --reference batch
  alidade compare runs/a runs/b                    compare finished runs over the same data

Exit code 1: no reference or no measurement was available for the comparison; 65: the runs used
different data.)";

struct CompareArguments {
  std::string command;             ///< complete command line
  Input input;                     ///< input options; `paths` contains the config
  std::vector<std::string> paths;  ///< path of one config, or paths of folders
  std::string folder;
  std::optional<std::uint64_t> seed;
  SweepOptions sweep;
  CompareOptions options;
  bool all = false;
  bool no_decomposition = false, json = false, markdown = false, latex = false;
  bool force = false, quiet = false;
};

std::string FormatComparison(const Comparison& comparison, const CompareArguments& arguments) {
  if (arguments.json) return CompareJson(comparison);
  if (arguments.markdown) return CompareReport(comparison, TableStyle::kMarkdown);
  if (arguments.latex) return CompareReport(comparison, TableStyle::kLatex);
  return CompareReport(comparison, TableStyle::kText,
                       arguments.all ? ReportRows::kAll : ReportRows::kMain, OutputWidth());
}

/// Prints the comparison, and the path of the page in the folder of the comparison. The output in
/// another format than text contains only the comparison.
void Report(const Comparison& comparison, const CompareArguments& arguments,
            const fs::path& folder) {
  const bool is_text = !arguments.json && !arguments.markdown && !arguments.latex;
  const bool has_report = is_text && !folder.empty() && !arguments.quiet;
  const std::string text = FormatComparison(comparison, arguments);
  is_text ? PrintText(text + (has_report ? ReportLine(folder) : "")) : Print(text);
}

/// Returns the exit code of the command. If the comparison is withheld, prints the reason. The code
/// is then kFound, unless the run failed for another reason than a failed estimator or seed.
ExitCode CodeOf(const Comparison& comparison, ExitCode run_code) {
  const bool is_minor =
      run_code == ExitCode::kOk || run_code == ExitCode::kDiverged || run_code == ExitCode::kFound;
  if (comparison.withheld.empty() || !is_minor) return run_code;
  PrintErrors(comparison.withheld);
  return ExitCode::kFound;
}

/// Returns true if the comparison added all estimators that failed. The comparison then reports
/// these failures.
bool OnlyAddedFailed(const RunResult& result, const ComparedExperiment& compared) {
  return result.code == ExitCode::kDiverged &&
         std::ranges::all_of(result.estimators, [&](const EstimatorResult& estimator) {
           return !estimator.failed || std::ranges::count(compared.added, estimator.name) > 0;
         });
}

/// Adds the files of the comparison to the folder of a run or sweep.
void AddFiles(auto& folder, const Comparison& comparison) {
  folder.AddFile("compare.json", CompareJson(comparison));
  folder.AddFile("compare.md", CompareReport(comparison, TableStyle::kMarkdown));
  folder.AddFile("compare.tex", CompareReport(comparison, TableStyle::kLatex));
}

/// Forecast of the total duration. The forecast is printed at most once, and only if it is at least
/// 10 s.
class Forecast {
 public:
  Forecast(const CompareArguments& arguments, std::int64_t jobs, Progress& progress)
      : progress_(progress),
        quiet_(arguments.quiet),
        budget_s_(arguments.options.budget_s),
        jobs_(jobs) {}

  /// Computes the forecast when the first of several runs is done.
  void UpdateFromRuns(std::int64_t total) {
    const double rounds = std::ceil(static_cast<double>(total) / static_cast<double>(jobs_));
    Report(rounds * elapsed_s(), "the first of " + std::to_string(total) + " runs took " +
                                     DurationText(elapsed_s()) + ": all runs may take ");
  }
  /// Computes the forecast after the first seconds. The forecast is a lower bound, because a batch
  /// that solves at each frame processes more data at each frame, and a batch of all data is solved
  /// after the last frame.
  void UpdateFromFrames(std::int64_t done, std::int64_t total) {
    if (total <= 0 || elapsed_s() < 2.0) return;
    Report(elapsed_s() * static_cast<double>(total) / static_cast<double>(done),
           std::to_string(done) + " of " + std::to_string(total) + " frames took " +
               DurationText(elapsed_s()) + ": all frames take at least ");
  }

 private:
  double elapsed_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  void Report(double forecast_s, const std::string& prefix) {
    constexpr double kMinReported_s = 10.0;
    if (is_reported_ || quiet_) return;
    is_reported_ = true;
    if (forecast_s < kMinReported_s) return;
    progress_.Clear();
    PrintNote(prefix + DurationText(forecast_s) +
              (budget_s_ ? "; the budget is " + DurationText(*budget_s_) : ""));
  }

  Progress& progress_;
  bool quiet_, is_reported_ = false;
  std::optional<double> budget_s_;
  std::int64_t jobs_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Returns the command with the options that affect the contents of the folder.
std::vector<std::string> ArgumentsOf(const CompareArguments& arguments) {
  const CompareOptions& options = arguments.options;
  std::vector<std::string> list = {"compare"};
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) list.insert(list.end(), {option, value});
  };
  if (options.over_seeds) {
    add("--runs", std::to_string(arguments.sweep.runs));
    add("--first-seed", std::to_string(arguments.seed.value_or(arguments.sweep.first_seed)));
  }
  add("--reference", options.reference);
  add("--filter", options.filter);
  if (options.full_information != FullInformation::kIfFast) {
    const bool is_always = options.full_information == FullInformation::kAlways;
    add("--full-information", is_always ? "always" : "never");
  }
  if (arguments.no_decomposition) list.emplace_back("--no-decomposition");
  return list;
}

/// Returns the text of inputs.json. `config` contains the estimators that the comparison added.
std::string InputsOf(const CompareArguments& arguments, const Config& config,
                     const internal::PluginHashes& plugins) {
  return arguments.input.InputsText(config, ArgumentsOf(arguments), {config}, plugins);
}

ExitCode CompareRun(const CompareArguments& arguments, ComparedExperiment& compared,
                    const PluginHost& host, const fs::path& folder) {
  Recorder::Options record{folder, arguments.force, arguments.command};
  record.covariances = true;
  record.plugins = internal::HashFiles(internal::FindUsedPlugins({compared.config}, host));
  record.inputs = InputsOf(arguments, compared.config, record.plugins);
  Recorder recorder(record, compared.config);
  RunComparer comparer(compared.experiment);
  Progress progress("frames", arguments.quiet);
  RunOptions options;
  options.observers = {&recorder, &comparer};
  Forecast forecast(arguments, 1, progress);
  options.progress = [&](std::int64_t done, std::int64_t total) {
    forecast.UpdateFromFrames(done, total);
    progress.Show(done, total);
  };
  options.stop = [&progress] {
    progress.Tick();
    return StopRequested();
  };
  const RunResult result = Run(compared.experiment, options);
  progress.Clear();
  CompareOptions run_options = arguments.options;
  run_options.filter = compared.filter;
  Comparison comparison;
  try {
    comparison = comparer.Finish(result, run_options);
  } catch (const Error&) {  // the run is still recorded, and its failure is reported
    recorder.Finish(result);
    if (result.status == RunStatus::kOk) throw;
    if (result.status == RunStatus::kFailed) PrintErrors(result.reason);
    if (result.status == RunStatus::kStopped) PrintNote(result.reason);
    return result.code;
  }
  comparison.notes.insert(comparison.notes.begin(), compared.notes.begin(), compared.notes.end());
  if (!compared.beyond_budget.empty()) {
    for (DecompositionStep& step : comparison.decomposition) {
      const bool is_missing = step.estimator.empty() || step.reference.empty();
      if (is_missing) step.withheld += "; " + compared.beyond_budget;
    }
  }
  if (result.status != RunStatus::kOk) comparison.notes.push_back(result.reason);
  AddFiles(recorder, comparison);
  recorder.Finish(result);
  Report(comparison, arguments, folder);
  if (result.status == RunStatus::kStopped) {
    PrintNote(result.reason);
    return result.code;
  }
  if (OnlyAddedFailed(result, compared)) return CodeOf(comparison, ExitCode::kOk);
  if (result.status == RunStatus::kFailed) PrintErrors(result.reason);
  return CodeOf(comparison, result.code);
}

ExitCode CompareOverSeeds(const CompareArguments& arguments, const ComparedExperiment& compared,
                          const PluginHost& host, const fs::path& folder) {
  Progress progress("runs", arguments.quiet);
  SweepOptions options = arguments.sweep;
  if (arguments.seed) options.first_seed = *arguments.seed;
  const std::int64_t jobs = options.jobs > 0 ? options.jobs : internal::UsableProcessors();
  Forecast forecast(arguments, std::min(jobs, options.runs), progress);
  options.progress = [&](std::int64_t done, std::int64_t total) {
    forecast.UpdateFromRuns(total);
    progress.Show(done, total);
  };
  options.first_run_progress = [&](std::int64_t done, std::int64_t total) {
    progress.Show(done, total, "frames of the first run");
  };
  options.stop = StopRequested;
  SweepFolder sweep_folder(folder, arguments.force);
  sweep_folder.AddFile(
      internal::kInputsFile,
      InputsOf(arguments, compared.config,
               internal::HashFiles(internal::FindUsedPlugins({compared.config}, host))));
  ComparedSeeds seeds = CompareSeeds(compared, host, options, arguments.options);
  progress.Clear();
  Comparison& comparison = seeds.comparison;
  comparison.notes.insert(comparison.notes.begin(), compared.notes.begin(), compared.notes.end());
  std::int64_t failed = 0;
  for (const SweepRun& run : seeds.sweep.done) {
    if (run.status != RunStatus::kFailed) continue;
    if (failed++ == 0) PrintErrors("seed " + std::to_string(run.seed) + ": " + run.reason);
  }
  if (failed > 1) PrintErrors(std::to_string(failed) + " runs failed: see failures.csv");
  const bool has_results = !comparison.estimators.empty();  // false if no run has finished
  if (has_results) {
    AddFiles(sweep_folder, comparison);
    WriteSeedFiles(sweep_folder.files(), comparison);
  }
  sweep_folder.Write(seeds.sweep, Summarise(seeds.sweep), compared.config);
  if (has_results) Report(comparison, arguments, folder);
  if (seeds.sweep.stopped && seeds.beyond_budget == 0) {
    ReportStopped(seeds.sweep.done.size(), options.runs);
    return ExitCode::kStopped;
  }
  return CodeOf(comparison, failed > 0 ? ExitCode::kFound : ExitCode::kOk);
}

ExitCode CompareConfig(const CompareArguments& arguments) {
  Input input = arguments.input;
  input.config = arguments.paths.front();
  Config config = input.Load();
  if (arguments.seed) config.Set("source.seed", std::to_string(*arguments.seed), "--seed");
  const Output output = OutputFolder(arguments.folder, config, input, arguments.force, "compare-");
  const PluginHost host = input.Host(config);
  StopOnSignals();
  ComparedExperiment compared = BuildComparedExperiment(config, host, arguments.options);
  if (!arguments.quiet) {
    ReportOutput(output);
    if (!compared.too_slow.empty()) PrintNote(compared.too_slow);
  }
  return arguments.options.over_seeds ? CompareOverSeeds(arguments, compared, host, output.folder)
                                      : CompareRun(arguments, compared, host, output.folder);
}

ExitCode CompareFinished(const CompareArguments& arguments) {
  ProtectInputs(arguments.folder, arguments.paths);
  std::vector<fs::path> folders;
  for (const std::string& folder : arguments.paths) folders.emplace_back(folder);
  const Comparison comparison = CompareFolders(folders, arguments.options);
  if (!arguments.folder.empty()) {
    WriteComparison(comparison, arguments.folder, arguments.force);
  }
  Report(comparison, arguments, arguments.folder);
  return CodeOf(comparison, ExitCode::kOk);
}

/// Returns true if all paths are folders, and false for a single config. Rejects any other list of
/// paths.
bool AreFolders(const std::vector<std::string>& paths) {
  const auto is_folder = [](const std::string& path) {
    std::error_code error;
    return fs::is_directory(path, error);
  };
  if (std::ranges::all_of(paths, is_folder)) return true;
  if (paths.size() == 1) return false;
  const auto file = std::ranges::find_if_not(paths, is_folder);
  throw CLI::ValidationError(
      "CONFIG | DIR...", "'" + *file + "' is not a folder; expected one config, or run folders");
}

/// Rejects the options that finished runs do not support.
void RejectRunOptions(const CLI::App& command) {
  for (const char* option : {"--runs", "--first-seed", "--jobs", "--seed", "--set", "--plugin-path",
                             "--allow-outside", "--budget", "--full-information"}) {
    if (command.count(option) == 0) continue;
    throw CLI::ValidationError(option,
                               "finished runs do not support this option; expected a config");
  }
}

void AddFullInformation(CLI::App& command, CompareArguments& arguments) {
  const auto read_condition = [&arguments](const std::string& text) {
    arguments.options.full_information =
        text == "always" ? FullInformation::kAlways : FullInformation::kNever;
  };
  command
      .add_option_function<std::string>(
          "--full-information", read_condition,
          "whether to add the full-information filter, which solves a batch at every frame; "
          "default: unless it would take 10 s or more, and more than half of the CPU time")
      ->option_text("always|never")
      ->check([](const std::string& text) {
        return text == "always" || text == "never"
                   ? std::string()
                   : '\'' + text + "' is not a condition; expected always or never";
      });
}

void AddOptions(CLI::App& command, CompareArguments& arguments) {
  command
      .add_option("CONFIG | DIR", arguments.paths, "a config to run, or folders of finished runs")
      ->option_text(" ")
      ->required()
      ->check(IsNonEmpty);
  command
      .add_option("--reference", arguments.options.reference,
                  "reference of the errors: truth, or an estimator; default: truth if truth is "
                  "known, else the batch")
      ->option_text("truth|NAME");
  command
      .add_option("--filter", arguments.options.filter,
                  "filter whose error is decomposed; default: the first filter")
      ->option_text("NAME");
  command.add_flag("--no-decomposition", arguments.no_decomposition,
                   "do not decompose the error, and do not add estimators for the decomposition");
  command.add_option("--runs", arguments.sweep.runs, "compare over N seeds")
      ->option_text("N")
      ->check(IsInteger(1, 1'000'000));
  command
      .add_option("--first-seed", arguments.sweep.first_seed,
                  "use the seeds S, S + 1, ...; default 1")
      ->option_text("S")
      ->check(IsInteger(0, std::int64_t{1} << 62))
      ->needs("--runs");
  command
      .add_option("--jobs", arguments.sweep.jobs,
                  "number of threads; default: all available processors")
      ->option_text("J")
      ->check(IsInteger(1, 1024))
      ->needs("--runs");
  command
      .add_option("--budget", arguments.options.budget_s,
                  "time limit in s: do not start a run that would exceed the limit; in a single "
                  "run, do not add an estimator that would exceed the limit")
      ->option_text("SECONDS")
      ->check(IsNumber(1e-9, 1e9));
  AddFullInformation(command, arguments);
  AddSeed(command, arguments.seed)->excludes("--first-seed");
  AddSets(command, arguments.input.sets,
          "set a key of the config, such as source.seed=7; may be repeated");
  AddPluginPath(command, arguments.input.plugin_paths);
  command.add_flag("--allow-outside", arguments.input.allow_outside,
                   "allow paths in `include:` and `output:` that lead out of their folders");
  AddOutput(command, arguments.folder,
            "output folder; default for a config: `output:` of the config, or compare-NAME, in "
            "runs/; default for folders: nothing is written");
  command.add_flag("--force", arguments.force, "replace the folder if it exists");
  command.add_flag("--all", arguments.all, "print all rows of the tables");
  command.add_flag("--json", arguments.json, "print all values as JSON");
  command.add_flag("--markdown", arguments.markdown, "print the tables as Markdown")
      ->excludes("--json");
  command.add_flag("--latex", arguments.latex, "print the tables as LaTeX")
      ->excludes("--json")
      ->excludes("--markdown");
  command.add_flag("--quiet", arguments.quiet, "print the comparison and errors only");
}

}  // namespace

void AddCompare(CLI::App& program, Action& action, const std::string& command_line) {
  CLI::App& command = *program.add_subcommand(
      "compare", "Compare estimators over the same data, and decompose the error of a filter");
  const auto arguments = std::make_shared<CompareArguments>();
  arguments->command = command_line;
  AddOptions(command, *arguments);
  command.footer(kCompareFooter);
  command.callback([&action, &command, arguments] {
    const bool folders = AreFolders(arguments->paths);
    if (folders) RejectRunOptions(command);
    arguments->options.decompose = !arguments->no_decomposition;
    arguments->options.over_seeds = command.count("--runs") > 0;
    arguments->options.runs = arguments->sweep.runs;
    action = [arguments, folders] {
      return folders ? CompareFinished(*arguments) : CompareConfig(*arguments);
    };
  });
}

}  // namespace alidade::cli
