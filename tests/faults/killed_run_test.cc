// SPDX-License-Identifier: Apache-2.0
//
// FAULTS 91: a run that is killed at any moment, and then `--resume`, gives the bytes of one that
// was not interrupted. ALIDADE_KILLS says how often each is killed, as in CONTRIBUTING.md.
#include <random>

#include "support/run_files.h"

namespace alidade::testing {
namespace {

class KilledRun : public ProgramTest {
 protected:
  /// Kills and resumes `command`, which goes to `out`, until it is finished, again and again.
  void KillAndResume(const Arguments& command) {
    const Arguments whole = With(command, {"-o", "whole"});
    const auto start = std::chrono::steady_clock::now();
    ASSERT_EQ(Call(whole).code, 0) << Read("stderr");
    double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    int kept = 0;
    for (int round = 0; round < Rounds(); ++round) {
      SCOPED_TRACE(round);
      const Arguments into = With(command, {"-o", "out"});
      Kill(into, round, took_s);
      kept += Leftovers() > 0 ? 1 : 0;
      const Arguments resumed = With(into, {"--resume"});
      if (round % 3 == 2) Kill(resumed, round, took_s);  // the one that resumes, too
      const Outcome end = Call(resumed);
      ASSERT_EQ(end.code, 0) << end.err;
      ExpectSameFiles(folder_ / "out", folder_ / "whole");
      EXPECT_EQ(Leftovers(), 0) << end.err;
      fs::remove_all(folder_ / "out");
    }
    EXPECT_GE(kept, Rounds() / 4);
  }

 private:
  static int Rounds() {
    const char* const variable = std::getenv("ALIDADE_KILLS");
    return variable == nullptr ? 4 : std::atoi(variable);
  }
  static Arguments With(Arguments arguments, const Arguments& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  /// At a random moment: of its whole time, or (every other round) of that after its first rows.
  /// One that had ended before tells that it takes less than `took_s`: less runs beside it now.
  void Kill(const Arguments& arguments, int round, double& took_s) {
    const pid_t process = Start(arguments);
    if (round % 2 == 1) {
      const std::string mark = ".out.partial-" + std::to_string(process) + "/.keep";
      const auto begun = [&] { return Exists(mark) || Exists("out"); };
      for (int i = 0; i < 20'000 && !begun(); ++i) {
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      }
    }
    const double most_s = round % 2 == 1 ? 0.5 * took_s : took_s;
    const double fraction = std::uniform_real_distribution<>(0.0, 1.0)(random_);
    std::this_thread::sleep_for(std::chrono::duration<double>(fraction * most_s));
    ::kill(process, SIGKILL);
    if (Wait(process).code == 0) took_s *= 0.5;
  }
  /// Folders next to `out` that hold what an unfinished run wrote.
  int Leftovers() const {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      count += name.starts_with("out.failed-") || name.starts_with(".out.") ? 1 : 0;
    }
    return count;
  }

  std::mt19937 random_{91};
};

TEST_F(KilledRun, OfAFilterIsResumedToTheSameBytes) {
  KillAndResume({"run", ALIDADE_SOURCE_DIR "/examples/05_depth_principled/config.yaml", "--quiet",
                 "--no-figures", "--set", "source.duration_s=300"});
}

TEST_F(KilledRun, OfAMapIsResumedToTheSameBytes) {
  KillAndResume({"run", ALIDADE_SOURCE_DIR "/examples/10_slam_scene/config.yaml", "--quiet",
                 "--no-figures", "--covariances", "--set", "source.max_frames=150"});
}

TEST_F(KilledRun, OfASweepIsResumedToTheSameBytes) {
  KillAndResume(
      {"sweep", "config.yaml", "--quiet", "--runs", "30", "--set", "source.duration_s=20"});
}

}  // namespace
}  // namespace alidade::testing
