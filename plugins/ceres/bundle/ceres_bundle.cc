// SPDX-License-Identifier: Apache-2.0
#include <ceres/crs_matrix.h>
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include "alidade/bundle/bundle.h"
#include "alidade/state/covariance.h"
#include "alidade/state/dense_algebra.h"
#include "geometry_manifold.h"
#include "plugins/ceres/loss.h"
#include "sensor_cost.h"

namespace alidade::ceres_batch {
namespace {

// Ambient sizes of a point and of a pose, which is a position and an orientation.
constexpr int kPoint = 3, kPose = 7;

/// Callback that reports the progress of the solve, and ends the solve if requested.
class ProgressCallback : public ceres::IterationCallback {
 public:
  explicit ProgressCallback(const BundleOptions& options) : options_(options) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (options_.progress) options_.progress(summary.iteration);
    const bool stop = options_.stop && options_.stop();
    return stop ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const BundleOptions& options_;
};

/// Ceres problem of a bundle adjustment. A parameter block is the pose of a camera, the intrinsics,
/// or a point. The block of a camera also contains its intrinsics if they are free and no two
/// cameras share intrinsics. The problem contains only the blocks that an observation uses.
class Bundle {
 public:
  Bundle(const SensorModel& sensor, const BundleProblem& problem, const BundleOptions& options)
      : sensor_(sensor), roles_(RolesOf(sensor)), problem_data_(problem), options_(options) {
    std::vector<std::string> fixed = problem.fixed;
    fixed.insert(fixed.end(), options.fixed.begin(), options.fixed.end());
    fixed_ = FixedElements(sensor, fixed);
    if (roles_.intrinsics >= 0) {
      lens_ = sensor.roles()[static_cast<std::size_t>(roles_.intrinsics)].geometry;
      lens_in_camera_block_ = !all_fixed() && HasUniqueIntrinsics();
    }
    CopyValues();
    for (const BundleObservation& observation : problem.observations) {
      if (observation.used) Add(observation);
    }
    AddManifolds();
  }

  BundleResult Solve();
  /// Copies the solution to `problem`.
  void CopyTo(BundleProblem& problem) const;

 private:
  int camera_size() const { return kPose + (lens_in_camera_block_ ? lens_.ambient : 0); }
  bool all_fixed() const { return std::ranges::count(fixed_, false) == 0; }
  bool separate_lens() const { return roles_.intrinsics >= 0 && !lens_in_camera_block_; }
  double* camera(int i) { return cameras_.data() + i * camera_size(); }
  double* point(int i) { return points_.data() + i * kPoint; }
  double* lens(int i) { return lenses_.data() + i * lens_.ambient; }

  bool HasUniqueIntrinsics() const {
    std::vector<int> users(problem_data_.intrinsics.size());
    for (const BundleCamera& camera : problem_data_.cameras)
      ++users[static_cast<std::size_t>(camera.intrinsics)];
    return std::ranges::all_of(users, [](int count) { return count < 2; });
  }
  void CopyValues() {
    for (const BundleCamera& camera : problem_data_.cameras) {
      cameras_.insert(cameras_.end(), camera.position.begin(), camera.position.end());
      cameras_.insert(cameras_.end(), camera.orientation.begin(), camera.orientation.end());
      if (!lens_in_camera_block_) continue;
      const auto& lens = problem_data_.intrinsics[static_cast<std::size_t>(camera.intrinsics)];
      cameras_.insert(cameras_.end(), lens.begin(), lens.end());
    }
    for (const auto& lens : problem_data_.intrinsics)
      lenses_.insert(lenses_.end(), lens.begin(), lens.end());
    for (const auto& point : problem_data_.points)
      points_.insert(points_.end(), point.begin(), point.end());
  }
  /// Returns the kind of cost for the given W = L^-1. The first call with this W creates the kind.
  const CostKind<SensorModel>& KindOf(const std::vector<double>& w) {
    auto& kind = kinds_[w];
    if (kind != nullptr) return *kind;
    std::vector<RolePlace> places(sensor_.roles().size());
    places[roles_.position] = {0, 0};
    places[roles_.orientation] = {0, 3};
    places[roles_.point] = {1, 0};
    std::vector<int> sizes = {camera_size(), kPoint};
    if (roles_.intrinsics >= 0) {
      places[static_cast<std::size_t>(roles_.intrinsics)] =
          lens_in_camera_block_ ? RolePlace{0, kPose} : RolePlace{2, 0};
    }
    if (separate_lens()) sizes.push_back(lens_.ambient);
    kind = std::make_unique<CostKind<SensorModel>>(sensor_, places, sizes, w);
    return *kind;
  }
  void Add(const BundleObservation& observation) {
    const int m = sensor_.measurement().geometry.tangent;
    RowMajor l(m, m);
    const Status status = sensor_.SqrtNoise(RoleValues(roles_, problem_data_, observation).data(),
                                            observation.z.data(), l.data());
    if (status != Status::kOk) return;
    std::vector<double> w(static_cast<std::size_t>(m * m));
    Eigen::Map<RowMajor>(w.data(), m, m) =
        l.triangularView<Eigen::Lower>().solve(RowMajor::Identity(m, m));
    auto* const cost = new SensorCost<SensorModel>(KindOf(w), observation.z.data());
    const bool robust = options_.loss.kind != LossKind::kNone;
    std::vector<double*> blocks = {camera(observation.camera), point(observation.point)};
    if (separate_lens())
      blocks.push_back(
          lens(problem_data_.cameras[static_cast<std::size_t>(observation.camera)].intrinsics));
    ceres_problem_.AddResidualBlock(cost, robust ? new Loss(options_.loss) : nullptr, blocks);
  }
  void AddManifolds() {
    const Geometry position = Geometry::Vector(3), orientation = Geometry::UnitQuaternion();
    bool first = true;
    for (int i = 0; i < static_cast<int>(problem_data_.cameras.size()); ++i) {
      if (!ceres_problem_.HasParameterBlock(camera(i))) continue;
      std::vector<GeometryManifold::Part> parts = {{position, first}, {orientation, first}};
      if (lens_in_camera_block_) AddLens(parts);
      if (first && !lens_in_camera_block_) {
        ceres_problem_.SetParameterBlockConstant(camera(i));
      } else {
        ceres_problem_.SetManifold(camera(i), new GeometryManifold(parts));
      }
      first = false;
    }
    for (int i = 0; separate_lens() && i < static_cast<int>(problem_data_.intrinsics.size()); ++i) {
      if (!ceres_problem_.HasParameterBlock(lens(i))) continue;
      std::vector<GeometryManifold::Part> parts;
      AddLens(parts);
      if (all_fixed()) {
        ceres_problem_.SetParameterBlockConstant(lens(i));
      } else {
        ceres_problem_.SetManifold(lens(i), new GeometryManifold(parts));
      }
    }
  }
  void AddLens(std::vector<GeometryManifold::Part>& parts) const {
    for (const bool fixed : fixed_) parts.push_back({Geometry::Vector(1), fixed});
  }
  double StepTolerance() const;
  ceres::Solver::Options SolverOptions() const;
  void Eliminate(ceres::Solver::Options& options);
  int Rank();

