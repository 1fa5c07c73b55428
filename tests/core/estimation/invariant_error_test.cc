// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/invariant_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/estimation/ekf.h"
#include "alidade/estimation/rollback.h"
#include "alidade/estimation/rts.h"
#include "alidade/testing/frames.h"
#include "support/driven.h"
#include "support/model_checks.h"

namespace alidade {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::Blocks;
using testing::Pointers;

/// Direction and distance of a known point in the frame of the body, z = R' (l - p) + b + n. The
/// orientation is the first role, and the bias is outside the group.
struct KnownPoint : Sensor<Vec<3>, UnitQuaternion, Vec<3>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"orientation", "", "", "w,x,y,z"},
                                     Quantity{"bias", "", "", "x,y,z"},
                                     Quantity{"position", "m", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"point", "m", "", "x,y,z"};
  template <class T>
  bool Predict(const T* q, const T* bias, const T* p, T* z) const {
    const T offset[3] = {4.0 - p[0], -3.0 - p[1], 2.0 - p[2]};
    UnitQuaternion::RotateBack(q, offset, z);
    for (int i = 0; i < 3; ++i) z[i] += bias[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(0.05);
  }
};

/// Products of elements of two vectors.
struct Crossed : Sensor<Vec<3>, Vec<3>, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"a", "", "", "x,y,z"},
                                     Quantity{"b", "", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "", "", "x,y,z"};
  template <class T>
  bool Predict(const T* a, const T* b, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = a[i] * b[(i + 1) % 3];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(0.1);
  }
};

/// Returns an inertial problem whose prior sigmas are `scale` times 1 m, 1 m/s, 1 rad and 0.1.
Problem BodyInSpace(double scale) {
  Problem problem;
  const double root = std::sqrt(0.5);
  problem.AddState("body", testing::Inertial(),
                   {{"position", {1.0, -2.0, 3.0}, {scale, 0.5 * scale, scale}},
                    {"velocity", {0.5, 1.0, 0.0}, scale},
                    {"orientation", {root, 0.0, 0.0, root}, {0.3 * scale, 0.2 * scale, scale}},
                    {"force_bias", {0.0, 0.0, 0.0}, 0.1 * scale},
                    {"rate_bias", {0.0, 0.0, 0.0}, 0.1 * scale}},
                   {"imu"});
  const auto block = [&](const char* name) { return problem.layout.Find(name); };
  const BlockId position = block("body.position"), velocity = block("body.velocity");
  problem.AddSensor("gnss", testing::Position3(), {position});
  problem.AddSensor("point", KnownPoint(),
                    {block("body.orientation"), block("body.force_bias"), position});
  problem.AddSensor("crossed", Crossed(), {velocity, position});
  problem.AddSensor("bias", testing::Position3(), {block("body.rate_bias")});
  return problem;
}

InvariantError ErrorOf(const Problem& problem, ErrorSide side) {
  return {side,
          {problem.layout.Find("body.position"), problem.layout.Find("body.orientation"),
           problem.layout.Find("body.velocity")}};
}

/// Returns a problem in the plane. The mast stands outside the group.
Problem PlanarBody() {
  Problem problem;
  const StateHandle body = problem.AddState(
      "body", testing::Unicycle(),
      {{"position", {1.0, 2.0}, {0.5, 0.2}}, {"heading", {2.0}, {0.4}}, {"mast", {0.3, 0.1}, 0.1}},
      {"odometry"});
  problem.AddSensor("gnss", testing::OnMast(), {body["position"], body["heading"], body["mast"]});
  return problem;
}

constexpr double kInput[6] = {0.4, -0.3, 9.6, 0.5, -0.2, 0.8};
const Blocks kElementAndBiases{
    {1.0, -2.0, 3.0, 0.5, -0.5, 0.1, 0.7, 0.5, 4.0, -1.0}, {0.1, 0.2, -0.1}, {0.02, -0.01, 0.03}};

Blocks Normalised(const std::vector<Space>& spaces, Blocks blocks) {
  for (std::size_t i = 0; i < blocks.size(); ++i) spaces[i].geometry.Normalise(blocks[i].data());
  return blocks;
}

class InvariantErrorOf : public ::testing::TestWithParam<ErrorSide> {};
INSTANTIATE_TEST_SUITE_P(BothSides, InvariantErrorOf,
                         ::testing::Values(ErrorSide::kLeft, ErrorSide::kRight),
                         [](const auto& side) {
                           return side.param == ErrorSide::kLeft ? "left" : "right";
                         });

