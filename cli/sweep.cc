// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/sweep.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <charconv>
#include <memory>
#include <utility>

#include "alidade/replay/run_inputs.h"
#include "alidade/sweep/finished_runs.h"
#include "alidade/sweep/sweep_config.h"
#include "command.h"
#include "console.h"
#include "sweep_report.h"

namespace alidade::cli {
namespace {

constexpr const char* kSweepFooter = R"(Examples:
  alidade sweep config.yaml --runs 200             use seeds 1 to 200 and all processors
  alidade sweep config.yaml --runs 200 --first-seed 1001 -o runs/test
  alidade sweep config.yaml --runs 10000 --shard 3/16 -o runs/shard-03
  alidade sweep config.yaml --runs 200 --vary sensors.stereo.sigma_px=0.5,1,2
  alidade sweep config.yaml --runs 200 --vary-filter state.robot.noise.acceleration=0.1,1
  alidade sweep config.yaml --runs 200 -o runs/test --resume

The folder contains sweep.json, runs.csv and table.md. With --vary or --vary-filter, it also
contains sweep.csv. The number of jobs does not change the contents. Exit code 1: some
runs failed; 75: a signal stopped the sweep. Until all runs are finished, the folder is called
FOLDER.partial. A sweep that was stopped or killed leaves this folder, and --resume adds the missing
runs. `alidade merge` merges the folders of shards.)";

struct SweepArguments {
  std::string command;  ///< complete command line
  Input input;
  std::string folder;
  std::string vary;  ///< "": no key is varied
  Variation::Scope scope = Variation::Scope::kConfig;
  SweepOptions options;
  bool force = false, quiet = false, resume = false;
};

void ReadShard(const std::string& text, SweepOptions& options) {
  const auto parse_number = [](const std::string& part, int& number) {
    const char* const end = part.data() + part.size();
    const auto [parsed_end, error] = std::from_chars(part.data(), end, number);
    return error == std::errc() && parsed_end == end && !part.starts_with('0');
  };
  const std::size_t slash = text.find('/');
  Shard& shard = options.shard.emplace();
  const bool is_valid = slash != std::string::npos &&
                        parse_number(text.substr(0, slash), shard.index) &&
                        parse_number(text.substr(slash + 1), shard.count);
  if (is_valid && shard.index >= 1 && shard.index <= shard.count) return;
  throw CLI::ValidationError("--shard",
                             "'" + text + "' is not a shard; expected i/n with 1 <= i <= n");
}

/// Requires at least one run for each shard.
void CheckShards(const SweepOptions& options) {
  if (!options.shard || options.shard->count <= options.runs) return;
  throw CLI::ValidationError("--shard", std::to_string(options.shard->count) + " shards of " +
                                            std::to_string(options.runs) +
                                            " runs; expected at least one run for each shard");
}

/// Inputs that both kinds of sweep need.
struct Task {
  const SweepArguments& arguments;
  const Config& config;
  const PluginHost& host;
  const std::filesystem::path& path;
  const std::string& inputs;  ///< text of inputs.json
  Progress& progress;
};

/// Opens the folder of the sweep. Reads the runs that are already finished into `options`.
std::unique_ptr<SweepFolder> OpenFolder(const Task& task, SweepOptions& options) {
  const SweepArguments& arguments = task.arguments;
  auto folder = std::make_unique<SweepFolder>(
      SweepFolder::Options{task.path, arguments.force, task.inputs, arguments.resume,
                           options.shard.has_value()},
      task.config);
  options.finished = folder->finished();
  if (const std::size_t count = options.finished->size(); count > 0 && !arguments.quiet) {
    PrintNote("resuming " + folder->files().partial().string() + ": " + std::to_string(count) +
              (count == 1 ? " run is finished" : " runs are finished"));
  }
  return folder;
}

ExitCode SweepSeeds(const Task& task, SweepOptions options) {
  const std::unique_ptr<SweepFolder> folder = OpenFolder(task, options);
  const SweepResult result = Sweep(task.config, task.host, options);
  task.progress.Clear();
  return FinishSweep(*folder, task.path, result, task.config, task.inputs, task.arguments.command,
                     task.arguments.quiet);
}

ExitCode SweepValues(const Task& task, SweepOptions options) {
  const Variation variation = Variation::FromText(task.arguments.vary, task.arguments.scope);
  const std::unique_ptr<SweepFolder> folder = OpenFolder(task, options);
  const VariedSweep sweep = SweepVariation(task.config, task.host, options, variation);
  task.progress.Clear();
  return FinishSweep(*folder, task.path, sweep, task.config, task.arguments.command,
                     task.arguments.quiet);
}

/// For --resume: returns true if `folder` is a finished sweep of this config and these inputs.
/// Error: kCannotCreate if the folder was made from different inputs.
bool IsFinished(const std::filesystem::path& folder, const Config& config,
                const std::string& inputs) {
  if (!std::filesystem::exists(folder / internal::kInputsFile)) return false;
  const std::string difference = internal::DescribeDifferences(
      internal::ReadInputTexts(folder), (folder / internal::kInputsFile).string(),
      {config.ToYaml(), inputs});
  if (difference.empty()) return true;
  throw Error(ExitCode::kCannotCreate,
              ErrorLine(Place{folder.string()}, {},
                        "the folder was made from other inputs: " + difference) +
                  "; to replace the folder, use --force instead of --resume");
}

/// Returns the config of the runs, or one config for each varied value. Omits values that cannot be
/// set, because the sweep reports these values.
std::vector<Config> ConfigsOf(const SweepArguments& arguments, const Config& config) {
  if (arguments.vary.empty()) return {config};
  const Variation variation = Variation::FromText(arguments.vary, arguments.scope);
  std::vector<Config> configs;
  for (const std::string& value : variation.values) {
    try {
      Config varied_config = config.Copy();
      variation.Set(varied_config, value);
      configs.push_back(std::move(varied_config));
    } catch (const Error&) {
    }
  }
  return configs;
}

/// Returns the options that affect the contents of the folder.
std::vector<std::string> ArgumentsOf(const SweepArguments& arguments) {
  const SweepOptions& options = arguments.options;
  std::vector<std::string> list = {"sweep", "--runs", std::to_string(options.runs), "--first-seed",
                                   std::to_string(options.first_seed)};
  if (const std::optional<Shard>& shard = options.shard) {
    list.insert(list.end(),
                {"--shard", std::to_string(shard->index) + '/' + std::to_string(shard->count)});
  }
  if (!arguments.vary.empty()) {
    list.insert(list.end(), {Variation::OptionOf(arguments.scope), arguments.vary});
  }
  return list;
}

ExitCode RunSweep(const SweepArguments& arguments) {
  const Config config = arguments.input.Load();
  const Output output =
      OutputFolder(arguments.folder, config, arguments.input, arguments.force, "sweep-");
  const std::filesystem::path& path = output.folder;
  const std::vector<Config> configs = ConfigsOf(arguments, config);
  const PluginHost host = arguments.input.HostFor(config, configs);
  StopOnSignals("stopping the unfinished runs");
  const std::string inputs =
      arguments.input.InputsText(config, ArgumentsOf(arguments), configs,
                                 internal::HashFiles(internal::FindUsedPlugins(configs, host)));
  if (arguments.resume && IsFinished(path, config, inputs)) {
    if (!arguments.quiet) PrintNote(path.string() + " is already finished");
    return std::filesystem::exists(path / "failures.csv") ? ExitCode::kFound : ExitCode::kOk;
  }
  Progress progress("runs", arguments.quiet);
  SweepOptions options = arguments.options;
  bool is_reported = arguments.quiet;
  options.progress = [&](std::int64_t done, std::int64_t total) {
    // Progress implies that the config is valid, so the output folder can be reported now.
    if (!std::exchange(is_reported, true)) ReportOutput(output);
    progress.Show(done, total);
  };
  options.first_run_progress = [&](std::int64_t done, std::int64_t total) {
    progress.Show(done, total, "frames of the first run");
  };
  options.stop = StopRequested;
  const Task task{arguments, config, host, path, inputs, progress};
  return arguments.vary.empty() ? SweepSeeds(task, options) : SweepValues(task, options);
}

/// Adds the option that varies keys of the given scope.
CLI::Option* AddVariation(CLI::App& command, SweepArguments& arguments, Variation::Scope scope,
                          const char* help) {
  const auto read = [&arguments, scope](const std::string& text) {
    arguments.vary = text;
    arguments.scope = scope;
  };
  return command.add_option_function<std::string>(Variation::OptionOf(scope), read, help)
      ->option_text("KEY=v1,v2,...")
      ->check(IsNonEmpty);
}

}  // namespace

