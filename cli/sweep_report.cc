// SPDX-License-Identifier: Apache-2.0
#include "sweep_report.h"

#include "alidade/base/text.h"
#include "alidade/io/output_folder.h"
#include "alidade/replay/run_inputs.h"
#include "alidade/sweep/worst_seeds.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

/// Prints the reasons why the first few runs failed. If more runs failed, also prints the number of
/// failed runs. Each line begins with `prefix`. Returns true if a run failed.
bool ReportFailures(const SweepResult& result, const std::string& prefix) {
  constexpr int kShown = 5;
  int failed = 0;
  for (const SweepRun& run : result.done) {
    if (run.status != RunStatus::kFailed) continue;
    if (++failed <= kShown)
      PrintErrors(prefix + "seed " + std::to_string(run.seed) + ": " + run.reason);
  }
  if (failed > kShown)
    PrintErrors(prefix + std::to_string(failed) + " runs failed: see failures.csv");
  return failed > 0;
}

/// Returns the lines of the worst seeds, and the command that repeats the run of the worst. Returns
/// "" if no seeds are listed. `inputs` is the text of inputs.json.
std::string WorstSeedText(const SweepResult& result, const std::filesystem::path& folder,
                          const std::string& inputs) {
  const std::vector<internal::WorstSeeds> worst = internal::FindWorstSeeds(result);
  if (worst.empty()) return "";
  std::string command = "alidade run " +
                        internal::ShellWord((folder / internal::kResolvedConfig).string()) +
                        " --seed " + std::to_string(worst.front().seeds.front());
  const internal::RecordedInputs recorded =
      internal::ReadInputs(inputs, (folder / internal::kInputsFile).string());
  for (const std::filesystem::path& path : recorded.command.plugin_paths) {
    command += " --plugin-path " + internal::ShellWord(path.string());
  }
  return internal::WorstSeedLines(worst) + "repeat the run of a seed: " + command + '\n';
}

/// Returns the command that continues a stopped sweep, as the end of a message. `command_line` is
/// the command that was stopped.
std::string ContinueText(std::string command_line, const std::filesystem::path& path) {
  command_line += ' ';
  const std::string force = " --force ";
  if (const std::size_t found = command_line.find(force); found != command_line.npos) {
    command_line.erase(found, force.size() - 1);
  }
  const bool has_output = command_line.find(" -o") != command_line.npos ||
                          command_line.find(" --output") != command_line.npos;
  const bool resumes = command_line.find(" --resume ") != command_line.npos;
  return "; continue with: " + command_line +
         (has_output ? "" : "-o " + internal::ShellWord(path.string()) + ' ') +
         (resumes ? "" : "--resume");
}

ExitCode CodeOf(bool stopped, bool failed) {
  if (stopped) return ExitCode::kStopped;
  return failed ? ExitCode::kFound : ExitCode::kOk;
}

}  // namespace

ExitCode FinishSweep(SweepFolder& folder, const std::filesystem::path& path,
                     const SweepResult& result, const Config& config, const std::string& inputs,
                     const std::string& command_line, bool quiet) {
  const bool failed = ReportFailures(result, "");
  if (result.stopped)
    ReportStopped(result.done.size(), result.runs, ContinueText(command_line, path));
  const std::vector<SweepSummary> summaries = Summarise(result);
  folder.Write(result, summaries, config);
  if (!quiet) {
    const std::filesystem::path written = result.stopped ? internal::PartialOf(path) : path;
    PrintText(SweepTable(result, summaries, OutputWidth()) +
              WorstSeedText(result, written, inputs) +
              "all metrics: " + (written / "table.md").string() + '\n' + ReportLine(written));
  }
  return CodeOf(result.stopped, failed);
}

ExitCode FinishSweep(SweepFolder& folder, const std::filesystem::path& path,
                     const VariedSweep& sweep, const Config& config,
                     const std::string& command_line, bool quiet) {
  const Variation& variation = sweep.variation;
  bool failed = false;
  std::size_t done = 0;
  for (std::size_t v = 0; v < sweep.results.size(); ++v) {
    const std::string prefix = variation.key + '=' + variation.values[v] + ", ";
    failed = ReportFailures(sweep.results[v], prefix) || failed;
    done += sweep.results[v].done.size();
  }
  const auto values = static_cast<std::int64_t>(variation.values.size());
  if (sweep.stopped())
    ReportStopped(done, values * sweep.results.front().runs, ContinueText(command_line, path));
  folder.Write(sweep, config);
  if (!quiet) {
    const std::filesystem::path written = sweep.stopped() ? internal::PartialOf(path) : path;
    PrintText(SweepTable(sweep, OutputWidth()) + ReportLine(written));
  }
  return CodeOf(sweep.stopped(), failed);
}

}  // namespace alidade::cli
