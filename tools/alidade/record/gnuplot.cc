// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/gnuplot.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <thread>

namespace alidade::internal {
namespace {

using End = GnuplotResult::End;

/// The environment of this process, with the language of numbers and messages set to C.
std::vector<std::string> Environment() {
  std::vector<std::string> variables;
  for (char** v = environ; v != nullptr && *v != nullptr; ++v) {
    if (std::strncmp(*v, "LC_", 3) != 0 && std::strncmp(*v, "GNUPLOT", 7) != 0) {
      variables.emplace_back(*v);
    }
  }
  variables.emplace_back("LC_ALL=C");
  return variables;
}

std::vector<char*> Pointers(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

/// Waits for the child, or ends it where a limit is reached.
End WaitFor(pid_t child, const DrawingLimits& limits, int* status) {
  End end = End::kDrawn;
  while (end == End::kDrawn) {
    const pid_t done = ::waitpid(child, status, WNOHANG);
    // A Ctrl-C ends gnuplot too.
    if (limits.stop && limits.stop()) end = End::kStopped;
    if (done == child || (done < 0 && errno != EINTR)) return end;
    if (std::chrono::steady_clock::now() > limits.end) end = End::kTimeUp;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, status, 0);
  return end;
}

/// "" where it ended well.
std::string HowItEnded(int status) {
  if (WIFSIGNALED(status)) return "was ended by signal " + std::to_string(WTERMSIG(status));
  const int code = WEXITSTATUS(status);
  return code == 0 ? "" : "failed with exit code " + std::to_string(code);
}

/// The line of gnuplot's complaint that says what is wrong: the last that is not empty.
std::string Complaint(const std::filesystem::path& log) {
  std::ifstream stream(log);
  std::string line, last;
  while (std::getline(stream, line)) {
    if (line.find_first_not_of(" \t^") != line.npos) last = line;
  }
  return last;
}

}  // namespace

GnuplotResult RunGnuplot(const std::filesystem::path& folder,
                         const std::vector<std::string>& arguments, const DrawingLimits& limits) {
  if (limits.stop && limits.stop()) return {End::kStopped, ""};
  const std::filesystem::path log = folder / "figures/.gnuplot.log";
  std::vector<std::string> words = {"gnuplot", "-d"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<std::string> variables = Environment();
  const std::vector<char*> argv = Pointers(words), environment = Pointers(variables);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "figures/.gnuplot.log",
                                   O_WRONLY | O_CREAT | O_TRUNC, 0666);
  pid_t child = 0;
  const int error =
      ::posix_spawnp(&child, "gnuplot", &actions, nullptr, argv.data(), environment.data());
  posix_spawn_file_actions_destroy(&actions);

  GnuplotResult result;
  int status = 0;
  if (error == ENOENT) {
    result.end = End::kMissing;
  } else if (error != 0) {
    result = {End::kFailed, std::string("gnuplot does not start: ") + std::strerror(error)};
  } else {
    result.end = WaitFor(child, limits, &status);
    const std::string how = HowItEnded(status);
    if (result.end == End::kDrawn && !how.empty()) {
      const std::string complaint = Complaint(log);
      result = {End::kFailed, "gnuplot " + how + (complaint.empty() ? "" : ": " + complaint)};
    }
  }
  std::error_code ignored;
  std::filesystem::remove(log, ignored);
  return result;
}

std::string Obstacle(GnuplotResult::End end) {
  switch (end) {
    case GnuplotResult::End::kMissing:
      return "gnuplot is not installed";
    case GnuplotResult::End::kStopped:
      return "the drawing was stopped";
    case GnuplotResult::End::kTimeUp:
      return "gnuplot took too long";
    case GnuplotResult::End::kDrawn:
    case GnuplotResult::End::kFailed:
      break;
  }
  return "";
}

}  // namespace alidade::internal
