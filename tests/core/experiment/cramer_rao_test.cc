// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/cramer_rao.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <functional>

#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/ekf.h"
#include "alidade/model/model.h"
#include "support/landmark_models.h"
#include "support/systems.h"

namespace alidade::internal {
namespace {

using testing::FrameAt;

/// Returns frame k of a target at depth 0.3 + 0.1 sin(t). The measurements have errors of at least
/// one pixel. Every third frame has no disparity.
SourceFrame SwingingFrame(int k) {
  const double t_s = 0.1 * k, depth = 0.3 + 0.1 * std::sin(t_s), wobble = std::sin(37.0 * k);
  SourceFrame frame{FrameAt(t_s, {{1, depth / 0.3 + 0.01 * wobble}}),
                    {{depth}, {0.1 * std::cos(t_s)}, {1.0 / 0.3}}};
  if (k % 3 != 0)
    frame.measurements.push_back({frame.timestamp, 0, -1, {26.0 / depth + wobble}, {}});
  return frame;
}

const std::vector<StreamInfo> kTruths = {{"depth"}, {"depth_rate"}, {"inverse_distance"}};

// Compares the bound with the information form, whose derivatives at the truth are written out by
// hand.
TEST(CramerRaoBound, IsTheInverseOfTheInformationAtTruth) {
  const Problem problem = testing::DepthFilter();
  CramerRaoBound bound(problem, testing::StreamsOf(problem), kTruths);
  Eigen::Matrix3d p = Eigen::Vector3d(0.1 * 0.1, 0.5 * 0.5, 0.5 * 0.5).asDiagonal();
  Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
  f(0, 1) = 0.1;
  const Eigen::Vector3d g(0.5 * 0.1 * 0.1, 0.1, 0.0);
  for (int k = 0; k < 30; ++k) {
    const SourceFrame frame = SwingingFrame(k);
    ASSERT_TRUE(bound.Add(frame));
    if (k > 0) p = f * p * f.transpose() + g * g.transpose();
    const double z = frame.truth[0][0], lambda = frame.truth[2][0];
    Eigen::Matrix3d information = p.inverse();
    if (k % 3 != 0) {
      const Eigen::Vector3d h(-26.0 / (z * z), 0.0, 0.0);
      information += h * h.transpose();
    }
    const Eigen::Vector3d h(lambda, 0.0, z);
    const double sigma = 2.0 / 300.0 * std::pow(lambda * z, 3);
    information += h * h.transpose() / (sigma * sigma);
    p = information.inverse();
    const Eigen::Matrix3d difference = bound.state().covariance().Dense() - p;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        EXPECT_LT(std::abs(difference(i, j)), 1e-9 * std::sqrt(p(i, i) * p(j, j))) << k;
      }
    }
  }
}

