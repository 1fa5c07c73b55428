// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/evaluate.h"

#include <gtest/gtest.h>

#include "alidade/base/error.h"
#include "support/recording.h"
#include "support/trajectories.h"

namespace alidade {
namespace {

using Eigen::Vector3d;
using testing::Curve;
using testing::Inverse;
using testing::Line;
using testing::Turn;
using Pairs = std::vector<std::pair<int, int>>;

constexpr double kPi = 3.14159265358979323846;

TEST(StatisticsOf, AreThoseOfWorkedNumbers) {
  // The mean is 4, the squares are 9 + 1 + 4 + 100, and the squared deviations are 1 + 9 + 4 + 36.
  const ErrorStatistics s = StatisticsOf({3.0, 1.0, 2.0, 10.0});
  EXPECT_DOUBLE_EQ(s.mean, 4.0);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.sse, 114.0);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(28.5));
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(12.5));
  EXPECT_EQ(s.min, 1.0);
  EXPECT_EQ(s.max, 10.0);
  EXPECT_DOUBLE_EQ(StatisticsOf({3.0, 1.0, 2.0}).median, 2.0);
}

const PoseRelation kRelations[] = {PoseRelation::kTranslation, PoseRelation::kRotation,
                                   PoseRelation::kAngleDeg,    PoseRelation::kAngleRad,
                                   PoseRelation::kFull,        PoseRelation::kPointDistance};

EvaluateOptions AllRelations() {
  EvaluateOptions options;
  options.relations.assign(std::begin(kRelations), std::end(kRelations));
  return options;
}

TEST(Evaluate, AConstantErrorIsWhatEachRelationSays) {
  const Trajectory reference = Curve(20);
  Trajectory estimate = reference;
  const double angle = 0.3;
  estimate.positions.colwise() += Vector3d(0.3, 0.0, -0.4);
  for (Eigen::Quaterniond& q : estimate.orientations) q = q * Turn(angle);
  const Evaluation e = Evaluate(reference, estimate, AllRelations());
  // |R - I|^2 = 2 (3 - 1 - 2 cos(angle)) = 8 sin^2(angle / 2)
  const double rotation = std::sqrt(8.0) * std::sin(0.15);
  const double expected[] = {
      0.5, rotation, 0.3 * 180.0 / kPi, 0.3, std::sqrt(0.25 + rotation * rotation), 0.5};
  ASSERT_EQ(e.absolute.size(), 6u);
  for (std::size_t r = 0; r < 6; ++r) {
    SCOPED_TRACE(ToString(e.absolute[r].relation));
    EXPECT_NEAR(e.absolute[r].statistics.rmse, expected[r], 1e-12);
    EXPECT_NEAR(e.absolute[r].statistics.std, 0.0, 1e-12);
    EXPECT_EQ(e.absolute[r].errors.size(), 20u);
  }
  EXPECT_NEAR(e.relative[5].statistics.max, 0.0, 1e-12);  // the distances are equal
}

