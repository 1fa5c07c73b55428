// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/ukf.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>

#include "alidade/base/random.h"
#include "alidade/estimation/square_root_ekf.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

// In the first step P is singular, because v is known exactly. Q has rank 1, and the noise of the
// measurements is not small.
TEST(Ukf, EqualsTheKalmanFilterOnALinearProblemWithSingularCovariances) {
  Problem problem = MovingPoint(0.7);
  problem.priors[1].covariance.setZero();
  AddSensor(problem, "direct", LinearSensor(1.0, 0.3), {"p.x"});
  AddSensor(problem, "doubled", LinearSensor(2.0, 0.7), {"p.x"});
  for (const double alpha : {1.0, 0.5, 1e-3}) {
    for (const Fuse fuse : {Fuse::kJoint, Fuse::kPerMeasurement}) {
      UkfOptions options;
      options.alpha = alpha;
      options.kappa = 0.5;
      options.filter.fuse = fuse;
      Ukf ukf(problem, options, StreamsOf(problem));
      ukf.Start(0);
      Eigen::Vector2d x(1.0, -0.5);
      Eigen::Matrix2d p = Eigen::Vector2d(4.0, 0.0).asDiagonal();
      const Eigen::Matrix2d f = (Eigen::Matrix2d() << 1.0, 0.04, 0.0, 1.0).finished();
      const Eigen::Vector2d g = 0.7 * Eigen::Vector2d(0.5 * 0.04 * 0.04, 0.04);
      Random random(31);
      for (int k = 1; k <= 200; ++k) {
        x = f * x;
        p = f * p * f.transpose() + g * g.transpose();
        const double z[] = {random.Normal(), random.Normal()};
        const double gains[] = {1.0, 2.0}, sigmas[] = {0.3, 0.7};
        for (int i = 0; i < 2 && k % 5 != 0; ++i) {
          const double s = gains[i] * gains[i] * p(0, 0) + sigmas[i] * sigmas[i];
          const Eigen::Vector2d gain = p.col(0) * gains[i] / s;
          x += gain * (z[i] - gains[i] * x[0]);
          p = p - gain * s * gain.transpose();
        }
        ukf.Process(k % 5 != 0 ? FrameAt(0.04 * k, {{0, z[0]}, {1, z[1]}}) : FrameAt(0.04 * k, {}));
        ASSERT_NEAR(ValueOf(ukf.state(), "p.x"), x[0], 1e-9) << k << " alpha " << alpha;
        ASSERT_NEAR(ValueOf(ukf.state(), "p.v"), x[1], 1e-9) << k << " alpha " << alpha;
        ASSERT_LT((ukf.state().covariance().Dense() - p).norm(), 1e-9) << k << " alpha " << alpha;
      }
    }
  }
}

/// Measures z = x^2 + n.
struct Square : Sensor<Vec<1>, Vec<1>> {
  static constexpr std::array kRoles{Quantity{"x"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = x[0] * x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.5);
  }
};

// If x ~ N(m, s^2), then E[x^2] = m^2 + s^2, Var[x^2] = 4 m^2 s^2 + 2 s^4 and
// Cov[x, x^2] = 2 m s^2. The filter is exact for c^2 = 3 and beta = 0.
TEST(Ukf, GetsTheMomentsOfASquareExactly) {
  Problem problem;
  AddMotion(problem, "p", testing::ConstantMotion(1), {{"x", 1.5, 0.8}});
  AddSensor(problem, "square", MakeSensor(Square{}, "square"), {"p.x"});
  UkfOptions options;
  options.alpha = 1.0;
  options.beta = 0.0;
  options.kappa = 2.0;
  Ukf ukf(problem, options, StreamsOf(problem));
  const UpdateReport& report = ukf.Process(FrameAt(0.0, {{0, 4.0}}));
  const MeasurementReport& entry = report.measurements()[0];
  const double m = 1.5, v = 0.64, s = 4.0 * m * m * v + 2.0 * v * v + 0.25, k = 2.0 * m * v / s;
  EXPECT_NEAR(entry.h[0], m * m + v, 1e-13);
  EXPECT_NEAR(entry.s[0], s, 1e-13);
  EXPECT_NEAR(entry.gain[0], k, 1e-13);
  EXPECT_NEAR(ValueOf(ukf.state(), "p.x"), m + k * (4.0 - m * m - v), 1e-13);
  EXPECT_NEAR(CovarianceOf(ukf.state(), "p.x", "p.x"), v - k * k * s, 1e-13);
}

