// SPDX-License-Identifier: Apache-2.0
#include "support/program.h"

namespace alidade {
namespace {

using testing::Contains;
using testing::Outcome;
using ExplainCli = testing::ProgramTest;

TEST_F(ExplainCli, TellsWhatCannotBeObserved) {
  const Outcome both = Call({"explain", "config.yaml"});
  EXPECT_EQ(both.code, 0) << both.err;
  EXPECT_FALSE(Contains(both.out, "unobservable")) << both.out;
  for (const char* part : {"target.depth ", "0.3 +- 0.1", "constant_velocity", "scale_2d",
                           "corrects", "gate ", "joint"}) {
    EXPECT_TRUE(Contains(both.out, part)) << part << '\n' << both.out;
  }
  const Outcome scale = Call({"explain", "config.yaml", "--set", "estimators.ekf.sensors=[scale]"});
  EXPECT_TRUE(Contains(scale.out,
                       "unobservable: target.depth together with target.depth_rate, "
                       "template.inverse_distance (1 direction)"))
      << scale.out;
  const Outcome known = Call({"explain", "config.yaml", "--set",
                              "sensors.scale.roles.inverse_distance={block: "
                              "template.inverse_distance, mode: known}"});
  EXPECT_TRUE(Contains(known.out, "unobservable: template.inverse_distance (1 direction)"))
      << known.out;
  EXPECT_TRUE(Contains(known.out, "knows")) << known.out;
  // The columns `mode` and `jacobian_at` are shown only if a cell differs from the default.
  EXPECT_TRUE(Contains(known.out, "  mode\n")) << known.out;
  EXPECT_FALSE(Contains(both.out, "  mode\n")) << both.out;
}

TEST_F(ExplainCli, TellsWhichTruthIsOfWhichBlock) {
  const Outcome both = Call({"explain", "config.yaml"});
  EXPECT_TRUE(Contains(both.out, "estimated  depth_rate        0 +- 0.5\n")) << both.out;
  EXPECT_FALSE(Contains(both.out, "truth not used")) << both.out;
  // If only the stereo sensor is used, the block of the template is omitted. The truth of this
  // block is then not used.
  const Outcome stereo =
      Call({"explain", "config.yaml", "--set", "estimators.ekf.sensors=[stereo]"});
  EXPECT_EQ(stereo.code, 0) << stereo.err;
  EXPECT_TRUE(Contains(stereo.out, "truth inverse_distance is not used: no block has this name\n"))
      << stereo.out;
  Write("table.csv", "t_s,d\n0,80\n");
  const Outcome some = Call({"explain", "table.yaml", "--set", "source.truth={depth_rate: d}"});
  EXPECT_TRUE(Contains(some.out, "estimated  -           0.3 +- 0.1\n")) << some.out;
  EXPECT_FALSE(Contains(Call({"explain", "table.yaml"}).out, "truth  ")) << some.out;
}

TEST_F(ExplainCli, TellsWhichNoiseTheConfigGivesAsACovariance) {
  EXPECT_FALSE(Contains(Call({"explain", "config.yaml"}).out, "noise of "));
  std::string text = Read("config.yaml");
  const auto replace = [&text](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos);
    text.replace(text.find(from), from.size(), to);
  };
  replace("acceleration: 1.0", "covariance: [[0.25]]");
  replace("baseline_m: 0.065, sigma_px: 1.0", "baseline_m: 0.065, covariance: [[2.25]]");
  Write("given.yaml", text);
  const Outcome given = Call({"explain", "given.yaml"});
  for (const char* line : {"    noise of target: covariance from the config, with sigma 0.5\n",
                           "    noise of stereo: covariance from the config, with sigma 1.5\n"}) {
    EXPECT_TRUE(Contains(given.out, line)) << given.out << given.err;
  }
}

TEST_F(ExplainCli, TellsTheNoiseAtThePrior) {
  // Depth 0.3 m and inverse distance 3.3 1/m; sigma of 1/scale: 2 sigma_px / template_px (0.99)^3.
  // Q = G G' with G = (dt^2 / 2, dt) and an acceleration of 1 m/s^2.
  const Outcome prior = Call({"explain", "config.yaml"});
  for (const char* part : {"stereo_disparity  1 px ", "scale_2d          0.006469 ",
                           "    Q of target for a step of 0.1 s, as sigma: target.depth 0.005 m, "
                           "target.depth_rate 0.1 m/s\n",
                           "template.inverse_distance  vector    1     1/m "}) {
    EXPECT_TRUE(Contains(prior.out, part)) << part << '\n' << prior.out;
  }
  const Outcome rate = Call({"explain", "config.yaml", "--set", "source.rate_hz=50", "--set",
                             "sensors.stereo.sigma_px=0.25"});
  EXPECT_TRUE(Contains(rate.out,
                       "step of 0.02 s, as sigma: target.depth 0.0002 m, "
                       "target.depth_rate 0.02 m/s\n"))
      << rate.out << rate.err;
  EXPECT_TRUE(Contains(rate.out, "stereo_disparity  0.25 px ")) << rate.out;
}

TEST_F(ExplainCli, RoundsNumbers) {
  const Outcome outcome =
      Call({"explain", "config.yaml", "--set",
            "state.target.initial.depth={mean: 0.25132741228718347, sigma: 0.1}"});
  EXPECT_TRUE(Contains(outcome.out, " 0.2513 +- 0.1\n")) << outcome.out;
}

// Values that the config contains are not listed.
TEST_F(ExplainCli, ListsWhatShortFormsFillIn) {
  EXPECT_FALSE(Contains(Call({"explain", "config.yaml"}).out, "filled in"));
  const Outcome outcome = Call({"explain", "config.yaml", "--set", "sensors.stereo.roles=target",
                                "--set", "state.target.initial.depth_rate={sigma: 0.5}", "--set",
                                "estimators=[ukf]", "--set", "defaults={gate: 0.99}"});
  EXPECT_TRUE(Contains(outcome.out,
                       "\nfilled in (short forms and defaults)\n"
                       "    state.target.initial.depth_rate.mean  0\n"
                       "    sensors.stereo.roles.depth            target.depth\n"
                       "    estimators.ukf.type                   ukf\n"
                       "    estimators.ukf.gate                   0.99\n"))
      << outcome.out << outcome.err;
}

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t i = text.find(part); i != text.npos; i = text.find(part, i + 1)) ++count;
  return count;
}

