// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "batch_fixture.h"
#include "support/landmark_models.h"

/// Helpers for the tests of the batch with landmarks.
namespace alidade::testing {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Results of a batch: the state of each frame, the map and the events.
struct Found {
  std::vector<State> states;
  std::vector<LandmarkEstimate> map;
  std::vector<Event> events;
  bool failed = false;

  Vector3d Camera(std::size_t k) const {
    const State& state = states[k];
    return Eigen::Map<const Vector3d>(state.value(state.layout().Find("cam.position")));
  }
  const LandmarkEstimate& Landmark(std::int64_t id) const {
    return *std::ranges::find(map, id, &LandmarkEstimate::id);
  }
  /// Returns the number after `cost` in the event of the solve.
  double Cost() const { return std::stod(events.back().text.substr(5)); }
};

inline Found Solve(Estimator& batch, const std::vector<Frame>& frames) {
  Found found;
  for (const Frame& frame : frames) batch.Process(frame);
  batch.Smooth([&](std::size_t, const State& state, const UpdateReport& report) {
    found.states.push_back(state);
    found.events.insert(found.events.end(), report.events.begin(), report.events.end());
  });
  found.map = batch.landmarks();
  found.failed = batch.failed();
  return found;
}
inline Found Solve(const Problem& problem, const std::vector<Frame>& frames,
                   const std::string& options = "") {
  return Solve(*MakeBatch(problem, options), frames);
}

inline constexpr double kPixel = 0.004, kRho = 0.5, kRhoSigma = 0.15, kWalk = 0.1, kDt = 0.1;

/// Problem of MapSystem() with measurements: a camera moves in front of points. The vector x
/// contains the positions of the camera, r_1.., and the points p_0.., with 3 numbers each.
struct MapProblem {
  int steps, points;
  std::vector<Frame> frames;
  VectorXd truth;
  RobustLoss loss;