TEST(Evaluate, MatricesGiveTheSameRelativeErrors) {
  const Trajectory reference = Curve(20);
  Trajectory estimate = reference;
  for (int i = 0; i < 20; ++i) {
    estimate.positions.col(i) += 0.01 * Vector3d(std::sin(5.0 * i), std::cos(3.0 * i), 0.1 * i);
    estimate.orientations[static_cast<std::size_t>(i)] *= Turn(0.02 * std::sin(4.0 * i));
  }
  EvaluateOptions options = AllRelations();
  options.pairs.delta = 3;
  options.pairs.all = true;
  const Evaluation e = Evaluate(reference, estimate, options);
  ASSERT_EQ(e.pairs.size(), 17u);
  const auto matrix = [](const Trajectory& t, int i) {
    Eigen::Isometry3d pose(t.orientations[static_cast<std::size_t>(i)]);
    pose.translation() = t.positions.col(i);
    return pose.matrix();
  };
  for (std::size_t k = 0; k < e.pairs.size(); ++k) {
    const auto [i, j] = e.pairs[k];
    const Eigen::Matrix4d q = matrix(reference, i).inverse() * matrix(reference, j);
    const Eigen::Matrix4d p = matrix(estimate, i).inverse() * matrix(estimate, j);
    const Eigen::Matrix4d error = q.inverse() * p;
    const Eigen::Matrix3d turn = error.topLeftCorner<3, 3>();
    EXPECT_NEAR(e.relative[0].errors[k], error.topRightCorner(3, 1).norm(), 1e-12);
    EXPECT_NEAR(e.relative[1].errors[k], (turn - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(e.relative[3].errors[k], std::abs(Eigen::AngleAxisd(turn).angle()), 1e-9);
    EXPECT_NEAR(e.relative[4].errors[k], (error - Eigen::Matrix4d::Identity()).norm(), 1e-12);
    const double apart = std::abs(q.topRightCorner(3, 1).norm() - p.topRightCorner(3, 1).norm());
    EXPECT_NEAR(e.relative[5].errors[k], apart, 1e-12);
  }
}

TEST(Evaluate, AConstantDriftIsTheRelativeError) {
  // The estimate is 2 % too long. From pose to pose it is rotated by 0.001 rad too much.
  const Trajectory reference = Line(101, 0.5);
  Trajectory estimate = Line(101, 0.51);
  for (int i = 0; i <= 100; ++i) {
    estimate.orientations[static_cast<std::size_t>(i)] =
        Eigen::AngleAxisd(0.001 * i, Vector3d::UnitX());
  }
  EvaluateOptions options = AllRelations();
  const Evaluation step = Evaluate(reference, estimate, options);
  EXPECT_EQ(step.pairs.size(), 100u);
  EXPECT_NEAR(step.relative[0].statistics.rmse, 0.01, 1e-12);
  EXPECT_NEAR(step.relative[3].statistics.max, 0.001, 1e-12);
  // Distances are measured along the path of the estimate. Pose 20 is the first pose at least 10 m
  // away.
  options.pairs.delta = 10.0;
  options.pairs.unit = DeltaUnit::kMetres;
  const Evaluation metres = Evaluate(reference, estimate, options);
  EXPECT_EQ(metres.pairs, (Pairs{{20, 40}, {40, 60}, {60, 80}, {80, 100}}));
  EXPECT_NEAR(metres.relative[0].statistics.mean, 0.2, 1e-12);
  EXPECT_NEAR(metres.relative[3].statistics.mean, 0.02, 1e-12);
}

TEST(PairsOf, AreDeltaApartInEachUnit) {
  Trajectory t = Line(11, 0.5);
  for (int i = 0; i < 11; ++i) {
    t.orientations[static_cast<std::size_t>(i)] = Eigen::AngleAxisd(0.1 * i, Vector3d::UnitY());
  }
  EXPECT_EQ(PairsOf(t, {4.0, DeltaUnit::kFrames}), (Pairs{{0, 4}, {4, 8}}));
  EXPECT_EQ(PairsOf(t, {8.0, DeltaUnit::kFrames, true}), (Pairs{{0, 8}, {1, 9}, {2, 10}}));
  EXPECT_EQ(PairsOf(t, {1.9, DeltaUnit::kMetres}), (Pairs{{4, 8}}));
  EXPECT_EQ(PairsOf(t, {4.4, DeltaUnit::kMetres, true, 0.05}), (Pairs{{0, 9}, {1, 10}}));
  EXPECT_EQ(PairsOf(t, {0.45, DeltaUnit::kSeconds}), (Pairs{{0, 5}, {5, 10}}));
  EXPECT_EQ(PairsOf(t, {0.95, DeltaUnit::kSeconds, true}), (Pairs{{0, 9}, {1, 10}}));
  // Timestamps are exact: an interval of 0.3 s is found exactly, at any time.
  EXPECT_EQ(PairsOf(t, {0.3, DeltaUnit::kSeconds}), (Pairs{{0, 3}, {3, 6}, {6, 9}}));
  EXPECT_EQ(PairsOf(t, {0.7, DeltaUnit::kSeconds, true, 0.0}),
            (Pairs{{0, 7}, {1, 8}, {2, 9}, {3, 10}}));
  EXPECT_EQ(PairsOf(t, {0.45, DeltaUnit::kRadians}), (Pairs{{0, 5}, {5, 10}}));
  EXPECT_EQ(PairsOf(t, {26.0, DeltaUnit::kDegrees}), (Pairs{{0, 5}, {5, 10}}));
  EXPECT_EQ(PairsOf(t, {0.91, DeltaUnit::kRadians, true, 0.05}), (Pairs{{0, 9}, {1, 10}}));
}

TEST(Crop, KeepsTheEndsOfTheRange) {
  const Trajectory t = Curve(10);  // 100.0 s to 100.9 s
  const Timestamp start = 100'200'000'000, end = 100'500'000'000;
  EXPECT_EQ(Crop(t, {}).size(), 10);
  EXPECT_EQ(Crop(t, {start, {}}).rows, (std::vector<int>{2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(Crop(t, {{}, end}).rows, (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(Crop(t, {start, end}).rows, (std::vector<int>{2, 3, 4, 5}));
  try {
    Crop(t, {0, 1});
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "curve.tum --t-start, --t-end: no pose is in this range of time; expected a part "
                 "of 100.000000 s to 100.900000 s");
  }
  Trajectory bare = t;
  bare.timestamps.clear();
  EXPECT_THROW(Crop(bare, {start, {}}), Error);
}

TEST(Downsample, TakesIndicesAtEqualDistances) {
  const Trajectory t = Curve(10);
  EXPECT_EQ(Downsample(t, 0).size(), 10);
  EXPECT_EQ(Downsample(t, 10).size(), 10);
  EXPECT_EQ(Downsample(t, 11).size(), 10);
  EXPECT_EQ(Downsample(t, 4).rows, (std::vector<int>{0, 3, 6, 9}));
  EXPECT_EQ(Downsample(t, 3).rows, (std::vector<int>{0, 4, 9}));  // 4.5 is rounded down
  EXPECT_EQ(Downsample(t, 1).rows, (std::vector<int>{0}));
}

/// The orientation is Rz(c) Ry(b) Rx(a) with a = 0.1, b = 0.2, c = 2.
TEST(Project, KeepsThePositionInThePlaneAndTheRotationAboutItsNormal) {
  using Eigen::AngleAxisd;
  Trajectory t = Curve(1);
  t.positions.col(0) = Vector3d(1, 2, 3);
  t.orientations[0] = AngleAxisd(2.0, Vector3d::UnitZ()) * AngleAxisd(0.2, Vector3d::UnitY()) *
                      AngleAxisd(0.1, Vector3d::UnitX());
  struct Case {
    Plane plane;
    Vector3d position;
    double angle;
    Vector3d normal;
  };
  for (const Case& c : {Case{Plane::kXy, {1, 2, 0}, 2.0, Vector3d::UnitZ()},
                        {Plane::kXz, {1, 0, 3}, 0.2, Vector3d::UnitY()},
                        {Plane::kYz, {0, 2, 3}, 0.1, Vector3d::UnitX()}}) {
    SCOPED_TRACE(ToString(c.plane));
    const Trajectory projected = Project(t, c.plane);
    EXPECT_EQ(projected.positions.col(0), c.position);
    EXPECT_TRUE(projected.orientations[0].isApprox(
        Eigen::Quaterniond(AngleAxisd(c.angle, c.normal)), 1e-14));
  }
  EXPECT_EQ(Project(t, Plane::kNone).positions.col(0), Vector3d(1, 2, 3));
}

TEST(Evaluate, ProjectsAfterTheAlignment) {
  // The estimate is the reference rotated by 90 degrees about x. Its own projection would be wrong.
  const Similarity rotation{1.0, Eigen::AngleAxisd(0.5 * kPi, Vector3d::UnitX()).toRotationMatrix(),
                            Vector3d::Zero()};
  EvaluateOptions options;
  options.alignment = Alignment::kSe3;
  options.plane = Plane::kXy;
  const Evaluation e = Evaluate(Curve(30), rotation * Curve(30), options);
  EXPECT_LT(e.absolute[0].statistics.max, 1e-12);
  EXPECT_TRUE(e.reference.positions.row(2).isZero(0.0));
  EXPECT_TRUE(e.estimate.positions.row(2).isZero(0.0));
}

TEST(Evaluate, CropsTheReferenceAndDownsamplesBoth) {
  EvaluateOptions options;
  options.range = {100'200'000'000, 100'500'000'000};
  // Poses 2 to 5 of the reference are used. The second estimate ends at pose 4.
  EXPECT_EQ(Evaluate(Curve(10), Curve(10), options).possible, 4);
  const Evaluation cropped = Evaluate(Curve(10), Curve(5), options);
  EXPECT_EQ(cropped.possible, 3);
  EXPECT_EQ(cropped.estimate.rows, (std::vector<int>{2, 3, 4}));
  EXPECT_TRUE(cropped.warnings.empty());
  options = {};
  options.downsample = 4;
  const Evaluation sampled = Evaluate(Curve(10), Curve(10), options);
  EXPECT_EQ(sampled.reference.rows, (std::vector<int>{0, 3, 6, 9}));
  EXPECT_EQ(sampled.estimate.rows, sampled.reference.rows);
}

TEST(Evaluate, WithholdsTheNeesOfAProjection) {
  Trajectory estimate = Curve(30);
  estimate.position_covariances.assign(30, Eigen::Matrix3d::Identity());
  estimate.orientation_covariances = estimate.position_covariances;
  EvaluateOptions options;
  options.plane = Plane::kXy;
  const Evaluation e = Evaluate(Curve(30), estimate, options);
  EXPECT_FALSE(e.position_nees);
  EXPECT_EQ(e.nees_withheld,
            "the projection to xy removes part of the error that the covariance describes; for the "
            "NEES, omit "
            "the projection");
}

TEST(PairsOf, RefusesADeltaThatNoTwoPosesAreApart) {
  EXPECT_THROW(PairsOf(Line(5, 0.5), {5.0, DeltaUnit::kFrames}), Error);
  EXPECT_THROW(PairsOf(Line(5, 0.5), {1.2, DeltaUnit::kMetres, true, 0.1}), Error);
  Trajectory bare = Line(5, 0.5);
  bare.timestamps.clear();
  EXPECT_THROW(PairsOf(bare, {0.1, DeltaUnit::kSeconds}), Error);
  EXPECT_THROW(PairsOf(bare, {0.0, DeltaUnit::kFrames}), ContractViolation);
}

TEST(PairsOf, RefusesMorePairsThanAnyoneReads) {
  PairOptions options{0.1, DeltaUnit::kDegrees, true, 1.0};
  EXPECT_EQ(PairsOf(Line(100, 0.0), options).size(), 100u * 99 / 2);
  constexpr int kPoses = 4480;  // all poses are equal, so there are 4480 * 4479 / 2 > 1e7 pairs
  try {
    PairsOf(Line(kPoses, 0.0), options);
    ADD_FAILURE() << "no error; expected the limit on the number of pairs";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::kBadData);
    EXPECT_STREQ(
        error.what(),
        "curve.tum --delta: more than 10000000 pairs of poses have this rotation; expected a "
        "larger --delta, or a smaller --delta-tol");
  }
}

TEST(Evaluate, WithoutPairsThereAreNoRelativeErrorsButAWarning) {
  EvaluateOptions options;
  options.pairs = {1000.0, DeltaUnit::kMetres};
  const Evaluation e = Evaluate(Curve(20), Curve(20), options);
  EXPECT_EQ(e.absolute.size(), 2u);
  EXPECT_TRUE(e.relative.empty());
  EXPECT_EQ(e.warnings, (std::vector<std::string>{
                            "curve.tum --delta: no two of 20 poses are 1000 m apart; expected a "
                            "smaller --delta, or a larger --delta-tol"}));
}

TEST(Evaluate, NeesIsThatOfTheCovariancesBesideThePoses) {
  const Trajectory reference = Curve(40);
  Trajectory estimate = reference;
  for (int i = 0; i < 40; ++i) {
    const auto at = static_cast<std::size_t>(i);
    // The error along one axis is 4 sigma in every fourth pose and 1 sigma in the other poses. The
    // first pose has an exact position.
    const double sigmas = i % 4 == 0 ? 4.0 : 1.0;
    Eigen::Matrix3d covariance = Vector3d(0.01, 0.04, 1.0).asDiagonal();
    estimate.positions(1, i) -= 0.2 * sigmas;
    estimate.position_covariances.push_back(i == 0 ? Eigen::Matrix3d::Zero() : covariance);
    covariance.diagonal() << 1.0, 1.0, 0.0025;
    estimate.orientations[at] =
        estimate.orientations[at] * Eigen::AngleAxisd(-0.05 * sigmas, Vector3d::UnitZ());
    estimate.orientation_covariances.push_back(covariance);
  }
  const Evaluation e = Evaluate(reference, estimate, {});
  ASSERT_TRUE(e.position_nees && e.orientation_nees);
  EXPECT_EQ(e.position_nees->dof, 3);
  EXPECT_EQ(e.position_nees->poses, 39);
  // The NEES is 16 / 3 in 9 poses and 1 / 3 in 30 poses; chi2(0.95, 3) = 7.8.
  EXPECT_NEAR(e.position_nees->mean, (9.0 * 16.0 + 30.0) / 3.0 / 39.0, 1e-9);
  EXPECT_NEAR(e.position_nees->within95, 30.0 / 39.0, 1e-12);
  EXPECT_EQ(e.orientation_nees->poses, 40);
  EXPECT_NEAR(e.orientation_nees->mean, (10.0 * 16.0 + 30.0) / 3.0 / 40.0, 1e-9);
  EXPECT_EQ(e.nees_withheld, "");
}

TEST(Evaluate, NeesOfAPlanarPoseIsOfItsOwnDegreesOfFreedom) {
  // x, y and the heading are uncertain in at least one pose. z, roll and pitch are known exactly in
  // all poses.
  Trajectory estimate = Curve(10);
  Eigen::Matrix3d position = Eigen::Matrix3d::Zero(), orientation = position;
  position.topLeftCorner<2, 2>() << 0.05, 0.03, 0.03, 0.05;
  orientation(2, 2) = 0.0025;
  estimate.position_covariances.assign(10, position);
  estimate.orientation_covariances.assign(10, orientation);
  estimate.position_covariances[0].setZero();  // the position of this pose is known exactly
  for (int i = 0; i < 10; ++i) {
    estimate.positions.col(i) -= Vector3d(0.2, -0.2, 7.0);
    estimate.orientations[static_cast<std::size_t>(i)] *=
        Eigen::Quaterniond(Eigen::AngleAxisd(-0.1, Vector3d::UnitZ()));
  }
  const Evaluation e = Evaluate(Curve(10), estimate, {});
  ASSERT_TRUE(e.position_nees && e.orientation_nees);
  // (0.2, -0.2) is along the eigenvector with the eigenvalue 0.05 - 0.03 = 0.02. The NEES is
  // 0.08 / 0.02 = 4, divided by 2 degrees of freedom.
  EXPECT_EQ(e.position_nees->dof, 2);
  EXPECT_EQ(e.position_nees->poses, 9);
  EXPECT_NEAR(e.position_nees->mean, 2.0, 1e-9);
  EXPECT_NEAR(e.position_nees->within95, 1.0, 1e-12);  // 4 <= chi2(0.95, 2) = 5.99
  // 0.1^2 / 0.05^2 = 4 is above chi2(0.95, 1) = 3.84.
  EXPECT_EQ(e.orientation_nees->dof, 1);
  EXPECT_EQ(e.orientation_nees->poses, 10);
  EXPECT_NEAR(e.orientation_nees->mean, 4.0, 1e-9);
  EXPECT_NEAR(e.orientation_nees->within95, 0.0, 1e-12);
}

TEST(Evaluate, NeesThatLacksIsToldOf) {
  Trajectory estimate = Curve(5);
  estimate.position_covariances.assign(5, Eigen::Matrix3d::Zero());
  estimate.orientation_covariances.assign(5, Eigen::Matrix3d::Identity());
  Evaluation e = Evaluate(Curve(5), estimate, {});
  EXPECT_FALSE(e.position_nees);
  EXPECT_TRUE(e.orientation_nees);
  EXPECT_EQ(e.nees_withheld, "every covariance of the position is singular");
  estimate.orientation_covariances = estimate.position_covariances;
  e = Evaluate(Curve(5), estimate, {});
  EXPECT_EQ(e.nees_withheld,
            "every covariance of the position is singular; every covariance of the orientation is "
            "singular");
}

TEST(Evaluate, NeesIsWithheldOfAnAlignedEstimate) {
  Trajectory estimate = Curve(40);
  estimate.position_covariances.assign(40, Eigen::Matrix3d::Identity());
  estimate.orientation_covariances = estimate.position_covariances;
  for (const Alignment alignment : {Alignment::kScale, Alignment::kOrigin, Alignment::kYaw,
                                    Alignment::kSe3, Alignment::kSim3}) {
    EvaluateOptions options;
    options.alignment = alignment;
    const Evaluation e = Evaluate(Curve(40), estimate, options);
    EXPECT_FALSE(e.position_nees || e.orientation_nees);
    EXPECT_EQ(e.nees_withheld,
              std::string("the alignment by ") + ToString(alignment) +
                  " removes part of the error that the covariance describes; for the NEES, omit "
                  "the alignment");
  }
}

TEST(Evaluate, ScaleAndItsDriftAreOfThePath) {
  const Trajectory reference = Curve(40);
  Trajectory estimate = reference;
  estimate.positions.leftCols(20) /= 2.0;
  estimate.positions.rightCols(20) /= 2.2;
  const Evaluation e = Evaluate(reference, estimate, {});
  EXPECT_NEAR(*e.scale_drift, 0.1, 1e-12);
  EXPECT_GT(*e.sim3_scale, 2.0);
  EXPECT_LT(*e.sim3_scale, 2.2);
  EXPECT_FALSE(Evaluate(Curve(19), Curve(19), {}).scale_drift);
}

TEST(ReadInnovations, TellsNisAndAutocorrelation) {
  const testing::TemporaryFolder folder;
  std::string text = "t_s,stream,sensor,landmark,outcome,dof,nis,z0,h0,s0,r0\n";
  // r / s alternates between 1 and -1, so the product of neighbours is always -1.
  for (int i = 0; i < 10; ++i) {
    text += "0,a,range,,accepted,1,1,0,0,2," + std::string(i % 2 == 0 ? "2" : "-2") + "\n";
  }
  text += "0,a,range,,gated,1,100,0,0,2,20\n";
  // There are two landmarks, each with constant residuals.
  for (int i = 0; i < 10; ++i) {
    text += "0,b,pixel," + std::to_string(i % 2) + ",accepted,1,6,0,0,1," +
            std::to_string(1 - 2 * (i % 2)) + "\n";
  }
  std::ofstream(folder / "innovations.csv") << text;
  const std::vector<InnovationStatistics> all = ReadInnovations(folder / "innovations.csv");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].sensor, "pixel");
  EXPECT_EQ(all[0].measurements, 10);
  EXPECT_DOUBLE_EQ(all[0].nis_mean, 6.0);
  EXPECT_DOUBLE_EQ(all[0].nis_within95, 0.0);  // 6 is above chi2(0.95, 1) = 3.84
  EXPECT_DOUBLE_EQ(all[0].autocorrelation, 1.0);
  EXPECT_DOUBLE_EQ(all[0].white_within, 1.96 / std::sqrt(8.0));
  EXPECT_EQ(all[1].sensor, "range");
  EXPECT_DOUBLE_EQ(all[1].nis_mean, 1.0);
  EXPECT_DOUBLE_EQ(all[1].nis_within95, 1.0);
  EXPECT_DOUBLE_EQ(all[1].autocorrelation, -1.0);
  EXPECT_DOUBLE_EQ(all[1].white_within, 1.96 / 3.0);
  std::ofstream(folder / "innovations.csv") << "t_s,sensor\n";
  EXPECT_THROW(ReadInnovations(folder / "innovations.csv"), Error);
  // `dof` is larger than the number of columns, then larger than an int can represent.
  const std::string header = "t_s,stream,sensor,landmark,outcome,dof,nis,z0,h0,s0,r0\n";
  for (const char* dof : {"2", "2147483648", "4294967297", "9223372036854775807"}) {
    std::ofstream(folder / "innovations.csv")
        << header << "0.1,pixels,pixels,,accepted," << dof << ",1,0,0,1,1\n";
    try {
      static_cast<void>(ReadInnovations(folder / "innovations.csv"));
      ADD_FAILURE() << dof;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("too few columns"), std::string::npos) << e.what();
    }
  }
}

}  // namespace
}  // namespace alidade
