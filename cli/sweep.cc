// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <charconv>
#include <memory>

#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kFooter = R"(Examples:
  alidade sweep config.yaml --runs 200             seeds 1 to 200, all processors
  alidade sweep config.yaml --runs 200 --first-seed 1001 -o runs/test
  alidade sweep config.yaml --runs 10000 --shard 3/16 -o runs/share-03

The folder gets sweep.json, runs.csv and table.md. The number of jobs does not change a byte of
them. Exit code 1: some runs failed; 75: stopped by a signal, with what was complete written.)";

struct Arguments {
  Input input;
  std::string folder;
  SweepOptions options;
  bool force = false, quiet = false;
};

void ReadShard(const std::string& text, SweepOptions& options) {
  const auto read = [](const std::string& part, int& number) {
    const char* const end = part.data() + part.size();
    const auto [rest, error] = std::from_chars(part.data(), end, number);
    return error == std::errc() && rest == end;
  };
  const std::size_t slash = text.find('/');
  const bool two = slash != std::string::npos && read(text.substr(0, slash), options.shard) &&
                   read(text.substr(slash + 1), options.shards);
  if (two && options.shard >= 1 && options.shard <= options.shards) return;
  throw CLI::ValidationError("--shard",
                             "'" + text + "' is no share; expected i/n with 1 <= i <= n");
}

/// Every share has a run, so that each gives a result.
void CheckShares(const SweepOptions& options) {
  if (options.shards <= options.runs) return;
  throw CLI::ValidationError("--shard", std::to_string(options.shards) + " shares of " +
                                            std::to_string(options.runs) +
                                            " runs; expected a run for each share");
}

/// Tells of the runs that failed, the first few in full; true where there are any.
bool ReportFailures(const SweepResult& result) {
  constexpr int kShown = 5;
  int failed = 0;
  for (const SweepRun& run : result.done) {
    if (run.status != RunStatus::kFailed) continue;
    if (++failed <= kShown) PrintErrors("seed " + std::to_string(run.seed) + ": " + run.reason);
  }
  if (failed > kShown) PrintErrors(std::to_string(failed) + " runs failed: see failures.csv");
  return failed > 0;
}

ExitCode RunSweep(const Arguments& arguments) {
  const Config config = arguments.input.Load();
  const std::filesystem::path path =
      OutputFolder(arguments.folder, config, arguments.input, "sweep-");
  const PluginHost host = arguments.input.Host(config);
  SweepFolder folder(path, arguments.force);

  ReportCrashes();
  StopOnSignals();
  Progress progress("runs", arguments.quiet);
  SweepOptions options = arguments.options;
  options.progress = [&](std::int64_t done, std::int64_t total) { progress.Show(done, total); };
  options.stop = StopRequested;
  const SweepResult result = Sweep(config, host, options);
  progress.Clear();
  const bool failed = ReportFailures(result);
  if (result.stopped) {
    PrintNote("stopped after " + std::to_string(result.done.size()) + " of " +
              std::to_string(result.runs) + " runs");
  }
  folder.Write(result, config);
  if (!arguments.quiet) {
    Print(SweepTable(result) + "\nwrote " + path.string() + "\n  " + (path / "table.md").string() +
          "\n  " + (path / "sweep.json").string() + "\n  " + (path / "runs.csv").string() + '\n');
  }
  if (result.stopped) return ExitCode::kStopped;
  return failed ? ExitCode::kFound : ExitCode::kOk;
}

}  // namespace

void AddSweep(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand("sweep", "Run a config with many seeds");
  const auto arguments = std::make_shared<Arguments>();
  arguments->input.AddTo(command);
  command.add_option("--runs", arguments->options.runs, "number of runs, of all shards together")
      ->option_text("N")
      ->required()
      ->check(IsInteger(1, 1'000'000));
  command
      .add_option("--first-seed", arguments->options.first_seed, "seeds count up from S; default 1")
      ->option_text("S")
      ->check(IsInteger(0, std::int64_t{1} << 62));
  command.add_option("--jobs", arguments->options.jobs, "threads; default: all processors")
      ->option_text("J")
      ->check(IsInteger(1, 1024));
  const auto read_shard = [arguments](const std::string& text) {
    ReadShard(text, arguments->options);
  };
  command
      .add_option_function<std::string>("--shard", read_shard, "do share i of n of the seeds only")
      ->option_text("i/n");
  AddOutput(command, arguments->folder,
            "folder; default: the config's `output:`, or sweep-NAME, in runs/");
  command.add_flag("--force", arguments->force, "replace the folder if it is there");
  command.add_flag("--quiet", arguments->quiet, "print errors only");
  command.footer(kFooter);
  command.callback([&action, arguments] {
    CheckShares(arguments->options);
    action = [arguments] { return RunSweep(*arguments); };
  });
}

}  // namespace alidade::cli
