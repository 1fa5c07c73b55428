// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "alidade/config/config.h"
#include "support/temporary_folder.h"

namespace alidade::testing {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

inline std::string ReadText(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

inline bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Returns `text` with one blank in place of each sequence of blanks and line ends.
inline std::string Unwrapped(const std::string& text) {
  std::istringstream words(text);
  std::string unwrapped;
  for (std::string word; words >> word;) unwrapped += word + ' ';
  return unwrapped;
}

/// Result of a finished program.
struct Outcome {
  int code = -1;   ///< exit code; -1 if a signal ended the program
  int signal = 0;  ///< signal that ended the program; 0 if it exited
  std::string out, err;
};

// Common part of the configs below.
inline const std::string kTargetConfig = R"(alidade: 1
state:
  target:
    model: constant_velocity
    blocks: {position: depth, velocity: depth_rate}
    noise: {kind: discrete, acceleration: 1.0}
    initial: {depth: {mean: 0.3, sigma: 0.1}, depth_rate: {mean: 0, sigma: 0.5}}
)";
inline const std::string kStereoConfig = R"(sensors:
  stereo: {model: stereo_disparity, stream: disparity, roles: {depth: target.depth},
           focal_px: 400, baseline_m: 0.065, sigma_px: 1.0}
)";

/// Config of a target whose depth is measured by a stereo pair and by its image size.
inline const std::string kDepthConfig =
    kTargetConfig + R"(  template:
    model: constant
    blocks: {value: inverse_distance}
    initial: {inverse_distance: {mean: 3.3, sigma: 0.5}}
)" + kStereoConfig +
    R"(  scale:  {model: scale_2d, stream: inverse_scale, template_px: 300, sigma_px: 1.0,
           roles: {depth: target.depth, inverse_distance: template.inverse_distance}}
source: {type: depth_target, seed: 1}
estimators: {ekf: {type: ekf, gate: 0.999}}
reference: truth
)";

/// Config with the stereo sensor only, and data from a table.
inline const std::string kTableConfig =
    kTargetConfig + kStereoConfig +
    R"(source: {type: tables, path: table.csv, streams: {disparity: d}}
estimators: {ekf: {type: ekf}}
)";

/// Test that runs the program of this build in a temporary folder with `config.yaml` and
/// `table.yaml`. The name of the folder is `config`. A run of config.yaml therefore writes to
/// `runs/config`.
class ProgramTest : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(folder_);
    Write("config.yaml", kDepthConfig);
    Write("table.yaml", kTableConfig);
    ::unsetenv("ALIDADE_PLUGIN_PATH");
    ::setenv("COLUMNS", "200", 1);  // long lines are not wrapped
    ::setenv("XDG_DATA_HOME", (folder_ / "data").c_str(), 1);
  }

  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  std::string Read(const std::string& name) const { return ReadText(folder_ / name); }
  /// Reads a JSON file whose root is an object. The reader of configs can read it, because JSON is
  /// also YAML.
  Config Json(const std::string& name) const { return Config::FromText(Read(name), name); }
  bool Exists(const std::string& name) const { return fs::exists(folder_ / name); }

  /// Starts `alidade ARGUMENTS...`, with the output redirected to files. If `before_` is not empty,
  /// a shell runs this command first, for example to set limits or to redirect streams.
  pid_t Start(Arguments arguments, const std::string& out = "stdout") const {
    arguments.insert(arguments.begin(), ALIDADE_BINARY_DIR "/bin/alidade");
    if (!before_.empty()) {
      const Arguments shell = {"/bin/sh", "-c", before_ + "; exec \"$0\" \"$@\""};
      arguments.insert(arguments.begin(), shell.begin(), shell.end());
    }
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder_.c_str());
    constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "stderr", kFlags, 0600);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), kFlags, 0600);
    pid_t pid = -1;
    const int error = ::posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    EXPECT_EQ(error, 0) << "cannot start " << argv[0];
    return pid;
  }
  Outcome Wait(pid_t pid) const {
    int status = 0;
    EXPECT_EQ(::waitpid(pid, &status, 0), pid);
    Outcome outcome;
    if (WIFEXITED(status)) outcome.code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) outcome.signal = WTERMSIG(status);
    outcome.out = Read("stdout");
    outcome.err = Read("stderr");
    return outcome;
  }
  Outcome Call(Arguments arguments, const std::string& out = "stdout") const {
    return Wait(Start(std::move(arguments), out));
  }

  /// Returns `arguments`, extended by an initial state that makes the filter diverge: 0.3 m away,
  /// approaching the camera at 5 m/s.
  static Arguments Diverging(Arguments arguments) {
    arguments.insert(arguments.end(),
                     {"--set", "state.target.initial.depth_rate={mean: -5, sigma: 0}", "--set",
                      "state.target.initial.depth={mean: 0.3, sigma: 0}"});
    return arguments;
  }

  /// Waits until `condition` holds, for at most 20 s. Returns false if it does not hold by then.
  template <class Condition>
  static bool Eventually(const Condition& condition) {
    for (int i = 0; i < 2000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  const TemporaryFolder temporary_;
  fs::path folder_ = temporary_ / "config";
  std::string before_;
};

}  // namespace alidade::testing
