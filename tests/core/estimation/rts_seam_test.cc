// SPDX-License-Identifier: Apache-2.0
//
// Tests the smoother on the sphere. The direction crosses the discontinuity of the tangent basis.
// The result is compared with a batch solution.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "alidade/base/random.h"
#include "alidade/estimation/rts.h"
#include "support/systems.h"

namespace alidade {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the fixtures of this project

/// Motion model of a direction that performs a random walk: n' = n (+) w.
struct Wander : Motion<2, UnitVector> {
  static constexpr std::array kBlocks{Quantity{"n", "", "", "x,y,z"}};
  double sigma;
  explicit Wander(double s) : sigma(s) {}
  template <class T>
  void Step(const T* n, const T* w, double, T* next) const {
    UnitVector::Plus(n, w, next);
  }
  void SqrtQ(double, MatrixRef l) const { l(0, 0) = l(1, 1) = sigma; }
};

/// Measures a direction.
struct Direction : Sensor<UnitVector, UnitVector> {
  static constexpr std::array kRoles{Quantity{"n", "", "", "x,y,z"}};
  static constexpr Quantity kMeasurement{"z", "", "", "x,y,z"};
  double sigma;
  explicit Direction(double s) : sigma(s) {}
  template <class T>
  bool Predict(const T* n, T* z) const {
    for (int i = 0; i < 3; ++i) z[i] = n[i];
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, T* l) const {
    l[0] = l[3] = T(sigma);
  }
};

/// Returns the rotation from a to b as a vector in space. No basis is used, so there is no
/// discontinuity.
Eigen::Vector3d Turn(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d across = b - a.dot(b) * a;
  const double sine = across.norm();
  return sine > 0.0 ? Eigen::Vector3d(across * (std::atan2(sine, a.dot(b)) / sine)) : across;
}

/// Returns the basis of the tangent plane at n as a 3 x 2 matrix.
Eigen::Matrix<double, 3, 2> BasisAt(const double* n) {
  double basis[6];
  UnitVector::Basis(n, basis);
  return Eigen::Map<Eigen::Matrix<double, 3, 2, Eigen::RowMajor>>(basis);
}

/// Batch solution that applies Gauss-Newton with numeric derivatives to all directions together.
struct DirectionBatch {
  Prior prior;
  double sigma;                         ///< standard deviation of a step and of a measurement
  std::vector<Eigen::Vector3d> n = {};  ///< solution of the last iteration
  /// One measurement per frame; empty if the frame has none.
  std::vector<std::vector<double>> z = {};
  /// Joint covariance of all directions, in the tangent planes at n.
  Eigen::MatrixXd covariance = {};