/// Measures the distance of a point of the plane from a beacon at the origin.
struct Range : Sensor<Vec<1>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"p", "m", "", "x,y"}};
  static constexpr Quantity kMeasurement{"range", "m"};
  template <class T>
  bool Predict(const T* p, T* z) const {
    using std::sqrt;
    z[0] = sqrt(p[0] * p[0] + p[1] * p[1]);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.1);
  }
};

/// Returns a problem with a point at (distance, 0) +- 1 m, and the sensor Range.
Problem PointNearBeacon(double distance) {
  Problem problem;
  MotionBinding binding{"p", testing::ConstantMotion(2), {}};
  binding.blocks.push_back(problem.layout.Declare("p.x", "p", binding.model->blocks()[0]));
  problem.priors.push_back({0, {distance, 0.0}, Eigen::Matrix2d::Identity(), ""});
  problem.motions.push_back(binding);
  AddSensor(problem, "range", MakeSensor(Range{}, "range"), {"p.x"});
  return problem;
}

// At distance d from the beacon, the mean range is 1.25 m, its variance 0.43 m^2. The curvature of
// h at the estimate is 1 / d, which is far above the curvature at most points of the prior. The
// predicted mean is at most sqrt(N) / alpha = 3.54 m.
TEST(Ukf, ReportsOnceThatABeaconIsTooNear) {
  for (const double distance : {0.001, 0.1}) {
    const Problem problem = PointNearBeacon(distance);
    Ukf ukf(problem, {}, StreamsOf(problem));
    const UpdateReport first = ukf.Process(FrameAt(0.0, {{0, 1.25}}));
    const MeasurementReport& entry = first.measurements()[0];
    EXPECT_EQ(entry.outcome, Outcome::kAccepted);
    EXPECT_LT(entry.h[0], 3.6);
    EXPECT_LT(entry.nis, 1.0);
    ASSERT_EQ(first.events.size(), 1u);
    EXPECT_EQ(first.events[0].kind, EventKind::kNonlinear);
    EXPECT_NE(first.events[0].text.find("sensor 'range'"), std::string::npos);
    EXPECT_TRUE(ukf.Process(FrameAt(0.0, {{0, 1.25}})).events.empty());
  }
}

TEST(Ukf, DoesNotReportABeaconThatIsFarEnough) {
  const Problem problem = PointNearBeacon(3.0);
  Ukf ukf(problem, {}, StreamsOf(problem));
  EXPECT_TRUE(ukf.Process(FrameAt(0.0, {{0, 3.0}})).events.empty());
}

/// Measures x^2 - y^2, whose curvatures cancel in the mean if x and y have the same variance.
struct Saddle : Sensor<Vec<1>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"p", "m", "", "x,y"}};
  static constexpr Quantity kMeasurement{"saddle", "m^2"};
  template <class T>
  bool Predict(const T* p, T* z) const {
    z[0] = p[0] * p[0] - p[1] * p[1];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.1);
  }
};

TEST(Ukf, DoesNotReportCurvaturesThatCancelInTheMean) {
  Problem problem;
  MotionBinding binding{"p", testing::ConstantMotion(2), {}};
  binding.blocks.push_back(problem.layout.Declare("p.x", "p", binding.model->blocks()[0]));
  problem.priors.push_back({0, {0.0, 0.0}, Eigen::Matrix2d::Identity(), ""});
  problem.motions.push_back(binding);
  AddSensor(problem, "saddle", MakeSensor(Saddle{}, "saddle"), {"p.x"});
  Ukf ukf(problem, {}, StreamsOf(problem));
  for (const Event& event : ukf.Process(FrameAt(0.0, {{0, 0.0}})).events) {
    EXPECT_NE(event.kind, EventKind::kNonlinear) << event.text;
  }
}

