// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/measurement_log.h"

#include <gtest/gtest.h>

#include <optional>

#include "sensors/stereo_disparity.h"
#include "support/systems.h"

namespace alidade {
namespace {

constexpr Timestamp kStep = 100'000'000;

Problem OneSensor() {
  Problem problem;
  problem.sensors.push_back({"stereo",
                             "disparity",
                             MakeSensor(StereoDisparity(400.0, 0.065, 1.0), "stereo_disparity"),
                             {}});
  return problem;
}

/// Adds a frame with one measurement, or with none if `outcome` is nullopt.
void AddFrame(MeasurementLog& log, Timestamp timestamp, std::optional<Outcome> outcome,
              std::int64_t landmark = -1) {
  UpdateReport report;
  if (outcome) report.Add(0, *outcome, landmark, 1);
  log.Add(timestamp, report);
}

TEST(MeasurementLog, CountsUsedAndRejectedMeasurements) {
  MeasurementLog log(OneSensor());
  const Outcome outcomes[] = {Outcome::kInitialised, Outcome::kAccepted, Outcome::kGated,
                              Outcome::kNotReady, Outcome::kGated};
  for (int i = 0; i < 5; ++i) AddFrame(log, i * kStep, outcomes[i]);
  const SensorUse& use = log.uses().at(0);
  EXPECT_EQ(use.used, 2);
  EXPECT_EQ(use.rejected, 2);
  EXPECT_EQ(use.rejected_in_a_row, 2);
  EXPECT_EQ(use.rejected_since, 2 * kStep);
  EXPECT_EQ(use.RejectionText(), "sensor 'stereo': 2 of 4 measurements were rejected");
  AddFrame(log, 5 * kStep, Outcome::kAccepted);
  EXPECT_EQ(log.uses().at(0).rejected_in_a_row, 0);
}

TEST(MeasurementLog, RejectionsOfLandmarksAreNotInARow) {
  MeasurementLog log(OneSensor());
  for (int i = 0; i < 30; ++i) AddFrame(log, i * kStep, Outcome::kGated, i);
  EXPECT_EQ(log.uses().at(0).rejected, 30);
  EXPECT_EQ(log.uses().at(0).rejected_in_a_row, 0);
}

TEST(MeasurementLog, FindsTheLongestTimeWithoutAUsedMeasurement) {
  MeasurementLog log(OneSensor());
  Timestamp timestamp = 0;
  for (int i = 0; i < 20; ++i) AddFrame(log, timestamp += kStep, Outcome::kAccepted);
  EXPECT_FALSE(log.longest_gap());
  const Timestamp last = timestamp;
  for (int i = 0; i < 29; ++i) AddFrame(log, timestamp += kStep, Outcome::kGated);
  EXPECT_FALSE(log.longest_gap()) << "29 time steps";
  AddFrame(log, timestamp += kStep, std::nullopt);
  ASSERT_TRUE(log.longest_gap()) << "up to the last frame";
  EXPECT_EQ(log.longest_gap()->start, last);
  EXPECT_EQ(log.longest_gap()->end, timestamp);
  AddFrame(log, timestamp += kStep, Outcome::kAccepted);
  for (int i = 0; i < 20; ++i) AddFrame(log, timestamp += kStep, Outcome::kAccepted);
  ASSERT_TRUE(log.longest_gap()) << "between used measurements";
  EXPECT_EQ(log.longest_gap()->start, last);
  EXPECT_EQ(log.longest_gap()->end, last + 31 * kStep);
}

TEST(MeasurementLog, FindsASensorWithoutMeasurementsAtTheEnd) {
  Problem problem = OneSensor();
  problem.sensors.push_back(problem.sensors[0]);
  MeasurementLog log(problem);
  Timestamp timestamp = 0;
  const auto add_frame = [&](bool both) {
    UpdateReport report;
    report.Add(0, Outcome::kAccepted, -1, 1);
    if (both) report.Add(1, Outcome::kGated, -1, 1);
    log.Add(timestamp += kStep, report);
  };
  for (int i = 0; i < 20; ++i) add_frame(true);
  const Timestamp last = timestamp;
  for (int i = 0; i < 29; ++i) add_frame(false);
  EXPECT_FALSE(log.FinalGap(1)) << "29 time steps";
  add_frame(false);
  ASSERT_TRUE(log.FinalGap(1));
  EXPECT_EQ(log.FinalGap(1)->start, last);
  EXPECT_FALSE(log.FinalGap(0));
  EXPECT_FALSE(log.longest_gap());
}

// The run has 400 time steps before the gap, so 30 time steps are less than a tenth of it.
TEST(MeasurementLog, IgnoresAGapAtTheEndThatIsShortForTheRun) {
  MeasurementLog log(OneSensor());
  for (int i = 0; i < 400; ++i) AddFrame(log, i * kStep, Outcome::kAccepted);
  for (int i = 400; i < 435; ++i) AddFrame(log, i * kStep, std::nullopt);
  EXPECT_FALSE(log.FinalGap(0));
}

}  // namespace
}  // namespace alidade
