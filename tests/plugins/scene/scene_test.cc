// SPDX-License-Identifier: Apache-2.0
//
// Tests the camera's measurements of the points, and errors in the config.
#include <Eigen/Core>
#include <cmath>
#include <set>

#include "alidade/model/geometry.h"
#include "scene_fixture.h"

namespace alidade::testing {
namespace {

using Eigen::Vector3d;

const std::string kStill = "trajectory: {keyframes: [{position: [0, 0, 0], rpy_deg: [0, 0, 0]}]}";

std::set<std::int64_t> Ids(const Frame& frame, int stream = 0) {
  std::set<std::int64_t> ids;
  for (const Measurement& m : frame.measurements) {
    if (m.stream != stream) continue;
    EXPECT_TRUE(ids.insert(m.landmark).second) << "a landmark occurs twice";
  }
  return ids;
}

TEST(Scene, SeesAPointWhereThePinholePutsIt) {
  // The point is 1 m to the right, 0.5 m down and 2 m ahead: u = 320 + 525 / 2, v = 240 + 525 / 4.
  const auto frames =
      SceneFrames("max_frames: 2, sigma_px: 0, points: {list: [[1, 0.5, 2]]}, " + kStill);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[1].timestamp, 33333333);
  ASSERT_EQ(frames[0].measurements.size(), 1u);
  const Measurement& seen = frames[0].measurements[0];
  EXPECT_EQ(seen.landmark, 0);
  EXPECT_EQ(seen.values, (std::vector<double>{320 + 525 / 2.0, 240 + 525 / 4.0}));
  EXPECT_TRUE(seen.covariance.empty());
}

TEST(Scene, SeesNothingBehindOrBesideTheImage) {
  // Of the six points, only points 1 and 4 are ahead and in the image. Half the width of the image
  // is 320.5 px, which is 1.221 m at a distance of 2 m.
  const auto frames = SceneFrames(
      "max_frames: 1, sigma_px: 0, points: {list: [[0, 0, -2], [0, 0, 2], [1.23, 0, 2], [0, 0, 0], "
      "[-1.21, 0, 2], [0, 0.93, 2]]}, " +
      kStill);
  EXPECT_EQ(Ids(frames[0]), (std::set<std::int64_t>{1, 4}));
}

TEST(Scene, DistortsAsTheCameraDoes) {
  const auto frames = SceneFrames(
      "max_frames: 1, sigma_px: 0, points: {list: [[0.4, 0.2, 2]]}, " + kStill, 1,
      "camera: {model: radtan, width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240, "
      "k1: -0.2, k2: 0.05, p1: 0.001, p2: 0.002}\n");
  // With x = 0.2, y = 0.1 and q = x^2 + y^2 = 0.05, the radial factor is
  // 1 - 0.01 + 0.000125 = 0.990125.
  const double x = 0.2 * 0.990125 + 2 * 0.001 * 0.02 + 0.002 * (0.05 + 0.08);
  const double y = 0.1 * 0.990125 + 0.001 * (0.05 + 0.02) + 2 * 0.002 * 0.02;
  EXPECT_NEAR(frames[0].measurements[0].values[0], 320 + 525 * x, 1e-12);
  EXPECT_NEAR(frames[0].measurements[0].values[1], 240 + 525 * y, 1e-12);
}

TEST(Scene, MeasuresStereoAndDepthToo) {
  const std::string point = "max_frames: 1, sigma_px: 0, points: {list: [[1, 0.5, 2]]}, " + kStill;
  const auto stereo = SceneFrames("measures: stereo, camera: {baseline_m: 0.1}, " + point);
  EXPECT_EQ(stereo[0].measurements[0].values,
            (std::vector<double>{582.5, 371.25, 582.5 - 525 * 0.1 / 2, 371.25}));
  const auto depth = SceneFrames("measures: depth, sigma_depth_m: 0, " + point);
  EXPECT_EQ(depth[0].measurements[0].values, (std::vector<double>{582.5, 371.25, 2.0}));
}

TEST(Scene, NoiseIsThatOfTheConfig) {
  // 500 points that are seen 20 times have 10000 samples of each noise. The variances are accurate
  // to 1.4 %. Tolerances are 4 sigma.
  const std::string keys =
      "max_frames: 20, points: {box: {min: [-1, -0.8, 2], max: [1, 0.8, 3]}, count: 500}, "
      "measures: depth, sigma_depth_m: 0.01, trajectory: {keyframes: [{position: [0, 0, -1], "
      "rpy_deg: [0, 0, 0]}]}";
  const auto exact = SceneFrames("sigma_px: 0, " + keys);
  const auto noisy = SceneFrames("sigma_px: 2, " + keys);
  const MadeScene made = MakeScene("sigma_px: 2, " + keys);
  double sums[3] = {};
  int count = 0;
  for (std::size_t k = 0; k < exact.size(); ++k) {
    ASSERT_EQ(exact[k].measurements.size(), 500u);
    ASSERT_EQ(noisy[k].measurements.size(), 500u);
    for (std::size_t m = 0; m < 500; ++m, ++count) {
      const auto &a = exact[k].measurements[m].values, &b = noisy[k].measurements[m].values;
      for (std::size_t i = 0; i < 2; ++i) sums[i] += std::pow(b[i] - a[i], 2);
      const double depth = 1.0 + (*made.scene->TrueLandmark(static_cast<std::int64_t>(m)))[2];
      sums[2] += std::pow(b[2] - depth, 2);
    }
  }
  EXPECT_NEAR(sums[0] / count, 4.0, 4 * 0.014 * 4.0);
  EXPECT_NEAR(sums[1] / count, 4.0, 4 * 0.014 * 4.0);
  EXPECT_NEAR(sums[2] / count, 1e-4, 4 * 0.014 * 1e-4);
}

TEST(Scene, SameSeedSameBytesAndOthersDiffer) {
  const std::string keys =
      "max_frames: 10, simulate_odometry: true, odometry_noise: {linear_velocity: 0.1, "
      "angular_velocity: 0.1}, "
      "trajectory: {random: {linear_acceleration: 1, angular_acceleration: 1}}, " +
      kPoints;
  const auto values = [&](std::uint64_t seed) {
    std::vector<double> all;
    for (const SourceFrame& frame : SceneFrames(keys, seed)) {
      for (const Measurement& m : frame.measurements) {
        all.insert(all.end(), m.values.begin(), m.values.end());
      }
      for (const auto& t : frame.truth) all.insert(all.end(), t.begin(), t.end());
    }
    return all;
  };
  EXPECT_EQ(values(3), values(3));
  EXPECT_NE(values(3), values(4));
}

TEST(Scene, TellsTheDepthOfTheFirstObservationOfTheKnown) {
  const auto frames = SceneFrames("max_frames: 5, sigma_px: 0.5, known_points: {count: 4}, " +
                                  kPoints + ", " + kSweep);
  const std::set<std::int64_t> known = Ids(frames[0], 1);
  EXPECT_EQ(known.size(), 4u);
  const MadeScene made = MakeScene("max_frames: 5, sigma_px: 0.5, " + kPoints + ", " + kSweep);
  for (const Measurement& m : frames[0].measurements) {
    if (m.stream == 0) {
      EXPECT_FALSE(known.contains(m.landmark));
      continue;
    }
    // The depth is measured along the axis, with a standard deviation of 0.5 % of the depth.
    const auto p = *made.scene->TrueLandmark(m.landmark);
    const Vector3d offset = Vector3d(p.data()) - Vector3d(frames[0].truth[0].data());
    Vector3d h;
    UnitQuaternion::RotateBack(frames[0].truth[1].data(), offset.data(), h.data());
    EXPECT_NEAR(m.values.at(2), h.z(), 5 * 0.005 * h.z());
    EXPECT_NE(m.values[2], h.z());
    ASSERT_EQ(m.covariance.size(), 9u);
    EXPECT_EQ(m.covariance[0], 0.25);
    EXPECT_NEAR(m.covariance[8], std::pow(0.005 * h.z(), 2), 1e-15);
  }
  for (std::size_t k = 1; k < 5; ++k) EXPECT_TRUE(Ids(frames[k], 1).empty());
  for (const std::int64_t id : known) EXPECT_TRUE(Ids(frames[1]).contains(id));
}

// In 9 frames the camera moves forward along x and then back. At the same time, it rotates by 90
// degrees about y and then back.
TEST(Scene, KeyframesTellTheWayToOneAnother) {
  const std::string keys =
      "max_frames: 9, rate_hz: 1, points: {list: [[0, 0, 5], [0, 0, 6]]}, trajectory: {keyframes: "
      "[{t_s: 0, position: [0, 0, 0], rpy_deg: [0, 0, 0]}, {t_s: 4, position: [4, 0, 0], "
      "rpy_deg: [0, 90, 0]}, {t_s: 8, position: [0, 0, 0], rpy_deg: [0, 0, 0]}]}, keyframes: "
      "{every_frames: 2, closure_radius_m: 0.5, closure_after: 2, sigma_position_m: 0, "
      "sigma_orientation_rad: 0}";
  const MadeScene made = MakeScene(keys);
  ASSERT_EQ(made.scene->streams().size(), 2u);
  EXPECT_EQ(made.scene->streams()[1].name, "relative_poses");
  const auto frames = SceneFrames(keys);
  const auto of_keyframes = [&](std::size_t k) {
    std::vector<Measurement> found;
    for (const Measurement& m : frames[k].measurements) {
      if (m.stream == 1) found.push_back(m);
    }
    return found;
  };
  // The first landmark after the two points is the keyframe of the first frame. The frame measures
  // this keyframe without noise.
  const std::vector<Measurement> first = of_keyframes(0);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].landmark, 2);
  EXPECT_EQ(first[0].values, (std::vector<double>{0, 0, 0, 1, 0, 0, 0}));
  EXPECT_EQ(first[0].covariance, std::vector<double>(36, 0.0));
  EXPECT_TRUE(of_keyframes(1).empty());
  // At the far end the camera looks along x of the world. It measures two keyframes: the previous
  // one, and that of the current frame.
  const std::vector<Measurement> far = of_keyframes(4);
  ASSERT_EQ(far.size(), 2u);
  EXPECT_EQ(far[0].landmark, 3);
  const double back = frames[2].truth[0][0] - 4.0;
  EXPECT_NEAR(far[0].values[0], 0.0, 1e-12);
  EXPECT_NEAR(far[0].values[2], back, 1e-12);
  EXPECT_TRUE(far[0].covariance.empty());
  // Back at the start, the camera measures three keyframes: the previous one, the first one, and
  // that of the current frame.
  const std::vector<Measurement> closed = of_keyframes(8);
  ASSERT_EQ(closed.size(), 3u);
  EXPECT_EQ(closed[1].landmark, 2);
  const double here[7] = {0, 0, 0, 1, 0, 0, 0};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(closed[1].values[i], here[i], 1e-12);
  EXPECT_EQ(closed[2].landmark, 6);
}