/// Motion model of an orientation that rotates by a random w ~ N(0, sigma^2 I) in each step: q' = q
/// Exp(w).
struct TurningOrientation : Motion<3, UnitQuaternion> {
  static constexpr std::array kBlocks{Quantity{"q", "", "", "w,x,y,z"}};
  double sigma;
  explicit TurningOrientation(double s) : sigma(s) {}
  template <class T>
  void Step(const T* q, const T* w, double, T* next) const {
    UnitQuaternion::Plus(q, w, next);
  }
  void SqrtQ(double, MatrixRef l) const {
    for (int i = 0; i < 3; ++i) l(i, i) = sigma;
  }
};

/// Measures an orientation.
struct Compass : Sensor<UnitQuaternion, UnitQuaternion> {
  static constexpr std::array kRoles{Quantity{"q", "", "", "w,x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "", "", "w,x,y,z"};
  template <class T>
  bool Predict(const T* q, T* z) const {
    for (int i = 0; i < 4; ++i) z[i] = q[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    for (int i = 0; i < 3; ++i) l[4 * i] = T(0.02);
  }
};

/// Returns a problem with an orientation that starts at (1, 0, 0, 0) +- 0.05 rad.
Problem Orientation() {
  Problem problem;
  MotionBinding binding{"body", MakeMotion(TurningOrientation(0.01), "turning"), {}};
  const BlockId id = problem.layout.Declare("body.q", "body", binding.model->blocks()[0]);
  binding.blocks.push_back(id);
  Prior prior;
  prior.block = id;
  prior.mean = {1.0, 0.0, 0.0, 0.0};
  prior.covariance = 0.0025 * Eigen::Matrix3d::Identity();
  problem.priors.push_back(prior);
  problem.motions.push_back(binding);
  AddSensor(problem, "compass", MakeSensor(Compass{}, "compass"), {"body.q"});
  return problem;
}

// The covariances are isotropic, and the orientation is measured directly, so 1/P+ = 1/(P + Q) +
// 1/R at every orientation. To second order in sigma, the estimate lies on the great circle between
// the prediction and the measurement.
TEST(Ukf, FollowsAnOrientationFarFromWhereItBegan) {
  const Problem problem = Orientation();
  UkfOptions options;
  options.alpha = 1.0;
  Ukf ukf(problem, options, StreamsOf(problem));
  Ekf ekf(problem, {}, StreamsOf(problem));
  Random random(32);
  Eigen::Quaterniond truth(1.0, 0.0, 0.0, 0.0);
  double p = 0.0025;
  for (int k = 0; k < 400; ++k) {
    const Eigen::Vector3d turn(0.01, 0.004, -0.006);
    truth = truth * Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
    Eigen::Vector3d n(random.Normal(), random.Normal(), random.Normal());
    n *= 0.02;
    const Eigen::Quaterniond z =
        truth * Eigen::Quaterniond(Eigen::AngleAxisd(n.norm(), n.normalized()));
    Frame frame = FrameAt(0.1 * k, {});
    frame.measurements.push_back({frame.timestamp, 0, -1, {z.w(), z.x(), z.y(), z.z()}, {}});
    const UpdateReport& report = ukf.Process(frame);
    ASSERT_EQ(report.measurements()[0].outcome, Outcome::kAccepted);
    ekf.Process(frame);
    if (k > 0) p += 1e-4;
    p = 1.0 / (1.0 / p + 1.0 / 4e-4);
    const double* q = ukf.state().value(0);
    ASSERT_NEAR(Eigen::Map<const Eigen::Vector4d>(q).norm(), 1.0, 1e-12);
    double between[3];
    UnitQuaternion::Minus(q, ekf.state().value(0), between);
    // Sigma points at a distance of sqrt(6) sigma change the moments by a fraction sigma^2 / 12,
    // which is at most 1e-3 here.
    ASSERT_LT(Eigen::Map<const Eigen::Vector3d>(between).norm(), 1e-3) << k;
    ASSERT_LT((ukf.state().covariance().Dense() - p * Eigen::Matrix3d::Identity()).norm(), 0.01 * p)
        << k;
  }
  EXPECT_GT(truth.angularDistance(Eigen::Quaterniond::Identity()), 1.0);
}

// In the joint update the disparity sensor needs sigma points closer to the estimate. The gate and
// the report of the other sensor use sigma points with the full spread.
TEST(Ukf, ReportsOfAJointUpdateWhatTheGateSaw) {
  Problem problem = DepthFilter();
  problem.priors[0].covariance(0) = 1.0;
  problem.sensors.pop_back();
  AddSensor(problem, "square", MakeSensor(Square{}, "square"), {"target.depth"});
  UkfOptions options;
  options.alpha = 1.0;
  Ukf joint(problem, options, StreamsOf(problem));
  const UpdateReport& report = joint.Process(FrameAt(0.0, {{0, 80.0}, {1, 0.1}}));
  EXPECT_TRUE(HasEvent(report, EventKind::kGuarded));
  ASSERT_EQ(report.measurements().size(), 2u);
  const MeasurementReport& square = report.measurements()[1];
  ASSERT_EQ(square.outcome, Outcome::kAccepted);
  EXPECT_NEAR(square.nis, square.innovation[0] * square.innovation[0] / square.s[0], 1e-12);
  EXPECT_NEAR(square.innovation[0], 0.1 - square.h[0], 1e-15);
  Ukf alone(problem, options, StreamsOf(problem));
  const UpdateReport& single = alone.Process(FrameAt(0.0, {{1, 0.1}}));
  EXPECT_EQ(square.h, single.measurements()[0].h);
  EXPECT_EQ(square.s, single.measurements()[0].s);
}

/// Measures z = x_1 + n.
struct First : Sensor<Vec<1>, Vec<2>> {
  static constexpr std::array kRoles{Quantity{"x", "", "", "x,y"}};
  static constexpr Quantity kMeasurement{"z"};
  template <class T>
  bool Predict(const T* x, T* z) const {
    z[0] = x[0];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = T(0.5);
  }
};

// Tests fault 82 of tests/faults/README.md.
TEST(Ukf, ACovarianceWithoutASquareRootIsRepairedAndThatIsSaid) {
  Problem problem;
  MotionBinding binding{"p", testing::ConstantMotion(2), {}};
  binding.blocks.push_back(problem.layout.Declare("p.x", "p", binding.model->blocks()[0]));
  Prior prior;
  prior.block = 0;
  prior.mean = {1.0, 2.0};
  // One eigenvalue is -0.1.
  prior.covariance = (Eigen::Matrix2d() << 1.0, 1.1, 1.1, 1.0).finished();
  problem.priors.push_back(prior);
  problem.motions.push_back(binding);
  AddSensor(problem, "first", MakeSensor(First{}, "first"), {"p.x"});
  Ukf ukf(problem, {}, StreamsOf(problem));
  const UpdateReport& report = ukf.Process(FrameAt(0.0, {{0, 1.5}}));
  EXPECT_TRUE(HasEvent(report, EventKind::kRepaired));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kAccepted);
  const Eigen::Matrix2d p = ukf.state().covariance().Dense();
  EXPECT_GE(p(0, 0), 0.0);
  EXPECT_GE(p.determinant(), -1e-12);
  EXPECT_FALSE(HasEvent(ukf.Process(FrameAt(0.0, {{0, 1.5}})), EventKind::kRepaired));
}

TEST(Ukf, GatesAndHoldsAsTheEkfDoes) {
  Problem problem = DepthFilter();
  problem.sensors[1].roles[1].mode = RoleMode::kKnown;
  UkfOptions options;
  options.filter.gate = 0.999;
  Ukf ukf(problem, options, StreamsOf(problem));
  const UpdateReport& report = ukf.Process(FrameAt(0.0, {{0, 1e9}, {1, 1.1}}));
  EXPECT_EQ(report.measurements()[0].outcome, Outcome::kGated);
  EXPECT_EQ(report.measurements()[1].outcome, Outcome::kAccepted);
  EXPECT_EQ(ValueOf(ukf.state(), "template.inverse_distance"), 3.3);
  EXPECT_NEAR(CovarianceOf(ukf.state(), "template.inverse_distance", "template.inverse_distance"),
              0.25, 1e-15);
  // h' = 3.3 Z is linear, so S equals that of the Kalman filter, with R = (2/300 h^3)^2 at the
  // prediction.
  const double h = 0.35 * 3.3, sigma = 2.0 / 300.0 * h * h * h;
  EXPECT_NEAR(report.measurements()[1].s[0], 3.3 * 3.3 * 0.01 + sigma * sigma, 1e-14);
}

// The model computes x' = x + v dt, but block x is constant.
TEST(Ukf, AFixedBlockIsNotMovedByItsModel) {
  Problem problem;
  const SharedMotion model = testing::ConstantVelocityMotion(0.7);
  const BlockId x = problem.layout.Declare("p.x", "p", model->blocks()[0], BlockStatus::kConstant);
  const BlockId v = problem.layout.Declare("p.v", "p", model->blocks()[1]);
  problem.motions.push_back({"p", model, {x, v}});
  problem.priors.push_back({x, {1.0}, {}, ""});
  problem.priors.push_back({v, {-0.5}, Eigen::MatrixXd::Constant(1, 1, 4.0), ""});
  Ukf ukf(problem, {}, {});
  ukf.Start(0);
  ukf.Process(FrameAt(0.5, {}));
  EXPECT_EQ(ValueOf(ukf.state(), "p.x"), 1.0);
  EXPECT_NEAR(CovarianceOf(ukf.state(), "p.v", "p.v"), 4.0 + 0.49 * 0.25, 1e-12);
}

// The system is linear, so all three filters agree. Block v is constant: no filter moves or
// corrects it.
TEST(Ukf, AFixedBlockEntersTheModelsAndStaysAsItIs) {
  Problem problem;
  const SharedMotion model = testing::ConstantVelocityMotion(0.7);
  const BlockId v = problem.layout.Declare("p.v", "p", model->blocks()[1], BlockStatus::kConstant);
  const BlockId x = problem.layout.Declare("p.x", "p", model->blocks()[0]);
  problem.motions.push_back({"p", model, {x, v}});
  problem.priors.push_back({v, {-0.5}, {}, ""});
  problem.priors.push_back({x, {1.0}, Eigen::MatrixXd::Constant(1, 1, 4.0), ""});
  AddSensor(problem, "direct", LinearSensor(1.0, 0.3), {"p.x"});
  Ekf ekf(problem, {}, StreamsOf(problem));
  Ukf ukf(problem, {}, StreamsOf(problem));
  SquareRootEkf root(problem, {}, StreamsOf(problem));
  Random random(33);
  for (int k = 0; k < 50; ++k) {
    const Frame frame = FrameAt(0.04 * k, {{0, random.Normal()}});
    ekf.Process(frame);
    for (Estimator* filter : std::initializer_list<Estimator*>{&ukf, &root}) {
      filter->Process(frame);
      EXPECT_EQ(ValueOf(filter->state(), "p.v"), -0.5);
      EXPECT_NEAR(ValueOf(filter->state(), "p.x"), ValueOf(ekf.state(), "p.x"), 1e-10);
      EXPECT_NEAR(CovarianceOf(filter->state(), "p.x", "p.x"),
                  CovarianceOf(ekf.state(), "p.x", "p.x"), 1e-10);
    }
  }
}

}  // namespace
}  // namespace alidade
