// SPDX-License-Identifier: Apache-2.0
#include "motion_models/quaternion_pose.h"

#include <gtest/gtest.h>

#include <cmath>

#include "alidade/base/random.h"
#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/ekf.h"
#include "alidade/estimation/ukf.h"
#include "support/model_checks.h"
#include "support/model_maker.h"

namespace alidade {
namespace {

using testing::AbiMotion;
using testing::Blocks;
using testing::MapHost;
using testing::StepResult;

const MapHost::Values kNoise{{"noise.linear_acceleration", {0.6}},
                             {"noise.angular_acceleration", {0.1, 0.2, 0.3}}};

TEST(QuaternionPose, MovesAndTurnsByWorkedNumbers) {
  // The body rotates by half a turn about z in 1 s. With a = (0, 2, 0) m/s^2, v' = (1, 2, 0) and r'
  // = (1, 2, 3).
  const double pi = 3.14159265358979323846;
  const Blocks x{{0, 0, 3}, {1, 0, 0, 0}, {1, 0, 0}, {0, 0, pi / 2}};
  const double w[6] = {0, 2, 0, 0, 0, pi / 2};
  const StepResult out =
      testing::StepWithJacobians(AbiMotion<QuaternionPose>(kNoise), x, nullptr, w, 1.0);
  EXPECT_EQ(out.next[0], (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(out.next[2], (std::vector<double>{1, 2, 0}));
  EXPECT_EQ(out.next[3], (std::vector<double>{0, 0, pi}));
  const double q[4] = {0, 0, 0, 1};  // q is a half turn about z
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(out.next[1][i], q[i], 1e-15);
}

TEST(QuaternionPose, HasTrueJacobiansAlsoWithoutTurning) {
  const auto motion = AbiMotion<QuaternionPose>(kNoise);
  const std::vector<double> w{0.3, -0.2, 0.5, 0.4, 0.1, -0.6}, none(6);
  const Blocks moving{{1, 2, 3}, {0.8, 0.2, -0.4, 0.4}, {0.5, -1, 0.2}, {0.7, -0.4, 1.1}};
  Blocks still = moving;
  still[3] = {0, 0, 0};
  testing::ExpectTrueJacobians(motion, moving, nullptr, w, 0.2);
  testing::ExpectTrueJacobians(motion, still, nullptr, none, 0.2);
  // At omega = 0, the derivative of the rotation with respect to omega is exactly dt.
  const StepResult out = testing::StepWithJacobians(motion, still, nullptr, none.data(), 0.2);
  for (int i = 0; i < 3; ++i) EXPECT_DOUBLE_EQ(out.f[(3 + i) * 12 + 9 + i], 0.2);
}

TEST(QuaternionPose, NoiseIsOneNumberOrOneForEachAxis) {
  const auto motion = AbiMotion<QuaternionPose>(kNoise);
  const Blocks x{{1, 2, 3}, {1, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  const std::vector<double> q = testing::Covariance(motion, x, 0.1);
  const double expected[6] = {0.36, 0.36, 0.36, 0.01, 0.04, 0.09};
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) EXPECT_NEAR(q[r * 6 + c], r == c ? expected[r] : 0.0, 1e-16);
  }
  for (const std::vector<double>& bad :
       {std::vector<double>{1, 2}, {1, 2, 3, 4}, {1, 2, 3, 4, 5}}) {
    const MapHost host({{"noise.linear_acceleration", bad}, {"noise.angular_acceleration", {1}}});
    static_cast<void>(testing::MakeInstance(&EmplaceMotion<QuaternionPose>, host));
    ASSERT_EQ(host.failures().size(), 1u) << bad.size();
    EXPECT_EQ(host.failures()[0],
              "noise.linear_acceleration: needs one number, or one number for each axis");
  }
}

/// Measures the block itself: z = x (+) n, n ~ N(0, 0.02^2 I).
template <class G>
struct Itself : Sensor<G, G> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    for (int i = 0; i < G::kAmbient; ++i) z[i] = x[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < G::kTangent; ++i) l[(G::kTangent + 1) * i] = T(0.02);
  }
};

/// Returns a problem with one body, which starts at rest. Sensors measure the position and the
/// orientation of the body.
Problem MeasuredPose(const SharedMotion& model) {
  Problem problem;
  MotionBinding binding{"body", model, {}};
  const Blocks means{{0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  for (std::size_t i = 0; i < means.size(); ++i) {
    const Space& space = model->blocks()[i];
    const BlockId id = problem.layout.Declare("body." + space.name, "body", space);
    binding.blocks.push_back(id);
    problem.priors.push_back({id, means[i], 0.0025 * Eigen::Matrix3d::Identity(), ""});
  }
  problem.motions.push_back(binding);
  const auto add = [&](const std::string& name, const SharedSensor& sensor, BlockId id) {
    SensorBinding& bound = problem.sensors.emplace_back(name, name, sensor);
    bound.roles.resize(1);
    bound.roles[0].block = id;
  };
  add("position", MakeSensor(Itself<Vec<3>>(), "position"), 0);
  add("orientation", MakeSensor(Itself<UnitQuaternion>(), "orientation"), 1);
  return problem;
}

// Velocities are about 0.3 m/s and 0.3 rad/s. The filters differ only by the nonlinearity of a
// rotation by 0.03 rad.
TEST(QuaternionPose, IsFollowedByTheUnscentedFilterAtEverySpread) {
  const auto motion = AbiMotion<QuaternionPose>(kNoise);
  const Problem problem = MeasuredPose(motion);
  for (const double alpha : {1e-4, 1e-3, 0.01, 0.1, 1.0}) {
    UkfOptions options;
    options.alpha = alpha;
    const std::vector<StreamInfo> streams{{"position", 3}, {"orientation", 4}};
    Ukf ukf(problem, options, streams);
    Ekf ekf(problem, {}, streams);
    Random random(43);
    Blocks x{{0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    for (int k = 0; k < 1000; ++k) {
      Blocks next = testing::Filled(motion->blocks(), 0.0);
      double w[6];
      for (double& element : w) element = 0.2 * random.Normal();
      ASSERT_EQ(motion->Step(testing::Pointers(x).data(), nullptr, w, 0.1,
                             {testing::Pointers(next).data(), nullptr, nullptr}),
                Status::kOk);
      x = next;
      for (const std::size_t i : {2u, 3u}) {
        for (double& element : x[i]) element *= 0.98;
      }
      Frame frame;
      frame.timestamp = TimestampFromSeconds(0.1 * (k + 1));
      for (int i = 0; i < 2; ++i) {
        const Geometry& geometry = motion->blocks()[static_cast<std::size_t>(i)].geometry;
        std::vector<double> z(x[static_cast<std::size_t>(i)]);
        const double n[3] = {0.02 * random.Normal(), 0.02 * random.Normal(),
                             0.02 * random.Normal()};
        geometry.Plus(z.data(), n, z.data());
        frame.measurements.push_back({frame.timestamp, i, -1, z, {}});
      }
      const UpdateReport& report = ukf.Process(frame);
      ASSERT_TRUE(report.events.empty()) << alpha << ' ' << k << ": " << report.events[0].text;
      for (const MeasurementReport& entry : report.measurements()) {
        ASSERT_EQ(entry.outcome, Outcome::kAccepted) << alpha << ' ' << k;
      }
      ekf.Process(frame);
      for (BlockId id = 0; id < 4; ++id) {
        double between[3];
        motion->blocks()[static_cast<std::size_t>(id)].geometry.Minus(
            ukf.state().value(id), ekf.state().value(id), between);
        for (const double d : between) ASSERT_LT(std::abs(d), 0.01) << alpha << ' ' << k;
      }
    }
  }
}

// One w is constant over the interval. r' is computed from v', so two half intervals change r by
// half of sigma_a dt^2 and change nothing else.
TEST(QuaternionPose, HoldsItsNoiseToFirstOrder) {
  const auto motion = AbiMotion<QuaternionPose>(kNoise);
  EXPECT_TRUE(motion->discrete_noise());
  const Blocks x{{1, 2, 3}, {0.8, 0.2, -0.4, 0.4}, {0.5, -1, 0.2}, {0.7, -0.4, 1.1}};
  EXPECT_LT(testing::DefectOfParts(motion, x, nullptr, 0.5e-3, 0.5e-3), 1e-3);
  EXPECT_LT(testing::DefectOfParts(motion, x, nullptr, 0.5e-6, 0.5e-6), 1e-6);
}

TEST(ContinuousQuaternionPose, MovesAndTurnsByWorkedNumbers) {
  // In 1 s the angular velocity rotates the body by a quarter turn about z, and w rotates it by
  // another quarter turn.
  const double pi = 3.14159265358979323846;
  const Blocks x{{0, 0, 3}, {1, 0, 0, 0}, {1, 0, 0}, {0, 0, pi / 2}};
  const double w[12] = {0, 2, 0, 0, 0, pi / 2, 0, 0, 4, 0, 1, 0};
  const StepResult out =
      testing::StepWithJacobians(AbiMotion<ContinuousQuaternionPose>(kNoise), x, nullptr, w, 1.0);
  EXPECT_EQ(out.next[0], (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(out.next[2], (std::vector<double>{1, 0, 4}));
  EXPECT_EQ(out.next[3], (std::vector<double>{0, 1, pi / 2}));
  const double q[4] = {0, 0, 0, 1};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(out.next[1][i], q[i], 1e-15);
}

TEST(ContinuousQuaternionPose, HasTrueJacobiansAlsoWithoutTurning) {
  const auto motion = AbiMotion<ContinuousQuaternionPose>(kNoise);
  std::vector<double> w(12);
  for (std::size_t i = 0; i < w.size(); ++i) w[i] = 0.3 * std::sin(2.0 * static_cast<double>(i));
  const Blocks moving{{1, 2, 3}, {0.8, 0.2, -0.4, 0.4}, {0.5, -1, 0.2}, {0.7, -0.4, 1.1}};
  Blocks still = moving, slow = moving;
  still[3] = {0, 0, 0};
  slow[3] = {0.02, -0.03, 0.025};  // at the limit below which the Jacobian uses series
  const std::vector<double> none(12);
  testing::ExpectTrueJacobians(motion, moving, nullptr, w, 0.2);
  testing::ExpectTrueJacobians(motion, still, nullptr, none, 0.2);
  testing::ExpectTrueJacobians(motion, slow, nullptr, none, 0.2);
  testing::ExpectTrueJacobians(motion, slow, nullptr, none, 0.3);
}

// Each axis of (r, v) has noise of covariance sigma^2 [dt^3/3 dt^2/2; dt^2/2 dt]. Without rotation,
// the covariance of (q, omega) has the same form.
TEST(ContinuousQuaternionPose, NoiseAddsUp) {
  const auto motion = AbiMotion<ContinuousQuaternionPose>(kNoise);
  EXPECT_FALSE(motion->discrete_noise());
  const Blocks still{{1, 2, 3}, {0.8, 0.2, -0.4, 0.4}, {0.5, -1, 0.2}, {0, 0, 0}};
  Blocks turning = still;
  turning[3] = {0.7, -0.4, 1.1};
  const double sigma[6] = {0.6, 0.6, 0.6, 0.1, 0.2, 0.3}, t = 0.1;
  const Eigen::MatrixXd n = testing::StepWithNoise(motion, still, nullptr, t, still, t).n;
  const Eigen::MatrixXd q = n * n.transpose();
  for (int i = 0; i < 6; ++i) {
    const double density = sigma[i] * sigma[i];
    EXPECT_NEAR(q(i, i), density * t * t * t / 3.0, 1e-17);
    EXPECT_NEAR(q(i, 6 + i), density * t * t / 2.0, 1e-17);
    EXPECT_NEAR(q(6 + i, 6 + i), density * t, 1e-17);
  }
  EXPECT_LT(testing::DefectOfParts(motion, still, nullptr, 0.03, 0.17), 1e-15);
  EXPECT_LT(testing::DefectOfParts(motion, turning, nullptr, 0.5e-3, 0.5e-3), 1e-6);
}

}  // namespace
}  // namespace alidade
