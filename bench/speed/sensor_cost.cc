// SPDX-License-Identifier: Apache-2.0
//
// Measures the time of an iteration of Ceres on a bundle adjustment. The costs are created from a
// sensor model. The reference is the same problem with hand-written cost functions. The problem has
// 50 cameras, 2000 points and 20 000 pixels.
#include "plugins/ceres/bundle/sensor_cost.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/product_manifold.h>
#include <ceres/rotation.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numbers>
#include <vector>

#include "alidade/estimation/direct_models.h"
#include "alidade/sweep/sweep.h"
#include "bench/speed/interleaved.h"
#include "plugins/ceres/bundle/geometry_manifold.h"

namespace alidade::bench {
namespace {

using ceres_batch::CostKind;
using ceres_batch::GeometryManifold;
using ceres_batch::SensorCost;

constexpr double kFocal = 500.0;  // px
constexpr int kPose = 7;          // numbers in position and world_from_cam

/// Model z = f (hx, hy) / hz,  h = R_CW (p - r), without analytic Jacobians.
struct Pinhole : Sensor<Vec<2>, Vec<3>, UnitQuaternion, Vec<3>> {
  static constexpr std::array kRoles{Quantity{"position"}, Quantity{"orientation"},
                                     Quantity{"point"}};
  static constexpr Quantity kMeasurement{"pixel", "px", "", "u,v"};
  template <class T>
  bool Predict(const T* position, const T* orientation, const T* point, T* z) const {
    const T offset[3] = {point[0] - position[0], point[1] - position[1], point[2] - position[2]};
    T h[3];
    UnitQuaternion::RotateBack(orientation, offset, h);
    if (!(h[2] > T(0.0))) return false;
    const T inverse = 1.0 / h[2];  // the Jacobian uses the same quotient
    z[0] = kFocal * (h[0] * inverse);
    z[1] = kFocal * (h[1] * inverse);
    return true;
  }
  template <class T>
  void SqrtNoise(const T*, const T*, const T*, T* l) const {
    l[0] = l[3] = T(1.0);
  }
};

/// Computes a row of the Jacobian with respect to all roles. The model and the hand-written cost
/// share this function.
inline void Row(const double* orientation, const double* h, double ax, double ay, double x,
                double y, double* J_r, double* J_q, double* J_p) {
  const double a[3] = {ax, ay, -(ax * x + ay * y)};
  UnitQuaternion::Rotate(orientation, a, J_p);
  for (int i = 0; i < 3; ++i) J_r[i] = -J_p[i];
  J_q[0] = a[1] * h[2] - a[2] * h[1];
  J_q[1] = a[2] * h[0] - a[0] * h[2];
  J_q[2] = a[0] * h[1] - a[1] * h[0];
}

/// The same model with analytic Jacobians.
struct PinholeAnalytic : Pinhole {
  void Jacobian(const double* position, const double* orientation, const double* point,
                MatrixRef J_r, MatrixRef J_q, MatrixRef J_p) const {
    const double offset[3] = {point[0] - position[0], point[1] - position[1],
                              point[2] - position[2]};
    double h[3];
    UnitQuaternion::RotateBack(orientation, offset, h);
    const double inverse = 1.0 / h[2], a = kFocal * inverse, x = h[0] * inverse, y = h[1] * inverse;
    Row(orientation, h, a, 0.0, x, y, &J_r(0, 0), &J_q(0, 0), &J_p(0, 0));
    Row(orientation, h, 0.0, a, x, y, &J_r(1, 0), &J_q(1, 0), &J_p(1, 0));
  }
};

/// Cost r = z - h, written by hand for GeometryManifold: the Jacobian is [J | 0].
class HandWrittenCost final : public ceres::SizedCostFunction<2, kPose, 3> {
 public:
  explicit HandWrittenCost(const double* z) : u_(z[0]), v_(z[1]) {}
  bool Evaluate(const double* const* blocks, double* r, double** j) const override {
    const double* const pose = blocks[0];
    const double* const q = pose + 3;
    const double offset[3] = {blocks[1][0] - pose[0], blocks[1][1] - pose[1],
                              blocks[1][2] - pose[2]};
    double h[3];
    UnitQuaternion::RotateBack(q, offset, h);
    if (!(h[2] > 0.0)) return false;
    const double inverse = 1.0 / h[2], x = h[0] * inverse, y = h[1] * inverse;
    r[0] = u_ - kFocal * x;
    r[1] = v_ - kFocal * y;
    if (j == nullptr) return true;
    const double a = -kFocal * inverse;
    double pose_rows[14], point_rows[6];
    Row(q, h, a, 0.0, x, y, pose_rows, pose_rows + 3, point_rows);
    Row(q, h, 0.0, a, x, y, pose_rows + 7, pose_rows + 10, point_rows + 3);
    pose_rows[6] = pose_rows[13] = 0.0;
    if (j[0] != nullptr) std::copy_n(pose_rows, 14, j[0]);
    if (j[1] != nullptr) std::copy_n(point_rows, 6, j[1]);
    return true;
  }

