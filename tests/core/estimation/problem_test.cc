// SPDX-License-Identifier: Apache-2.0
//
// Tests that a problem built in code equals the problem read from a config, and that invalid
// problems are rejected with a message.
#include <gtest/gtest.h>

#include "alidade/base/error.h"
#include "alidade/estimation.h"
#include "motion_models/constant.h"
#include "motion_models/constant_velocity.h"
#include "sensors/pseudorange.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"
#include "support/systems.h"

namespace alidade {
namespace {

using Point = ConstantVelocity<1, false>;

/// Returns the message of the error that `call` throws.
template <class Call>
std::string RefusalOf(const Call& call) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadConfig);
    return e.what();
  }
  return "nothing";
}

/// Calls `add` with a problem that has the state `target`. Returns the message of the error.
template <class Add>
std::string Refusal(const Add& add) {
  Problem problem;
  const auto target =
      problem.AddState("target", Point(1.0), {{"position", 0.3, 0.1}, {"velocity", 0.0, 0.5}});
  return RefusalOf([&] { add(problem, target); });
}

TEST(Problem, OfCodeIsThatOfBindingsByHand) {
  Problem problem;
  const auto target =
      problem.AddState("target", Point(1.0), {{"velocity", 0.0, 0.5}, {"position", 0.35, 0.1}});
  const auto model = problem.AddState("template", Constant<1>(1), {{"value", 3.3, 0.5}});
  const auto stereo =
      problem.AddSensor("disparity", StereoDisparity(400.0, 0.065, 1.0), {target["position"]});
  const auto scale = problem.AddSensor("inverse_scale", Scale2d::FromPixels(300.0, 1.0),
                                       {target["position"], model["value"]});
  const Problem by_hand = testing::DepthFilter();
  Ekf ekf(problem), other(by_hand, {}, testing::StreamsOf(by_hand));
  for (int k = 0; k < 20; ++k) {
    const Timestamp now = TimestampFromSeconds(0.1 * k);
    const double depth = 0.35 + 0.01 * k;
    ekf.Push(now, {{stereo, {26.0 / depth}}, {scale, {3.3 * depth}}});
    other.Process(testing::FrameAt(0.1 * k, {{0, 26.0 / depth}, {1, 3.3 * depth}}));
    ASSERT_EQ(ekf.state().values(), other.state().values());
    ASSERT_EQ(ekf.state().covariance().Dense(), other.state().covariance().Dense());
  }
  const auto [value, sigma] = ekf.Estimate(target["position"]);
  EXPECT_EQ(value[0], *ekf.state().value(target["position"]));
  EXPECT_EQ(sigma[0], ekf.state().sigma(target["position"]));
}

TEST(Problem, ASensorBringsTheStatesThatItOwns) {
  Problem problem;
  const auto receiver =
      problem.AddState("receiver", Constant<3>(3), {{"value", {0.0, 0.0, 0.0}, 10.0}});
  const std::size_t before = problem.motions.size();
  const auto sensor = problem.AddSensor("range", Pseudorange(1.0), {receiver["value"]});
  ASSERT_GE(problem.motions.size(), before + 1);
  EXPECT_EQ(problem.motions.back().name, "range");
  EXPECT_GE(problem.sensors[0].roles.back().block, 0);
  EXPECT_EQ(problem.streams[static_cast<std::size_t>(sensor.stream)].known, 3);
}

TEST(Problem, ABlockMayStartFromAMeasurement) {
  Problem problem;
  const auto target = problem.AddState(
      "target", Point(1.0),
      {InitialValue::FromMeasurement("position", "stereo"), {"velocity", 0.0, 0.5}});
  const auto stereo =
      problem.AddSensor("stereo", StereoDisparity(400.0, 0.065, 1.0), {target["position"]});
  Ekf ekf(problem);
  ekf.Push(0, stereo, 52.0);
  EXPECT_NEAR(ekf.Estimate(target["position"]).value[0], 0.5, 1e-12);
  EXPECT_NEAR(ekf.Estimate(target["position"]).sigma[0], 0.5 / 52.0, 1e-12);
}

