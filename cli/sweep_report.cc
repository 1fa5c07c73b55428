// SPDX-License-Identifier: Apache-2.0
#include "sweep_report.h"

#include <algorithm>

#include "alidade/io/output_folder.h"
#include "alidade/replay/run_inputs.h"
#include "alidade/sweep/worst_seeds.h"
#include "command.h"
#include "console.h"

namespace alidade::cli {
namespace {

constexpr const char* kResume = "; --resume continues the sweep";

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
                        ShellQuoted((folder / internal::kResolvedConfig).string()) + " --seed " +
                        std::to_string(worst.front().seeds.front());
  const internal::RecordedInputs recorded =
      internal::ReadInputs(inputs, (folder / internal::kInputsFile).string());
  for (const std::filesystem::path& path : recorded.command.plugin_paths) {
    command += " --plugin-path " + ShellQuoted(path.string());
  }
  return internal::WorstSeedLines(worst) + "repeat the run of a seed: " + command + '\n';
}

/// Prints the table of a sweep and the names of its main files.
void PrintWritten(const std::filesystem::path& path, const std::string& table,
                  const std::vector<std::string>& names) {
  std::string text = table + "\nwrote " + path.string() + '\n';
  for (const std::string& name : names) text += "  " + (path / name).string() + '\n';
  Print(text);
}

ExitCode CodeOf(bool stopped, bool failed) {
  if (stopped) return ExitCode::kStopped;
  return failed ? ExitCode::kFound : ExitCode::kOk;
}

}  // namespace

ExitCode FinishSweep(SweepFolder& folder, const std::filesystem::path& path,
                     const SweepResult& result, const Config& config, const std::string& inputs,
                     bool quiet) {
  const bool failed = ReportFailures(result, "");
  if (result.stopped) ReportStopped(result.done.size(), result.runs, kResume);
  const std::vector<SweepSummary> summaries = Summarise(result);
  folder.Write(result, summaries, config);
  if (!quiet) {
    const std::filesystem::path written = result.stopped ? internal::PartialOf(path) : path;
    PrintWritten(written, SweepTable(result, summaries) + WorstSeedText(result, written, inputs),
                 {"table.md", "sweep.json", "runs.csv"});
  }
  return CodeOf(result.stopped, failed);
}

ExitCode FinishSweep(SweepFolder& folder, const std::filesystem::path& path,
                     const VariedSweep& sweep, const Config& config, bool quiet) {
  const Variation& variation = sweep.variation;
  bool failed = false;
  std::size_t done = 0;
  for (std::size_t v = 0; v < sweep.results.size(); ++v) {
    const std::string prefix = variation.key + '=' + variation.values[v] + ", ";
    failed = ReportFailures(sweep.results[v], prefix) || failed;
    done += sweep.results[v].done.size();
  }
  const auto values = static_cast<std::int64_t>(variation.values.size());
  if (sweep.stopped()) ReportStopped(done, values * sweep.results.front().runs, kResume);
  const std::string note = folder.Write(sweep, config, StopRequested);
  if (!quiet) {
    const std::filesystem::path written = sweep.stopped() ? internal::PartialOf(path) : path;
    std::vector<std::string> names = {"table.md", "sweep.csv", "sweep.json", "runs.csv"};
    if (note.empty()) names.insert(names.begin(), "figures/vary.svg");
    const std::string reprojection = "figures/reprojection.svg";
    if (std::filesystem::exists(written / reprojection)) names.insert(names.begin(), reprojection);
    PrintWritten(written, SweepTable(sweep), names);
  }
  if (!note.empty()) Log(LogLevel::kWarning, "no figure was drawn: " + note);
  return CodeOf(sweep.stopped(), failed);
}

}  // namespace alidade::cli
