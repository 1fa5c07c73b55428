// SPDX-License-Identifier: Apache-2.0
#include "alidade/diagnosis/verdict.h"

#include <gtest/gtest.h>

#include "alidade/base/random.h"
#include "alidade/base/statistics.h"

namespace alidade {
namespace {

/// Returns `n` values of chi2(3) / 3 times `factor`.
NeesSeries MakeNees(double factor, int n) {
  Random random(7);
  NeesSeries series{"target", 3.0, {}};
  for (int k = 0; k < n; ++k) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double x = random.Normal();
      sum += x * x;
    }
    series.values.push_back(factor * sum / 3.0);
  }
  return series;
}

VerdictState StateOf(double factor, int n) {
  const NeesSeries nees = MakeNees(factor, n);
  return ComputeVerdict({.nees = {&nees, 1}}).state;
}

TEST(Verdict, ComparesTheMeanNeesWithOne) {
  EXPECT_EQ(StateOf(1.0, 200), VerdictState::kConsistent);
  EXPECT_EQ(StateOf(2.0, 200), VerdictState::kOverconfident);
  EXPECT_EQ(StateOf(0.4, 200), VerdictState::kUnderconfident);
  EXPECT_EQ(StateOf(2.0, 19), VerdictState::kNotTested);
  // The sigmas may be wrong by 15 %, however many samples there are.
  EXPECT_EQ(StateOf(1.2, 100'000), VerdictState::kConsistent);
}

TEST(Verdict, DoesNotTestErrorsThatAreExactlyZero) {
  EXPECT_EQ(StateOf(0.0, 200), VerdictState::kNotTested);
  const std::vector<NeesSeries> owners = {MakeNees(1.0, 200), MakeNees(0.0, 200)};
  EXPECT_EQ(ComputeVerdict({.nees = owners}).state, VerdictState::kConsistent);
}

TEST(Verdict, StatesItsReasonAndItsBasis) {
  const NeesSeries nees = MakeNees(4.0, 200);
  const Verdict verdict = ComputeVerdict({.nees = {&nees, 1}});
  EXPECT_EQ(verdict.basis, VerdictBasis::kNees);
  EXPECT_NE(verdict.because.find("the NEES of target is "), std::string::npos) << verdict.because;
  EXPECT_NE(verdict.because.find("larger than P indicates"), std::string::npos) << verdict.because;
}

TEST(Verdict, IsTheFirstThatApplies) {
  const NeesSeries nees = MakeNees(9.0, 200);
  const SensorUse rejected{.sensor = "gnss", .used = 30, .rejected = 31};
  const Event lost{5, EventKind::kLost, "the error exceeded 10 sigma"};
  Event diverged{7, EventKind::kDiverged, "out of domain"};
  diverged.divergence = true;
  VerdictFacts facts{.nees = {&nees, 1}};
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kOverconfident);
  facts.sensors = {&rejected, 1};
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kMostlyRejected);
  const std::vector<Event> events = {lost, diverged};
  facts.events = {events.data(), 1};
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kLost);
  EXPECT_EQ(ComputeVerdict(facts).since, 5);
  facts.events = events;
  facts.diverged = true;
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kDiverged);
  EXPECT_EQ(ComputeVerdict(facts).since, 7);
  facts.failed = true;
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kFailed);
}

TEST(Verdict, NamesTheEventThatEndedTheEstimator) {
  const Event skipped{1, EventKind::kPluginFailed, "a measurement was skipped"};
  Event diverged{7, EventKind::kDiverged, "out of domain"};
  diverged.divergence = true;
  const std::vector<Event> events = {skipped, diverged};
  const Verdict verdict = ComputeVerdict({.diverged = true, .events = events});
  EXPECT_EQ(verdict.because, "out of domain");
  EXPECT_EQ(verdict.since, 7);
}

TEST(Verdict, CountsDependentValuesOfTheNeesAsOne) {
  NeesSeries constant{"target", 3.0, std::vector<double>(100, 5.0)}, slow = constant;
  for (int i = 0; i < 100; ++i) slow.values[i] = 0.1 * i;
  const Verdict of_constant = ComputeVerdict({.nees = {&constant, 1}}),
                of_slow = ComputeVerdict({.nees = {&slow, 1}});
  EXPECT_EQ(of_constant.state, VerdictState::kConsistent);
  EXPECT_NE(of_constant.because.find("5 (nearly constant)"), std::string::npos);
  EXPECT_EQ(of_slow.state, VerdictState::kConsistent);
  EXPECT_NE(of_slow.because.find("4.95 (strongly correlated)"), std::string::npos)
      << of_slow.because;
}

TEST(Verdict, MentionsTheEventThatDigitsWereLost) {
  const NeesSeries nees = MakeNees(1.0, 200);
  const Event lost{5, EventKind::kDigitsLost, "a variance is lost by rounding"};
  VerdictFacts facts;
  facts.nees = {&nees, 1};
  EXPECT_EQ(ComputeVerdict(facts).because.find("digits_lost"), std::string::npos);
  facts.events = {&lost, 1};
  EXPECT_NE(ComputeVerdict(facts).because.find("digits_lost"), std::string::npos);
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kConsistent);
}

