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
  alidade compare config.yaml                      run it, and decompose the error of a filter
  alidade compare config.yaml --runs 100           over seeds 1 to 100
  alidade compare config.yaml --runs 200 --budget 600   as many of them as ten minutes allow
  alidade compare config.yaml --no-decomposition --reference batch
  alidade compare runs/a runs/b                    finished runs over the same data

Exit code 1: there was no reference, or no measurement, to compare with; 65: runs over different
data.)";

struct CompareArguments {
  std::string command;          ///< the whole line
  Input input;                  ///< without its config
  std::vector<std::string> of;  ///< a config, or folders
  std::string folder;
  std::optional<std::uint64_t> seed;
  SweepOptions sweep;
  CompareOptions options;
  bool all = false;
  bool no_decomposition = false, json = false, markdown = false, latex = false;
  bool force = false, quiet = false, figures = false;
};

std::string Shown(const Comparison& comparison, const CompareArguments& arguments) {
  if (arguments.json) return CompareJson(comparison);
  if (arguments.markdown) return CompareReport(comparison, TableStyle::kMarkdown);
  if (arguments.latex) return CompareReport(comparison, TableStyle::kLatex);
  return CompareReport(comparison, TableStyle::kText,
                       arguments.all ? ReportRows::kAll : ReportRows::kMain);
}

/// Prints the comparison, and where it lies.
void Report(const Comparison& comparison, const CompareArguments& arguments,
            const fs::path& folder) {
  Print(Shown(comparison, arguments));
  if (!folder.empty() && !arguments.quiet) PrintNote("wrote " + folder.string());
}

/// That a comparison is withheld counts for more than an estimator or a seed that failed, and for
/// less than anything else that ended a run.
ExitCode CodeOf(const Comparison& comparison, ExitCode of_run) {
  const bool more =
      of_run == ExitCode::kOk || of_run == ExitCode::kDiverged || of_run == ExitCode::kFound;
  if (comparison.withheld.empty() || !more) return of_run;
  PrintErrors(comparison.withheld);
  return ExitCode::kFound;
}

/// Whether what ended the run was an estimator that was added, of which the comparison tells.
bool OnlyAddedFailed(const RunResult& result, const ComparedExperiment& compared) {
  return result.code == ExitCode::kDiverged &&
         std::ranges::all_of(result.estimators, [&](const EstimatorResult& one) {
           return !one.failed || std::ranges::count(compared.added, one.name) > 0;
         });
}

/// What a folder, of a run or a sweep, has besides.
void AddFiles(auto& folder, const Comparison& comparison) {
  folder.AddFile("compare.json", CompareJson(comparison));
  folder.AddFile("compare.md", CompareReport(comparison, TableStyle::kMarkdown));
  folder.AddFile("compare.tex", CompareReport(comparison, TableStyle::kLatex));
}

/// `83 s`, `12 min`, `3.4 h`
std::string DurationText(double s) {
  if (s < 120.0) return internal::RoundedText(s, 2) + " s";
  return s < 7200.0 ? internal::RoundedText(s / 60.0, 2) + " min"
                    : internal::RoundedText(s / 3600.0, 2) + " h";
}

/// Foretells once, from what is done, how long all takes, where that is worth a word.
class Forecast {
 public:
  Forecast(const CompareArguments& arguments, std::int64_t jobs, Progress& progress)
      : progress_(progress),
        quiet_(arguments.quiet),
        budget_s_(arguments.options.budget_s),
        jobs_(jobs) {}

  /// From the first of several runs.
  void OfRuns(std::int64_t total) {
    const double rounds = std::ceil(static_cast<double>(total) / static_cast<double>(jobs_));
    Tell(rounds * elapsed_s(), "the first of " + std::to_string(total) + " runs took " +
                                   DurationText(elapsed_s()) + ": all may take ");
  }
  /// From the frames of the first seconds. One frame may take longer than another: a batch that
  /// solves at each has more data each time, one of all data comes after the last.
  void OfFrames(std::int64_t done, std::int64_t total) {
    if (total <= 0 || elapsed_s() < 2.0) return;
    Tell(elapsed_s() * static_cast<double>(total) / static_cast<double>(done),
         std::to_string(done) + " of " + std::to_string(total) + " frames took " +
             DurationText(elapsed_s()) + ": all take at least ");
  }