 private:
  double u_, v_;
};

/// Cost r = z - h for the automatic differentiation of Ceres, as users of Ceres write it.
struct Functor {
  double u, v;
  template <class T>
  bool operator()(const T* pose, const T* point, T* r) const {
    const T offset[3] = {point[0] - pose[0], point[1] - pose[1], point[2] - pose[2]};
    const T cam_from_world[4] = {pose[3], -pose[4], -pose[5], -pose[6]};
    T h[3];
    ceres::UnitQuaternionRotatePoint(cam_from_world, offset, h);
    if (!(h[2] > T(0.0))) return false;
    const T inverse = kFocal / h[2];
    r[0] = u - inverse * h[0];
    r[1] = v - inverse * h[1];
    return true;
  }
};

/// Cameras on a circle that look at points in a box. The initial points deviate from the truth by
/// up to 1 % of half the side of the box. The pixels have errors of up to 0.5 px.
struct Scene {
  static constexpr int kCameras = 50, kPoints = 2000, kViewsPerPoint = 10;
  struct Pixel {
    int camera, point;
    double z[2];
  };
  std::vector<double> poses, points;
  std::vector<Pixel> pixels;

  Scene() {
    auto wave = [n = 0]() mutable {
      ++n;
      return std::sin(1.7 * n) * std::cos(0.31 * n * std::sqrt(n));
    };
    for (int i = 0; i < kPoints; ++i)
      for (int k = 0; k < 3; ++k) points.push_back(2.0 * wave());
    for (int i = 0; i < kCameras; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kCameras, turn[3] = {0.0, angle, 0.0};
      double q[4];
      UnitQuaternion::Exp(turn, q);
      poses.insert(poses.end(), {-8.0 * std::sin(angle), 0.3 * wave(), -8.0 * std::cos(angle)});
      poses.insert(poses.end(), q, q + 4);
    }
    const Pinhole model;
    for (int i = 0; i < kPoints; ++i) {
      for (int k = 0; k < kViewsPerPoint; ++k) {
        Pixel pixel{(7 * i + 5 * k) % kCameras, i, {}};
        const double* const pose = &poses[static_cast<std::size_t>(kPose * pixel.camera)];
        if (!model.Predict(pose, pose + 3, &points[static_cast<std::size_t>(3 * i)], pixel.z))
          continue;
        for (double& z : pixel.z) z += 0.5 * wave();
        pixels.push_back(pixel);
      }
    }
    for (double& x : points) x += 0.02 * wave();
  }
};

/// Bundle adjustment with the costs of one contender, and with a separate copy of all values.
class Adjustment {
 public:
  using MakeCost = std::function<ceres::CostFunction*(const double* z)>;
  using MakeManifold = std::function<ceres::Manifold*()>;

  Adjustment(const Scene& scene, ceres::LinearSolverType solver, const MakeCost& make,
             const MakeManifold& manifold)
      : scene_(scene), solver_(solver), poses_(scene.poses), points_(scene.points) {
    for (const Scene::Pixel& pixel : scene.pixels) {
      double* const pose = &poses_[static_cast<std::size_t>(kPose * pixel.camera)];
      double* const point = &points_[static_cast<std::size_t>(3 * pixel.point)];
      costs_.push_back({make(pixel.z), {pose, point}});
      problem_.AddResidualBlock(costs_.back().cost, nullptr, pose, point);
    }
    for (int i = 0; i < Scene::kCameras; ++i)
      problem_.SetManifold(&poses_[static_cast<std::size_t>(kPose * i)], manifold());
    problem_.SetParameterBlockConstant(poses_.data());
  }