TEST(Scene, OfTooManyPointsKeepsThoseItSaw) {
  // Point 0 enters the image from the right when two other points are already visible.
  const auto frames = SceneFrames(
      "max_frames: 30, sigma_px: 0, max_features_per_frame: 2, points: {list: [[3, 0, 4], [0, 0, "
      "4], "
      "[0.5, 0, 4]]}, trajectory: {keyframes: [{position: [0, 0, 0], rpy_deg: [0, 0, 0]}, "
      "{position: [1, 0, 0], rpy_deg: [0, 0, 0]}]}");
  for (const SourceFrame& frame : frames) EXPECT_EQ(Ids(frame), (std::set<std::int64_t>{1, 2}));
  // When one of the other points leaves the image, point 0 is measured.
  const auto all = SceneFrames(
      "max_frames: 30, sigma_px: 0, max_features_per_frame: 2, points: {list: [[3, 0, 4], [-2, 0, "
      "4], "
      "[0.5, 0, 4]]}, trajectory: {keyframes: [{position: [0, 0, 0], rpy_deg: [0, 0, 0]}, "
      "{position: [1, 0, 0], rpy_deg: [0, 0, 0]}]}");
  EXPECT_EQ(Ids(all.front()), (std::set<std::int64_t>{1, 2}));
  EXPECT_EQ(Ids(all.back()), (std::set<std::int64_t>{0, 2}));
}