  const SensorModel& sensor_;
  BundleRoles roles_;
  const BundleProblem& problem_data_;
  const BundleOptions& options_;
  Geometry lens_;
  std::vector<bool> fixed_;            ///< true for each constant element of the intrinsics
  bool lens_in_camera_block_ = false;  ///< true if the block of a camera contains its intrinsics
  std::vector<double> cameras_, lenses_, points_;
  std::map<std::vector<double>, std::unique_ptr<CostKind<SensorModel>>> kinds_;  ///< key: W
  ceres::Problem ceres_problem_;
};

/// Eliminates the points first, or the cameras if the cameras have more unknowns. Both orders are
/// valid, because a residual depends on one camera and one point.
void Bundle::Eliminate(ceres::Solver::Options& options) {
  int cameras = 0, points = 0;
  const auto count = [&](const double* block, int& sum) {
    if (ceres_problem_.HasParameterBlock(block) && !ceres_problem_.IsParameterBlockConstant(block))
      sum += ceres_problem_.ParameterBlockTangentSize(block);
  };
  for (int i = 0; i < static_cast<int>(problem_data_.cameras.size()); ++i)
    count(camera(i), cameras);
  for (int i = 0; i < static_cast<int>(problem_data_.points.size()); ++i) count(point(i), points);
  const bool points_first = points >= cameras;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  const auto add = [&](double* block, int group) {
    if (ceres_problem_.HasParameterBlock(block)) ordering->AddElementToGroup(block, group);
  };
  for (int i = 0; i < static_cast<int>(problem_data_.points.size()); ++i)
    add(point(i), points_first ? 0 : 1);
  for (int i = 0; i < static_cast<int>(problem_data_.cameras.size()); ++i)
    add(camera(i), points_first ? 1 : 0);
  for (int i = 0; i < static_cast<int>(problem_data_.intrinsics.size()); ++i) add(lens(i), 1);
  options.linear_solver_ordering = ordering;
  constexpr int kDense = 1000;  // maximum number of unknowns for a dense solver
  options.linear_solver_type =
      std::min(cameras, points) <= kDense ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
}

/// Returns the relative tolerance of a step. Ceres compares the step with the norm of all unknowns.
/// With a very distant point, every step would be small enough to end the solve. The tolerance is
/// therefore scaled to the norm that the points would have if every coordinate had the median size.
/// The problem has at least one point.
double Bundle::StepTolerance() const {
  constexpr double kTolerance = 1e-12;
  std::vector<double> sizes;
  for (const double x : points_) sizes.push_back(std::abs(x));
  const auto middle = sizes.begin() + std::ssize(sizes) / 2;
  std::ranges::nth_element(sizes, middle);
  const double norm = Eigen::Map<const Eigen::VectorXd>(points_.data(), std::ssize(points_)).norm();
  const double typical = *middle * std::sqrt(static_cast<double>(sizes.size()));
  return norm > typical ? kTolerance * typical / norm : kTolerance;
}

ceres::Solver::Options Bundle::SolverOptions() const {
  ceres::Solver::Options options;
  options.max_num_iterations = options_.max_iterations;
  // A cost is a sum of n squares. Its relative rounding error is about epsilon sqrt(n).
  const double rounding =
      std::numeric_limits<double>::epsilon() *
      std::sqrt(static_cast<double>(std::max(1, ceres_problem_.NumResiduals())));
  options.function_tolerance = std::max(options_.function_tolerance, rounding);
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = StepTolerance();
  // A step that cannot be computed halves the trust region. If the start is distant, several steps
  // in a row may fail in this way.
  options.max_num_consecutive_invalid_steps = 50;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  return options;
}

BundleResult Bundle::Solve() {
  ProgressCallback callback(options_);
  ceres::Solver::Options options = SolverOptions();
  Eliminate(options);
  options.callbacks = {&callback};
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem_, &summary);
  BundleResult result;
  result.message = summary.message;
  result.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  for (const ceres::IterationSummary& step : summary.iterations) {
    result.steps.push_back({step.cost, step.gradient_max_norm, step.step_is_successful});
  }
  result.cost_before = summary.initial_cost;
  result.cost_after = summary.final_cost;
  result.residuals = ceres_problem_.NumResiduals();
  result.unknowns = summary.num_effective_parameters_reduced;
  if (summary.termination_type == ceres::CONVERGENCE) result.end = BundleEnd::kConverged;
  if (summary.termination_type == ceres::NO_CONVERGENCE) result.end = BundleEnd::kOutOfIterations;
  if (summary.termination_type == ceres::USER_SUCCESS) result.end = BundleEnd::kStopped;
  if (result.unknowns <= kBundleRankUnknowns) result.rank = Rank();
  return result;
}

/// Returns the rank of dr/dx with columns scaled to length 1, or -1 if dr/dx is not finite. It is
/// the rank of R in dr/dx = Q R. R is computed from a few rows at a time to save memory.
int Bundle::Rank() {
  std::vector<double*> blocks, moved;
  ceres_problem_.GetParameterBlocks(&blocks);
  std::ranges::copy_if(blocks, std::back_inserter(moved), [&](const double* block) {
    return !ceres_problem_.IsParameterBlockConstant(block);
  });
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = moved;
  options.apply_loss_function = false;
  ceres::CRSMatrix sparse;
  if (!ceres_problem_.Evaluate(options, nullptr, nullptr, nullptr, &sparse)) return -1;
  const int n = sparse.num_cols, batch_rows = 4 * n;
  if (n == 0) return 0;
  Eigen::MatrixXd rows =
      Eigen::MatrixXd::Zero(n + batch_rows, n);  // R of the previous rows, above the new rows
  for (int first = 0; first < sparse.num_rows; first += batch_rows) {
    for (int r = first; r < std::min(first + batch_rows, sparse.num_rows); ++r) {
      for (auto k = static_cast<std::size_t>(sparse.rows[static_cast<std::size_t>(r)]);
           k < static_cast<std::size_t>(sparse.rows[static_cast<std::size_t>(r) + 1]); ++k) {
        rows(n + r - first, sparse.cols[k]) = sparse.values[k];
      }
    }
    const Eigen::MatrixXd r = internal::UpperTriangleOf(rows);
    rows.setZero();
    rows.topRows(n) = r;
  }
  for (auto column : rows.colwise()) {
    const double norm = column.norm();
    if (norm > 0.0) column /= norm;
  }
  constexpr double kRankTolerance = 1e-9;
  return internal::RankOf(rows.topRows(n), kRankTolerance);
}

void Bundle::CopyTo(BundleProblem& problem) const {
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    const double* const source = cameras_.data() + i * static_cast<std::size_t>(camera_size());
    std::copy_n(source, 3, problem.cameras[i].position.data());
    std::copy_n(source + 3, 4, problem.cameras[i].orientation.data());
    if (lens_in_camera_block_) {
      auto& lens = problem.intrinsics[static_cast<std::size_t>(problem.cameras[i].intrinsics)];
      std::copy_n(source + kPose, lens.size(), lens.data());
    }
  }
  for (std::size_t i = 0; separate_lens() && i < problem.intrinsics.size(); ++i)
    std::copy_n(lenses_.data() + i * problem.intrinsics[i].size(), problem.intrinsics[i].size(),
                problem.intrinsics[i].data());
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    std::copy_n(points_.data() + i * kPoint, kPoint, problem.points[i].data());
}

BundleResult Adjust(const SensorModel& sensor, BundleProblem& problem,
                    const BundleOptions& options) {
  Bundle bundle(sensor, problem, options);
  const BundleResult result = bundle.Solve();
  if (result.end != BundleEnd::kFailed) bundle.CopyTo(problem);
  return result;
}

}  // namespace
}  // namespace alidade::ceres_batch

ALIDADE_BUNDLE_PLUGIN(&alidade::ceres_batch::Adjust)