/// Motion model x' = x + (x - x^3 + w) dt, w ~ N(0, 1).
struct DoubleWell : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double dt_s, T* next) const {
    next[0] = x[0] + (x[0] - x[0] * x[0] * x[0] + w[0]) * dt_s;
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

TEST(CramerRaoBound, TakesTheMotionAtTruth) {
  Problem problem;
  testing::AddMotion(problem, "p", MakeMotion(DoubleWell(), "double_well"), {{"x", 5.0, 0.5}});
  testing::AddSensor(problem, "z", testing::LinearSensor(1.0, 0.4), {"p.x"});
  problem.initial_time_s = -0.1;  // one step before the first frame
  CramerRaoBound bound(problem, testing::StreamsOf(problem), {{"x"}});
  const double dt_s = 0.1, q = dt_s * dt_s;
  double p = 0.25, before = 0.0;
  for (int k = 0; k < 30; ++k) {
    const double x = std::sin(0.5 * k);
    ASSERT_TRUE(bound.Add({FrameAt(dt_s * k, {{0, x + std::sin(37.0 * k)}}), {{x}}}));
    p = std::pow(1.0 + dt_s * (1.0 - 3.0 * before * before), 2) * p + q;
    p = 1.0 / (1.0 / p + 1.0 / (0.4 * 0.4));
    EXPECT_NEAR(bound.state().covariance().Dense()(0, 0), p, 1e-12) << k;
    before = x;
  }
}

TEST(CramerRaoBound, OfALinearProblemIsTheCovarianceOfTheKalmanFilter) {
  Problem problem = testing::MovingPoint();
  testing::AddSensor(problem, "z", testing::LinearSensor(2.0, 0.5), {"p.x"});
  const std::vector<StreamInfo> streams = testing::StreamsOf(problem);
  Ekf ekf(problem, {}, streams);
  CramerRaoBound bound(problem, streams, {{"x"}, {"v"}});
  for (int k = 0; k < 20; ++k) {
    const Frame frame = FrameAt(0.1 * k, {{0, std::sin(9.0 * k)}});
    ekf.Process(frame);
    ASSERT_TRUE(bound.Add({frame, {{std::sin(0.1 * k)}, {std::cos(0.1 * k)}}}));
    EXPECT_LT((bound.state().covariance().Dense() - ekf.state().covariance().Dense()).norm(),
              1e-12);
  }
}

// A robust loss, a Schmidt (consider) gain and a Jacobian at the implied state make a filter worse,
// but they do not change the bound.
TEST(CramerRaoBound, IsThatOfTheBestFilter) {
  Problem worse = testing::DepthFilter();
  worse.sensors[0].loss = {LossKind::kCauchy, 0.1};
  worse.sensors[0].roles[0].jacobian_at = JacobianAt::kMeasurement;
  worse.sensors[1].roles[1].mode = RoleMode::kConsider;
  const Problem problem = testing::DepthFilter();
  const std::vector<StreamInfo> streams = testing::StreamsOf(problem);
  CramerRaoBound bound(problem, streams, kTruths), same(worse, streams, kTruths);
  for (int k = 0; k < 10; ++k) {
    ASSERT_TRUE(bound.Add(SwingingFrame(k)) && same.Add(SwingingFrame(k)));
  }
  EXPECT_EQ(bound.state().covariance().Dense(), same.state().covariance().Dense());
}

TEST(CramerRaoBound, EndsWhereTruthIsNotKnown) {
  const Problem problem = testing::DepthFilter();
  CramerRaoBound bound(problem, testing::StreamsOf(problem), kTruths);
  EXPECT_TRUE(bound.Add(SwingingFrame(0)));
  SourceFrame without = SwingingFrame(1);
  without.truth[1].clear();
  EXPECT_FALSE(bound.Add(without));
  EXPECT_FALSE(bound.Add(SwingingFrame(2)))
      << "the bound must remain undefined in all later frames";
}

TEST(CramerRaoBound, TellsWhyThereIsNone) {
  const Problem problem = testing::DepthFilter();
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(problem, kTruths), "");
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(problem, {{"depth"}, {"depth_rate"}}),
            "'template.inverse_distance' has no truth");
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(problem, {{"depth", 1, 0.1}, {"depth_rate"}}),
            "the truth of 'target.depth' is not exact");
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(
                testing::WithStatus(problem, "target.depth_rate", BlockStatus::kConsider), kTruths),
            "'target.depth_rate' is a consider state");
  const Problem constant =
      testing::WithStatus(problem, "template.inverse_distance", BlockStatus::kConstant);
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(constant, {{"depth"}, {"depth_rate"}}), "");
  Problem slam = problem;
  slam.landmarks.emplace();
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(slam, kTruths), "");
  slam.sensors[1].stream = slam.sensors[0].stream;
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(slam, kTruths),
            "'disparity' and 'inverse_scale' use the same stream");
}

using Point = std::array<double, 3>;

