// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <numeric>

#include "alidade/evaluate/evaluate.h"
#include "support/trajectories.h"

namespace alidade {
namespace {

using Eigen::Vector3d;
using testing::Curve;
using testing::Inverse;
using testing::Turn;

/// Returns the warnings, one warning per line.
std::string WarningsOf(const Trajectory& reference, const Trajectory& estimate,
                       const EvaluateOptions& options = {}) {
  std::string all;
  for (const std::string& warning : Evaluate(reference, estimate, options).warnings) {
    all += warning + '\n';
  }
  return all;
}

EvaluateOptions Aligned(Alignment alignment) {
  EvaluateOptions options;
  options.alignment = alignment;
  return options;
}

/// Adds errors of about 1 cm and 0.6 degrees, which are typical of an estimate.
Trajectory Estimate(Trajectory t) {
  for (int i = 0; i < t.size(); ++i) {
    t.positions.col(i) += 0.01 * Vector3d(std::sin(5.0 * i), std::cos(3.0 * i), std::sin(7.0 * i));
    t.orientations[static_cast<std::size_t>(i)] *= Turn(0.01 * std::sin(4.0 * i));
  }
  t.name = "estimate.tum";
  return t;
}

std::vector<int> Range(int first, int last) {
  std::vector<int> range(static_cast<std::size_t>(last - first));
  std::iota(range.begin(), range.end(), first);
  return range;
}

TEST(EvaluationWarnings, OfAGoodEstimateThereAreNone) {
  for (const Alignment alignment : {Alignment::kNone, Alignment::kSe3, Alignment::kSim3}) {
    EXPECT_EQ(WarningsOf(Curve(60), Estimate(Curve(60)), Aligned(alignment)), "");
  }
}

TEST(EvaluationWarnings, AScaleFarFromOneIsNoMetricScale) {
  Similarity known;
  known.scale = 2.228;
  const Trajectory mono = Estimate(Inverse(known) * Curve(60));
  const std::string warnings = WarningsOf(Curve(60), mono, Aligned(Alignment::kSe3));
  EXPECT_TRUE(warnings.starts_with("estimate.tum: the scale is 2.228 (the error is 0.0"))
      << warnings;
  EXPECT_TRUE(
      warnings.ends_with("m with se3): the estimate probably has no metric scale; expected the "
                         "option -as, which aligns with scale\n"))
      << warnings;
  EXPECT_EQ(WarningsOf(Curve(60), mono, Aligned(Alignment::kSim3)), "");
}

TEST(EvaluationWarnings, AScaleOfAUnitIsNamed) {
  struct Case {
    double scale;
    const char* text;
  };
  for (const Case& c : {Case{1e-3, "is probably in mm;"},
                        {1e-2, "is probably in cm;"},
                        {0.3048, "is probably in feet;"},
                        {1e3, "is probably in km;"},
                        {1.03 * 0.3048, "probably has no metric scale;"}}) {
    Similarity known;
    known.scale = c.scale;
    Trajectory estimate = Estimate(Curve(60));
    estimate = Inverse(known) * estimate;
    const std::string warnings = WarningsOf(Curve(60), estimate, Aligned(Alignment::kSe3));
    EXPECT_NE(warnings.find(std::string("the estimate ") + c.text), std::string::npos) << warnings;
  }
}

TEST(EvaluationWarnings, AnAxisWithTheOppositeDirectionIsNamed) {
  Trajectory mirrored = Estimate(Curve(60));
  mirrored.positions.row(1) *= -1.0;
  const std::string warnings = WarningsOf(Curve(60), mirrored, Aligned(Alignment::kSe3));
  EXPECT_NE(warnings.find("estimate.tum: the error with sim3 is 0.0"), std::string::npos)
      << warnings;
  EXPECT_NE(warnings.find(": an axis probably has the opposite direction; expected axes of a "
                          "right-handed frame in both files\n"),
            std::string::npos)
      << warnings;
}

// In a plane, a reflection is a rotation. Both errors are then rounding errors, whose ratio is
// arbitrary.
TEST(EvaluationWarnings, PosesInAPlaneHaveNoReflection) {
  for (int size = 20; size < 120; ++size) {
    Trajectory flat = Curve(size);
    flat.positions.row(2).setZero();
    Trajectory mirrored = flat;
    mirrored.positions.row(1) *= -1.0;
    for (const Trajectory& estimate : {flat, mirrored}) {
      const std::string warnings = WarningsOf(flat, estimate, Aligned(Alignment::kSe3));
      EXPECT_EQ(warnings.find("mirrored"), std::string::npos) << warnings;
    }
  }
}

TEST(EvaluationWarnings, AnErrorThatAlignmentTakesAwayIsOfAnotherWorld) {
  const Similarity known{1.0, Turn(0.5).toRotationMatrix(), Vector3d(3.0, 4.0, 0.0)};
  const Trajectory estimate = Estimate(Inverse(known) * Curve(60));
  const std::string warnings = WarningsOf(Curve(60), estimate);
  EXPECT_TRUE(warnings.starts_with("estimate.tum: the error is ")) << warnings;
  EXPECT_TRUE(warnings.ends_with(
      "with se3: the world frames probably differ; expected the option --align\n"))
      << warnings;
  EXPECT_EQ(WarningsOf(Curve(60), estimate, Aligned(Alignment::kSe3)), "");
}

TEST(EvaluationWarnings, FewMatchesAreTold) {
  Trajectory estimate = Estimate(Curve(60));
  for (std::size_t i = 0; i < 60; i += 4) estimate.timestamps[i] += 1;
  for (std::size_t i = 0; i < 60; ++i) estimate.timestamps[i] += i % 4 == 0 ? 0 : 30'000'000;
  EXPECT_EQ(WarningsOf(Curve(60), estimate),
            "estimate.tum: 15 of 60 possible poses match within 0.01 s; expected the same clock "
            "and rate, or the options --t-offset and --t-max-diff\n");
}

TEST(EvaluationWarnings, NumbersOfFramesAreToldWithTheirFile) {
  // The reference has 10 poses per second, so that only each tenth of its poses has a partner.
  Trajectory estimate = Estimate(Curve(60));
  for (std::size_t i = 0; i < 60; ++i) {
    estimate.timestamps[i] = 100'000'000'000 + 1'000'000'000 * static_cast<Timestamp>(i);
  }
  const std::string warnings = WarningsOf(Curve(60), estimate);
  EXPECT_NE(warnings.find("estimate.tum:1 t: 6 of 60 possible poses match: the timestamps are "
                          "probably numbers of frames; expected the time of each frame, from the "
                          "list of its images\n"),
            std::string::npos)
      << warnings;
  // Times in whole seconds that match are times.
  EXPECT_EQ(WarningsOf(Curve(60), Estimate(Curve(60).Select({0, 10, 20, 30, 40, 50}))), "");
}

TEST(EvaluationWarnings, MotionlessPosesDetermineNoAlignment) {
  Trajectory reference = testing::Line(60, 0.0), estimate = Estimate(testing::Line(60, 0.0));
  for (const char* spread : {"0 m", "0.00123 m"}) {  // exactly motionless, and except for noise
    SCOPED_TRACE(spread);
    for (const Alignment alignment : {Alignment::kYaw, Alignment::kSe3}) {
      EXPECT_EQ(
          WarningsOf(reference, estimate, Aligned(alignment)),
          std::string("estimate.tum: the rotation of ") + ToString(alignment) +
              " is undetermined: the positions of 60 poses are uncorrelated, with a spread of "
              "0.0121 m in the estimate and " +
              spread +
              " in the reference; expected poses that move, --align-origin or no "
              "alignment\n");
    }
    EXPECT_EQ(WarningsOf(reference, estimate, Aligned(Alignment::kNone)), "");
    EXPECT_EQ(WarningsOf(reference, estimate, Aligned(Alignment::kOrigin)), "");
    for (int i = 0; i < 60; ++i) {
      reference.positions.col(i) =
          1e-3 * Vector3d(std::sin(11.0 * i), std::cos(13.0 * i), std::sin(17.0 * i));
    }
  }
  EXPECT_TRUE(
      WarningsOf(reference, estimate, Aligned(Alignment::kSim3))
          .starts_with("estimate.tum: the rotation and the scale of sim3 are undetermined"));
  EXPECT_TRUE(WarningsOf(reference, estimate, Aligned(Alignment::kScale))
                  .starts_with("estimate.tum: the scale is undetermined"));
}

TEST(EvaluationWarnings, TheFirstPosesAtRestDetermineNoAlignment) {
  Trajectory reference = Curve(60);
  for (int i = 0; i < 20; ++i) reference.positions.col(i) = reference.positions.col(20);
  EvaluateOptions options = Aligned(Alignment::kSe3);
  EXPECT_EQ(WarningsOf(reference, Estimate(reference), options), "");
  options.align_poses = 20;
  const std::string warnings = WarningsOf(reference, Estimate(reference), options);
  EXPECT_TRUE(
      warnings.starts_with("estimate.tum: the rotation of se3 is undetermined: the "
                           "positions of 20 poses are uncorrelated"))
      << warnings;
}

TEST(EvaluationWarnings, AConstantTimeOffsetIsToldWithTheOptionThatTakesIt) {
  Trajectory estimate = Estimate(Curve(60));
  for (Timestamp& timestamp : estimate.timestamps) timestamp += 8'000'000;
  EXPECT_EQ(WarningsOf(Curve(60), estimate),
            "estimate.tum: the timestamps are 0.008 s after those of the reference (median "
            "difference); expected the option --t-offset -0.008\n");
  EvaluateOptions options;
  options.offset = -8'000'000;
  EXPECT_EQ(WarningsOf(Curve(60), estimate, options), "");
}

TEST(EvaluationWarnings, APathThatEndsEarlyIsTold) {
  const Trajectory estimate = Estimate(Curve(60));
  const std::string warnings = WarningsOf(Curve(60), estimate.Select(Range(0, 20)));
  EXPECT_TRUE(warnings.starts_with("estimate.tum: the estimate covers only ")) << warnings;
  EXPECT_TRUE(
      warnings.ends_with(" m of the reference; expected an estimate of the whole trajectory\n"))
      << warnings;
  EXPECT_EQ(WarningsOf(Curve(60), estimate.Select(Range(0, 40))), "");
}

TEST(EvaluationWarnings, OrientationsTurnedAllAlikeAreOfAnotherBody) {
  Trajectory estimate = Estimate(Curve(60));
  for (Eigen::Quaterniond& q : estimate.orientations) q = q * Turn(1.5);
  const std::string warnings = WarningsOf(Curve(60), estimate);
  // The rotation is 1.5 rad, apart from the oscillating error.
  EXPECT_TRUE(
      warnings.starts_with("estimate.tum: all orientations differ by the same rotation of 85."))
      << warnings;
  EXPECT_TRUE(
      warnings.ends_with("deg: the body frames probably differ; expected poses of the same body "
                         "frame; the positions may also belong to different points\n"))
      << warnings;
}

TEST(EvaluationWarnings, PositionsOnALineDetermineNoTurnAboutIt) {
  Trajectory estimate = testing::Line(60, 0.5);
  estimate.positions.row(1) = 1e-4 * estimate.positions.row(0).array().sin();
  estimate.name = "estimate.tum";
  EXPECT_EQ(WarningsOf(testing::Line(60, 0.5), estimate, Aligned(Alignment::kSe3)),
            "estimate.tum: the positions of the estimate or the reference are collinear: the "
            "rotation of se3 about the line and the orientation errors are arbitrary; expected no "
            "alignment, --align-origin or --align-mode yaw for orientation errors\n");
  EXPECT_EQ(WarningsOf(testing::Line(60, 0.5), estimate, Aligned(Alignment::kYaw)), "");
}

TEST(EvaluationWarnings, QuaternionsInTheOtherOrderAreToldOfWithTheirFile) {
  Trajectory estimate = Estimate(Curve(60));
  Trajectory swapped = estimate;
  // These quaternions result if a TUM file with the order qw qx qy qz is read.
  for (Eigen::Quaterniond& q : swapped.orientations) {
    q = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
  }
  swapped.first_line = 7;
  std::string warnings = WarningsOf(Curve(60), swapped);
  EXPECT_TRUE(warnings.starts_with("estimate.tum:7: the orientations agree to 0.")) << warnings;
  EXPECT_NE(warnings.find(" deg if quaternions are read with w first, but only to "),
            std::string::npos);
  EXPECT_TRUE(warnings.ends_with(" deg with w last; expected qx qy qz qw\n")) << warnings;
  // The same warning is given for the reference.
  swapped.name = "reference.tum";
  warnings = WarningsOf(swapped, Curve(60));
  // These quaternions result if a EuRoC file with the order qx qy qz qw is read.
  EXPECT_TRUE(warnings.starts_with("reference.tum:7: the orientations agree to 0.")) << warnings;
  for (Eigen::Quaterniond& q : estimate.orientations) {
    q = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
  }
  estimate.format = TrajectoryFormat::kEuroc;
  warnings = WarningsOf(Curve(60), estimate);
  EXPECT_NE(warnings.find("are read with w last, but only to "), std::string::npos) << warnings;
  EXPECT_TRUE(warnings.ends_with("expected qw qx qy qz\n")) << warnings;
}

// The orientations of a body that turns about z only fit if either file is read in the other order.
TEST(EvaluationWarnings, AnAmbiguousOrderOfQuaternionsIsToldOfWithBothFiles) {
  Trajectory reference = Curve(60);
  for (std::size_t i = 0; i < 60; ++i) {
    const double half = 0.15 + 0.025 * static_cast<double>(i);
    reference.orientations[i] = Eigen::Quaterniond(std::cos(half), 0.0, 0.0, std::sin(half));
  }
  Trajectory swapped = Estimate(reference);
  for (Eigen::Quaterniond& q : swapped.orientations) {
    q = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
  }
  for (const bool is_reference_wrong : {false, true}) {
    Trajectory first = is_reference_wrong ? swapped : reference,
               second = is_reference_wrong ? reference : swapped;
    first.name = "reference.tum";
    second.name = "estimate.tum";
    const std::string warnings = WarningsOf(first, second);
    EXPECT_TRUE(warnings.starts_with("estimate.tum:")) << warnings;
    EXPECT_NE(warnings.find(" deg with w last; the other order of reference.tum fits as well"),
              std::string::npos)
        << warnings;
  }
}

TEST(EvaluationWarnings, ASwapOfReferenceAndEstimateIsSeenByTheirNames) {
  struct Case {
    const char *reference, *estimate;
    bool swapped;
  };
  for (const Case& c : {Case{"orb.txt", "fr2_desk_groundtruth.txt", true},
                        {"orb.txt", "KITTI_00_gt.txt", true},
                        {"orb.txt", "V1/state_groundtruth_estimate0/data.csv", true},
                        {"runs/slam/ekf/trajectory.tum", "runs/slam/truth.tum", true},
                        {"orb.txt", "GT-office.txt", true},
                        {"fr2_desk_groundtruth.txt", "orb.txt", false},
                        {"V1/state_groundtruth_estimate0/data.csv", "V1.csv", false},
                        {"runs/slam/truth.tum", "runs/truth.tum", false},
                        {"orb.txt", "tgt_gtsam.txt", false},
                        {"orb.txt", "sptam.txt", false}}) {
    SCOPED_TRACE(c.estimate);
    Trajectory reference = Curve(60), estimate = Estimate(Curve(60));
    reference.name = c.reference;
    estimate.name = c.estimate;
    EXPECT_EQ(WarningsOf(reference, estimate),
              c.swapped
                  ? std::string(c.estimate) +
                        ": the file is named like ground truth, but is used as the estimate; the "
                        "reference is " +
                        c.reference + "; expected REF first, then EST\n"
                  : "");
  }
}

TEST(EvaluationWarnings, ASwapOfReferenceAndEstimateIsSeenByTheCovariances) {
  Trajectory with = Estimate(Curve(60));
  with.position_covariances.assign(60, Eigen::Matrix3d::Identity());
  with.orientation_covariances = with.position_covariances;
  EXPECT_EQ(WarningsOf(with, Curve(60)),
            "estimate.tum: the reference has covariances, as an estimate does, but the estimate "
            "curve.tum does not have covariances; expected REF first, then EST\n");
  EXPECT_EQ(WarningsOf(Curve(60), with), "");
  EXPECT_EQ(WarningsOf(with, with), "");
}

}  // namespace
}  // namespace alidade
