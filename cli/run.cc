// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/run.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "alidade/record/follower.h"
#include "alidade/record/live_run.h"
#include "alidade/record/recorder.h"
#include "alidade/record/run_viewer.h"
#include "alidade/replay/run_inputs.h"
#include "command.h"
#include "console.h"
#include "live_port.h"
#include "run_report.h"
#include "video_name.h"

namespace alidade::cli {
namespace {

constexpr const char* kRunFooter = R"(Examples:
  alidade run base.yaml                            write runs/base; a second run writes runs/base-2
  alidade run near/config.yaml                     write runs/near
  alidade run config.yaml -o runs/b --seed 2 --set estimators.ekf.gate=0.99
  alidade run config.yaml --set source.path=other.csv --force
  alidade run images.yaml --save-video run.avi     draw features, gates and the estimate
  tail -f log.csv | alidade run live.yaml --set source.path=/dev/stdin --follow | my_robot

The folder is called DIR.partial until the run ends. Ctrl-C finishes the frame, writes the results
so far and exits with code 75; a second Ctrl-C exits at once.)";

struct RunArguments {
  std::string command;  ///< complete command line
  Input input;
  std::string folder;
  std::optional<std::uint64_t> seed;
  bool force = false, quiet = false, verbose = false, covariances = false, all = false;
  bool follow = false, view = false, strict = false;
  std::string video, live;
};

/// Returns the text on standard output after a run.
std::string Summary(const RunArguments& arguments, const RunReport& report, const RunResult& result,
                    const Recorder& recorder) {
  std::string text = arguments.verbose
                         ? report.Verbose(result, recorder.conclusions(), arguments.all)
                         : report.Short(result, recorder.conclusions(), arguments.all);
  if (!arguments.video.empty()) text += "\nvideo    " + arguments.video + '\n';
  return text + ReportLine(recorder.folder());
}

/// Returns the viewer for the video and the window, or null if neither is requested.
std::unique_ptr<RunViewer> ViewerOf(const RunArguments& arguments, const Experiment& experiment,
                                    const Config& config) {
  if (arguments.video.empty() && !arguments.view) return nullptr;
  const std::filesystem::path video(arguments.video);
  ProtectInputs(video, config.inputs());
  ProtectInputs(video.parent_path() / (video.stem().string() + ".partial.avi"), config.inputs());
  const auto title = config.root().Find("title");
  auto viewer = std::make_unique<RunViewer>(experiment, title ? title->Text() : "alidade run");
  if (!arguments.video.empty()) viewer->AddVideo(arguments.video, arguments.force);
  if (arguments.view) viewer->AddWindow();
  return viewer;
}

/// Returns the server of the live page, or null if it is not requested.
std::unique_ptr<LiveRun> LiveRunOf(const RunArguments& arguments, const Config& config,
                                   const std::filesystem::path& folder) {
  if (arguments.live.empty()) return nullptr;
  auto live = std::make_unique<LiveRun>(PortOf(arguments.live), folder, config);
  if (!arguments.quiet) PrintNote("live page at " + live->address());
  return live;
}

/// Sends the report to the browsers that show the live page, and stops its server.
void FinishLive(LiveRun& live, const std::filesystem::path& folder, bool quiet) {
  live.Finish();
  if (quiet) return;
  PrintNote("the live page ended with " + std::to_string(live.dropped()) +
            " dropped updates; its report is " + (folder / "report.html").string());
}

/// Returns the options that affect the bytes of the run folder.
std::vector<std::string> ArgumentsOf(const RunArguments& arguments) {
  std::vector<std::string> list = {"run"};
  if (arguments.seed) list.insert(list.end(), {"--seed", std::to_string(*arguments.seed)});
  if (arguments.covariances) list.emplace_back("--covariances");
  return list;
}

Recorder::Options RecordOf(const RunArguments& arguments, const Config& config,
                           const std::filesystem::path& folder, const PluginHost& host) {
  Recorder::Options record{folder, arguments.force, arguments.command};
  record.covariances = arguments.covariances;
  if (!arguments.live.empty()) record.max_delay = LiveRun::kMaxDelay;
  record.plugins = internal::HashFiles(internal::FindUsedPlugins({config}, host));
  record.inputs =
      arguments.input.InputsText(config, ArgumentsOf(arguments), {config}, record.plugins);
  return record;
}

/// Returns whether no verdict is worse than `not tested`.
bool IsAcceptable(const RunResult& result) {
  return WorstVerdict(result).value_or(VerdictState::kConsistent) >= VerdictState::kNotTested;
}

ExitCode RunConfig(const RunArguments& arguments) {
  Config written = arguments.input.Load();
  if (arguments.seed) written.Set("source.seed", std::to_string(*arguments.seed), "--seed");
  const Output output = OutputFolder(arguments.folder, written, arguments.input, arguments.force);
  const PluginHost host = arguments.input.HostFor(written);
  StopOnSignals();  // BuildExperiment may wait for a pipe, which a signal must interrupt
  Experiment experiment = BuildExperiment(written, host);
  const Config& config = *experiment.config;
  const std::unique_ptr<RunViewer> viewer = ViewerOf(arguments, experiment, config);
  const std::unique_ptr<LiveRun> live = LiveRunOf(arguments, config, output.folder);
  Recorder recorder(RecordOf(arguments, config, output.folder, host), config);
  if (!arguments.quiet) ReportOutput(output);

  Progress progress("frames", arguments.quiet);
  RunOptions options;
  RunReport report(OutputWidth());
  options.observers = {&recorder, &report};
  Follower follower(Print);
  if (arguments.follow) options.observers.push_back(&follower);
  if (viewer) options.observers.push_back(viewer.get());
  if (live) options.observers.push_back(live.get());
  std::int64_t total_frames = -1;
  options.progress = [&](std::int64_t done, std::int64_t total) {
    total_frames = total;
    progress.Show(done, total);
  };
  options.stop = [&progress] {
    progress.Tick();
    return StopRequested();
  };
  const RunResult result = Run(experiment, options);
  progress.Clear();
  // Without a frame there is nothing to record, and the recorder removes the run folder.
  if (result.frames == 0 && result.status == RunStatus::kFailed)
    throw Error(result.code, result.reason);
  recorder.Finish(result);
  if (live) FinishLive(*live, output.folder, arguments.quiet);
  if (viewer) viewer->Close();
  if (!arguments.quiet && !arguments.follow) {
    PrintText(Summary(arguments, report, result, recorder));
  }
  if (result.status == RunStatus::kFailed) PrintErrors(result.reason);
  if (result.status == RunStatus::kStopped && !OutputClosed()) {
    PrintNote(result.reason +
              (total_frames > result.frames ? " of " + std::to_string(total_frames) : "") +
              "; the results so far are in " + recorder.folder().string());
  }
  return arguments.strict && result.code == ExitCode::kOk && !IsAcceptable(result)
             ? ExitCode::kFound
             : result.code;
}

}  // namespace