TEST_P(InvariantErrorOf, JacobiansOfTheMotionModelAreTrue) {
  const Problem body = BodyInSpace(1.0), plane = PlanarBody();
  const Problem problem = internal::InvariantProblem(ErrorOf(body, GetParam()), body);
  const SharedMotion& motion = problem.motions[0].model;
  EXPECT_EQ(motion->blocks()[0].geometry.tangent, 9);
  const std::vector<double> w(12, 0.1);
  testing::ExpectTrueJacobians(motion, Normalised(motion->blocks(), kElementAndBiases), kInput, w,
                               0.2);
  const Problem planar = internal::InvariantProblem(
      {GetParam(), {plane.layout.Find("body.position"), plane.layout.Find("body.heading")}}, plane);
  const double odometry[2] = {2.0, -0.5};
  testing::ExpectTrueJacobians(planar.motions[0].model, {{1.0, -2.0, 3.0}, {0.3, 0.1}}, odometry,
                               {0.2}, 0.3);
}

TEST_P(InvariantErrorOf, JacobiansOfTheSensorModelsAreTrue) {
  const Problem body = BodyInSpace(1.0), plane = PlanarBody();
  const Problem problem = internal::InvariantProblem(ErrorOf(body, GetParam()), body);
  const auto expect_true = [](const SharedSensor& sensor, Blocks roles) {
    roles = Normalised(sensor->roles(), std::move(roles));
    testing::ExpectSame(testing::SensorJacobian(sensor, roles),
                        testing::NumericSensorJacobian(sensor, roles), testing::kNumeric);
  };
  const std::vector<double>& element = kElementAndBiases[0];
  expect_true(problem.sensors[0].model, {element});
  expect_true(problem.sensors[1].model, {element, {0.1, 0.2, 0.3}});
  expect_true(problem.sensors[2].model, {element});
  EXPECT_EQ(problem.sensors[3].model, body.sensors[3].model) << "does not measure the group";
  const Problem planar = internal::InvariantProblem(
      {GetParam(), {plane.layout.Find("body.position"), plane.layout.Find("body.heading")}}, plane);
  expect_true(planar.sensors[0].model, {{1.0, -2.0, 3.0}, {0.3, 0.1}});
}