std::optional<Point> PlaceOf(std::int64_t id) {
  if (id > 4) return {};
  const double k = static_cast<double>(id);
  return Point{0.4 * k - 0.8, 0.3 * std::sin(2.0 * k), 1.6 + 0.3 * k};
}

Eigen::Vector3d CameraAt(int k) { return {0.1 * k, 0.03 * std::sin(k), 0.02 * k}; }

Eigen::Vector2d Pixel(const Eigen::Vector3d& r, const Eigen::Vector3d& p) {
  const Eigen::Vector3d h = p - r;
  return {h.x() / h.z(), h.y() / h.z()};
}

/// Returns true if frame k sees landmark `id`. The landmark is first seen in frame `id`. Afterwards
/// it is seen in all frames except every fourth.
bool Sees(int k, int id) { return k >= id && (k == id || (k + id) % 4 != 0); }

SourceFrame MappingFrame(int k, double noise) {
  const Eigen::Vector3d r = CameraAt(k);
  SourceFrame frame{{TimestampFromSeconds(0.1 * k), {}}, {{r.x(), r.y(), r.z()}}};
  for (int id = 0; id < 5; ++id) {
    if (!Sees(k, id)) continue;
    const Eigen::Vector2d z = Pixel(r, Eigen::Vector3d(PlaceOf(id)->data()));
    frame.measurements.push_back({frame.timestamp,
                                  0,
                                  id,
                                  {z.x() + noise * std::sin(37.0 * k + id), z.y() - noise * 0.5},
                                  {}});
  }
  return frame;
}

/// Computes the Fisher information by central differences. The unknowns are the camera positions in
/// frames 0 to `last` and five landmarks.
class JointInformation {
 public:
  explicit JointInformation(int last) : x_(3 * (last + 6)) {
    for (int k = 0; k <= last; ++k) x_.segment<3>(3 * k) = CameraAt(k);
    for (int id = 0; id < 5; ++id) {
      x_.segment<3>(3 * (last + 1 + id)) = Eigen::Vector3d(PlaceOf(id)->data());
    }
    information_ = Eigen::MatrixXd::Zero(x_.size(), x_.size());
  }
  template <class F>
  void Add(const F& residual) {
    Eigen::MatrixXd j(residual(x_).size(), x_.size());
    constexpr double kStep = 1e-5;
    for (Eigen::Index i = 0; i < x_.size(); ++i) {
      Eigen::VectorXd up = x_, down = x_;
      up[i] += kStep;
      down[i] -= kStep;
      j.col(i) = (residual(up) - residual(down)) / (2.0 * kStep);
    }
    information_ += j.transpose() * j;
  }
  /// Returns the covariance of the position in frame `last`. Uses only the landmarks seen up to
  /// that frame.
  Eigen::Matrix3d Covariance(int last) const {
    const Eigen::Index n = 3 * (last + 1 + std::min(last + 1, 5));
    return information_.topLeftCorner(n, n).inverse().block<3, 3>(3 * last, 3 * last);
  }

 private:
  Eigen::VectorXd x_;
  Eigen::MatrixXd information_;
};

Eigen::Matrix3d CovarianceByInformation(int last) {
  JointInformation joint(last);
  using Vector = Eigen::VectorXd;
  const auto at = [](const Vector& x, int i) { return Eigen::Vector3d(x.segment<3>(3 * i)); };
  joint.Add([&](const Vector& x) { return Vector(at(x, 0) / 0.05); });
  for (int k = 0; k < last; ++k) {
    joint.Add([&](const Vector& x) {
      return Vector((at(x, k + 1) - at(x, k)) / (0.1 * std::sqrt(0.1)));
    });
  }
  for (int id = 0; id < 5 && id <= last; ++id) {
    const int p = last + 1 + id;
    joint.Add([&](const Vector& x) {  // the residual of the prior of the inverse distance
      return Vector(Vector::Constant(1, 1.0 / (at(x, p) - at(x, id)).norm() / 0.25));
    });
    for (int k = id; k <= last; ++k) {
      if (!Sees(k, id)) continue;
      joint.Add([&](const Vector& x) { return Vector(Pixel(at(x, k), at(x, p)) / 0.01); });
    }
  }
  return joint.Covariance(last);
}