TEST(Scene, PointsLieWhereTheConfigPutsThem) {
  const auto points = [](const std::string& keys) {
    const MadeScene made = MakeScene("max_frames: 1, " + kStill + ", points: {" + keys + "}");
    std::vector<Vector3d> all;
    for (std::int64_t id = 0; const auto p = made.scene->TrueLandmark(id); ++id) {
      all.emplace_back(p->data());
    }
    EXPECT_FALSE(made.scene->TrueLandmark(-1));
    return all;
  };
  const auto room = points("room: {min: [-3, -1, -2], max: [3, 1.5, 2]}, count: 3000");
  ASSERT_EQ(room.size(), 3000u);
  int on[6] = {};
  for (const Vector3d& p : room) {
    const Vector3d low = p - Vector3d(-3, -1, -2), high = Vector3d(3, 1.5, 2) - p;
    EXPECT_GE(std::min(low.minCoeff(), high.minCoeff()), 0.0);
    EXPECT_EQ(std::min(low.minCoeff(), high.minCoeff()), 0.0);
    for (int i = 0; i < 3; ++i) on[i] += low[i] == 0.0, on[3 + i] += high[i] == 0.0;
  }
  // The room has two faces of 10 m^2, two of 24 m^2 and two of 15 m^2. Tolerances are 4 sigma of a
  // binomial distribution.
  const double share[3] = {10.0 / 98, 24.0 / 98, 15.0 / 98};
  for (int i = 0; i < 6; ++i) {
    const double p = share[i % 3];
    EXPECT_NEAR(on[i], 3000 * p, 4 * std::sqrt(3000 * p * (1 - p))) << i;
  }
  const auto shells = points("shells: {centre: [0, 0, 1], radii: [4.3, 10, 20]}, count: 300");
  Vector3d mean = Vector3d::Zero();
  for (std::size_t i = 0; i < shells.size(); ++i) {
    const double radius = std::vector<double>{4.3, 10, 20}[i % 3];
    EXPECT_NEAR((shells[i] - Vector3d(0, 0, 1)).norm(), radius, 1e-12);
    mean += (shells[i] - Vector3d(0, 0, 1)) / (radius * 300);
  }
  EXPECT_LT(mean.norm(), 4.0 / std::sqrt(300.0));
}

