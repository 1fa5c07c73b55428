// SPDX-License-Identifier: Apache-2.0
#include "alidade/run/cramer_rao.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "alidade/filter/ekf.h"
#include "alidade/host/in_process.h"
#include "alidade/model/model.h"
#include "support/landmark_models.h"
#include "support/systems.h"

namespace alidade::internal {
namespace {

using testing::FrameAt;

/// Depth 0.3 + 0.1 sin(t), measured with errors of a pixel and more; each third frame is blind.
SourceFrame SwingingFrame(int k) {
  const double t_s = 0.1 * k, depth = 0.3 + 0.1 * std::sin(t_s), wobble = std::sin(37.0 * k);
  SourceFrame frame{FrameAt(t_s, {{1, depth / 0.3 + 0.01 * wobble}}),
                    {{depth}, {0.1 * std::cos(t_s)}, {1.0 / 0.3}}};
  if (k % 3 != 0)
    frame.measurements.push_back({frame.timestamp, 0, -1, {26.0 / depth + wobble}, {}});
  return frame;
}

const std::vector<StreamInfo> kTruths = {{"depth"}, {"depth_rate"}, {"inverse_distance"}};

// The same by the information form, with the derivatives written out at truth.
TEST(CramerRaoBound, IsTheInverseOfTheInformationAtTruth) {
  const System system = testing::DepthFilter();
  CramerRaoBound bound(system, testing::StreamsOf(system), kTruths);
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

/// x' = x + (x - x^3 + w) dt, w ~ N(0, 1).
struct DoubleWell : Motion<1, Vec<1>> {
  static constexpr std::array kBlocks{Quantity{"x"}};
  template <class T>
  void Step(const T* x, const T* w, double dt_s, T* next) const {
    next[0] = x[0] + (x[0] - x[0] * x[0] * x[0] + w[0]) * dt_s;
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = 1.0; }
};

TEST(CramerRaoBound, TakesTheMotionAtTruth) {
  System system;
  testing::AddMotion(system, "p", InProcessMotion(DoubleWell(), "double_well"), {{"x", 5.0, 0.5}});
  testing::AddSensor(system, "z", testing::LinearSensor(1.0, 0.4), {"p.x"});
  CramerRaoBound bound(system, testing::StreamsOf(system), {{"x"}});
  const double dt_s = 0.1, q = dt_s * dt_s;
  double p = 0.25, before = 0.0;
  for (int k = 0; k < 30; ++k) {
    const double x = std::sin(0.5 * k);
    ASSERT_TRUE(bound.Add({FrameAt(dt_s * k, {{0, x + std::sin(37.0 * k)}}), {{x}}}));
    if (k > 0) p = std::pow(1.0 + dt_s * (1.0 - 3.0 * before * before), 2) * p + q;
    p = 1.0 / (1.0 / p + 1.0 / (0.4 * 0.4));
    EXPECT_NEAR(bound.state().covariance().Dense()(0, 0), p, 1e-12) << k;
    before = x;
  }
}

TEST(CramerRaoBound, OfALinearProblemIsTheCovarianceOfTheKalmanFilter) {
  System system = testing::MovingPoint();
  testing::AddSensor(system, "z", testing::LinearSensor(2.0, 0.5), {"p.x"});
  const std::vector<StreamInfo> streams = testing::StreamsOf(system);
  Ekf ekf(system, {}, streams);
  CramerRaoBound bound(system, streams, {{"x"}, {"v"}});
  for (int k = 0; k < 20; ++k) {
    const Frame frame = FrameAt(0.1 * k, {{0, std::sin(9.0 * k)}});
    ekf.Process(frame);
    ASSERT_TRUE(bound.Add({frame, {{std::sin(0.1 * k)}, {std::cos(0.1 * k)}}}));
    EXPECT_LT((bound.state().covariance().Dense() - ekf.state().covariance().Dense()).norm(),
              1e-12);
  }
}

// A loss, a Schmidt gain and a Jacobian at what the measurement implies all make a filter worse.
TEST(CramerRaoBound, IsThatOfTheBestFilter) {
  System worse = testing::DepthFilter();
  worse.sensors[0].loss = {LossKind::kCauchy, 0.1};
  worse.sensors[0].roles[0].jacobian_at = JacobianAt::kMeasurement;
  worse.sensors[1].roles[1].mode = RoleMode::kConsider;
  const System system = testing::DepthFilter();
  const std::vector<StreamInfo> streams = testing::StreamsOf(system);
  CramerRaoBound bound(system, streams, kTruths), same(worse, streams, kTruths);
  for (int k = 0; k < 10; ++k) {
    ASSERT_TRUE(bound.Add(SwingingFrame(k)) && same.Add(SwingingFrame(k)));
  }
  EXPECT_EQ(bound.state().covariance().Dense(), same.state().covariance().Dense());
}

TEST(CramerRaoBound, EndsWhereTruthIsNotKnown) {
  const System system = testing::DepthFilter();
  CramerRaoBound bound(system, testing::StreamsOf(system), kTruths);
  EXPECT_TRUE(bound.Add(SwingingFrame(0)));
  SourceFrame without = SwingingFrame(1);
  without.truth[1].clear();
  EXPECT_FALSE(bound.Add(without));
  EXPECT_FALSE(bound.Add(SwingingFrame(2))) << "for good";
}

TEST(CramerRaoBound, TellsWhyThereIsNone) {
  const System system = testing::DepthFilter();
  EXPECT_EQ(CramerRaoBound::WhyNone(system, kTruths), "");
  EXPECT_EQ(CramerRaoBound::WhyNone(system, {{"depth"}, {"depth_rate"}}),
            "'template.inverse_distance' has no truth");
  EXPECT_EQ(CramerRaoBound::WhyNone(system, {{"depth", 1, 0.1}, {"depth_rate"}}),
            "the truth of 'target.depth' is not exact");
  EXPECT_EQ(CramerRaoBound::WhyNone(
                testing::WithStatus(system, "target.depth_rate", BlockStatus::kConsider), kTruths),
            "'target.depth_rate' is a consider state");
  const System constant =
      testing::WithStatus(system, "template.inverse_distance", BlockStatus::kConstant);
  EXPECT_EQ(CramerRaoBound::WhyNone(constant, {{"depth"}, {"depth_rate"}}), "");
  System slam = system;
  slam.landmarks.emplace();
  EXPECT_EQ(CramerRaoBound::WhyNone(slam, kTruths), "");
  slam.sensors[1].stream = slam.sensors[0].stream;
  EXPECT_EQ(CramerRaoBound::WhyNone(slam, kTruths),
            "'disparity' and 'inverse_scale' share a stream");
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

/// Landmark id is first seen in frame id, and then in all but each fourth.
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

/// The information of a camera's path, frames 0 to `last`, and five points, by central differences.
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
  /// Of those seen by then, the last position.
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
    joint.Add([&](const Vector& x) {  // the prior of the inverse distance
      return Vector(Vector::Constant(1, 1.0 / (at(x, p) - at(x, id)).norm() / 0.25));
    });
    for (int k = id; k <= last; ++k) {
      if (!Sees(k, id)) continue;
      joint.Add([&](const Vector& x) { return Vector(Pixel(at(x, k), at(x, p)) / 0.01); });
    }
  }
  return joint.Covariance(last);
}

// Of a path and a map: the prior's mean and the noise of the data count for nothing.
template <class Model>
void ExpectJointBound(const Model& model, double max_linearity_index) {
  LandmarkOptions options = testing::WithPrior(0.8, 0.25);
  options.max_linearity_index = max_linearity_index;
  const System system = testing::MapSystem(model, options, 0.05);
  CramerRaoBound bound(system, testing::StreamsOf(system), {{"position", 3}}, PlaceOf);
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

TEST(CramerRaoBound, EndsAtALandmarkWithoutTruth) {
  const System system =
      testing::MapSystem(testing::InverseDepthPixels(0.01), testing::WithPrior(), 0.05);
  CramerRaoBound bound(system, testing::StreamsOf(system), {{"position", 3}}, PlaceOf);
  SourceFrame frame = MappingFrame(0, 0.0);
  EXPECT_TRUE(bound.Add(frame));
  frame = MappingFrame(1, 0.0);
  frame.measurements[0].landmark = 5;
  EXPECT_FALSE(bound.Add(frame));
}

}  // namespace
}  // namespace alidade::internal
