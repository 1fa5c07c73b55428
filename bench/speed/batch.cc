// SPDX-License-Identifier: Apache-2.0
//
// Measures the time of an iteration of the sparse batch, for a camera with 12 unknowns and 40
// observations per frame. Tracks have 20 to 40 frames; a tenth of the tracks have 80 to 120. The
// depth is known to 1 m at the first observation, the process noise has rank 6 of 12, and the first
// pose is exact. The peer is Ceres with hand-written costs and analytic Jacobians for the same
// observations. Ceres needs process noise of full rank (white acceleration). The problem of Ceres
// has the same structure, but only its time can be compared.
//
//   bench_batch [--frames N]... [--iterations N] [--ceres N]
//
//   ratio batch/ceres VALUE     time of an iteration: batch / the faster solver of Ceres
//   exponent VALUE              exponent b of (time of an iteration) ~ (number of frames)^b
#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/estimator.h"
#include "bench/speed/interleaved.h"
#include "motion_models/quaternion_pose.h"
#include "plugins/ceres/batch/kkt_covariance.h"
#include "sensors/depth_feature.h"
#include "sensors/inverse_depth_feature.h"

namespace alidade::bench {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Vector12d = Eigen::Matrix<double, 12, 1>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kFocal = 500.0, kCentre = 1000.0, kPixel = 1.0, kDepth = 1.0;
constexpr double kDt = 0.1, kAcceleration = 0.3, kAngular = 0.3;
constexpr int kTracks = 40;

struct Pose {
  Vector3d r;
  Quaterniond q;
  Vector3d v, omega;
};

struct Observed {
  int frame, landmark;
  double u, v, depth;
  bool first;
};

Matrix3d Hat(const Vector3d& a) {
  Matrix3d m;
  m << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
  return m;
}
Quaterniond Exp(const Vector3d& a) {
  const double angle = a.norm();
  return angle < 1e-9 ? Quaterniond(1.0, 0.5 * a[0], 0.5 * a[1], 0.5 * a[2]).normalized()
                      : Quaterniond(Eigen::AngleAxisd(angle, a / angle));
}
Vector3d Log(const Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0, n = q.vec().norm();
  return n < 1e-9 ? Vector3d(2.0 * sign * q.vec())
                  : Vector3d(2.0 * sign * std::atan2(n, sign * q.w()) / n * q.vec());
}

/// Simulated data for both solvers, with initial values near the truth.
struct Scene {
  std::vector<Pose> truth, start;
  std::vector<Vector3d> landmarks;
  std::vector<Observed> observations;  ///< observations, ordered by frame

  explicit Scene(int frames) {
    Random random(1);
    for (int k = 0; k < frames; ++k) truth.push_back(PoseAt(kDt * k));
    std::vector<int> landmark(kTracks, -1), remaining_frames(kTracks, 0);
    for (int k = 0; k < frames; ++k) {
      for (std::size_t s = 0; s < kTracks; ++s) {
        const bool first = remaining_frames[s] == 0;
        if (first) {
          const bool is_long = random.Uniform() < 0.1;
          remaining_frames[s] =
              static_cast<int>(is_long ? 80 + 41 * random.Uniform() : 20 + 21 * random.Uniform());
          if (k == 0)
            remaining_frames[s] =
                std::max(3, static_cast<int>(remaining_frames[s] * random.Uniform()));
          landmark[s] = static_cast<int>(landmarks.size());
          const Pose& middle =
              truth[static_cast<std::size_t>(std::min(k + remaining_frames[s] / 2, frames - 1))];
          const double z = is_long ? 15 + 15 * random.Uniform() : 5 + 7 * random.Uniform();
          const Vector3d in_cam((random.Uniform() - 0.5) * 0.7 * z,
                                (random.Uniform() - 0.5) * 0.5 * z, z);
          landmarks.push_back(middle.q * in_cam + middle.r);
        }
        --remaining_frames[s];
        const Pose& pose = truth[static_cast<std::size_t>(k)];
        const Vector3d h =
            pose.q.conjugate() * (landmarks[static_cast<std::size_t>(landmark[s])] - pose.r);
        if (h[2] < 1.0) {
          remaining_frames[s] = 0;
          if (first) landmarks.pop_back();
          continue;
        }
        observations.push_back({k, landmark[s],
                                kFocal * h[0] / h[2] + kCentre + kPixel * random.Normal(),
                                kFocal * h[1] / h[2] + kCentre + kPixel * random.Normal(),
                                h[2] + 0.3 * kDepth * random.Normal(), first});
      }
    }
    const auto noise = [&](double sigma) {
      return Vector3d(sigma * random.Normal(), sigma * random.Normal(), sigma * random.Normal());
    };
    start = truth;
    for (std::size_t k = 1; k < start.size(); ++k) {
      start[k].r += noise(0.02);
      start[k].q = start[k].q * Exp(noise(0.002));
      start[k].v += noise(0.05);
      start[k].omega += noise(0.02);
    }
  }