void AddRun(CLI::App& program, Action& action, const std::string& command_line) {
  CLI::App& command = *program.add_subcommand("run", "Run the estimators of a config");
  const auto arguments = std::make_shared<RunArguments>();
  arguments->command = command_line;
  arguments->input.AddTo(command);
  AddOutput(command, arguments->folder,
            "run folder; default: the config's `output:`, or the name of the config, in runs/");
  AddSeed(command, arguments->seed);
  command.add_flag("--force", arguments->force, "replace the run folder if it exists");
  command.add_flag("--all", arguments->all, "print all rows of the table");
  command.add_flag("-v,--verbose", arguments->verbose,
                   "also print the findings, the events and all reasons of the verdicts");
  command.add_flag("--quiet", arguments->quiet, "print errors only");
  command.add_flag("--strict", arguments->strict,
                   "exit with code 1 if a verdict is neither `consistent` nor `not tested`");
  command.add_flag("--follow", arguments->follow,
                   "print each estimate at once as a line of JSON; do not print the table");
  command
      .add_option("--save-video", arguments->video,
                  "save an annotated video (features, gates, estimate); needs OpenCV")
      ->option_text("FILE")
      ->check(IsAvi);
  command.add_flag("--view", arguments->view,
                   "show the annotated images in a window during the run");
  command
      .add_option("--live", arguments->live,
                  "serve the page of the run at 127.0.0.1 during the run; 0: any free port")
      ->option_text("PORT")
      ->check(IsLivePort);
  command.add_flag("--covariances", arguments->covariances,
                   "write the covariance of every estimate, for `alidade compare`");
  command.footer(kRunFooter);
  command.callback(
      [&action, arguments] { action = [arguments] { return RunConfig(*arguments); }; });
}

}  // namespace alidade::cli