  std::vector<Eigen::Vector3d> Moved(const Eigen::VectorXd& d) const {
    std::vector<Eigen::Vector3d> to(n.size());
    for (std::size_t k = 0; k < n.size(); ++k) {
      UnitVector::Plus(n[k].data(), d.data() + 2 * k, to[k].data());
    }
    return to;
  }
  Eigen::VectorXd Residuals(const Eigen::VectorXd& d) const {
    const auto at = Moved(d);
    Eigen::VectorXd r = Eigen::VectorXd::Zero(6 * static_cast<Eigen::Index>(n.size()));
    double start[2];
    UnitVector::Minus(at[0].data(), prior.mean.data(), start);
    r.head<2>() = prior.covariance.llt().matrixL().solve(Eigen::Vector2d(start));
    for (std::size_t k = 0; k < n.size(); ++k) {
      const auto row = 6 * static_cast<Eigen::Index>(k);
      if (k > 0) r.segment<3>(row) = Turn(at[k - 1], at[k]) / sigma;
      if (!z[k].empty()) {
        r.segment<3>(row + 3) = Turn(at[k], Eigen::Vector3d(z[k].data())) / sigma;
      }
    }
    return r;
  }
  void Iterate() {
    const double step = 1e-3 * sigma;
    const Eigen::Index size = 2 * static_cast<Eigen::Index>(n.size());
    Eigen::VectorXd d = Eigen::VectorXd::Zero(size);
    Eigen::MatrixXd j(3 * size, size);
    for (Eigen::Index i = 0; i < size; ++i) {
      d[i] = step;
      j.col(i) = Residuals(d);
      d[i] = -step;
      j.col(i) = (j.col(i) - Residuals(d)) / (2.0 * step);
      d[i] = 0.0;
    }
    covariance = (j.transpose() * j).inverse();
    n = Moved(-covariance * j.transpose() * Residuals(d));
  }
};

/// Largest differences between the smoother and the batch. The difference of estimates is divided
/// by the standard deviation, and the difference of P by P.
struct SeamDistance {
  double estimate = 0.0, covariance = 0.0;
};

/// Filters and smooths a direction that crosses z = 0 several times. At z = 0 the basis of the
/// tangent plane is discontinuous. All angles are proportional to `sigma`.
SeamDistance Follow(double sigma) {
  Problem problem;
  MotionBinding binding{"d", MakeMotion(Wander(sigma), "wander"), {}};
  binding.blocks.push_back(problem.layout.Declare("d.n", "d", binding.model->blocks()[0]));
  Prior prior;
  prior.block = 0;
  const double y0 = 10.0 * sigma, z0 = 0.5 * sigma;
  prior.mean = {std::sqrt(1.0 - y0 * y0 - z0 * z0), y0, z0};
  prior.covariance = sigma * sigma * Eigen::Matrix2d{{2.5, 0.5}, {0.5, 1.0}};
  problem.priors.push_back(prior);
  problem.motions.push_back(binding);
  AddSensor(problem, "seen", MakeSensor(Direction(sigma), "direction"), {"d.n"});
  RtsSmoother rts(problem, {}, StreamsOf(problem));
  DirectionBatch batch{prior, sigma};
  Random random(3);
  int crossings = 0;
  for (int k = 0; k < 40; ++k) {
    Frame frame = FrameAt(0.1 * k, {});
    batch.z.emplace_back();
    if (k % 4 != 1) {
      const double y = sigma * (10.0 + random.Normal());
      const double z = sigma * (2.5 * std::sin(0.8 * k) + random.Normal());
      batch.z.back() = {std::sqrt(1.0 - y * y - z * z), y, z};
      frame.measurements.push_back({frame.timestamp, 0, -1, batch.z.back(), {}});
    }
    const double before = rts.state().value(0)[2];
    rts.Process(frame);
    crossings += before * rts.state().value(0)[2] < 0.0 ? 1 : 0;
  }
  EXPECT_GE(crossings, 3);
  batch.n.assign(batch.z.size(), Eigen::Vector3d(prior.mean.data()));
  for (int i = 0; i < 6; ++i) batch.Iterate();
  SeamDistance most;
  rts.Smooth([&](std::size_t k, const State& state, const UpdateReport&) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    const Eigen::Matrix<double, 3, 2> b = BasisAt(batch.n[k].data()), c = BasisAt(state.value(0));
    const Eigen::Matrix3d p = b * batch.covariance.block<2, 2>(at, at) * b.transpose();
    const Eigen::Matrix3d ours = c * state.covariance().Dense() * c.transpose();
    const double turn = Turn(batch.n[k], Eigen::Vector3d(state.value(0))).norm();
    most.estimate = std::max(most.estimate, turn / std::sqrt(p.trace()));
    most.covariance = std::max(most.covariance, (ours - p).norm() / p.norm());
  });
  return most;
}

// The smoother is linearised at the filter's estimates, and the batch at its own solution. Because
// of the curvature of the sphere, the two results differ by a term of second order in the angles,
// in units of sigma. If the angles are divided by 4, this term is divided by 16, but an error of
// first order would be divided only by 4. The factor 8 is halfway on a logarithmic scale. An error
// at the discontinuity would not become smaller.
TEST(RtsSmoother, FollowsADirectionAcrossTheSeamOfItsBasisAsTheBatchDoes) {
  const SeamDistance wide = Follow(2e-3), narrow = Follow(0.5e-3);
  EXPECT_GT(wide.estimate, 8.0 * narrow.estimate) << wide.estimate << ' ' << narrow.estimate;
  EXPECT_GT(wide.covariance, 8.0 * narrow.covariance)
      << wide.covariance << ' ' << narrow.covariance;
}

}  // namespace
}  // namespace alidade