  static Pose PoseAt(double t) {
    const auto q = [](double s) {
      Matrix3d camera_axes;  // the camera looks along y of the world
      camera_axes << 1, 0, 0, 0, 0, 1, 0, -1, 0;
      return Quaterniond(camera_axes) *
             Exp({0.1 * std::sin(0.6 * s), 0.1 * std::sin(0.4 * s + 1.0), 0.1 * std::sin(0.5 * s)});
    };
    const auto r = [](double s) {
      return Vector3d(s, 0.3 * std::sin(0.5 * s), 0.2 * std::sin(0.7 * s));
    };
    return {r(t), q(t), (r(t) - r(t - kDt)) / kDt, Log(q(t - kDt).conjugate() * q(t)) / kDt};
  }
};

// Functions for the batch.

Problem BuildProblem(const Scene& scene) {
  Problem problem;
  const SharedMotion motion = MakeMotion(
      QuaternionPose({kAcceleration, kAcceleration, kAcceleration}, {kAngular, kAngular, kAngular}),
      "quaternion_pose");
  MotionBinding binding{"cam", motion, {}};
  const Pose& first = scene.truth.front();
  const std::vector<std::vector<double>> means = {
      {first.r[0], first.r[1], first.r[2]},
      {first.q.w(), first.q.x(), first.q.y(), first.q.z()},
      {first.v[0], first.v[1], first.v[2]},
      {first.omega[0], first.omega[1], first.omega[2]}};
  const std::array<double, 4> sigmas = {0.0, 0.0, 1.0, 0.5};
  for (std::size_t i = 0; i < 4; ++i) {
    const BlockId id =
        problem.layout.Declare("cam." + motion->blocks()[i].name, "cam", motion->blocks()[i]);
    binding.blocks.push_back(id);
    Prior prior;
    prior.block = id;
    prior.mean = means[i];
    prior.covariance = sigmas[i] * sigmas[i] * Matrix3d::Identity();
    problem.priors.push_back(prior);
  }
  const Camera camera(2000, 2000, kFocal, kFocal, kCentre, kCentre);
  SensorBinding pixels{"pixels",
                       "pixels",
                       MakeSensor(InverseDepthFeature<InverseDepth>(camera, kPixel), "pixels"),
                       {}};
  SensorBinding depth{"depth",
                      "depth",
                      MakeSensor(DepthFeature<InverseDepth>(camera, kPixel, kDepth), "depth"),
                      {}};
  for (SensorBinding* sensor : {&pixels, &depth}) {
    sensor->roles.resize(sensor->model->roles().size());
    for (std::size_t i = 0; i < 2; ++i) sensor->roles[i].block = binding.blocks[i];
    problem.sensors.push_back(*sensor);
  }
  problem.motions.push_back(std::move(binding));
  problem.landmarks = LandmarkOptions{};
  problem.landmarks->prior = LandmarkOptions::Prior{0.1, 0.05, 0};
  return problem;
}

/// Estimator that reports the outcome of each measurement. It replaces the filter that would
/// provide the initial values.
class StartEstimator : public Estimator {
 public:
  StartEstimator(const Problem& problem, const Scene& scene)
      : scene_(scene), state_(problem.InitialState(/*reserved=*/true)) {}
  void Start(Timestamp) override {}
  const UpdateReport& Process(const Frame& frame) override {
    report_.Clear();
    for (const Measurement& m : frame.measurements) {
      MeasurementReport& report = report_.Add();
      report.sensor = m.stream;
      report.landmark = m.landmark;
      report.dof = m.stream == 1 ? 3 : 2;
      if (m.stream == 1) report.outcome = Outcome::kInitialised;
    }
    const Pose& pose = scene_.start[next_++];
    const double x[13] = {pose.r[0],     pose.r[1],     pose.r[2],    pose.q.w(), pose.q.x(),
                          pose.q.y(),    pose.q.z(),    pose.v[0],    pose.v[1],  pose.v[2],
                          pose.omega[0], pose.omega[1], pose.omega[2]};
    state_.values().assign(x, x + 13);
    return report_;
  }
  const State& state() const override { return state_; }
  Timestamp timestamp() const override { return 0; }
  bool diverged() const override { return false; }
  bool failed() const override { return false; }

