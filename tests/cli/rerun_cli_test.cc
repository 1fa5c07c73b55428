// SPDX-License-Identifier: Apache-2.0
//
// A run or sweep writes its config into its folder. Tests that this config repeats the run from any
// working folder.
#include "support/program.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using testing::Arguments;
using testing::Outcome;

const fs::path kExample = fs::path(ALIDADE_SOURCE_DIR) / "examples/07_depth_pairs";

class Rerun : public testing::ProgramTest {
 protected:
  /// Copies the example and its table to the folder `made` in the current folder.
  void SetUp() override {
    ProgramTest::SetUp();
    fs::create_directories(folder_ / "made");
    for (const char* name : {"config.yaml", "approach.csv"}) {
      fs::copy_file(kExample / name, folder_ / "made" / name);
    }
  }
  void ExpectOk(Arguments arguments) const {
    arguments.insert(arguments.end(), {"--quiet"});
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
  }
  /// Runs `config` from another folder and expects the estimates of `first`.
  void ExpectSameFrom(const std::string& config, const std::string& first) {
    const fs::path before = folder_;
    fs::create_directory(folder_ / "elsewhere");
    folder_ /= "elsewhere";
    ExpectOk({"run", "../" + config, "-o", "again"});
    folder_ = before;
    const std::string estimates = Read(first + "/fused/estimates.csv");
    EXPECT_GT(estimates.size(), 1000u);
    EXPECT_EQ(Read("elsewhere/again/fused/estimates.csv"), estimates);
  }
};

TEST_F(Rerun, ResolvedConfigOfARunGivesTheSameBytes) {
  ExpectOk({"run", "made/config.yaml", "-o", "first", "--set", "source.blind_after=0.5"});
  ExpectSameFrom("first/config.resolved.yaml", "first");
}

TEST_F(Rerun, ResolvedConfigKeepsAPathOfTheCommandLine) {
  fs::rename(folder_ / "made/approach.csv", folder_ / "other.csv");
  ExpectOk({"run", "made/config.yaml", "-o", "first", "--set", "source.path=other.csv"});
  ExpectSameFrom("first/config.resolved.yaml", "first");
}

TEST_F(Rerun, ResolvedConfigFindsItsPlugins) {
  fs::create_directories(folder_ / "made/plugins");
  fs::permissions(folder_ / "made/plugins", fs::perms::owner_all);
  fs::copy_file(ALIDADE_BINARY_DIR "/tests/faults/ratio.so", folder_ / "made/plugins/ratio.so");
  ExpectOk({"run", "made/config.yaml", "-o", "first", "--set", "plugins=[made/plugins]"});
  ExpectSameFrom("first/config.resolved.yaml", "first");
  std::ofstream(folder_ / "made/config.yaml", std::ios::app) << "plugins: [plugins/ratio.so]\n";
  fs::remove_all(folder_ / "elsewhere");
  ExpectOk({"run", "made/config.yaml", "-o", "second"});
  ExpectSameFrom("second/config.resolved.yaml", "second");
}

}  // namespace
}  // namespace alidade