TEST(Verdict, OfARunThatEndedEarlyIsFailed) {
  const NeesSeries nees = MakeNees(1.0, 200);
  VerdictFacts facts;
  facts.nees = {&nees, 1};
  facts.run_failure = "data.csv:22: 'N/A' is not a number";
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kFailed);
  EXPECT_EQ(ComputeVerdict(facts).because,
            "the run ended early: data.csv:22: 'N/A' is not a number");
  facts.diverged = true;
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kDiverged);
}

TEST(Verdict, CountsTheRejectionsAtTheEnd) {
  SensorUse use{.sensor = "gnss", .used = 1000, .rejected = 20, .rejected_in_a_row = 19};
  EXPECT_EQ(ComputeVerdict({.sensors = {&use, 1}}).state, VerdictState::kNotTested);
  use.rejected_in_a_row = 20;
  use.rejected_since = 3;
  const Verdict verdict = ComputeVerdict({.sensors = {&use, 1}});
  EXPECT_EQ(verdict.state, VerdictState::kMostlyRejected);
  EXPECT_EQ(verdict.since, 3);
}

TEST(Verdict, IsNotTestedIfNoMeasurementWasUsed) {
  const NeesSeries nees = MakeNees(1.0, 200);
  const SensorUse unused{.sensor = "gnss"}, used{.sensor = "imu", .used = 1};
  const Event event{kNoTimestamp, EventKind::kUnused, "sensor 'gnss' had no measurement"};
  VerdictFacts facts{.events = {&event, 1}, .sensors = {&unused, 1}, .nees = {&nees, 1}};
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kNotTested);
  EXPECT_EQ(ComputeVerdict(facts).because,
            "no measurement was used; sensor 'gnss' had no measurement");
  const std::vector<SensorUse> both = {unused, used};
  facts.sensors = both;
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kConsistent);
  EXPECT_TRUE(ComputeVerdict(facts).because.ends_with("; sensor 'gnss' had no measurement"));
}

// A mean NEES of 6 is not significant if all values count as one: chi2(1 - 8e-7; 3) / 3 = 10.4. It
// is significant beside a finding: chi2(0.995; 3) / 3 = 4.3.
TEST(Verdict, IsStricterIfThereIsAFinding) {
  const NeesSeries slow{"target", 3.0, std::vector<double>(100, 6.0)};
  VerdictFacts facts{.nees = {&slow, 1}};
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kConsistent);
  const Finding finding{FindingKind::kCorrelated, "gnss", "successive innovations", 0.5};
  facts.findings = {&finding, 1};
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kOverconfident);
}

TEST(Verdict, UsesTheInnovationsWithoutTruth) {
  const Finding finding{FindingKind::kOverconfident, "gnss", "innovations are 2 times as large",
                        2.0};
  VerdictFacts facts;
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kNotTested);
  facts.tested_sensors = 1;
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kConsistent);
  EXPECT_EQ(ComputeVerdict(facts).basis, VerdictBasis::kNis);
  facts.findings = {&finding, 1};
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kOverconfident);
}

TEST(Verdict, GivesTheFirstFindingAsTheReason) {
  const std::vector<Finding> findings = {{FindingKind::kStuck, "gnss", "it repeats", 20.0},
                                         {FindingKind::kOverconfident, "gnss", "too large", 2.0}};
  VerdictFacts facts;
  facts.tested_sensors = 1;
  facts.findings = findings;
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kOverconfident);
  EXPECT_EQ(ComputeVerdict(facts).because, "it repeats");
  facts.findings = {findings.data(), 1};
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kConsistent);
  EXPECT_NE(ComputeVerdict(facts).because.find("; but it repeats"), std::string::npos);
}

// The innovations of a filter are less correlated than its errors, so they show a wrong sigma in
// runs that are too short for the NEES.
TEST(Verdict, UsesTheInnovationsIfTheNeesIsPassed) {
  const Finding finding{FindingKind::kUnderconfident, "gnss", "innovations are half as large", 0.5};
  const NeesSeries passed = MakeNees(1.0, 200), failed = MakeNees(4.0, 200);
  VerdictFacts facts;
  facts.nees = {&passed, 1};
  facts.findings = {&finding, 1};
  facts.tested_sensors = 1;
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kUnderconfident);
  EXPECT_EQ(ComputeVerdict(facts).basis, VerdictBasis::kNis);
  facts.nees = {&failed, 1};
  EXPECT_EQ(ComputeVerdict(facts).state, VerdictState::kOverconfident);
  EXPECT_EQ(ComputeVerdict(facts).basis, VerdictBasis::kNees);
}

}  // namespace
}  // namespace alidade