 private:
  double elapsed_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  void Tell(double foretold_s, const std::string& words) {
    constexpr double kWorthAWord_s = 10.0;
    if (told_ || quiet_) return;
    told_ = true;
    if (foretold_s < kWorthAWord_s) return;
    progress_.Clear();
    PrintNote(words + DurationText(foretold_s) +
              (budget_s_ ? ", the budget is " + DurationText(*budget_s_) : ""));
  }

  Progress& progress_;
  bool quiet_, told_ = false;
  std::optional<double> budget_s_;
  std::int64_t jobs_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

ExitCode CompareRun(const CompareArguments& arguments, ComparedExperiment& compared,
                    const PluginHost& host, const fs::path& folder) {
  Recorder::Options record{folder, arguments.force, arguments.figures, arguments.command,
                           StopRequested};
  record.covariances = true;
  record.plugins = internal::HashFiles(internal::FindUsedPlugins({compared.config}, host));
  Recorder recorder(record, compared.config);
  RunComparer comparer(compared.experiment);
  Progress progress("frames", arguments.quiet);
  RunOptions options;
  options.observers = {&recorder, &comparer};
  Forecast forecast(arguments, 1, progress);
  options.progress = [&](std::int64_t done, std::int64_t total) {
    forecast.OfFrames(done, total);
    progress.Show(done, total);
  };
  options.stop = StopRequested;
  const RunResult result = Run(compared.experiment, options);
  progress.Clear();
  CompareOptions of_run = arguments.options;
  of_run.filter = compared.filter;
  Comparison comparison;
  try {
    comparison = comparer.Finish(result, of_run);
  } catch (const Error&) {  // the run is kept, with its own reason where it has one
    recorder.Finish(result);
    if (result.status == RunStatus::kOk) throw;
    if (result.status == RunStatus::kFailed) PrintErrors(result.reason);
    if (result.status == RunStatus::kStopped) PrintNote(result.reason);
    return result.code;
  }
  comparison.notes.insert(comparison.notes.begin(), compared.notes.begin(), compared.notes.end());
  if (!compared.beyond_budget.empty()) {
    for (DecompositionStep& step : comparison.decomposition) {
      const bool missing = step.from.empty() || step.to.empty();
      if (missing) step.withheld += "; " + compared.beyond_budget;
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
    forecast.OfRuns(total);
    progress.Show(done, total);
  };
  options.stop = StopRequested;
  SweepFolder out(folder, arguments.force);
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
  const bool any = !comparison.estimators.empty();  // else no run came to its end
  std::string no_figure;
  if (any) AddFiles(out, comparison);
  if (any) no_figure = WriteSeedReport(out.files(), comparison, compared.config, StopRequested);
  if (!no_figure.empty()) Log(LogLevel::kWarning, "figures: " + no_figure);
  out.Write(seeds.sweep, Summarise(seeds.sweep), compared.config);
  if (any) Report(comparison, arguments, folder);
  if (seeds.sweep.stopped && seeds.beyond_budget == 0) {
    TellStopped(seeds.sweep.done.size(), options.runs);
    return ExitCode::kStopped;
  }
  return CodeOf(comparison, failed > 0 ? ExitCode::kFound : ExitCode::kOk);
}

ExitCode CompareConfig(const CompareArguments& arguments) {
  Input input = arguments.input;
  input.config = arguments.of.front();
  Config config = input.Load();
  if (arguments.seed) config.Set("source.seed", std::to_string(*arguments.seed), "--seed");
  const Output output = OutputFolder(arguments.folder, config, input, arguments.force, "compare-");
  const PluginHost host = input.Host(config);
  StopOnSignals();
  ComparedExperiment compared = BuildComparedExperiment(config, host, arguments.options);
  if (!arguments.quiet) TellOutput(output);
  return arguments.options.over_seeds ? CompareOverSeeds(arguments, compared, host, output.folder)
                                      : CompareRun(arguments, compared, host, output.folder);
}

ExitCode CompareFinished(const CompareArguments& arguments) {
  KeepInputs(arguments.folder, arguments.of);
  std::vector<fs::path> folders;
  for (const std::string& folder : arguments.of) folders.emplace_back(folder);
  const Comparison comparison = CompareFolders(folders, arguments.options);
  if (!arguments.folder.empty()) {
    WriteComparison(comparison, arguments.folder, arguments.force);
  }
  Report(comparison, arguments, arguments.folder);
  return CodeOf(comparison, ExitCode::kOk);
}

/// Whether these are run folders; what is neither all folders nor one config is refused.
bool AreFolders(const std::vector<std::string>& of) {
  const auto is_folder = [](const std::string& path) {
    std::error_code error;
    return fs::is_directory(path, error);
  };
  if (std::ranges::all_of(of, is_folder)) return true;
  if (of.size() == 1) return false;
  const auto file = std::ranges::find_if_not(of, is_folder);
  throw CLI::ValidationError(
      "CONFIG | DIR...", "'" + *file + "' is not a folder; expected one config, or run folders");
}

/// Of finished runs.
void CheckOptions(const CLI::App& command) {
  for (const char* option : {"--runs", "--first-seed", "--jobs", "--seed", "--set", "--plugin-path",
                             "--allow-outside", "--figures", "--budget"}) {
    if (command.count(option) == 0) continue;
    throw CLI::ValidationError(option, "a finished run is not run again; expected a config");
  }
}

void AddOptions(CLI::App& command, CompareArguments& arguments) {
  command.add_option("CONFIG | DIR", arguments.of, "a config to run, or folders of finished runs")
      ->option_text(" ")
      ->required()
      ->check(IsNamed);
  command
      .add_option("--reference", arguments.options.reference,
                  "take errors from truth, or from an estimator; default: truth where it is known, "
                  "else the batch")
      ->option_text("truth|NAME");
  command
      .add_option("--filter", arguments.options.filter,
                  "the filter whose error is decomposed; default: the first")
      ->option_text("NAME");
  command.add_flag("--no-decomposition", arguments.no_decomposition,
                   "decompose no error, and add no estimators for it");
  command.add_option("--runs", arguments.sweep.runs, "compare over that many seeds")
      ->option_text("N")
      ->check(IsInteger(1, 1'000'000));
  command
      .add_option("--first-seed", arguments.sweep.first_seed, "seeds count up from S; default 1")
      ->option_text("S")
      ->check(IsInteger(0, std::int64_t{1} << 62))
      ->needs("--runs");
  command
      .add_option("--jobs", arguments.sweep.jobs,
                  "threads; default: all processors that may be used")
      ->option_text("J")
      ->check(IsInteger(1, 1024))
      ->needs("--runs");
  command
      .add_option("--budget", arguments.options.budget_s,
                  "begin no run that would end later; of one run, add nothing that takes longer")
      ->option_text("SECONDS")
      ->check(IsNumber(1e-9, 1e9));
  AddSeed(command, arguments.seed)->excludes("--first-seed");
  AddSets(command, arguments.input.sets,
          "set a key of the config, in dotted form; may be repeated");
  AddPluginPath(command, arguments.input.plugin_paths);
  command.add_flag("--allow-outside", arguments.input.allow_outside,
                   "let `include:` and `output:` of the config leave their folders");
  AddOutput(command, arguments.folder,
            "folder; default of a config: its `output:`, or compare-NAME, in runs/; of folders: "
            "none is written");
  command.add_flag("--force", arguments.force, "replace the folder if it is there");
  command.add_flag("--all", arguments.all, "print all rows of the tables");
  command.add_flag("--json", arguments.json, "print all values as JSON");
  command.add_flag("--markdown", arguments.markdown, "print the tables as Markdown")
      ->excludes("--json");
  command.add_flag("--latex", arguments.latex, "print the tables as LaTeX")
      ->excludes("--json")
      ->excludes("--markdown");
  command.add_flag("--figures", arguments.figures, "draw the figures of the run too")
      ->excludes("--runs");
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
    const bool folders = AreFolders(arguments->of);
    if (folders) CheckOptions(command);
    arguments->options.decompose = !arguments->no_decomposition;
    arguments->options.over_seeds = command.count("--runs") > 0;
    action = [arguments, folders] {
      return folders ? CompareFinished(*arguments) : CompareConfig(*arguments);
    };
  });
}

}  // namespace alidade::cli