void AddSweep(CLI::App& program, Action& action, const std::string& command_line) {
  CLI::App& command = *program.add_subcommand("sweep", "Run a config with many seeds");
  const auto arguments = std::make_shared<SweepArguments>();
  arguments->command = command_line;
  arguments->input.AddTo(command);
  command.add_option("--runs", arguments->options.runs, "total number of runs, over all shards")
      ->option_text("N")
      ->required()
      ->check(IsInteger(1, 1'000'000));
  command
      .add_option("--first-seed", arguments->options.first_seed,
                  "use the seeds S, S + 1, ...; default 1")
      ->option_text("S")
      ->check(IsInteger(0, std::int64_t{1} << 62));
  command
      .add_option("--jobs", arguments->options.jobs,
                  "number of threads; default: all available processors")
      ->option_text("J")
      ->check(IsInteger(1, 1024));
  const auto read_shard = [arguments](const std::string& text) {
    ReadShard(text, arguments->options);
  };
  command
      .add_option_function<std::string>("--shard", read_shard,
                                        "run only the seeds of shard i of n equal shards")
      ->option_text("i/n");
  AddVariation(command, *arguments, Variation::Scope::kConfig,
               "run all seeds with each value of a key, or of several keys KEY+KEY");
  AddVariation(command, *arguments, Variation::Scope::kEstimators,
               "like --vary, but only the estimators have the values: truth and the data of the "
               "source keep the value of the config")
      ->excludes(command.get_option("--vary"));
  AddOutput(command, arguments->folder,
            "output folder; default: the config's `output:`, or sweep-NAME, in runs/");
  command.add_flag("--force", arguments->force, "replace the folder if it exists");
  command
      .add_flag("--resume", arguments->resume,
                "add the missing runs to FOLDER.partial, the folder of a stopped sweep")
      ->needs(command.get_option("--output"))
      ->excludes(command.get_option("--force"));
  command.add_flag("--quiet", arguments->quiet, "print errors only");
  command.footer(kSweepFooter);
  command.callback([&action, arguments] {
    CheckShards(arguments->options);
    action = [arguments] { return RunSweep(*arguments); };
  });
}

}  // namespace alidade::cli