  /// Runs three iterations from the initial values. Returns the CPU time per iteration, ms. More
  /// iterations would reach the minimum. There, rounding decides whether a step succeeds and needs
  /// Jacobians.
  double Iterate() {
    poses_ = scene_.poses;
    points_ = scene_.points;
    ceres::Solver::Options options;
    options.linear_solver_type = solver_;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (int i = 0; i < Scene::kPoints; ++i)
      options.linear_solver_ordering->AddElementToGroup(&points_[static_cast<std::size_t>(3 * i)],
                                                        0);
    for (int i = 0; i < Scene::kCameras; ++i)
      options.linear_solver_ordering->AddElementToGroup(
          &poses_[static_cast<std::size_t>(kPose * i)], 1);
    options.max_num_iterations = 3;
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 0.0;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    const double start = CpuNs();
    ceres::Solve(options, &problem_, &summary);
    const double ms = 1e-6 * (CpuNs() - start);
    cost_ = summary.final_cost;
    jacobian_evaluations_ = summary.num_jacobian_evaluations;
    return ms / static_cast<double>(summary.iterations.size() - 1);
  }
  /// Evaluates residuals and Jacobians of all pixels once. Returns the CPU time per pixel, ns.
  double Evaluate() {
    double r[2], pose[2 * kPose], point[6];
    double* jacobians[] = {pose, point};
    const double start = CpuNs();
    for (const Cost& cost : costs_)
      sum_ += cost.cost->Evaluate(cost.blocks, r, jacobians) ? r[0] : 0;
    return (CpuNs() - start) / static_cast<double>(costs_.size());
  }
  double cost() const { return cost_; }
  int jacobian_evaluations() const { return jacobian_evaluations_; }

 private:
  struct Cost {
    ceres::CostFunction* cost;
    const double* blocks[2];
  };
  const Scene& scene_;
  ceres::LinearSolverType solver_;
  std::vector<double> poses_, points_;
  std::vector<Cost> costs_;
  ceres::Problem problem_;
  double cost_ = 0.0, sum_ = 0.0;
  int jacobian_evaluations_ = 0;
};

double QuantileOf(std::vector<double> values, double q) {
  std::ranges::sort(values);
  return Quantile(values, q);
}

/// Contenders: kinds of costs. Each contender has a peer, to which its times are compared.
struct Contenders {
  PinholeAnalytic analytic;
  Pinhole automatic;
  SharedSensor abi_analytic = MakeSensor(analytic, "analytic");
  SharedSensor abi_automatic = MakeSensor(automatic, "automatic");
  std::vector<ceres_batch::RolePlace> places{{0, 0}, {0, 3}, {1, 0}};
  std::vector<double> identity_weight{1.0, 0.0, 0.0, 1.0};  // W for a noise of 1 px
  CostKind<PinholeAnalytic> analytic_kind{analytic, places, {kPose, 3}, identity_weight};
  CostKind<Pinhole> automatic_kind{automatic, places, {kPose, 3}, identity_weight};
  CostKind<SensorModel> abi_analytic_kind{*abi_analytic, places, {kPose, 3}, identity_weight};
  CostKind<SensorModel> abi_automatic_kind{*abi_automatic, places, {kPose, 3}, identity_weight};

