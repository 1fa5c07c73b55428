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

constexpr int kPoint = 3, kPose = 7;  // ambient sizes; a pose is position and orientation

/// Tells of the iterations, and ends the solve where that is asked for.
class Watch : public ceres::IterationCallback {
 public:
  explicit Watch(const BundleOptions& options) : options_(options) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& done) override {
    if (options_.progress) options_.progress(done.iteration);
    const bool stop = options_.stop && options_.stop();
    return stop ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const BundleOptions& options_;
};

/// A bundle as a problem of Ceres. Parameter blocks: of each camera its pose, followed by its
/// intrinsics where they are free and no other camera has them; else of each intrinsics; of each
/// point. Only what an observation uses is in the problem.
class Bundle {
 public:
  Bundle(const SensorModel& sensor, const BundleProblem& from, const BundleOptions& options)
      : sensor_(sensor), roles_(RolesOf(sensor)), from_(from), options_(options) {
    fixed_ = FixedElements(sensor, options.fixed);
    if (roles_.intrinsics >= 0) {
      lens_ = sensor.roles()[static_cast<std::size_t>(roles_.intrinsics)].geometry;
      own_lens_ = !all_fixed() && NoneIsShared();
    }
    CopyValues();
    for (const BundleObservation& seen : from.observations) {
      if (seen.used) Add(seen);
    }
    AddManifolds();
  }

  BundleResult Solve();
  /// Writes the solution down.
  void CopyTo(BundleProblem& to) const;

 private:
  int camera_size() const { return kPose + (own_lens_ ? lens_.ambient : 0); }
  bool all_fixed() const { return std::ranges::count(fixed_, false) == 0; }
  bool separate_lens() const { return roles_.intrinsics >= 0 && !own_lens_; }
  double* camera(int i) { return cameras_.data() + i * camera_size(); }
  double* point(int i) { return points_.data() + i * kPoint; }
  double* lens(int i) { return lenses_.data() + i * lens_.ambient; }