// Compares the bound of a trajectory and a map with the joint information. The mean of the landmark
// prior and the noise of the data must have no influence on the bound.
template <class Model>
void ExpectJointBound(const Model& model, double max_linearity_index) {
  LandmarkOptions options = testing::WithPrior(0.8, 0.25);
  options.max_linearity_index = max_linearity_index;
  const Problem problem = testing::MapSystem(model, options, 0.05);
  CramerRaoBound bound(problem, testing::StreamsOf(problem), {{"position", 3}}, PlaceOf);
  for (int k = 0; k < 12; ++k) {
    ASSERT_TRUE(bound.Add(MappingFrame(k, 0.02)));
    const Eigen::Matrix3d expected = CovarianceByInformation(k);
    const Eigen::MatrixXd p = bound.state().covariance().Dense().topLeftCorner(3, 3);
    EXPECT_LT((p - expected).norm(), 1e-7 * expected.norm()) << k;
  }
}

TEST(CramerRaoBound, OfAMapIsThatOfPathAndPointsTogether) {
  for (const double max_linearity_index : {0.0, 0.3}) {
    ExpectJointBound(testing::InverseDepthPixels(0.01), max_linearity_index);
    ExpectJointBound(testing::AnchoredPixels<0>(0.01), max_linearity_index);
    ExpectJointBound(testing::AnchoredPixels<ALIDADE_ROLE_SHARED>(0.01), max_linearity_index);
  }
}

/// A camera that rotates at 0.3 rad/s about its y axis. The position of the camera performs a
/// random walk.
struct TurningWalk : Motion<6, Vec<3>, UnitQuaternion> {
  static constexpr std::array kBlocks{testing::kPosition, Quantity{"orientation"}};
  template <class T>
  void Step(const T* r, const T* q, const T* w, double dt_s, T* next_r, T* next_q) const {
    for (int i = 0; i < 3; ++i) next_r[i] = r[i] + w[i];
    const T turn[3] = {w[3], w[4] + T(0.3 * dt_s), w[5]};
    UnitQuaternion::Plus(q, turn, next_q);
  }
  void SqrtQ(double dt_s, MatrixRef l) const {
    for (int i = 0; i < 3; ++i) l(i, i) = 0.1 * std::sqrt(dt_s);
    for (int i = 3; i < 6; ++i) l(i, i) = 0.02 * std::sqrt(dt_s);
  }
};

/// Measures the pixel of a landmark in a TurningWalk camera.
struct TurnedPixels : Sensor<Vec<2>, Vec<3>, UnitQuaternion, Vec<3>, UnitVector, Vec<1>>,
                      testing::Pinhole {
  static constexpr std::array kRoles{
      testing::kPosition, Quantity{"orientation"},
      Quantity{"anchor", "m", "", "x,y,z", testing::kOfLandmark},
      Quantity{"direction", "", "", "x,y,z", testing::kOfLandmark},
      Quantity{"inverse_distance", "1/m", "", "", testing::kOfLandmark}};
  using Pinhole::kMeasurement;
  static constexpr int kInitialises = 2, kPrior = 1;
  template <class T>
  using Vector = Eigen::Matrix<T, 3, 1>;
  template <class T>
  static Eigen::Quaternion<T> Turn(const T* q) {
    return {q[0], q[1], q[2], q[3]};
  }
  template <class T>
  bool Predict(const T* r, const T* q, const T* a, const T* m, const T* rho, T* z) const {
    Vector<T> h;
    for (int i = 0; i < 3; ++i) h[i] = rho[0] * (a[i] - r[i]) + m[i];
    h = Turn(q).conjugate() * h;
    return Project(h.data(), z);
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, const T*, const T*, T* l) const {
    l[0] = l[3] = T(sigma);
  }
  template <class T>
  bool Initialise(const T* r, const T* q, const T* z, const T* rho, T* y) const {
    const Vector<T> m = Turn(q) * Vector<T>(z[0], z[1], T(1.0)).normalized();
    for (int i = 0; i < 3; ++i) {
      y[i] = r[i];
      y[3 + i] = m[i];
    }
    y[6] = rho[0];
    return true;
  }
};