// Without biases, the inertial model is group-affine. Then the error obeys a linear equation, also
// if it is large [Barrau2017] theorem 2.
TEST_P(InvariantErrorOf, ALargeErrorOfAGroupAffineModelPropagatesLinearly) {
  const Problem body = BodyInSpace(1.0);
  const Problem problem = internal::InvariantProblem(ErrorOf(body, GetParam()), body);
  const SharedMotion& motion = problem.motions[0].model;
  const Geometry& group = motion->blocks()[0].geometry;
  Blocks x{kElementAndBiases[0], {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  x = Normalised(motion->blocks(), x);
  Blocks y = x;
  // 5 m, 0.8 rad and 2 m/s
  VectorXd xi{{3.0, -4.0, 0.0, 0.48, -0.64, 0.0, 1.2, 0.0, -1.6}};
  group.Plus(x[0].data(), xi.data(), y[0].data());
  for (int k = 0; k < 200; ++k) {
    const double u[6] = {0.4 * std::sin(0.1 * k), -0.3, 9.6, 0.5, -0.2 * std::cos(0.2 * k), 0.8};
    const auto from_x = testing::StepWithJacobians(motion, x, u, nullptr, 0.02);
    const Eigen::Map<const Eigen::Matrix<double, 15, 15, Eigen::RowMajor>> f(from_x.f.data());
    xi = (f.topLeftCorner(9, 9) * xi).eval();
    x = from_x.next;
    y = testing::StepWithJacobians(motion, y, u, nullptr, 0.02).next;
    VectorXd error(9);
    group.Minus(y[0].data(), x[0].data(), error.data());
    ASSERT_LT((error - xi).cwiseAbs().maxCoeff(), 1e-9) << k;
  }
}

using Make = std::function<std::unique_ptr<Estimator>(const Problem&)>;
const Make kEkf = [](const Problem& problem) { return std::make_unique<Ekf>(problem); };

/// Returns 40 frames with inputs, and with measurements of all sensors near the prediction.
std::vector<Frame> Frames(const Problem& problem, double sigma) {
  Random random(3);
  std::vector<Frame> frames;
  Ekf ekf(problem);
  ekf.Start(0);
  for (int k = 0; k < 40; ++k) {
    std::vector<Reading> readings{Reading(ekf.stream("imu"), {0.4, -0.3, 9.6, 0.5, -0.2, 0.1 * k})};
    const Timestamp timestamp = TimestampFromSeconds(0.05 * k);
    for (const SensorBinding& sensor : problem.sensors) {
      if (k % 4 != 3) continue;
      std::vector<double> z = ekf.Expect(sensor.name, timestamp)->z;
      for (double& element : z) element += sigma * random.Normal();
      readings.emplace_back(ekf.stream(sensor.stream), z);
    }
    frames.push_back(ekf.MakeFrame(timestamp, readings));
    ekf.Process(frames.back());
  }
  return frames;
}

/// Returns the largest difference of two values, relative to the standard deviations of `a`.
double ValueDistance(const State& a, const State& b) {
  double largest = 0.0;
  for (BlockId id = 0; id < std::ssize(a.layout().blocks()); ++id) {
    const Geometry& geometry = a.layout()[id].geometry();
    std::vector<double> d(static_cast<std::size_t>(geometry.tangent));
    geometry.Minus(b.value(id), a.value(id), d.data());
    for (int i = 0; i < geometry.tangent; ++i) {
      largest = std::max(largest, std::abs(d[static_cast<std::size_t>(i)]) / a.sigma(id, i));
    }
  }
  return largest;
}
double CovarianceDistance(const State& a, const State& b) {
  const MatrixXd p = a.covariance().Dense();
  const VectorXd scale = p.diagonal().cwiseSqrt().cwiseInverse();
  return (scale.asDiagonal() * (b.covariance().Dense() - p) * scale.asDiagonal())
      .cwiseAbs()
      .maxCoeff();
}

// Both errors are equal to first order, and without measurements the propagation of P is exact.
TEST_P(InvariantErrorOf, PredictsTheCovarianceOfThePlainFilter) {
  const Problem problem = BodyInSpace(0.3);
  Ekf plain(problem);
  const auto invariant = MakeInvariant(ErrorOf(problem, GetParam()), problem, kEkf);
  plain.Start(0);
  invariant->Start(0);
  EXPECT_LT(CovarianceDistance(plain.state(), invariant->state()), 1e-14);
  for (int k = 1; k < 40; ++k) {
    const Frame frame =
        plain.MakeFrame(TimestampFromSeconds(0.05 * k),
                        {Reading(plain.stream("imu"), {0.4, -0.3, 9.6, 0.5, -0.2, 0.1 * k})});
    plain.Process(frame);
    invariant->Process(frame);
    ASSERT_LT(ValueDistance(plain.state(), invariant->state()), 1e-12) << k;
    ASSERT_LT(CovarianceDistance(plain.state(), invariant->state()), 1e-11) << k;
  }
}

// The errors differ by terms of second order, which are 1e-4 sigma for sigmas of 1e-4.
TEST_P(InvariantErrorOf, AgreesWithThePlainFilterIfTheErrorsAreSmall) {
  const Problem problem = BodyInSpace(1e-4);
  Ekf plain(problem);
  const auto invariant = MakeInvariant(ErrorOf(problem, GetParam()), problem, kEkf);
  plain.Start(0);
  invariant->Start(0);
  for (const Frame& frame : Frames(problem, 1e-4)) {
    const UpdateReport& a = plain.Process(frame);
    const UpdateReport& b = invariant->Process(frame);
    ASSERT_LT(ValueDistance(plain.state(), invariant->state()), 1e-3);
    ASSERT_LT(CovarianceDistance(plain.state(), invariant->state()), 1e-3);
    ASSERT_EQ(a.measurements().size(), b.measurements().size());
    for (std::size_t i = 0; i < a.measurements().size(); ++i) {
      const MeasurementReport &of_plain = a.measurements()[i], &of_group = b.measurements()[i];
      EXPECT_EQ(of_group.outcome, Outcome::kAccepted);
      EXPECT_NEAR(of_group.nis, of_plain.nis, 1e-3);
      ASSERT_EQ(of_group.gain.size(), of_plain.gain.size());
      const Eigen::Map<const VectorXd> k(of_plain.gain.data(), std::ssize(of_plain.gain));
      const Eigen::Map<const VectorXd> k_group(of_group.gain.data(), std::ssize(of_group.gain));
      EXPECT_LT((k - k_group).norm(), 1e-3 * k.norm());
    }
  }
}

TEST_P(InvariantErrorOf, SmoothsLikeThePlainSmootherIfTheErrorsAreSmall) {
  const Problem problem = BodyInSpace(1e-4);
  const auto make = [](const Problem& of) { return std::make_unique<RtsSmoother>(of); };
  RtsSmoother plain(problem);
  const auto invariant = MakeInvariant(ErrorOf(problem, GetParam()), problem, make);
  EXPECT_TRUE(invariant->offline());
  plain.Start(0);
  invariant->Start(0);
  for (const Frame& frame : Frames(problem, 1e-4)) {
    plain.Process(frame);
    invariant->Process(frame);
  }
  std::vector<State> smoothed;
  plain.Smooth([&](std::size_t, const State& state, const auto&) { smoothed.push_back(state); });
  std::size_t count = 0;
  invariant->Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
    ++count;
    EXPECT_LT(ValueDistance(smoothed[k], state), 1e-3);
    EXPECT_LT(CovarianceDistance(smoothed[k], state), 1e-3);
  });
  EXPECT_EQ(count, 40U);
}