 private:
  const Scene& scene_;
  State state_;
  UpdateReport report_;
  std::size_t next_ = 0;
};

struct Times {
  double iteration_s = 0.0, covariances_s = 0.0, linearise_s = 0.0, solve_s = 0.0, flops = 0.0;
  bool in_time_order = false;
};

double NowS() { return 1e-9 * CpuNs(); }

Times TimeBatch(const Scene& scene, int iterations) {
  const Problem problem = BuildProblem(scene);
  ceres_batch::CondensedRun run(problem, {{"pixels", 2}, {"depth", 3}},
                                std::numeric_limits<double>::infinity(),
                                std::numeric_limits<int>::max());
  StartEstimator start(problem, scene);
  ceres_batch::Trajectory linearisation_trajectory;
  std::size_t next_observed = 0;
  for (std::size_t k = 0; k < scene.start.size(); ++k) {
    Frame frame;
    frame.timestamp = TimestampFromSeconds(kDt * static_cast<double>(k));
    for (; next_observed < scene.observations.size() &&
           scene.observations[next_observed].frame == static_cast<int>(k);
         ++next_observed) {
      const Observed& s = scene.observations[next_observed];
      std::vector<double> z{s.u, s.v};
      if (s.first) z.push_back(s.depth);
      frame.measurements.push_back({frame.timestamp, s.first ? 1 : 0, s.landmark, z, {}});
    }
    if (!run.Add(frame, start.Process(frame), start, linearisation_trajectory)) {
      throw std::runtime_error(run.problem());
    }
  }
  ceres_batch::KktSystem kkt(run);
  Eigen::VectorXd z = kkt.Join(Eigen::VectorXd::Zero(run.shape().inputs));
  const auto require = [&](bool succeeded) {
    if (!succeeded) throw std::runtime_error("the batch failed: " + run.problem());
  };
  require(kkt.LineariseAbout(linearisation_trajectory, z) && kkt.Solve());
  z += kkt.step().dz;
  require(kkt.Freeze(z).has_value());
  Times times;
  const double begin = NowS();
  for (int i = 0; i < iterations; ++i) {
    double start_s = NowS();
    require(kkt.Linearise(z, 0.0));
    times.linearise_s += (NowS() - start_s) / iterations;
    start_s = NowS();
    require(kkt.Solve());
    times.solve_s += (NowS() - start_s) / iterations;
    z += kkt.step().dz;
    require(kkt.Cost(z).has_value());
  }
  times.iteration_s = (NowS() - begin) / iterations;
  const double end = NowS();
  const ceres_batch::KktSystem::Covariances covariances(kkt);
  for (std::size_t k = 0; k < scene.start.size(); ++k) covariances.OfFrame(k);
  times.covariances_s = NowS() - end;
  times.flops = kkt.elimination().flops;
  times.in_time_order = kkt.in_time_order();
  return times;
}

// Functions for the peer, Ceres.

/// Manifold of position and orientation. A cost writes the derivative with respect to the tangent
/// into the first six columns.
struct PoseManifold : ceres::Manifold {
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* d, double* x_plus_d) const override {
    for (int i = 0; i < 3; ++i) x_plus_d[i] = x[i] + d[i];
    const Quaterniond q(x[6], x[3], x[4], x[5]);
    Eigen::Map<Quaterniond>{x_plus_d + 3} = (q * Exp({d[3], d[4], d[5]})).normalized();
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
    j.setZero();
    j.topRows<6>().setIdentity();
    return true;
  }
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }
};