Problem TurningSystem() {
  Problem problem;
  MotionBinding binding{"cam", MakeMotion(TurningWalk(), "turning_walk"), {}};
  for (const Space& space : binding.model->blocks()) {
    const BlockId id = problem.layout.Declare("cam." + space.name, "cam", space);
    binding.blocks.push_back(id);
    Prior prior;
    prior.block = id;
    prior.mean = {0.0, 0.0, 0.0};
    if (space.geometry.ambient == 4) prior.mean = {1.0, 0.0, 0.0, 0.0};
    prior.covariance = 0.01 * Eigen::Matrix3d::Identity();
    problem.priors.push_back(prior);
  }
  SensorBinding sensor{"tracks", "tracks", MakeSensor(TurnedPixels(), "tracks"), {}};
  sensor.roles.resize(sensor.model->roles().size());
  for (std::size_t i = 0; i < 2; ++i) sensor.roles[i].block = binding.blocks[i];
  problem.motions.push_back(std::move(binding));
  problem.sensors.push_back(std::move(sensor));
  problem.landmarks = testing::WithPrior(0.5, 0.25);
  return problem;
}

/// Compares the bound with an ekf. The ekf starts at the truth and has exact data, so its Jacobians
/// are evaluated at the truth. The data of the bound have noise.
void ExpectThatOfExactData(const Problem& problem, const std::vector<StreamInfo>& truths,
                           const CramerRaoBound::TrueLandmark& place,
                           const std::function<SourceFrame(int k, double noise)>& frame) {
  Ekf ekf = testing::EkfOf(problem);
  CramerRaoBound bound(problem, testing::StreamsOf(problem), truths, place);
  for (int k = 0; k < 10; ++k) {
    ekf.Process(frame(k, 0.0));
    ASSERT_TRUE(bound.Add(frame(k, 0.02))) << k;
    const Eigen::MatrixXd p = bound.state().covariance().Dense();
    const Eigen::MatrixXd expected = ekf.state().covariance().Dense();
    ASSERT_EQ(p.rows(), expected.rows());
    EXPECT_LT((p - expected).norm(), 1e-9 * expected.norm()) << k;
  }
}

// The landmarks are at 2 m, which is the prior mean. All of them are seen from the start.
TEST(CramerRaoBound, OfATurningCamera) {
  const auto place = [](std::int64_t id) -> std::optional<Point> {
    const Eigen::Vector3d ray(0.2 * double(id) - 0.3, 0.2 * std::sin(3.0 * double(id)), 1.0);
    const Eigen::Vector3d p = 2.0 * ray.normalized();
    return Point{p.x(), p.y(), p.z()};
  };
  const auto frame = [&](int k, double noise) {
    const Eigen::Quaterniond q(Eigen::AngleAxisd(0.03 * k, Eigen::Vector3d::UnitY()));
    SourceFrame made{{TimestampFromSeconds(0.1 * k), {}},
                     {{0.0, 0.0, 0.0}, {q.w(), q.x(), q.y(), q.z()}}};
    for (int id = 0; id < 4; ++id) {
      const Eigen::Vector3d h = q.conjugate() * Eigen::Vector3d(place(id)->data());
      made.measurements.push_back(
          {made.timestamp,
           0,
           id,
           {h.x() / h.z() + noise * std::sin(37.0 * k + id), h.y() / h.z() - noise},
           {}});
    }
    return made;
  };
  ExpectThatOfExactData(TurningSystem(), {{"position", 3}, {"orientation", 4}}, place, frame);
}

