// SPDX-License-Identifier: Apache-2.0
//
// Tests that a copy of a filter also contains the history of the filter: the one-time warnings that
// were already issued, and the last measurement.
#include <algorithm>
#include <limits>

#include "support/recording.h"

namespace alidade::testing {
namespace {

/// Motion model whose state does not change in steps of up to one second. In longer steps the state
/// is not finite.
struct Breaking : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double dt_s, T* next) const {
    next[0] = (x[0] + w[0]) * (dt_s > 1.0 ? std::numeric_limits<double>::infinity() : 1.0);
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

/// Returns a filter with one block, whose prior is 1 +- 1. The block is measured directly with the
/// standard deviation `sigma`.
Ekf OneBlock(double sigma) {
  Problem problem;
  AddMotion(problem, "p", MakeMotion(Breaking(), "breaking"), {{"x", 1.0, 1.0}});
  AddSensor(problem, "z", LinearSensor(1.0, sigma), {"p.x"});
  return {problem, EkfOptions{}, {{"z", 1}}};
}

TEST(EkfSnapshot, AWarningThatIsGivenOnceIsGivenAgainOnlyFromBeforeIt) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 0.0, 1.0}});
  AddMotion(problem, "q", testing::ConstantMotion(1), {{"x", 0.0, 1.0}});
  AddSensor(problem, "z", SumSensor(1.0, 1.0, 1e-9), {"p.x", "q.x"});
  Ekf ekf(problem, EkfOptions{}, {{"z", 1}});
  const Ekf before = ekf;
  EXPECT_TRUE(testing::HasEvent(ekf.Process(FrameAt(0.0, {{0, 1.0}})), EventKind::kDigitsLost));
  const Ekf after = ekf;
  ekf = before;
  EXPECT_TRUE(testing::HasEvent(ekf.Process(FrameAt(0.0, {{0, 1.0}})), EventKind::kDigitsLost));
  ekf = before;
  ekf = after;
  EXPECT_FALSE(testing::HasEvent(ekf.Process(FrameAt(0.5, {{0, 1.0}})), EventKind::kDigitsLost));
}

TEST(EkfSnapshot, AFailureTellsTheLastMeasurementOfThePastThatCounts) {
  Ekf ekf = OneBlock(1.0);
  ekf.Process(FrameAt(0.0, {{0, 1.5}}));
  const Ekf saved = ekf;
  const std::vector<double> values = saved.state().values();
  ekf.Process(FrameAt(0.5, {{0, 2.5}}));
  ASSERT_TRUE(testing::HasEvent(ekf.Process(FrameAt(2.0, {{0, 1.0}})), EventKind::kNotFinite));
  EXPECT_TRUE(ekf.failed());
  ekf = saved;
  EXPECT_FALSE(ekf.failed());
  EXPECT_FALSE(ekf.diverged());
  EXPECT_EQ(ekf.timestamp(), 0);
  EXPECT_EQ(ekf.state().values(), values);
  const UpdateReport& report = ekf.Process(FrameAt(2.0, {{0, 1.0}}));
  ASSERT_TRUE(testing::HasEvent(report, EventKind::kNotFinite));
  const std::string end = "sensor 'z' at 0.000000 s, z = 1.5";
  EXPECT_TRUE(report.events.back().text.ends_with(end)) << report.events.back().text;
}

}  // namespace
}  // namespace alidade::testing
