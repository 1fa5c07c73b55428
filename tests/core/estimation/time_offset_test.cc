// SPDX-License-Identifier: Apache-2.0
//
// Tests a sensor with a clock offset: worked numbers, Jacobians compared with numeric ones, and
// late data.
#include "alidade/estimation/time_offset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "motion_models/quaternion_pose.h"
#include "sensors/inverse_depth_feature.h"
#include "support/model_checks.h"
#include "support/systems.h"

namespace alidade {
namespace {

using testing::AddMotion;
using testing::AddSensor;
using testing::Blocks;
using testing::ExpectSame;
using testing::kPoison;
using testing::LinearSensor;
using testing::NumericSensorJacobian;
using testing::Pointers;
using testing::SensorJacobian;

BlockId AddOffset(Problem& problem, double mean, double sigma) {
  AddMotion(problem, "clock", testing::ConstantMotion(1), {{"offset", mean, sigma}});
  return problem.layout.Find("clock.offset");
}

std::vector<std::string> NamesOf(const SharedSensor& sensor) {
  std::vector<std::string> names;
  for (const Space& role : sensor->roles()) names.push_back(role.name);
  return names;
}

// The sensor predicts z = 2 (x + v delta).
TEST(TimeOffset, SeesAPointWhereItIsThen) {
  Problem problem = testing::MovingPoint();
  AddSensor(problem, "z", LinearSensor(2.0, 0.1), {"p.x"});
  const BlockId offset = AddOffset(problem, 0.0, 0.1);
  SensorBinding& sensor = problem.sensors[0];
  ASSERT_EQ(internal::OffsetInTime(problem, offset, sensor), "");
  EXPECT_EQ(NamesOf(sensor.model), (std::vector<std::string>{"x", "p.v", "time_offset"}));
  EXPECT_EQ(sensor.roles[1].block, problem.layout.Find("p.v"));
  EXPECT_EQ(sensor.roles[2].block, offset);
  EXPECT_EQ(sensor.model->inverse().role, -1)
      << "z alone does not determine x if the clock has an offset";
  for (const double delta : {0.0, 0.25, -0.5}) {
    const Blocks roles{{3.0}, {-4.0}, {delta}};
    double z = kPoison, l = kPoison;
    ASSERT_EQ(sensor.model->Predict(Pointers(roles).data(), &z), Status::kOk);
    EXPECT_DOUBLE_EQ(z, 2.0 * (3.0 - 4.0 * delta));
    ExpectSame(SensorJacobian(sensor.model, roles), {2.0, 2.0 * delta, -8.0}, 1e-12);
    ASSERT_EQ(sensor.model->SqrtNoise(Pointers(roles).data(), &z, &l), Status::kOk);
    EXPECT_EQ(l, 0.1);
  }
}

// Tests rotations, landmark roles and an inverse measurement model: a camera that rotates and moves
// sees a landmark.
TEST(TimeOffset, HasTheJacobiansOfACameraThatMoves) {
  const Camera camera(640, 480, 400, 400, 320, 240);
  for (const bool anchored : {false, true}) {
    Problem problem;
    const SharedMotion pose =
        MakeMotion(QuaternionPose({0.3, 0.3, 0.3}, {0.2, 0.2, 0.2}), "quaternion_pose");
    MotionBinding motion{"cam", pose, {}};
    for (const Space& block : pose->blocks()) {
      motion.blocks.push_back(problem.layout.Declare("cam." + block.name, "cam", block));
    }
    problem.motions.push_back(motion);
    const BlockId offset = AddOffset(problem, 0.0, 0.1);
    SensorBinding sensor{
        "pixels",
        "pixels",
        anchored ? MakeSensor(InverseDepthFeature<Anchored>(camera, 1.0), "feature")
                 : MakeSensor(InverseDepthFeature<Xyz>(camera, 1.0), "feature"),
        {{problem.layout.Find("cam.position")}, {problem.layout.Find("cam.orientation")}}};
    sensor.roles.resize(sensor.model->roles().size());
    const int inverse = sensor.model->inverse().role;
    if (anchored) sensor.xyz = MakeSensor(InverseDepthFeature<Xyz>(camera, 1.0), "feature");
    ASSERT_EQ(internal::OffsetInTime(problem, offset, sensor), "");
    const std::vector<std::string> names = NamesOf(sensor.model);
    EXPECT_EQ(names[4], "time_offset");
    EXPECT_EQ(names.size(), anchored ? 8u : 6u);
    EXPECT_EQ(sensor.model->inverse().role, inverse + 3) << "expected the role of the landmark";
    EXPECT_EQ(sensor.xyz != nullptr, anchored);
    if (anchored) {
      EXPECT_EQ(sensor.xyz->roles().size(), 6u);
    }
    Blocks roles;
    for (const Space& role : sensor.model->roles()) {
      roles.push_back(role.geometry.Identity());
    }
    const auto set = [&](const std::string& name, std::vector<double> value) {
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (names[i] != name) continue;
        sensor.model->roles()[i].geometry.Normalise(value.data());
        roles[i] = value;
      }
    };
    set("position", {0.1, -0.2, 0.3});
    set("orientation", {0.98, 0.1, -0.15, 0.05});
    set("cam.velocity", {0.5, 1.0, -0.4});
    set("cam.angular_velocity", {0.3, -0.6, 0.9});
    set("time_offset", {0.08});
    if (anchored) {
      roles[5] = {0.0, 0.0, 0.0};
      roles[6] = {0.28, 0.0, 0.96};
      roles[7] = {0.4};
    } else {
      roles[5] = {0.4, 0.3, 3.0};
    }
    // df/ddelta is itself a numeric derivative. The error of this derivative is 1e-12 of the
    // values, divided by 1 ms.
    ExpectSame(SensorJacobian(sensor.model, roles), NumericSensorJacobian(sensor.model, roles),
               1e-7);
  }
}

/// Constant-velocity motion model that throws for speeds above the speed of light.
struct Refusing : ConstantVelocity<1, false> {
  using ConstantVelocity<1, false>::ConstantVelocity;
  template <class T>
  void Step(const T* x, const T* v, const T* w, double dt_s, T* next_x, T* next_v) const {
    if (v[0] > 3e8) throw std::runtime_error("faster than light");
    ConstantVelocity<1, false>::Step(x, v, w, dt_s, next_x, next_v);
  }
};

// The motion model fails, so the error message is that of the motion model.
TEST(TimeOffset, TellsWhatFailsOfAMotionModel) {
  Problem problem;
  AddMotion(problem, "p", MakeMotion(Refusing(1.0), "refusing"),
            {{"x", 0.0, 1.0}, {"v", 0.0, 1.0}});
  AddSensor(problem, "z", LinearSensor(1.0, 0.1), {"p.x"});
  const BlockId offset = AddOffset(problem, 0.0, 0.1);
  SensorBinding& sensor = problem.sensors[0];
  ASSERT_EQ(internal::OffsetInTime(problem, offset, sensor), "");
  double z = 0.0;
  const Blocks fast{{0.0}, {4e8}, {0.1}};
  EXPECT_EQ(sensor.model->Predict(Pointers(fast).data(), &z), Status::kError);
  EXPECT_EQ(sensor.model->error_text(), "motion model 'refusing': faster than light");
}

TEST(TimeOffset, RefusesWhatItCannotDo) {
  Problem still;
  AddMotion(still, "p", testing::ConstantMotion(1), {{"x", 0.0, 1.0}});
  AddSensor(still, "z", LinearSensor(1.0, 0.1), {"p.x"});
  const BlockId offset = AddOffset(still, 0.0, 0.1);
  EXPECT_NE(internal::OffsetInTime(still, offset, still.sensors[0]).find("has no effect"),
            std::string::npos);
  Problem moving = testing::MovingPoint();
  AddSensor(moving, "z", LinearSensor(1.0, 0.1), {"p.x"});
  moving.sensors[0].roles[0].jacobian_at = JacobianAt::kMeasurement;
  EXPECT_NE(internal::OffsetInTime(moving, AddOffset(moving, 0.0, 0.1), moving.sensors[0])
                .find("jacobian_at"),
            std::string::npos);
}

// A point oscillates. One sensor is on time. The other sensor measures the point 20 ms before the
// timestamp of the measurement. The true motion is a sine, which no motion model generates.
TEST(TimeOffset, IsFoundInDataThatAreLate) {
  Problem problem = testing::MovingPoint(2.0);
  AddSensor(problem, "good", LinearSensor(1.0, 0.01), {"p.x"});
  AddSensor(problem, "late", LinearSensor(1.0, 0.01), {"p.x"});
  const BlockId offset = AddOffset(problem, 0.0, 0.05);
  ASSERT_EQ(internal::OffsetInTime(problem, offset, problem.sensors[1]), "");
  Ekf filter(problem, {}, testing::StreamsOf(problem));
  std::mt19937_64 engine(5);
  std::normal_distribution<double> noise(0.0, 0.01);
  const auto truth = [](double t_s) { return std::sin(1.5 * t_s) + 1.0; };
  for (int k = 0; k < 1000; ++k) {
    const double t_s = 0.02 * k;
    filter.Process(testing::FrameAt(
        t_s, {{0, truth(t_s) + noise(engine)}, {1, truth(t_s - 0.02) + noise(engine)}}));
  }
  const double sigma = filter.state().sigma(offset);
  EXPECT_LT(sigma, 0.002);
  EXPECT_NEAR(*filter.state().value(offset), -0.02, 3.0 * sigma);
}

}  // namespace
}  // namespace alidade