TEST_P(InvariantErrorOf, CopiesAreIndependentAndRollBack) {
  const Problem problem = BodyInSpace(0.1);
  std::vector<Frame> frames = Frames(problem, 0.05);
  std::unique_ptr<Estimator> estimator = MakeInvariant(ErrorOf(problem, GetParam()), problem, kEkf);
  estimator->Start(0);
  const std::unique_ptr<Estimator> in_order = estimator->Clone();
  Snapshots snapshots(*estimator);
  for (const Frame& frame : frames) in_order->Process(frame);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (k != 20) snapshots.Replace(snapshots.frames().size(), {frames[k]}, estimator);
  }
  EXPECT_NE(estimator->state().values(), in_order->state().values());
  snapshots.Replace(20, {frames.begin() + 20, frames.end()}, estimator);
  EXPECT_EQ(estimator->state().values(), in_order->state().values());
  EXPECT_EQ(estimator->state().covariance().Dense(), in_order->state().covariance().Dense());
  EXPECT_EQ(estimator->timestamp(), in_order->timestamp());
}

TEST(InvariantError, MessagesReportTheOriginalBlocks) {
  const Problem problem = BodyInSpace(0.1);
  const Problem inner = internal::InvariantProblem(ErrorOf(problem, ErrorSide::kLeft), problem);
  EXPECT_EQ(inner.layout.blocks().back().name, "body.position, body.orientation, body.velocity");
}

TEST(InvariantError, RefusesBlocksThatAreNotAGroup) {
  const Problem problem = BodyInSpace(1.0);
  const auto defect = [&](const std::vector<std::string>& names, const Problem& of) {
    InvariantError error;
    for (const std::string& name : names) error.blocks.push_back(of.layout.Find(name));
    return FindDefect(error, of);
  };
  const std::vector<std::string> pose{"body.position", "body.orientation"};
  EXPECT_EQ(defect(pose, problem), "");
  EXPECT_NE(defect({"body.orientation", "body.position"}, problem).find("do not form a group"),
            std::string::npos);
  EXPECT_EQ(defect({"body.position", "body.orientation", "body.position"}, problem),
            "a block is listed twice");
  Problem other = problem;
  other.motions[0].blocks.erase(other.motions[0].blocks.begin());
  EXPECT_EQ(defect(pose, other), "the blocks do not belong to one motion model");
  other = problem;
  other.layout[other.layout.Find("body.position")].status = BlockStatus::kConsider;
  EXPECT_EQ(defect(pose, other), "block 'body.position' is constant or a consider state");
  other = problem;
  other.priors[0].sensor = "gnss";
  EXPECT_EQ(defect(pose, other), "block 'body.position' starts from a measurement");
  other = problem;
  other.sensors[0].roles[0].mode = RoleMode::kKnown;
  EXPECT_EQ(defect(pose, other), "sensor 'gnss' does not estimate block 'body.position'");
  other = problem;
  other.sensors[0].roles[0].jacobian_at = JacobianAt::kMeasurement;
  EXPECT_EQ(defect(pose, other),
            "sensor 'gnss' evaluates the Jacobian of block 'body.position' at the measurement");
  other = problem;
  other.landmarks.emplace();
  EXPECT_EQ(defect(pose, other), "the state has landmarks, which the group would have to contain");
  EXPECT_THROW(MakeInvariant({ErrorSide::kLeft, {other.layout.Find("body.position")}}, other, kEkf),
               Error);
}

}  // namespace
}  // namespace alidade