template <int kRows>
struct Observation : ceres::SizedCostFunction<kRows, 7, 3> {
  Observed observed;
  explicit Observation(const Observed& s) : observed(s) {}
  bool Evaluate(double const* const* x, double* r, double** j) const override {
    const Eigen::Map<const Vector3d> position(x[0]), y(x[1]);
    const Matrix3d cam_from_world =
        Eigen::Map<const Quaterniond>(x[0] + 3).conjugate().toRotationMatrix();
    const Vector3d h = cam_from_world * (y - position);
    if (h[2] < 1e-3) return false;
    const double f = kFocal / (h[2] * kPixel);
    Matrix3d d;
    d << f, 0, -f * h[0] / h[2], 0, f, -f * h[1] / h[2], 0, 0, 1.0 / kDepth;
    r[0] = f * h[0] - (observed.u - kCentre) / kPixel;
    r[1] = f * h[1] - (observed.v - kCentre) / kPixel;
    if (kRows > 2) r[kRows - 1] = (h[2] - observed.depth) / kDepth;
    if (j == nullptr) return true;
    const auto rows = d.topRows<kRows>();
    if (j[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kRows, 7, Eigen::RowMajor>> j_x(j[0]);
      j_x.setZero();
      j_x.template leftCols<3>() = -rows * cam_from_world;
      j_x.template middleCols<3>(3) = rows * Hat(h);
    }
    if (j[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kRows, 3, Eigen::RowMajor>>{j[1]} = rows * cam_from_world;
    }
    return true;
  }
};

/// Cost of a step with white acceleration, so that Q has full rank. The derivative of Exp is the
/// derivative at zero, because only the time of the cost matters.
struct Step : ceres::SizedCostFunction<12, 7, 6, 7, 6> {
  Matrix12d whiten;
  Step() {
    Matrix12d q = Matrix12d::Zero();
    const double s = kAcceleration * kAcceleration * kDt;
    for (int i = 0; i < 6; ++i) {
      q(i, i) = s * kDt * kDt / 3.0;
      q(i, 6 + i) = q(6 + i, i) = s * kDt / 2.0;
      q(6 + i, 6 + i) = s;
    }
    whiten = q.llt().matrixL().solve(Matrix12d::Identity());
  }
  bool Evaluate(double const* const* x, double* r, double** j) const override {
    const Eigen::Map<const Vector3d> r0(x[0]), r1(x[2]);
    const Eigen::Map<const Vector6d> v0(x[1]), v1(x[3]);
    const Eigen::Map<const Quaterniond> q0(x[0] + 3), q1(x[2] + 3);
    Vector12d c;
    c << r1 - r0 - kDt * v0.head<3>(), Log(q0.conjugate() * q1) - kDt * v0.tail<3>(), v1 - v0;
    Eigen::Map<Vector12d>{r} = whiten * c;
    if (j == nullptr) return true;
    Matrix12d j_previous_state = -Matrix12d::Identity(), j_next_state = Matrix12d::Identity();
    j_previous_state.topRightCorner<6, 6>() = -kDt * Eigen::Matrix<double, 6, 6>::Identity();
    j_previous_state.block<3, 3>(3, 3) = -(q1.conjugate() * q0).toRotationMatrix();
    const Matrix12d j_previous = whiten * j_previous_state, j_next = whiten * j_next_state;
    for (int b = 0; b < 4; ++b) {
      if (j[b] == nullptr) continue;
      const auto columns = (b < 2 ? j_previous : j_next).middleCols<6>(b % 2 == 0 ? 0 : 6);
      const int width = b % 2 == 0 ? 7 : 6;
      Eigen::Map<Eigen::Matrix<double, 12, Eigen::Dynamic, Eigen::RowMajor>> jacobian(j[b], 12,
                                                                                      width);
      jacobian.setZero();
      jacobian.leftCols<6>() = columns;
    }
    return true;
  }
};

struct VelocityPrior : ceres::SizedCostFunction<6, 6> {
  Vector6d mean;
  bool Evaluate(double const* const* x, double* r, double** j) const override {
    for (int i = 0; i < 6; ++i) r[i] = (x[0][i] - mean[i]) / (i < 3 ? 1.0 : 0.5);
    if (j == nullptr || j[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> jacobian(j[0]);
    jacobian.setZero();
    for (int i = 0; i < 6; ++i) jacobian(i, i) = i < 3 ? 1.0 : 2.0;
    return true;
  }
};

/// Returns the CPU time of an iteration, s.
double TimeCeres(const Scene& scene, ceres::LinearSolverType type, int iterations) {
  std::vector<std::array<double, 7>> poses;
  std::vector<Vector6d> velocities;
  std::vector<Vector3d> landmarks = scene.landmarks;
  for (const Pose& pose : scene.start) {
    poses.push_back(
        {pose.r[0], pose.r[1], pose.r[2], pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()});
    velocities.emplace_back();
    velocities.back() << pose.v, pose.omega;
  }
  PoseManifold manifold;
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  auto* ordering = new ceres::ParameterBlockOrdering;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    problem.AddParameterBlock(poses[k].data(), 7, &manifold);
    problem.AddParameterBlock(velocities[k].data(), 6);
    ordering->AddElementToGroup(poses[k].data(), 1);
    ordering->AddElementToGroup(velocities[k].data(), 1);
    if (k == 0) continue;
    problem.AddResidualBlock(new Step, nullptr, poses[k - 1].data(), velocities[k - 1].data(),
                             poses[k].data(), velocities[k].data());
  }
  for (const Observed& s : scene.observations) {
    double* const pose = poses[static_cast<std::size_t>(s.frame)].data();
    double* const landmark = landmarks[static_cast<std::size_t>(s.landmark)].data();
    if (s.first) {
      problem.AddResidualBlock(new Observation<3>(s), nullptr, pose, landmark);
    } else {
      problem.AddResidualBlock(new Observation<2>(s), nullptr, pose, landmark);
    }
  }
  for (Vector3d& y : landmarks) {
    if (problem.HasParameterBlock(y.data())) ordering->AddElementToGroup(y.data(), 0);
  }
  auto* prior = new VelocityPrior;
  prior->mean = velocities[0];
  problem.AddResidualBlock(prior, nullptr, velocities[0].data());
  problem.SetParameterBlockConstant(poses[0].data());
  ceres::Solver::Options options;
  options.num_threads = 1;
  options.linear_solver_type = type;
  if (type == ceres::SPARSE_SCHUR) {
    options.linear_solver_ordering.reset(ordering);
  } else {
    delete ordering;
  }
  options.max_num_iterations = iterations;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 0.0;
  options.initial_trust_region_radius = 1e12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  const double begin = NowS();
  ceres::Solve(options, &problem, &summary);
  const double total_s = NowS() - begin;
  const int count = summary.num_successful_steps + summary.num_unsuccessful_steps - 1;
  return total_s * summary.minimizer_time_in_seconds / summary.total_time_in_seconds / count;
}

void Run(const std::vector<int>& frames, int iterations, int max_ceres_frames) {
  std::printf("%7s %9s | %9s %9s %9s %9s %8s | %9s %9s | CPU s per iteration\n", "frames", "obs",
              "batch", "linearise", "solve", "P, all", "flops", "normal", "schur");
  std::vector<double> time;
  for (const int count : frames) {
    const Scene scene(count);
    const Times batch = TimeBatch(scene, iterations);
    time.push_back(batch.iteration_s);
    std::printf("%7d %9zu | %9.4f %9.4f %9.4f %9.4f %8.1e | ", count, scene.observations.size(),
                batch.iteration_s, batch.linearise_s, batch.solve_s, batch.covariances_s,
                batch.flops);
    if (count > max_ceres_frames) {
      std::printf("%9s %9s | %s\n", "-", "-",
                  batch.in_time_order ? "time order" : "minimum degree");
      continue;
    }
    const double normal = TimeCeres(scene, ceres::SPARSE_NORMAL_CHOLESKY, iterations);
    const double schur = TimeCeres(scene, ceres::SPARSE_SCHUR, iterations);
    std::printf("%9.4f %9.4f | %s\n", normal, schur,
                batch.in_time_order ? "time order" : "minimum degree");
    std::printf("ratio batch/ceres %.3f\n", batch.iteration_s / std::min(normal, schur));
    std::fflush(stdout);
  }
  if (frames.size() > 1) {
    std::printf("exponent %.3f\n", std::log(time.back() / time.front()) /
                                       std::log(1.0 * frames.back() / frames.front()));
  }
}

}  // namespace
}  // namespace alidade::bench

int main(int argc, char** argv) {
  CLI::App app{"Time of an iteration of the sparse batch compared with Ceres"};
  std::vector<int> frames{500, 1000, 5000, 20000};
  int iterations = 5, max_ceres_frames = 5000;
  app.add_option("--frames", frames, "numbers of frames of the series");
  app.add_option("--iterations", iterations, "number of timed iterations");
  app.add_option("--ceres", max_ceres_frames, "maximum number of frames for Ceres");
  CLI11_PARSE(app, argc, argv);
  alidade::bench::Run(frames, iterations, max_ceres_frames);
  return 0;
}