  static ceres::Manifold* TangentManifold() {
    return new GeometryManifold(
        {{Geometry::Vector(3), false}, {Geometry::UnitQuaternion(), false}});
  }
  static ceres::Manifold* AmbientManifold() {
    return new ceres::ProductManifold<ceres::EuclideanManifold<3>, ceres::QuaternionManifold>();
  }
  struct Contender {
    const char* name;
    std::size_t peer;  ///< index of the contender to compare with
    Adjustment::MakeCost make;
    Adjustment::MakeManifold manifold;
  };
  std::vector<Contender> all = {
      {"by hand", 0, [](const double* z) { return new HandWrittenCost(z); }, TangentManifold},
      {"analytic, static", 0, [this](const double* z) { return new SensorCost(analytic_kind, z); },
       TangentManifold},
      {"analytic, plugin", 0,
       [this](const double* z) { return new SensorCost(abi_analytic_kind, z); }, TangentManifold},
      {"by hand, again", 0, [](const double* z) { return new HandWrittenCost(z); },
       TangentManifold},
      {"ceres::AutoDiffCostFunction", 4,
       [](const double* z) {
         return new ceres::AutoDiffCostFunction<Functor, 2, kPose, 3>(new Functor{z[0], z[1]});
       },
       AmbientManifold},
      {"automatic, static", 4,
       [this](const double* z) { return new SensorCost(automatic_kind, z); }, TangentManifold},
      {"automatic, plugin", 4,
       [this](const double* z) { return new SensorCost(abi_automatic_kind, z); }, TangentManifold},
  };
};

/// Times of one contender.
struct Times {
  std::vector<double> ms;      ///< times of an iteration
  std::vector<double> ns;      ///< times of an evaluation
  std::vector<double> ratios;  ///< times of iterations, relative to the peer
};

int Main(int rounds) {
  const Scene scene;
  const Contenders contenders;
  for (const auto solver : {ceres::DENSE_SCHUR, ceres::SPARSE_SCHUR}) {
    std::vector<std::unique_ptr<Adjustment>> adjustments;
    for (const Contenders::Contender& contender : contenders.all)
      adjustments.push_back(
          std::make_unique<Adjustment>(scene, solver, contender.make, contender.manifold));
    std::vector<Times> times(contenders.all.size());
    const auto iterate = [&](std::size_t i) {
      times[i].ms.push_back(adjustments[i]->Iterate());
      return times[i].ms.back();
    };
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t i = 0; i < times.size(); ++i) {
        // Measures two solves between two solves of the peer, so that changes of the machine's
        // speed cancel.
        const double peer_before = iterate(contenders.all[i].peer), first = iterate(i),
                     second = iterate(i);
        times[i].ratios.push_back((first + second) /
                                  (peer_before + iterate(contenders.all[i].peer)));
      }
      for (std::size_t i = 0; i < times.size(); ++i)
        times[i].ns.push_back(adjustments[i]->Evaluate());
    }
    std::printf("%s\n%-28s %12s %8s %26s\n", ceres::LinearSolverTypeToString(solver), "",
                "ms/iteration", "ns/cost", "ratio (10 % to 90 %)");
    for (std::size_t i = 0; i < times.size(); ++i) {
      if (std::abs(adjustments[i]->cost() / adjustments[0]->cost() - 1.0) > 1e-6) {
        std::fprintf(stderr, "error: the final cost of %s is %.12g, that of 'by hand' is %.12g\n",
                     contenders.all[i].name, adjustments[i]->cost(), adjustments[0]->cost());
        return 1;
      }
      if (adjustments[i]->jacobian_evaluations() != adjustments[0]->jacobian_evaluations()) {
        std::fprintf(stderr, "error: %s evaluates Jacobians %d times, but 'by hand' %d times\n",
                     contenders.all[i].name, adjustments[i]->jacobian_evaluations(),
                     adjustments[0]->jacobian_evaluations());
        return 1;
      }
      std::printf("%-28s %12.2f %8.1f %10.3f (%.3f to %.3f)\n", contenders.all[i].name,
                  QuantileOf(times[i].ms, 0.5), QuantileOf(times[i].ns, 0.5),
                  QuantileOf(times[i].ratios, 0.5), QuantileOf(times[i].ratios, 0.1),
                  QuantileOf(times[i].ratios, 0.9));
    }
  }
  return 0;
}

}  // namespace
}  // namespace alidade::bench

int main(int argc, char** argv) {
  CLI::App app{
      "Time of an iteration of Ceres on costs from sensor models, relative to other costs."};
  int rounds = 15;
  app.add_option("--rounds", rounds, "Number of comparisons of each contender with its peer")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return alidade::bench::Main(rounds);
}
