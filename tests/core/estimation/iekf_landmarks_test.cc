// SPDX-License-Identifier: Apache-2.0
//
// Tests the iterated EKF with landmarks.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "alidade/estimation/iekf.h"
#include "support/landmark_models.h"

namespace alidade::testing {
namespace {

using Eigen::VectorXd;

template <class Filter, class Options = EkfOptions>
Filter Make(const Problem& problem, const Options& options = {}) {
  return {problem, options, {{"tracks", problem.sensors[0].model->measurement().geometry.ambient}}};
}

TEST(IekfLandmarks, ALinearMapIsThatOfTheEkf) {
  const Problem problem = MapSystem(Offset(0.05), {}, 0.3);
  Ekf ekf = Make<Ekf>(problem);
  Iekf iekf = Make<Iekf, IekfOptions>(problem);
  Random random(3);
  for (int k = 0; k < 20; ++k) {
    std::vector<Observation> observations;
    for (int i = 0; i < 5; ++i) {
      if ((k + 2 * i) % 5 > 2) continue;
      observations.push_back({i, {0.3 * i + 0.1 * random.Normal(), random.Normal(), 2.0}});
    }
    ekf.Process(FrameOf(0.1 * k, observations));
    const UpdateReport& report = iekf.Process(FrameOf(0.1 * k, observations));
    ASSERT_TRUE(report.events.empty()) << report.events[0].text;
    ASSERT_LT((PositionOf(iekf) - PositionOf(ekf)).norm(), 1e-12) << k;
    ASSERT_LT((iekf.state().covariance().Dense() - ekf.state().covariance().Dense()).norm(), 1e-12);
  }
  EXPECT_EQ(iekf.landmarks().size(), 5u);
}

/// Computes the cost of an update with one landmark in closed form:
/// c(dx) = dx' P^-1 dx + |z - h(x (+) dx)|^2 / sigma^2.
struct Cost {
  const State& prior;
  SharedSensor sensor;
  std::vector<double> z;
  double sigma;

  double operator()(const VectorXd& dx) const {
    std::vector<double> x, h(2);
    prior.Retract(dx.data(), x);
    std::vector<const double*> roles;
    for (const Block& block : prior.layout().blocks()) roles.push_back(&x[block.value_offset]);
    EXPECT_EQ(sensor->Predict(roles.data(), h.data()), Status::kOk);
    return dx.dot(prior.covariance().Dense().llt().solve(dx)) +
           (std::pow(z[0] - h[0], 2) + std::pow(z[1] - h[1], 2)) / (sigma * sigma);
  }
  VectorXd Gradient(const VectorXd& dx) const {
    constexpr double kStep = 1e-5;
    VectorXd gradient(dx.size());
    for (Eigen::Index i = 0; i < dx.size(); ++i) {
      const VectorXd d = kStep * VectorXd::Unit(dx.size(), i);
      gradient[i] = ((*this)(dx + d) - (*this)(dx - d)) / (2.0 * kStep);
    }
    return gradient;
  }
  /// Returns x (-) prior.
  VectorXd From(const State& x) const {
    VectorXd dx(prior.covariance().size());
    for (const Block& block : prior.layout().blocks()) {
      block.geometry().Minus(&x.values()[block.value_offset], &prior.values()[block.value_offset],
                             dx.data() + block.tangent_offset);
    }
    return dx;
  }
};

// The landmark contains a direction on the sphere. The H of an iterate is transported to the
// tangent space at the prediction.
TEST(IekfLandmarks, AnUpdateEndsWhereItsCostIsLeast) {
  constexpr double kSigma = 0.05;
  const AnchoredPixels<0> pixels(kSigma);
  const Problem problem = MapSystem(pixels, WithPrior(), 0.3);
  const std::vector<double> later = {0.9, -0.7};
  Ekf prediction = Make<Ekf>(problem), ekf = Make<Ekf>(problem);
  IekfOptions options;
  options.max_iterations = 500;
  Iekf iekf = Make<Iekf>(problem, options);
  const Frame frame = FrameOf(1.0, {{0, later}});
  for (Filter* const filter : std::initializer_list<Filter*>{&prediction, &ekf, &iekf}) {
    filter->Process(FrameOf(0.0, {{0, {0.3, 0.1}}}));
    filter->Process(filter == &prediction ? FrameOf(1.0, {}) : frame);
  }
  const Cost cost{prediction.state(), MakeSensor(pixels, "tracks"), later, kSigma};
  ASSERT_EQ(prediction.state().layout().blocks().size(), 4u);
  const double before = cost.Gradient(VectorXd::Zero(cost.From(iekf.state()).size())).norm();
  EXPECT_LT(cost.Gradient(cost.From(iekf.state())).norm(), 1e-4 * before);
  // The single step of the EKF does not reach the minimum.
  EXPECT_GT(cost.Gradient(cost.From(ekf.state())).norm(), 1e-2 * before);
}

}  // namespace
}  // namespace alidade::testing