TEST(Scene, NamesTruthAsTheStateIsNamed) {
  const MadeScene made = MakeScene("max_frames: 3, state_entry: robot, " + kPoints + ", " + kStill);
  EXPECT_EQ(made.scene->truths()[0].name, "robot.position");
  EXPECT_EQ(made.scene->truths()[3].name, "robot.angular_velocity");
  EXPECT_EQ(made.scene->size(), 3);
}

TEST(Scene, RefusesWhatMakesNoScene) {
  const auto refused = [](const std::string& keys, const std::string& message) {
    try {
      MakeScene(keys);
      ADD_FAILURE() << "no error; expected: " << message;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::kBadConfig);
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos)
          << error.what() << "\nexpected: " << message;
    }
  };
  refused(kStill, "points: missing key, needed by scene");
  refused(kPoints, "trajectory: missing key, needed by scene");
  refused(kStill + ", points: {bix: 3}", "points.bix: unknown key; did you mean 'box'?");
  refused(kStill + ", points: {count: 3}",
          "points: a key is missing; expected one of list, box, room, shells");
  refused(kStill + ", points: {list: [[1, 2, 3]], count: 3}",
          "points.count: the number of points follows from the list");
  refused(kStill + ", points: {list: [[1, 2]]}", "points.list[0]");
  refused(kStill + ", points: {box: {min: [0, 0, 0], max: [1, 0, 1]}, count: 3}",
          "points.box.max: 'max' does not exceed 'min'");
  refused(kStill + ", points: {shells: {radii: [1, -1]}, count: 3}",
          "points.shells.radii: a radius is not positive");
  refused(kPoints + ", trajectory: {}", "expected one of look_at, keyframes, random");
  refused(kPoints + ", trajectory: {look_at: [{position: [0, 0, 0], target: [0, -2, 0]}]}",
          "trajectory.look_at: at -0.033333 s the orientation of the camera");
  refused(kPoints +
              ", trajectory: {up: [0, 0, 1], random: {linear_acceleration: 1, "
              "angular_acceleration: 1}}",
          "trajectory.up: this key has no effect without 'look_at'");
  refused(kPoints +
              ", trajectory: {keyframes: [{position: [0, 0, 0], matrix: [[1, 0, 0], "
              "[0, 1, 0], [0, 0, -1]]}]}",
          "matrix: the matrix is not a rotation; expected R R' = I to 1e-3, and determinant 1");
  refused(kPoints +
              ", trajectory: {keyframes: [{position: [0, 0, 0], quaternion: "
              "{w: 1, x: 1, y: 0, z: 0}}]}",
          "quaternion: the quaternion does not have unit length");
  refused(kPoints +
              ", trajectory: {keyframes: [{position: [0, 0, 0], rpy_deg: [0, 0, 0], "
              "axis_angle_deg: [0, 0, 1, 5]}]}",
          "'rpy_deg' and 'axis_angle_deg' are both given");
  refused(kPoints +
              ", trajectory: {keyframes: [{t_s: 0, position: [0, 0, 0], rpy_deg: "
              "[0, 0, 0]}, {t_s: 0, position: [0, 0, 0], rpy_deg: [0, 0, 0]}]}",
          "keyframes[1].t_s: this time is not later than the time of the previous item");
  refused(kPoints +
              ", max_frames: 31, trajectory: {keyframes: [{t_s: 0, position: [0, 0, 0], "
              "rpy_deg: [0, 0, 0]}, {t_s: 0.5, position: [0, 0, 0], rpy_deg: "
              "[0, 0, 0]}]}",
          "keyframes[1].t_s: the trajectory ends before the last frame; expected at least 1.0");
  refused(kPoints + ", trajectory: {random: {linear_acceleration: -1, angular_acceleration: 1}}",
          "trajectory.random.linear_acceleration: a standard deviation is negative");
  refused(kPoints + ", " + kStill + ", sigma_px: -1", "source.sigma_px: '-1'");
  refused(
      kPoints + ", " + kStill + ", measures: depth, sigma_depth_m: 0.1, known_points: {count: 3}",
      "source.known");
}

}  // namespace
}  // namespace alidade::testing
