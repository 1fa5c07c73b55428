// SPDX-License-Identifier: Apache-2.0
//
// Tests comparisons of constructed runs: the reference of each estimator, and runs with different
// data.
#include "alidade/compare/candidates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "support/temporary_folder.h"

namespace alidade {
namespace {

using internal::Candidate;
using internal::ComparedRun;
using internal::CompareRuns;

EstimatorKind KindOf(const std::string& type) {
  if (type == "rts") return EstimatorKind::kSmoother;
  if (type == "fixed_lag") return EstimatorKind::kSlidingWindow;
  return type == "ceres_batch" ? EstimatorKind::kBatch : EstimatorKind::kFilter;
}

/// Returns an estimator of a block p.x. The truth is 0, and the error at each of three timestamps
/// is `error`.
Candidate Entry(const std::string& name, const std::string& type, bool smoothed, double error,
                const std::vector<std::string>& sensors = {"stereo"}) {
  Candidate entry;
  entry.result.type = type;
  entry.result.kind = KindOf(type);
  entry.result.smoothed = smoothed;
  entry.result.sensors = sensors;
  entry.series.blocks = {{"p.x", "m", Geometry::Vector(1)}};
  entry.series.timestamps = {10, 20, 30};
  entry.series.values = {error, error, error};
  entry.series.covariances = {1.0, 1.0, 1.0};
  entry.result.name = name;
  entry.result.counts["accepted:" + sensors.front()] = 3;
  entry.result.metrics = {{"rmse:p.x", error}, {"final_error:p.x", error}};
  return entry;
}

ComparedRun RunOf(const std::vector<Candidate>& estimators) {
  ComparedRun run;
  run.frames = 3;
  run.estimators = estimators;
  return run;
}

const ComparedEstimator& Find(const Comparison& comparison, const std::string& name) {
  for (const ComparedEstimator& one : comparison.estimators) {
    if (one.name == name) return one;
  }
  throw std::out_of_range(name);
}

TEST(CompareRuns, HoldsAnEstimatorAgainstTheBatchOfItsSensors) {
  const ComparedRun run =
      RunOf({Entry("stereo_batch", "ceres_batch", true, 8.0),
             Entry("both", "ekf", false, 2.0, {"scale", "stereo"}),
             Entry("stereo", "ekf", false, 16.0), Entry("scale", "ekf", false, 5.0, {"scale"}),
             Entry("both_batch", "ceres_batch", true, 1.0, {"stereo", "scale"}),
             Entry("both_rts", "rts", true, 3.0, {"stereo", "scale"})});
  const Comparison comparison = CompareRuns({run}, {});
  EXPECT_EQ(Find(comparison, "both").final_reference, "both_batch");
  EXPECT_EQ(Find(comparison, "both").ratios.at("final_error:p.x").value(), 2.0);
  EXPECT_EQ(Find(comparison, "both_rts").reference, "both_batch");
  EXPECT_EQ(Find(comparison, "stereo").final_reference, "stereo_batch");
  EXPECT_EQ(Find(comparison, "stereo").ratios.at("final_error:p.x").value(), 2.0);
  EXPECT_EQ(Find(comparison, "scale").final_reference, "");
  EXPECT_FALSE(Find(comparison, "scale").values.contains("final_difference:p.x"));
  EXPECT_EQ(comparison.notes, (std::vector<std::string>{"'scale' has no reference: no batch "
                                                        "uses the same sensors"}));
  const std::string text = CompareReport(comparison, TableStyle::kText);
  EXPECT_NE(text.find("ratios and differences relative to the reference of each column"), text.npos)
      << text;
}

// A batch with other overrides, such as a robust loss, solves another problem. Such a batch is the
// reference only if no batch of the same problem is usable.
TEST(CompareRuns, OverridesMakeAnotherSystem) {
  Candidate other = Entry("other", "ceres_batch", true, 8.0);
  other.result.overrides = "{sensors: {stereo: {loss: {cauchy: 1}}}}";
  ComparedRun run =
      RunOf({other, Entry("ekf", "ekf", false, 2.0), Entry("batch", "ceres_batch", true, 1.0)});
  EXPECT_EQ(Find(CompareRuns({run}, {}), "ekf").final_reference, "batch");
  // A reference that is named explicitly is always used.
  EXPECT_EQ(Find(CompareRuns({run}, {"other", "", true}), "ekf").final_reference, "other");
  run.estimators[2].result.failed = true;
  EXPECT_EQ(Find(CompareRuns({run}, {}), "ekf").final_reference, "other");
  EXPECT_EQ(CompareRuns({run}, {}).withheld, "");
}

TEST(CompareRuns, ABatchThatFailedGivesWayToOneThatDidNot) {
  Candidate failed = Entry("failed", "ceres_batch", true, 8.0);
  failed.result.failed = true;
  const Candidate ekf = Entry("ekf", "ekf", false, 2.0);
  const Candidate batch = Entry("batch", "ceres_batch", true, 1.0);
  for (const auto& entries : {std::vector{failed, ekf, batch}, std::vector{batch, ekf, failed}}) {
    const Comparison comparison = CompareRuns({RunOf(entries)}, {});
    EXPECT_EQ(comparison.withheld, "");
    EXPECT_EQ(Find(comparison, "ekf").final_reference, "batch");
    EXPECT_EQ(comparison.decomposition[0].reference, "batch");
  }
  const Comparison alone = CompareRuns({RunOf({failed, ekf})}, {});
  EXPECT_EQ(alone.withheld,
            "no reference is available: estimator 'failed' failed, so the comparison with this "
            "estimator is withheld");
}

// Without measurements the filter and the batch agree, because both have only the prior.
TEST(CompareRuns, WithoutAMeasurementThereIsNothingToCompare) {
  ComparedRun run =
      RunOf({Entry("ekf", "ekf", false, 2.0), Entry("batch", "ceres_batch", true, 1.0)});
  run.estimators[0].result.counts.clear();
  EXPECT_EQ(CompareRuns({run}, {}).withheld, "");
  run.estimators[1].result.counts = {{"landmarks.deleted", 2}};
  EXPECT_EQ(CompareRuns({run}, {}).withheld,
            "no estimator received a measurement: only initial estimates are compared");
}

TEST(CompareRuns, TellsOfRejectionRecoveryOfTheFilter) {
  ComparedRun run =
      RunOf({Entry("ekf", "ekf", false, 2.0), Entry("batch", "ceres_batch", true, 1.0)});
  EXPECT_TRUE(CompareRuns({run}, {}).notes.empty());
  run.estimators[0].had_rejection_recovery = true;
  EXPECT_EQ(CompareRuns({run}, {}).notes,
            std::vector<std::string>{
                "'ekf' recovered from consecutive rejections: the steps to a batch or smoother "
                "include the cost of this recovery"});
}

TEST(CompareRuns, HasTheWorstStatusOfTheRuns) {
  std::vector<ComparedRun> runs(3, RunOf({Entry("ekf", "ekf", false, 2.0)}));
  EXPECT_NE(CompareJson(CompareRuns(runs, {})).find("\"status\": \"ok\""), std::string::npos);
  runs[1].status = RunStatus::kStopped;
  EXPECT_NE(CompareJson(CompareRuns(runs, {})).find("\"status\": \"stopped\""), std::string::npos);
}

TEST(CompareRuns, GivesNoRatioToAnErrorWithoutBound) {
  const double inf = std::numeric_limits<double>::infinity();
  const ComparedRun run =
      RunOf({Entry("rts", "rts", true, inf), Entry("batch", "ceres_batch", true, inf)});
  EXPECT_FALSE(Find(CompareRuns({run}, {}), "rts").ratios.contains("rmse:p.x"));
}

TEST(CompareRuns, ExplainsTheGapOfAFilterAlone) {
  const ComparedRun run =
      RunOf({Entry("ekf", "ekf", false, 2.0), Entry("rts", "rts", true, 1.0),
             Entry("now", "ceres_batch", false, 1.0), Entry("batch", "ceres_batch", true, 1.0)});
  for (const char* name : {"rts", "now", "batch"}) {
    try {
      CompareRuns({run}, {"", name, true});
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kUsage);
      EXPECT_EQ(std::string(error.what()), std::string("--filter: '") + name +
                                               "' is not an online filter; expected one of ekf");
    }
  }
  EXPECT_EQ(CompareRuns({run}, {"", "ekf", true}).decomposed, "ekf");
}

/// Adds a map of three landmarks. Each landmark has the error `error` along x.
Candidate WithMap(Candidate entry, double error) {
  const Eigen::Vector3d places[] = {{0, 0, 1}, {1, 0, 2}, {0, 1, 3}};
  entry.result.landmarks.emplace();
  for (int i = 0; i < 3; ++i) {
    LandmarkEstimate& one = entry.result.landmarks->emplace_back();
    one.id = i;
    one.position = places[i] + Eigen::Vector3d(error, 0.0, 0.0);
  }
  entry.result.metrics["map.rmse"] = error;
  return entry;
}

// With landmarks no batch solves at every frame. At the last frame the batch of all data has used
// the same data as the filter, so the batch and the filter are compared at that frame.
TEST(CompareRuns, WithoutABatchSoFarLinearisationIsToldFromTheLastFrame) {
  Candidate ekf = WithMap(Entry("ekf", "ekf", false, 2.0), 0.5);
  ekf.series.values = {9.0, 9.0, 2.0};
  ekf.result.metrics["rmse:p.x"] = 7.5;
  Candidate batch = WithMap(Entry("batch", "ceres_batch", true, 0.5), 0.125);
  batch.series.covariances = {4.0, 4.0, 0.25};
  const Comparison comparison = CompareRuns({RunOf({ekf, batch})}, {});
  const DecompositionStep& step = comparison.decomposition[0];
  EXPECT_TRUE(step.at_end);
  EXPECT_EQ(step.withheld, "");
  EXPECT_EQ(step.reference, "batch");
  const auto value = [&](const char* key) { return step.values.at(key).mean; };
  EXPECT_EQ(value("rmsd:p.x"), 1.5);
  EXPECT_EQ(value("rmsd.sigmas:p"), 3.0);
  EXPECT_EQ(step.ratios.at("rmse:p.x").value(), 4.0);
  EXPECT_EQ(step.ratios.at("rmse:map").value(), 4.0);
  EXPECT_EQ(value("rmsd:map"), 0.375);
  EXPECT_LT(value("rmsd:map.sim3"), 1e-12);
  const std::string text = CompareReport(comparison, TableStyle::kText);
  EXPECT_NE(text.find("linearisation, ekf compared with batch, at the last frame\n"), text.npos)
      << text;
  EXPECT_NE(text.find("\nmap [m]"), text.npos) << text;
  EXPECT_NE(CompareJson(comparison).find("\"at_end\": true"), std::string::npos);
}

// If the batch of the accepted measurements also exists, this batch is the reference. The effect of
// the gate is then a separate step of the decomposition.
TEST(CompareRuns, TheLastFrameIsThatOfTheBatchOfWhatTheFilterAccepted) {
  Candidate accepted = Entry("accepted", "ceres_batch", true, 1.0);
  accepted.result.accepted_by = "ekf";
  const Candidate ekf = Entry("ekf", "ekf", false, 2.0);
  const Candidate batch = Entry("batch", "ceres_batch", true, 0.5);
  EXPECT_EQ(CompareRuns({RunOf({ekf, batch, accepted})}, {}).decomposition[0].reference,
            "accepted");
  Candidate full_information = Entry("full_information", "ceres_batch", false, 1.5);
  const DecompositionStep step =
      CompareRuns({RunOf({ekf, batch, accepted, full_information})}, {}).decomposition[0];
  EXPECT_EQ(step.reference, "full_information");
  EXPECT_FALSE(step.at_end);
}

/// Returns the error message for two runs with the given texts of measurements.csv.
std::string Refusal(const std::string& one, const std::string& other) {
  const testing::TemporaryFolder folders[2];
  std::ofstream(folders[0] / "measurements.csv") << one;
  std::ofstream(folders[1] / "measurements.csv") << other;
  std::vector<ComparedRun> runs(2);
  for (const std::size_t r : {0, 1}) {
    runs[r].folder = folders[r].path();
    runs[r].measurements_sha256 = std::to_string(r);
  }
  try {
    internal::CheckSameData(runs);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(CheckSameData, TellsTheFirstTimestampWhateverTheColumnsAndTheOrderOfStreams) {
  const std::string text =
      Refusal("t_s,stream,landmark,v0,v1\n0.1,a,,1,\n0.1,b,,2,3\n0.2,a,,4,\n0.3,a,,5,\n",
              "t_s,stream,landmark,v0,v1,v2\n0.1,b,,2,3,\n0.1,a,,1,,\n0.2,a,,4,,\n0.3,a,,6,,\n");
  EXPECT_NE(text.find("the first difference is at t = 0.3 s;"), text.npos) << text;
}

TEST(CheckSameData, TheOrderWithinAStreamIsData) {
  const std::string header = "t_s,stream,landmark,v0\n";
  const std::string text =
      Refusal(header + "0.1,a,,1\n0.2,a,,1\n0.2,a,,2\n", header + "0.1,a,,1\n0.2,a,,2\n0.2,a,,1\n");
  EXPECT_NE(text.find("the first difference is at t = 0.2 s;"), text.npos) << text;
}

TEST(CheckSameData, SaysWhereARunHasLessAndWhereTheFilesDoNotTell) {
  const std::string rows = "t_s,stream,landmark,v0\n0.1,a,,1\n";
  EXPECT_NE(Refusal(rows + "0.2,a,,1\n", rows)
                .find("the end of the file, the other file has t = 0.2 s there"),
            std::string::npos);
  EXPECT_NE(Refusal(rows, rows)
                .find("the covariances of measurements or the timestamps of empty frames differ"),
            std::string::npos);
}

}  // namespace
}  // namespace alidade