TEST_F(ExplainCli, DescribesEqualPartsOfEstimatorsOnce) {
  const Outcome outcome =
      Call({"explain", "config.yaml", "--set", "estimators.tight={type: ekf, gate: 0.9}", "--set",
            "estimators.alone={type: ukf, sensors: [stereo, scale], "
            "overrides: {sensors: {scale: {sigma_px: 2}}}}"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  for (const char* part : {"\nestimators ekf (ekf), tight (ekf)\n", "\nestimator alone (ukf)\n",
                           "  state, motion, effects on blocks: as estimator ekf\n",
                           "  options of tight that differ from those of ekf\n    gate  0.9: ",
                           "\ntype ekf supports\n", "\ntype ukf supports\n"}) {
    EXPECT_EQ(Count(outcome.out, part), 1) << part << '\n' << outcome.out;
  }
  EXPECT_EQ(Count(outcome.out, "  motion\n"), 1) << outcome.out;
  EXPECT_EQ(Count(outcome.out, "  sensors\n"), 2) << outcome.out;
}

TEST_F(ExplainCli, NamesTheBlocksOfTheRejectionRecovery) {
  const Outcome reset = Call({"explain", "config.yaml"});
  for (const char* part :
       {"recovery of stereo  reset target.depth from the measurement\n",
        "recovery of scale   reset template.inverse_distance from the measurement, or widen "
        "target.depth if it explains the rejections better\n"}) {
    EXPECT_TRUE(Contains(reset.out, part)) << part << '\n' << reset.out;
  }
  const Outcome inflate = Call(
      {"explain", "config.yaml", "--set", "estimators.ekf.rejection_recovery={action: inflate}"});
  EXPECT_TRUE(Contains(inflate.out,
                       "recovery of scale   multiply the sigma of target.depth, "
                       "template.inverse_distance by 10\n"))
      << inflate.out;
}

TEST_F(ExplainCli, WritesAPage) {
  const Outcome outcome = Call({"explain", "config.yaml", "-o", "model.html"});
  EXPECT_EQ(outcome.out, "report   model.html\n") << outcome.err;
  const std::string page = Read("model.html");
  for (const char* part : {R"("noise":"1 px","effects":[["target.depth","corrects"]])",
                           R"("noise":["target.depth 0.005 m","target.depth_rate 0.1 m/s"])",
                           R"(["sensors.stereo.focal_px","400","px",")"}) {
    EXPECT_TRUE(Contains(page, part)) << part;
  }
  EXPECT_EQ(Call({"explain", "config.yaml", "-o", "config.yaml"}).code, 73);
}

TEST_F(ExplainCli, TellsTheOptionsOfEachTypeOfEstimator) {
  const Outcome ekf =
      Call({"explain", "config.yaml", "--set", "estimators.ekf.jacobian=first_estimate", "--set",
            "sensors.stereo.loss={huber: 1.345}"});
  for (const char* part :
       {"jacobian            first_estimate: H at the first",
        "loss                stereo: huber 1.345", "consider (Schmidt)", "robust losses"}) {
    EXPECT_TRUE(Contains(ekf.out, part)) << part << '\n' << ekf.out;
  }
  const Outcome iekf = Call({"explain", "config.yaml", "--set", "estimators.ekf.type=iekf"});
  for (const char* part :
       {"(iekf)", "max_iterations      10", "tolerance           1e-04 posterior sigma",
        "blocks estimated or constant; roles estimate, known;",
        "Not supported: consider blocks and roles, jacobian_at measurement"}) {
    EXPECT_TRUE(Contains(iekf.out, part)) << part << '\n' << iekf.out;
  }
  EXPECT_FALSE(Contains(iekf.out, "loss  ")) << iekf.out;
}

TEST_F(ExplainCli, TellsWhatAFixedBlockIs) {
  const Outcome none = Call({"explain", "config.yaml"});
  EXPECT_FALSE(Contains(none.out, "constant: ")) << none.out;
  EXPECT_FALSE(Contains(none.out, "no effect for")) << none.out;
  // In the config the initial value is 3.3 +- 0.5.
  const Outcome one =
      Call({"explain", "config.yaml", "--set", "state.template.constant=[inverse_distance]"});
  for (const char* part :
       {"inverse_distance  3.3, exact\n",
        "    constant: the value is known exactly and never changes; it has no covariance\n",
        "template.inverse_distance  -       -         knows\n"}) {
    EXPECT_TRUE(Contains(one.out, part)) << part << '\n' << one.out;
  }
  EXPECT_TRUE(Contains(none.out, "    template  constant  ")) << none.out;
  EXPECT_FALSE(Contains(one.out, "    template  constant  ")) << one.out;
  EXPECT_FALSE(Contains(one.out, "no effect for")) << one.out;
  const Outcome considered =
      Call({"explain", "config.yaml", "--set", "state.target.consider=[depth]"});
  EXPECT_TRUE(Contains(testing::Unwrapped(considered.out),
                       "for sensors that do not correct a block: stereo "))
      << considered.out;
  // All blocks of the stereo sensor are constant.
  const Outcome all =
      Call({"explain", "config.yaml", "--set", "state.target.constant=[depth, depth_rate]"});
  EXPECT_TRUE(Contains(testing::Unwrapped(all.out),
                       "; no effect for sensors that do not correct a block: stereo "))
      << all.out;
}

}  // namespace
}  // namespace alidade