  MapProblem(int of_steps, int of_points, int outlier_every = 0)
      : steps(of_steps), points(of_points) {
    Random random(11);
    truth.setZero(3 * (steps - 1 + points));
    for (int k = 1; k < steps; ++k) {
      for (int e = 0; e < 3; ++e) {
        truth[3 * (k - 1) + e] = Camera(truth, k - 1)[e] +
                                 kWalk * std::sqrt(kDt) * random.Normal() + (e == 0 ? 0.02 : 0);
      }
    }
    for (int i = 0; i < points; ++i) {
      truth.segment<3>(3 * (steps - 1 + i)) =
          Vector3d(0.5 * random.Normal(), 0.5 * random.Normal(), 1.7 + 0.2 * (i % 5));
    }
    int count = 0;
    for (int k = 0; k < steps; ++k) {
      std::vector<Observation> observations;
      for (int i = 0; i < points; ++i) {
        if (k < i / 3 || (k + i) % 7 == 0) continue;
        Vector2d z = Pixel(truth, k, i) + kPixel * Vector2d(random.Normal(), random.Normal());
        if (outlier_every > 0 && ++count % outlier_every == 0) z[0] += 0.1;
        observations.push_back({i, {z[0], z[1]}});
      }
      frames.push_back(FrameOf(kDt * k, observations));
    }
  }
  Vector3d Camera(const VectorXd& x, int k) const {
    return k == 0 ? Vector3d::Zero() : Vector3d(x.segment<3>(3 * (k - 1)));
  }
  Vector3d Point(const VectorXd& x, std::int64_t i) const {
    return x.segment<3>(3 * (steps - 1 + i));
  }
  Vector2d Pixel(const VectorXd& x, int k, std::int64_t i) const {
    return (Point(x, i) - Camera(x, k)).hnormalized();
  }
  /// Returns all residuals, divided by their sigmas. `ends` receives the index after each
  /// observation that does not initialise a point.
  VectorXd Residuals(const VectorXd& x, std::vector<Eigen::Index>* ends = nullptr) const {
    std::vector<double> r;
    for (int k = 1; k < steps; ++k) {
      const Vector3d w = (Camera(x, k) - Camera(x, k - 1)) / (kWalk * std::sqrt(kDt));
      r.insert(r.end(), {w[0], w[1], w[2]});
    }
    std::vector<bool> seen(static_cast<std::size_t>(points), false);
    for (int k = 0; k < steps; ++k) {
      for (const Measurement& m : frames[static_cast<std::size_t>(k)].measurements) {
        const Vector2d d = Vector2d(m.values[0], m.values[1]) - Pixel(x, k, m.landmark);
        r.insert(r.end(), {d[0] / kPixel, d[1] / kPixel});
        const auto i = static_cast<std::size_t>(m.landmark);
        if (seen[i]) {
          if (ends != nullptr) ends->push_back(std::ssize(r));
        } else {  // the first observation and the prior initialise the point
          seen[i] = true;
          r.push_back((1.0 / (Point(x, m.landmark) - Camera(x, k)).norm() - kRho) / kRhoSigma);
        }
      }
    }
    return Eigen::Map<VectorXd>(r.data(), std::ssize(r));
  }
  double Cost(const VectorXd& x) const {
    std::vector<Eigen::Index> ends;
    const VectorXd r = Residuals(x, &ends);
    double cost = 0.5 * r.squaredNorm();
    for (const Eigen::Index end : ends) {
      const double d = r.segment<2>(end - 2).norm();
      cost += Rho(loss, d) - 0.5 * d * d;
    }
    return cost;
  }
  /// Computes J' J and J' r by central differences. Each observation is weighted with its loss at
  /// x.
  void NormalEquations(const VectorXd& x, MatrixXd& a, VectorXd& b) const {
    std::vector<Eigen::Index> ends;
    const VectorXd r = Residuals(x, &ends);
    MatrixXd j(r.size(), x.size());
    constexpr double kStep = 1e-5;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const VectorXd d = kStep * VectorXd::Unit(x.size(), i);
      j.col(i) = (Residuals(x + d) - Residuals(x - d)) / (2.0 * kStep);
    }
    VectorXd w = VectorXd::Ones(r.size());
    for (const Eigen::Index end : ends) {
      w.segment<2>(end - 2).setConstant(Weight(loss, r.segment<2>(end - 2).norm()));
    }
    a = j.transpose() * w.asDiagonal() * j;
    b = j.transpose() * w.asDiagonal() * r;
  }
  Problem Filter() const {
    Problem problem = MapSystem(InverseDepthPixels(kPixel), WithPrior(kRho, kRhoSigma));
    problem.sensors[0].loss = loss;
    return problem;
  }
  VectorXd Solution(const Found& found) const {
    VectorXd x(truth.size());
    for (int k = 1; k < steps; ++k) {
      x.segment<3>(3 * (k - 1)) = found.Camera(static_cast<std::size_t>(k));
    }
    for (int i = 0; i < points; ++i) {
      x.segment<3>(3 * (steps - 1 + i)) = found.Landmark(i).position;
    }
    return x;
  }
  /// Expects that `found` is the minimum of the cost of this problem and has the covariance at this
  /// minimum.
  void ExpectSolved(const Found& found) const {
    ASSERT_FALSE(found.failed);
    ASSERT_EQ(found.states.size(), frames.size());
    ASSERT_EQ(found.map.size(), static_cast<std::size_t>(points));
    const VectorXd x = Solution(found);
    EXPECT_NEAR(found.Cost(), Cost(x), 1e-7 * Cost(x));  // nine digits are printed
    EXPECT_LT(Cost(x), Cost(truth));
    MatrixXd a;
    VectorXd b;
    NormalEquations(x, a, b);
    // Compares the remaining step with sigma. Errors of J are third derivatives times 1e-10, about
    // 1e-8.
    const MatrixXd p = a.inverse();
    EXPECT_LT(std::sqrt(b.dot(p * b)), 1e-5);
    const auto expect_equal = [&](const MatrixXd& its, Eigen::Index at) {
      const MatrixXd expected = p.block<3, 3>(at, at);
      EXPECT_LT((its - expected).norm(), 1e-6 * expected.norm()) << at;
    };
    for (int k = 1; k < steps; ++k) {
      expect_equal(found.states[static_cast<std::size_t>(k)].covariance().Dense(), 3 * (k - 1));
    }
    for (int i = 0; i < points; ++i) {
      expect_equal(found.Landmark(i).covariance, 3 * (steps - 1 + i));
    }
  }
};

}  // namespace alidade::testing
