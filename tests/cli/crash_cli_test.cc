// SPDX-License-Identifier: Apache-2.0
//
// A model ends the process in the middle of a run.
#include <csignal>

#include "support/program.h"
#include "support/sanitized.h"

namespace alidade::testing {
namespace {

class CrashCli : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (kSanitized) GTEST_SKIP() << "a sanitizer ends such a process in its own way";
    if (!fs::exists(kPlugin)) GTEST_SKIP() << "built for test_plugins";
    Write("rows.csv", "t_s,u,v\n0,1,1\n1,1,1\n");
  }
  /// Runs a model of tests/faults/plugins/bad_models.cc.
  Outcome RunModel(const std::string& model) const {
    Write("bad.yaml", R"(alidade: 1
plugins: [)" + kPlugin + R"(]
state:
  s: {model: constant, size: 1, initial: {value: {mean: 1, sigma: 1}}}
  t: {model: constant, size: 1, initial: {value: {mean: 1, sigma: 1}}}
sensors:
  bad: {model: )" + model +
                          R"(, stream: z, roles: {x: s.value, y: t.value}}
source: {type: csv, path: rows.csv, streams: {z: [u, v]}}
estimators: {ekf: {type: ekf}}
)");
    return Call({"run", "bad.yaml", "-o", "out", "--no-figures"});
  }
  const std::string kPlugin = ALIDADE_BINARY_DIR "/tests/plugins/bad_models.so";
};

TEST_F(CrashCli, ACrashSaysWhereToLookAndTakesItsCourse) {
  const Outcome outcome = RunModel("crashes");
  EXPECT_EQ(outcome.signal, SIGSEGV);
  EXPECT_TRUE(outcome.err.starts_with("error: crashed, most likely inside a model")) << outcome.err;
  EXPECT_TRUE(Contains(outcome.err, "`alidade check PLUGIN`")) << outcome.err;
}

TEST_F(CrashCli, AnExitOfAModelIsNoSuccess) {
  const Outcome outcome = RunModel("exits");
  EXPECT_EQ(outcome.code, 70) << outcome.out;
  EXPECT_TRUE(Contains(outcome.err, "ended the process")) << outcome.err;
}

TEST_F(CrashCli, ARunOfAGoodModelSaysNothing) {
  const Outcome outcome = RunModel("right");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
}

}  // namespace
}  // namespace alidade::testing
