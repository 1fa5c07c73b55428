// SPDX-License-Identifier: Apache-2.0
//
// Tests which poses an evaluation compares: those with equal times, after the requested alignment.
#include <gtest/gtest.h>

#include <cmath>

#include "alidade/base/error.h"
#include "alidade/evaluate/evaluate.h"
#include "support/trajectories.h"

namespace alidade {
namespace {

using Eigen::Vector3d;
using testing::Curve;
using testing::Inverse;
using testing::Turn;

Similarity Known() { return {2.5, Turn(1.1).toRotationMatrix(), Vector3d(10.0, -20.0, 3.0)}; }

void ExpectSame(const Similarity& found, const Similarity& known) {
  EXPECT_NEAR(found.scale, known.scale, 1e-12);
  EXPECT_TRUE(found.rotation.isApprox(known.rotation, 1e-12)) << found.rotation;
  EXPECT_TRUE(found.translation.isApprox(known.translation, 1e-12)) << found.translation;
}

double SquaredError(const Similarity& s, const Trajectory& reference, const Trajectory& estimate) {
  return ((s * estimate).positions - reference.positions).squaredNorm();
}

TEST(Align, FindsAKnownSimilarity) {
  const Trajectory reference = Curve(50);
  Similarity known = Known();
  ExpectSame(Align(Alignment::kSim3, reference, Inverse(known) * reference), known);
  const Similarity scale = Align(Alignment::kScale, reference, Inverse(known) * reference);
  ExpectSame(scale, {2.5, Eigen::Matrix3d::Identity(), Vector3d::Zero()});
  ExpectSame(Align(Alignment::kNone, reference, Inverse(known) * reference), {});
  known.scale = 1.0;
  ExpectSame(Align(Alignment::kSe3, reference, Inverse(known) * reference), known);
  ExpectSame(Align(Alignment::kOrigin, reference, Inverse(known) * reference), known);
  known.rotation = Eigen::AngleAxisd(-2.0, Vector3d::UnitZ()).toRotationMatrix();
  ExpectSame(Align(Alignment::kYaw, reference, Inverse(known) * reference), known);
}

TEST(Align, OfPathsThatDifferNothingNearbyFitsBetter) {
  const Trajectory reference = Curve(50);
  Trajectory estimate = Inverse(Known()) * reference;
  for (int i = 0; i < 50; ++i) estimate.positions(i % 3, i) += 0.05 * std::sin(7.0 * i);
  for (const Alignment alignment : {Alignment::kYaw, Alignment::kSe3, Alignment::kSim3}) {
    SCOPED_TRACE(ToString(alignment));
    const Similarity best = Align(alignment, reference, estimate);
    const double least = SquaredError(best, reference, estimate);
    for (const double step : {-1e-4, 1e-4}) {
      for (int axis = 0; axis < 3; ++axis) {
        Similarity near = best;
        near.translation[axis] += step;
        EXPECT_GT(SquaredError(near, reference, estimate), least);
        near = best;
        near.rotation = Eigen::AngleAxisd(step, Vector3d::Unit(axis)) * best.rotation;
        near.translation +=
            reference.positions.rowwise().mean() - (near * estimate).positions.rowwise().mean();
        if (alignment == Alignment::kYaw && axis < 2) continue;
        EXPECT_GT(SquaredError(near, reference, estimate), least);
      }
      if (alignment != Alignment::kSim3) continue;
      Similarity near = best;
      near.scale += step;
      near.translation +=
          reference.positions.rowwise().mean() - (near * estimate).positions.rowwise().mean();
      EXPECT_GT(SquaredError(near, reference, estimate), least);
    }
  }
}

TEST(Align, TakesTheFirstPosesAloneWhereAsked) {
  const Trajectory reference = Curve(50);
  Trajectory estimate = Inverse(Known()) * reference;
  estimate.positions.rightCols(25).array() += 100.0;
  ExpectSame(Align(Alignment::kSim3, reference, estimate, 25), Known());
}

TEST(Align, RefusesWhatDeterminesNothing) {
  EXPECT_THROW(Align(Alignment::kSe3, Curve(2), Curve(2)), Error);
  Trajectory still = Curve(5);
  still.positions.setConstant(4.0);
  EXPECT_THROW(Align(Alignment::kSim3, Curve(5), still), Error);
  EXPECT_THROW(Align(Alignment::kScale, still, Curve(5)), Error);
  EXPECT_THROW(Align(Alignment::kSe3, Curve(5), Curve(4)), ContractViolation);
}

TEST(Align, RefusesWhatDeterminesNoScale) {
  // The x coordinates of the two trajectories are uncorrelated, so they determine no scale.
  Trajectory reference = Curve(12), estimate = Curve(12);
  for (int i = 0; i < 12; ++i) {
    reference.positions.col(i) << (i % 2 == 0 ? -1.0 : 1.0), 0.0, 0.0;
    estimate.positions.col(i) << (i % 4 < 2 ? -1.0 : 1.0), 0.0, 0.0;
  }
  for (const double off : {0.0, 0.1}) {  // for 0.1, rounding gives a scale of 1e-17
    estimate.positions.row(0).array() += off;
    for (const Alignment alignment : {Alignment::kSim3, Alignment::kScale}) {
      try {
        Align(alignment, reference, estimate);
        FAIL() << off;
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ExitCode::kBadData);
        EXPECT_STREQ(
            error.what(),
            "curve.tum: the scale is undetermined: the positions are not correlated with those of "
            "curve.tum; expected poses of the same trajectory, or --align, which does not estimate "
            "the scale");
      }
    }
    const Evaluation e = Evaluate(reference, estimate, {});
    EXPECT_FALSE(e.sim3_scale);
    EXPECT_TRUE(std::isfinite(e.absolute[0].statistics.rmse));
  }
}

Trajectory At(const std::vector<double>& seconds) {
  Trajectory t = Curve(static_cast<int>(seconds.size()));
  t.timestamps.clear();
  for (const double s : seconds) t.timestamps.push_back(TimestampFromSeconds(s));
  return t;
}

TEST(Associate, EachOfTheShorterTakesTheNearestOfTheLongerWithinTheTolerance) {
  const Trajectory reference = At({0.0, 1.0, 2.0, 3.0, 4.0});
  // 0.004 and 0.006 are both nearest to 0. 2.02 is too far from 2, and 3.01 is just close enough to
  // 3.
  const Matches matches = Associate(reference, At({0.004, 0.006, 2.02, 3.01}), 10'000'000, 0);
  EXPECT_EQ(matches.possible, 4);
  EXPECT_EQ(matches.reference, (std::vector<int>{0, 0, 3}));
  EXPECT_EQ(matches.estimate, (std::vector<int>{0, 1, 3}));
  // Each pose of the shorter trajectory is matched, whether the reference or the estimate is
  // shorter.
  const Matches other = Associate(At({0.006, 3.01}), reference, 10'000'000, 0);
  EXPECT_EQ(other.possible, 2);
  EXPECT_EQ(other.reference, (std::vector<int>{0, 1}));
  EXPECT_EQ(other.estimate, (std::vector<int>{0, 3}));
}

TEST(Associate, DuplicatesOfTheShorterAllPairAndOfTheLongerTheFirstDoes) {
  // In the longer trajectory |t - 1| is smallest at the indices 1 and 2. Index 1 is used because it
  // comes first.
  const Matches matches =
      Associate(At({0.0, 1.0, 1.0, 2.0, 3.0}), At({1.0, 1.0, 2.0}), 10'000'000, 0);
  EXPECT_EQ(matches.reference, (std::vector<int>{1, 1, 3}));
  EXPECT_EQ(matches.estimate, (std::vector<int>{0, 1, 2}));
  // The first index is also used if the matched time is a little smaller or larger.
  const Trajectory longer = At({0.0, 1.0, 1.0, 2.0, 2.0});
  EXPECT_EQ(Associate(longer, At({0.996, 1.004, 2.004}), 10'000'000, 0).reference,
            (std::vector<int>{1, 1, 3}));
}

TEST(Associate, TheOffsetIsAddedToTheEstimate) {
  const Trajectory longer = At({10.0, 11.0, 12.0, 13.0});
  const Trajectory shorter = At({0.0, 1.0, 2.0});
  EXPECT_EQ(Associate(longer, shorter, 1'000'000, 11'000'000'000).reference,
            (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(Associate(shorter, longer, 1'000'000, -11'000'000'000).estimate,
            (std::vector<int>{1, 2, 3}));
  try {
    Associate(longer, shorter, 1'000'000, 0);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kBadData);
    EXPECT_STREQ(
        error.what(),
        "curve.tum: no pose is within 0.001 s of a pose of curve.tum: the timestamps are from "
        "0.000000 s to 2.000000 s, those of the reference from 10.000000 s to 13.000000 s; "
        "expected timestamps of the same clock; or --t-offset, which is added to the timestamps of "
        "the estimate; or a larger --t-max-diff");
  }
}

TEST(Associate, NamesTheOffsetWhereItIsToBlame) {
  try {
    Associate(At({0.0, 1.0}), At({0.0, 1.0}), 1'000'000, 5'000'000'000);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what())
                  .find("0.000000 s to 1.000000 s plus --t-offset, those of the reference from "
                        "0.000000 s to 1.000000 s"),
              std::string::npos)
        << error.what();
  }
}

TEST(Associate, RefusesAnOffsetThatNoTimestampHolds) {
  const Trajectory two = At({1.6e9, 1.6e9 + 1.0}), one = At({1.6e9});
  constexpr Timestamp kOffset = 9'000'000'000'000'000'000;
  const auto refusal = [](const Trajectory& reference, const Trajectory& estimate,
                          Timestamp offset) {
    try {
      Associate(reference, estimate, 10'000'000, offset);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kBadData);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(
      refusal(two, one, kOffset),
      "curve.tum --t-offset: a timestamp plus 9000000000.000000 s is beyond 292 years; expected "
      "the time between the two clocks");
  EXPECT_EQ(
      refusal(one, two, -kOffset),
      "curve.tum --t-offset: a timestamp plus -9000000000.000000 s is beyond 292 years; expected "
      "the time between the two clocks");
}

TEST(Associate, WithoutTimestampsByRow) {
  Trajectory bare = Curve(4), five = Curve(5);
  bare.timestamps.clear();
  five.timestamps.clear();
  const Matches matches = Associate(bare, bare, 0, 0);
  EXPECT_TRUE(matches.by_row);
  EXPECT_EQ(matches.estimate, (std::vector<int>{0, 1, 2, 3}));
  EXPECT_THROW(Associate(bare, five, 0, 0), Error);
  EXPECT_THROW(Associate(bare, Curve(4), 0, 0), Error);
  // KITTI files are matched row by row if one of the two files has no times.
  Trajectory timed = Curve(4);
  timed.format = bare.format = five.format = TrajectoryFormat::kKitti;
  EXPECT_TRUE(Associate(timed, bare, 0, 0).by_row);
  EXPECT_TRUE(Associate(bare, timed, 0, 0).by_row);
  const auto refusal = [](const Trajectory& reference, const Trajectory& estimate) {
    try {
      Associate(reference, estimate, 0, 0);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  timed.name = "timed.txt";
  five.name = "five.txt";
  EXPECT_EQ(refusal(timed, five),
            "five.txt: the file has 5 poses without timestamps, but timed.txt has 4 poses; "
            "expected a row for each row of the reference, or timestamps for both files (KITTI: "
            "NAME_times.txt next to NAME.txt)");
  EXPECT_EQ(refusal(five, timed),
            "five.txt: the file has 5 poses without timestamps, but timed.txt has 4 poses; "
            "expected a row for each row of the estimate, or timestamps for both files (KITTI: "
            "NAME_times.txt next to NAME.txt)");
}

TEST(Associate, ByRowLeavesOutARowThatEitherFileHasLost) {
  Trajectory reference = Curve(5).Select({0, 1, 2, 4}), estimate = Curve(5).Select({1, 3, 4});
  reference.timestamps.clear();
  estimate.timestamps.clear();
  const Matches matches = Associate(reference, estimate, 0, 0);  // rows 1 and 4
  EXPECT_EQ(matches.reference, (std::vector<int>{1, 3}));
  EXPECT_EQ(matches.estimate, (std::vector<int>{0, 2}));
  EXPECT_EQ(matches.possible, 3);
  EXPECT_THROW(Associate(reference.Select({0}), estimate.Select({1}), 0, 0), Error);
}

TEST(Associate, NumbersOfFramesAreNamedIfNoTimesMatch) {
  const Trajectory numbered = At({0.0, 1.0, 2.0, 3.0}), timed = At({9.05, 9.1, 9.15});
  for (const auto& [reference, estimate] : {std::pair{timed, numbered}, {numbered, timed}}) {
    try {
      Associate(reference, estimate, 10'000'000, 0);
      FAIL();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what())
                    .find("; expected the time of each frame, from the list of its images, because "
                          "the timestamps of curve.tum are probably numbers of frames; or "
                          "timestamps of the same clock"),
                std::string::npos)
          << error.what();
    }
  }
}

TEST(Associate, WholeSecondsSince1970AreNotNumbersOfFrames) {
  const double now = 1.4e9;
  for (const double step : {0.0, 1.0}) {
    try {
      Associate(At({now + 9.05, now + 9.1, now + 9.15}), At({now, now + step, now + 2.0 * step}),
                10'000'000, 0);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find("numbers of frames"), std::string::npos)
          << error.what();
    }
  }
}

TEST(Associate, KittiWithTimesBesideBothGoesByThem) {
  Trajectory reference = At({0.0, 0.1, 0.2, 0.3}), estimate = At({0.1, 0.3});
  reference.format = estimate.format = TrajectoryFormat::kKitti;
  const Matches matches = Associate(reference, estimate, 10'000'000, 0);
  EXPECT_FALSE(matches.by_row);
  EXPECT_EQ(matches.reference, (std::vector<int>{1, 3}));
  EXPECT_EQ(matches.estimate, (std::vector<int>{0, 1}));
}

}  // namespace
}  // namespace alidade