// All three coordinates of a landmark are measured, so no prior is needed. Two landmarks are known
// in advance, one of them exactly.
TEST(CramerRaoBound, OfLandmarksMeasuredWholeOrKnown) {
  LandmarkOptions options;
  options.known = {{0, *PlaceOf(0), 0.02}, {1, *PlaceOf(1), 0.0}};
  const Problem problem = testing::MapSystem(testing::Offset(0.05), options, 0.2);
  const auto frame = [](int k, double noise) {
    SourceFrame made{{TimestampFromSeconds(0.1 * k), {}}, {{0.0, 0.0, 0.0}}};
    for (int id = k < 3 ? 2 : 0; id < 5;
         ++id) {  // Landmarks 0 and 1, which are known, are first seen in frame 3.
      const Point p = *PlaceOf(id);
      made.measurements.push_back({made.timestamp,
                                   0,
                                   id,
                                   {p[0] + noise * std::sin(37.0 * k + id), p[1], p[2] - noise},
                                   {}});
    }
    return made;
  };
  ExpectThatOfExactData(problem, {{"position", 3}}, PlaceOf, frame);
}

/// Measures the offset to a landmark on the ground, which has two coordinates.
struct OnGround : Sensor<Vec<2>, Vec<3>, Vec<2>> {
  static constexpr std::array kRoles{testing::kPosition,
                                     Quantity{"landmark", "m", "", "x,y", testing::kOfLandmark}};
  static constexpr Quantity kMeasurement{"offset", "m", "", "x,y"};
  static constexpr int kInitialises = 1;
  template <class T>
  bool Predict(const T* r, const T* p, T* z) const {
    for (int i = 0; i < 2; ++i) z[i] = p[i] - r[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, T* l) const {
    l[0] = l[3] = T(0.1);
  }
  template <class T>
  bool Initialise(const T* r, const T* z, T* p) const {
    for (int i = 0; i < 2; ++i) p[i] = r[i] + z[i];
    return true;
  }
};

/// Measures the pixel of a point. The point is initialised on its ray, at the distance of the
/// prior.
struct XyzByPrior : testing::XyzPixels {
  static constexpr int kInitialises = 1, kPrior = 1;
  XyzByPrior() : XyzPixels(0.01) {}
  template <class T>
  bool Initialise(const T* r, const T* z, const T* rho, T* p) const {
    for (int i = 0; i < 3; ++i) p[i] = r[i] + (i < 2 ? z[i] : T(1.0)) / rho[0];
    return true;
  }
};

TEST(CramerRaoBound, TellsWhyLandmarksCannotStartAtTruth) {
  const std::vector<StreamInfo> truths{{"position", 3}};
  Problem problem = testing::MapSystem(testing::Offset(0.1), LandmarkOptions());
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(problem, truths), "");
  problem.sensors[0].model = MakeSensor(OnGround(), "ground");
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(problem, truths),
            "'tracks' has a custom landmark representation");
  problem.sensors[0].model = MakeSensor(XyzByPrior(), "xyz");
  EXPECT_EQ(CramerRaoBound::WhyUnavailable(problem, truths),
            "'tracks' initialises xyz landmarks with a prior, whose mean changes the Jacobians");
}

TEST(CramerRaoBound, EndsAtALandmarkWithoutTruth) {
  const Problem problem =
      testing::MapSystem(testing::InverseDepthPixels(0.01), testing::WithPrior(), 0.05);
  CramerRaoBound bound(problem, testing::StreamsOf(problem), {{"position", 3}}, PlaceOf);
  SourceFrame frame = MappingFrame(0, 0.0);
  EXPECT_TRUE(bound.Add(frame));
  frame = MappingFrame(1, 0.0);
  frame.measurements[0].landmark = 5;
  EXPECT_FALSE(bound.Add(frame));
}

}  // namespace
}  // namespace alidade::internal