  bool NoneIsShared() const {
    std::vector<int> users(from_.intrinsics.size());
    for (const BundleCamera& one : from_.cameras) ++users[static_cast<std::size_t>(one.intrinsics)];
    return std::ranges::all_of(users, [](int count) { return count < 2; });
  }
  void CopyValues() {
    for (const BundleCamera& one : from_.cameras) {
      cameras_.insert(cameras_.end(), one.position.begin(), one.position.end());
      cameras_.insert(cameras_.end(), one.orientation.begin(), one.orientation.end());
      if (!own_lens_) continue;
      const auto& own = from_.intrinsics[static_cast<std::size_t>(one.intrinsics)];
      cameras_.insert(cameras_.end(), own.begin(), own.end());
    }
    for (const auto& one : from_.intrinsics) lenses_.insert(lenses_.end(), one.begin(), one.end());
    for (const auto& one : from_.points) points_.insert(points_.end(), one.begin(), one.end());
  }
  /// The kind of cost with W = L^-1, made when it is first asked for.
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
          own_lens_ ? RolePlace{0, kPose} : RolePlace{2, 0};
    }
    if (separate_lens()) sizes.push_back(lens_.ambient);
    kind = std::make_unique<CostKind<SensorModel>>(sensor_, places, sizes, w);
    return *kind;
  }
  void Add(const BundleObservation& seen) {
    const int m = sensor_.measurement().geometry.tangent;
    RowMajor l(m, m);
    const Status status =
        sensor_.SqrtNoise(RoleValues(roles_, from_, seen).data(), seen.z.data(), l.data());
    if (status != Status::kOk) return;
    std::vector<double> w(static_cast<std::size_t>(m * m));
    Eigen::Map<RowMajor>(w.data(), m, m) =
        l.triangularView<Eigen::Lower>().solve(RowMajor::Identity(m, m));
    auto* const cost = new SensorCost<SensorModel>(KindOf(w), seen.z.data());
    const bool robust = options_.loss.kind != LossKind::kNone;
    std::vector<double*> blocks = {camera(seen.camera), point(seen.point)};
    if (separate_lens())
      blocks.push_back(lens(from_.cameras[static_cast<std::size_t>(seen.camera)].intrinsics));
    problem_.AddResidualBlock(cost, robust ? new Loss(options_.loss) : nullptr, blocks);
  }
  void AddManifolds() {
    const Geometry position = Geometry::Vector(3), orientation = Geometry::UnitQuaternion();
    bool first = true;
    for (int i = 0; i < static_cast<int>(from_.cameras.size()); ++i) {
      if (!problem_.HasParameterBlock(camera(i))) continue;
      std::vector<GeometryManifold::Part> parts = {{position, first}, {orientation, first}};
      if (own_lens_) AddLens(parts);
      if (first && !own_lens_) {
        problem_.SetParameterBlockConstant(camera(i));
      } else {
        problem_.SetManifold(camera(i), new GeometryManifold(parts));
      }
      first = false;
    }
    for (int i = 0; separate_lens() && i < static_cast<int>(from_.intrinsics.size()); ++i) {
      if (!problem_.HasParameterBlock(lens(i))) continue;
      std::vector<GeometryManifold::Part> parts;
      AddLens(parts);
      if (all_fixed()) {
        problem_.SetParameterBlockConstant(lens(i));
      } else {
        problem_.SetManifold(lens(i), new GeometryManifold(parts));
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
  const BundleProblem& from_;
  const BundleOptions& options_;
  Geometry lens_;
  std::vector<bool> fixed_;  ///< elements of the intrinsics
  bool own_lens_ = false;    ///< in the block of the camera
  std::vector<double> cameras_, lenses_, points_;
  std::map<std::vector<double>, std::unique_ptr<CostKind<SensorModel>>> kinds_;  ///< by W
  ceres::Problem problem_;
};

/// Points are eliminated first, or cameras where they have more unknowns: either see but the other.
void Bundle::Eliminate(ceres::Solver::Options& options) {
  int cameras = 0, points = 0;
  const auto count = [&](const double* block, int& sum) {
    if (problem_.HasParameterBlock(block) && !problem_.IsParameterBlockConstant(block))
      sum += problem_.ParameterBlockTangentSize(block);
  };
  for (int i = 0; i < static_cast<int>(from_.cameras.size()); ++i) count(camera(i), cameras);
  for (int i = 0; i < static_cast<int>(from_.points.size()); ++i) count(point(i), points);
  const bool points_first = points >= cameras;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  const auto add = [&](double* block, int group) {
    if (problem_.HasParameterBlock(block)) ordering->AddElementToGroup(block, group);
  };
  for (int i = 0; i < static_cast<int>(from_.points.size()); ++i)
    add(point(i), points_first ? 0 : 1);
  for (int i = 0; i < static_cast<int>(from_.cameras.size()); ++i)
    add(camera(i), points_first ? 1 : 0);
  for (int i = 0; i < static_cast<int>(from_.intrinsics.size()); ++i) add(lens(i), 1);
  options.linear_solver_ordering = ordering;
  constexpr int kDense = 1000;  // unknowns that are left
  options.linear_solver_type =
      std::min(cameras, points) <= kDense ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
}

/// Ceres compares a step with the norm of all unknowns: one point very far away would let any step
/// pass. So the tolerance is scaled to the norm that the points, of which there must be one, would
/// have if all coordinates were of the median size.
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
  // A cost is a sum of squares, known to about epsilon times the root of their number.
  const double rounding = std::numeric_limits<double>::epsilon() *
                          std::sqrt(static_cast<double>(std::max(1, problem_.NumResiduals())));
  options.function_tolerance = std::max(options_.function_tolerance, rounding);
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = StepTolerance();
  // A step that cannot be computed halves the trust region; from a far start it takes some of them.
  options.max_num_consecutive_invalid_steps = 50;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  return options;
}

BundleResult Bundle::Solve() {
  Watch watch(options_);
  ceres::Solver::Options options = SolverOptions();
  Eliminate(options);
  options.callbacks = {&watch};
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  BundleResult result;
  result.message = summary.message;
  result.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  result.cost_before = summary.initial_cost;
  result.cost_after = summary.final_cost;
  result.residuals = problem_.NumResiduals();
  result.unknowns = summary.num_effective_parameters_reduced;
  if (summary.termination_type == ceres::CONVERGENCE) result.end = BundleEnd::kConverged;
  if (summary.termination_type == ceres::NO_CONVERGENCE) result.end = BundleEnd::kOutOfIterations;
  if (summary.termination_type == ceres::USER_SUCCESS) result.end = BundleEnd::kStopped;
  if (result.unknowns <= kBundleRankUnknowns) result.rank = Rank();
  return result;
}

/// Of dr/dx, columns scaled to length 1; -1 where it is not finite. It is that of R in dr/dx = Q R,
/// which is made of a few rows at a time: dr/dx itself would need much memory.
int Bundle::Rank() {
  std::vector<double*> blocks, moved;
  problem_.GetParameterBlocks(&blocks);
  std::ranges::copy_if(blocks, std::back_inserter(moved), [&](const double* block) {
    return !problem_.IsParameterBlockConstant(block);
  });
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = moved;
  options.apply_loss_function = false;
  ceres::CRSMatrix sparse;
  if (!problem_.Evaluate(options, nullptr, nullptr, nullptr, &sparse)) return -1;
  const int n = sparse.num_cols, some = 4 * n;
  if (n == 0) return 0;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(n + some, n);  // R of those so far, and more
  for (int first = 0; first < sparse.num_rows; first += some) {
    for (int r = first; r < std::min(first + some, sparse.num_rows); ++r) {
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
  constexpr double kNothing = 1e-9;
  return internal::RankOf(rows.topRows(n), kNothing);
}

void Bundle::CopyTo(BundleProblem& to) const {
  for (std::size_t i = 0; i < to.cameras.size(); ++i) {
    const double* const from = cameras_.data() + i * static_cast<std::size_t>(camera_size());
    std::copy_n(from, 3, to.cameras[i].position.data());
    std::copy_n(from + 3, 4, to.cameras[i].orientation.data());
    if (own_lens_) {
      auto& own = to.intrinsics[static_cast<std::size_t>(to.cameras[i].intrinsics)];
      std::copy_n(from + kPose, own.size(), own.data());
    }
  }
  for (std::size_t i = 0; separate_lens() && i < to.intrinsics.size(); ++i)
    std::copy_n(lenses_.data() + i * to.intrinsics[i].size(), to.intrinsics[i].size(),
                to.intrinsics[i].data());
  for (std::size_t i = 0; i < to.points.size(); ++i)
    std::copy_n(points_.data() + i * kPoint, kPoint, to.points[i].data());
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
