// SPDX-License-Identifier: Apache-2.0
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "alidade/sweep/shards.h"
#include "command.h"
#include "console.h"
#include "sweep_report.h"

namespace alidade::cli {
namespace {

constexpr const char* kMergeFooter = R"(Examples:
  alidade sweep config.yaml --runs 1000 --shard 1/2 -o runs/shard-1
  alidade sweep config.yaml --runs 1000 --shard 2/2 -o runs/shard-2
  alidade merge runs/shard-1 runs/shard-2 -o runs/whole

The merged folder is equal, byte for byte, to the folder of one sweep over all runs. Exit code 1:
some runs failed; 65: a shard is missing, occurs twice, is not finished, or belongs to another
sweep.)";

struct MergeArguments {
  std::vector<std::string> shards;
  std::string folder;
  bool force = false, quiet = false;
};

ExitCode Merge(const MergeArguments& arguments) {
  ProtectInputs(arguments.folder, arguments.shards);
  const std::filesystem::path path = arguments.folder;
  StopOnSignals();
  const internal::MergedSweep merged =
      internal::MergeShards({arguments.shards.begin(), arguments.shards.end()});
  SweepFolder folder({path, arguments.force, merged.inputs}, merged.config);
  if (!merged.variation) {
    return FinishSweep(folder, path, merged.results.front(), merged.config, merged.inputs,
                       "alidade merge", arguments.quiet);
  }
  const VariedSweep sweep{*merged.variation, merged.results, merged.warning};
  return FinishSweep(folder, path, sweep, merged.config, "alidade merge", arguments.quiet);
}

}  // namespace

void AddMerge(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand("merge", "Merge the shards of a sweep");
  const auto arguments = std::make_shared<MergeArguments>();
  command.add_option("DIR", arguments->shards, "the folders of all shards of a sweep")
      ->option_text("...")
      ->required()
      ->check(IsNonEmpty);
  AddOutput(command, arguments->folder, "the folder of the merged sweep");
  command.get_option("--output")->required();
  command.add_flag("--force", arguments->force, "replace the folder if it exists");
  command.add_flag("--quiet", arguments->quiet, "print errors only");
  command.footer(kMergeFooter);
  command.callback([&action, arguments] { action = [arguments] { return Merge(*arguments); }; });
}

}  // namespace alidade::cli