TEST(Problem, ABlockMayHaveAnotherNameAndACovariance) {
  Problem problem;
  const Eigen::Matrix3d covariance = Eigen::Vector3d(1.0, 4.0, 9.0).asDiagonal();
  InitialValue start = InitialValue::WithCovariance("value", {1.0, 2.0, 3.0}, covariance);
  start.name = "place";
  const auto body = problem.AddState("body", Constant<3>(3), {start});
  EXPECT_EQ(problem.layout[body["place"]].name, "body.place");
  const Ekf ekf(problem);
  EXPECT_EQ(ekf.Estimate(body["place"]).value, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(ekf.Estimate(body["place"]).sigma, Eigen::Vector3d(1.0, 2.0, 3.0));
}

TEST(Problem, SensorsMayReadOneStream) {
  Problem problem;
  const auto target =
      problem.AddState("target", Point(1.0), {{"position", 0.3, 0.1}, {"velocity", 0.0, 0.5}});
  const StereoDisparity stereo(400.0, 0.065, 1.0);
  const auto left = problem.AddSensor("left", stereo, {target["position"]}, {.stream = "camera"});
  const auto right = problem.AddSensor("right", stereo, {target["position"]}, {.stream = "camera"});
  EXPECT_EQ(left.stream, right.stream);
  ASSERT_EQ(problem.streams.size(), 1u);
  Ekf ekf(problem);
  EXPECT_EQ(ekf.Push(0, left, 87.0).measurements().size(), 2u);
}

TEST(Problem, AStateOfASensorMayStartOtherwiseThanItsModelSays) {
  Problem problem;
  const auto receiver =
      problem.AddState("receiver", Constant<3>(3), {{"value", {0.0, 0.0, 0.0}, 10.0}});
  const Pseudorange model(1.0);
  const std::size_t role = Pseudorange::kRoles.size() - 1;
  OwnedState drift = OwnedState::Of(MakeSensor(model)->owned(role));
  drift.initial = InitialValue("", 2.0, 0.5);
  problem.AddSensor("range", model, {receiver["value"]}, {.owned = {{role, drift}}});
  const Ekf ekf(problem);
  const auto [value, sigma] = ekf.Estimate(problem.sensors[0].roles[role].block);
  EXPECT_EQ(value[0], 2.0);
  EXPECT_EQ(sigma[0], 0.5);
}

TEST(Problem, WhatIsRefusedChangesNothing) {
  Problem problem;
  const auto receiver =
      problem.AddState("receiver", Constant<3>(3), {{"value", {0.0, 0.0, 0.0}, 10.0}});
  problem.AddSensor("range", Pseudorange(1.0), {receiver["value"]});
  const std::size_t blocks = problem.layout.blocks().size();
  const auto depth = problem.AddState("depth", Constant<1>(1), {{"value", 1.0, 1.0}});
  const auto add = [&](const std::string& stream) {
    problem.AddSensor("other", Pseudorange(1.0), {receiver["value"]}, {.stream = stream});
  };
  problem.AddSensor("stereo", StereoDisparity(400.0, 0.065, 1.0), {depth["value"]});
  EXPECT_NE(RefusalOf([&] { add("stereo"); }), "nothing");
  EXPECT_EQ(problem.layout.blocks().size(), blocks + 1);
  EXPECT_EQ(problem.FindSensor("other"), -1);
  EXPECT_EQ(RefusalOf([&] { add("range"); }), "nothing");
}

TEST(Problem, WhatDoesNotFitIsRefusedInWords) {
  const StereoDisparity stereo(400.0, 0.065, 1.0);
  EXPECT_EQ(Refusal([](Problem& p, auto&) { p.AddState("target", Constant<1>(1), {}); }),
            "state 'target': the name is already used; expected another name");
  EXPECT_EQ(Refusal([](Problem& p, auto&) {
              p.AddState("b", Point(1.0), {{"position", 0.0, 1.0}});
            }),
            "state 'b': block 'velocity' has no initial value; expected one");
  EXPECT_EQ(Refusal([](Problem& p, auto&) {
              p.AddState("b", Point(1.0), {{"depth", 0.0, 1.0}, {"velocity", 0.0, 1.0}});
            }),
            "state 'b': the model has no block 'depth'; expected one of position, velocity");
  EXPECT_EQ(Refusal([](Problem& p, auto&) {
              p.AddState("b", Constant<3>(3), {{"value", {0.0, 1.0}, 1.0}});
            }),
            "state 'b': the initial value of 'value', a vector(3), has the size 2; expected 3");
  EXPECT_EQ(Refusal([](Problem& p, auto&) {
              p.AddState("b", Constant<1>(1), {{"value", 0.0, -1.0}});
            }),
            "state 'b': the initial value of 'value', a vector(1), has an invalid standard "
            "deviation; expected a finite number >= 0");
  EXPECT_EQ(Refusal([](Problem& p, auto&) {
              p.AddState("b", Constant<1>(1), {{"value", 0.0, 1.0}, {"value", 1.0, 1.0}});
            }),
            "state 'b': block 'value' has several initial values; expected one");
  EXPECT_EQ(
      Refusal([](Problem& p, auto&) {
        p.AddState("b", Constant<3>(3),
                   {InitialValue::WithCovariance(
                       "value", {0.0, 0.0, 0.0},
                       Eigen::Vector3d(1.0, -1.0, 1.0).asDiagonal().toDenseMatrix())});
      }),
      "state 'b': the initial value of 'value', a vector(3), has an invalid covariance; expected a "
      "symmetric, positive semi-definite matrix of 3 x 3 finite numbers");
  EXPECT_EQ(Refusal([&](Problem& p, auto& t) {
              p.AddSensor("s", stereo, {t["position"]}, {.loss = {LossKind::kHuber, -1.0}});
            }),
            "sensor 's': the scale of the robust loss is -1; expected a number > 0");
  EXPECT_EQ(Refusal([&](Problem& p, auto& t) {
              p.AddSensor("s", stereo, {t["position"]}, {.owned = {{0, OwnedState::Of({})}}});
            }),
            "sensor 's': role 0 in the option `owned` is not a model parameter state; expected a "
            "role with the flag ALIDADE_ROLE_OWNED and without a block");
  EXPECT_EQ(Refusal([](Problem&, auto& target) { static_cast<void>(target["depth"]); }),
            "state 'target': the state has no block 'depth'; expected one of position, velocity");
  EXPECT_EQ(Refusal([&](Problem& p, auto&) { p.AddSensor("s", stereo, {}); }),
            "sensor 's': role 'depth' has no block; expected a block that is a vector(1)");
  EXPECT_EQ(Refusal([&](Problem& p, auto& t) {
              p.AddSensor("s", stereo, {t["position"], t["velocity"]});
            }),
            "sensor 's': the number of blocks for the roles is 2; expected at most 1: depth");
  EXPECT_EQ(Refusal([&](Problem& p, auto&) {
              const auto wide = p.AddState("wide", Constant<2>(2), {{"value", {0.0, 0.0}, 1.0}});
              p.AddSensor("s", stereo, {wide["value"]});
            }),
            "sensor 's': role 'depth' has the block 'wide.value', which is a vector(2); expected a "
            "block that is a vector(1)");
  EXPECT_EQ(Refusal([](Problem& p, auto& t) {
              p.AddSensor("s", Scale2d::FromPixels(300.0, 1.0), {t["position"], t["position"]});
            }),
            "sensor 's': block 'target.position' fills two roles; expected a different block for "
            "each role");
  EXPECT_EQ(
      Refusal([&](Problem& p, auto& t) {
        p.AddSensor("a", stereo, {t["position"]}, {.stream = "camera"});
        const auto wide = p.AddState("wide", Constant<3>(3), {{"value", {0.0, 0.0, 0.0}, 1.0}});
        p.AddSensor("b", Pseudorange(1.0), {wide["value"]}, {.stream = "camera"});
      }),
      "sensor 'b': stream 'camera' is already used with measurements of size 1 and 0 known "
      "numbers; expected size 1 and 3 known numbers");
  EXPECT_EQ(
      Refusal([](Problem& p, auto&) {
        p.AddState(
            "b", Constant<3>(3),
            {InitialValue::WithCovariance("value", {0.0, 0.0, 0.0}, Eigen::Matrix2d::Identity())});
      }),
      "state 'b': the initial value of 'value', a vector(3), has an invalid covariance; expected a "
      "symmetric, positive semi-definite matrix of 3 x 3 finite numbers");
}

TEST(Problem, AFilterRefusesABlockThatCannotStart) {
  const auto refusal = [](const std::string& block, const std::string& sensor) {
    Problem problem;
    const auto start = [&](const std::string& name) {
      if (name == block) return InitialValue::FromMeasurement(name, sensor);
      return InitialValue(name, 0.5, 1.0);
    };
    const auto target =
        problem.AddState("target", Point(1.0), {start("position"), start("velocity")});
    problem.AddSensor("stereo", StereoDisparity(400.0, 0.065, 1.0), {target["position"]});
    return RefusalOf([&] { Ekf filter(problem); });
  };
  EXPECT_EQ(refusal("position", "stereo"), "nothing");
  EXPECT_EQ(refusal("position", "stero"),
            "Ekf: from_measurement: this estimator has no sensor 'stero' (block "
            "'target.position'); expected a sensor of this estimator; did you mean 'stereo'?");
  EXPECT_EQ(refusal("velocity", "stereo"),
            "Ekf: from_measurement: sensor 'stereo' does not determine this block (block "
            "'target.velocity'); expected a sensor whose inverse measurement model determines this "
            "block");
}

TEST(Problem, AFilterRefusesACycleOfFirstMeasurements) {
  Problem problem;
  const auto start = InitialValue::FromMeasurement;
  const auto a = problem.AddState("a", Constant<1>(1), {start("value", "a_by_b")});
  const auto b = problem.AddState("b", Constant<1>(1), {start("value", "b_by_a")});
  problem.AddSensor("a_by_b", Scale2d::FromPixels(300.0, 1.0), {b["value"], a["value"]});
  problem.AddSensor("b_by_a", Scale2d::FromPixels(300.0, 1.0), {a["value"], b["value"]});
  EXPECT_EQ(RefusalOf([&] { Ekf filter(problem); }),
            "Ekf: from_measurement: the initialisation is cyclic: a.value <- b.value <- a.value "
            "(block 'a.value'); expected a mean for one block of the cycle");
}

TEST(Problem, AFilterRefusesARoleThatNoMeasurementImplies) {
  Problem problem;
  const auto target =
      problem.AddState("target", Point(1.0), {{"position", 0.3, 0.1}, {"velocity", 0.0, 0.5}});
  const auto model = problem.AddState("template", Constant<1>(1), {{"value", 3.3, 0.5}});
  const auto measured = [](BlockId block) {
    return RoleBinding(block, RoleMode::kEstimate, JacobianAt::kMeasurement);
  };
  problem.AddSensor("scale", Scale2d::FromPixels(300.0, 1.0),
                    {measured(target["position"]), model["value"]});
  EXPECT_EQ(RefusalOf([&] { Ekf filter(problem); }),
            "Ekf: jacobian_at: model 'scale' has no inverse measurement model of role 'depth' "
            "(sensor 'scale', role 'depth'); expected prediction");
  problem.sensors[0].roles = {target["position"], measured(model["value"])};
  EXPECT_EQ(RefusalOf([&] { Ekf filter(problem); }), "nothing");
}

}  // namespace
}  // namespace alidade
