// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/simulate.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "alidade/base/text.h"
#include "command.h"
#include "console.h"
#include "video_name.h"

namespace alidade::cli {
namespace {

constexpr const char* kSimulateFooter = R"(Examples:
  alidade simulate config.yaml -o data/scene
  alidade simulate config.yaml -o data/scene-7 --seed 7
  alidade simulate config.yaml -o data/scene --video video.avi --images images
  alidade run other.yaml --set source.path=data/scene   if source.type is tracks

No estimator runs. STREAM.csv contains the measurements of a stream. Its columns are
frame,feature,dim,value for tracks and known. For other streams they are frame,t_s, the landmark
and the values. The folder also contains timestamps.csv, truth, map.csv and calibration.yaml. Images
show the textured surfaces of the source. Without surfaces, images show an equal disc at each
measured pixel. The images of a stereo pair are in DIR/left and DIR/right.)";

struct SimulateArguments {
  Input input;
  std::string folder;
  std::optional<std::uint64_t> seed;
  SimulateImages images;
  bool force = false, quiet = false;
};

std::string IsInside(const std::string& name) {
  const std::filesystem::path path = std::filesystem::path(name).lexically_normal();
  if (!path.empty() && path != "." && path != "./") return {};
  return "'" + name + "' is the output folder; expected a name inside this folder, such as images";
}

ExitCode RunSimulate(const SimulateArguments& arguments) {
  Config config = arguments.input.Load();
  if (arguments.seed) config.Set("source.seed", std::to_string(*arguments.seed), "--seed");
  const Output output =
      OutputFolder(arguments.folder, config, arguments.input, arguments.force, "data-");
  const std::filesystem::path& path = output.folder;
  const PluginHost host = arguments.input.HostFor(config);
  StopOnSignals();
  const SimulateResult result =
      Simulate(config, host, path, arguments.force, StopRequested, arguments.images);
  if (!arguments.quiet) {
    ReportOutput(output);
    std::string text = std::to_string(result.frames) + " frames\nwrote " + path.string() + '\n';
    for (const std::string& file : result.files) text += "  " + (path / file).string() + '\n';
    text += "\nrun it with: alidade run CONFIG --set source.path=" +
            internal::ShellWord(path.string()) +
            "   if source.type of CONFIG is tracks or tables\n";
    PrintText(text);
  }
  if (!result.stopped) return ExitCode::kOk;
  PrintNote("stopped after " + std::to_string(result.frames) +
            (result.frames == 1 ? " frame" : " frames"));
  return ExitCode::kStopped;
}

}  // namespace

void AddSimulate(CLI::App& program, Action& action) {
  CLI::App& command = *program.add_subcommand(
      "simulate", "Write the measurements of a config's source to files, which `run` can read");
  const auto arguments = std::make_shared<SimulateArguments>();
  arguments->input.AddTo(command);
  AddOutput(command, arguments->folder,
            "output folder; default: the config's `output:`, or data-NAME, in runs/");
  AddSeed(command, arguments->seed);
  command
      .add_option("--video", arguments->images.video,
                  "write the images as a video, FILE.avi in the output folder; needs OpenCV")
      ->option_text("FILE")
      ->check(IsAvi);
  command
      .add_option("--images", arguments->images.folder,
                  "write one PNG file per frame to DIR in the output folder; needs OpenCV")
      ->option_text("DIR")
      ->check(IsNonEmpty)
      ->check(IsInside);
  command.add_flag("--force", arguments->force, "replace the folder if it exists");
  command.add_flag("--quiet", arguments->quiet, "print errors only");
  command.footer(kSimulateFooter);
  command.callback(
      [&action, arguments] { action = [arguments] { return RunSimulate(*arguments); }; });
}

}  // namespace alidade::cli
