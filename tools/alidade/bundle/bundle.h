// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "alidade/estimation/models.h"
#include "alidade/estimation/robust_loss.h"
#include "alidade/plugin/cpp_plugin.h"
#include "alidade/plugin/plugin_host.h"

/// Bundle adjustment: joint estimation of cameras, intrinsics and points from pixels.
///
///   argmin  sum_i rho(|r_i|),   r_i = L^-1 (z_i (-) h(camera_i, point_i)),   R = L L'
///
/// h is a sensor model with the roles `position`, `orientation` and optionally `intrinsics`. One
/// other role is the point. rho(d) is d^2 / 2 or a robust loss.
namespace alidade {

/// Pose of a camera and the index of its intrinsics.
struct BundleCamera {
  std::array<double, 3> position{};               ///< position in the world
  std::array<double, 4> orientation{1, 0, 0, 0};  ///< quaternion world_from_cam, w x y z
  int intrinsics = 0;                             ///< index into BundleProblem::intrinsics
};

/// Measurement `z` of point `point` by camera `camera`. The sensor model determines the size of z.
struct BundleObservation {
  int camera = 0, point = 0;
  std::array<double, 4> z{};
  bool used = true;  ///< false: ExcludeUndefined() has excluded the observation
};

struct BundleProblem {
  /// Entry of the sensor in YAML, as in a config: `model` and the parameters of the model.
  std::string sensor;
  std::vector<BundleCamera> cameras;
  std::vector<std::vector<double>> intrinsics;  ///< empty if the sensor has no role `intrinsics`
  std::vector<std::string> fixed;  ///< elements of the intrinsics that always remain constant
  std::vector<std::array<double, 3>> points;  ///< positions in the world
  std::vector<BundleObservation> observations;
};

/// Bounds of the scale of a robust loss, in standard deviations. Below the lower bound, all
/// residuals exceed the scale and the gradient vanishes. Above the upper bound, no residual exceeds
/// the scale.
inline constexpr double kBundleLossScaleMin = 1e-3, kBundleLossScaleMax = 1e6;

struct BundleOptions {
  int max_iterations = 500;
  /// The solution has converged if a step changes the cost by at most this fraction. A change
  /// within the rounding error of the cost counts as no change for any tolerance.
  double function_tolerance = 1e-8;
  RobustLoss loss;
  /// Elements of the intrinsics to fix, besides BundleProblem::fixed; `intrinsics` fixes all.
  std::vector<std::string> fixed;
  std::function<bool()> stop;         ///< if it returns true, the current iteration is the last
  std::function<void(int)> progress;  ///< called with the number of completed iterations
};

enum class BundleEnd { kConverged, kOutOfIterations, kStopped, kFailed };
/// Returns `converged`, `out_of_iterations`, `stopped` or `failed`.
const char* ToString(BundleEnd end);

/// Step that the solver tried. A step that is not accepted is undone.
struct BundleIteration {
  double cost = 0.0;      ///< cost after the step
  double gradient = 0.0;  ///< largest magnitude among the elements of the gradient
  bool accepted = true;
};

/// Result of a bundle adjustment.
struct BundleResult {
  BundleEnd end = BundleEnd::kFailed;
  std::string message;                 ///< message of the solver
  int iterations = 0;                  ///< number of steps that the solver tried
  std::vector<BundleIteration> steps;  ///< the start, followed by the steps
  double cost_before = 0.0, cost_after = 0.0;
  int residuals = 0;  ///< number of scalar residuals
  int unknowns = 0;   ///< number of estimated tangent elements; the constant first pose is excluded
  /// Extent of the problem: the median distance from the first used camera to the other used
  /// cameras. If this median is 0, it is replaced by the median distance to the used points. If
  /// there are no such distances, the extent is 0.
  double extent_before = 0.0, extent_after = 0.0;
  /// Rank of the Jacobian at the solution. It is -1 if there are more than kBundleRankUnknowns
  /// unknowns, or if the Jacobian is not finite.
  int rank = -1;
};
inline constexpr int kBundleRankUnknowns = 600;

/// Indices of the roles of a bundle adjustment in SensorModel::roles().
struct BundleRoles {
  std::size_t position, orientation, point;
  int intrinsics = -1;  ///< -1: the sensor does not have this role
};
/// Finds the roles by name. A role of three numbers with any other name is the point. Error:
/// kInternal if the sensor is not a camera, or does not measure 1 to 4 numbers.
BundleRoles RolesOf(const SensorModel& sensor);
/// Returns a pointer to the value of each role for an observation, in the order of
/// SensorModel::roles(). The values belong to `problem`.
std::vector<const double*> RoleValues(const BundleRoles& roles, const BundleProblem& problem,
                                      const BundleObservation& observation);

/// Returns a flag for each element of the intrinsics. The flag is true if the element is fixed. The
/// result is empty if the sensor does not have the role `intrinsics`. Error: kUsage if `fixed`
/// contains the name of an unknown element.
std::vector<bool> FixedElements(const SensorModel& sensor, const std::vector<std::string>& fixed);

/// Creates the sensor of `problem`. Errors: kPlugin, kBadConfig.
SharedSensor BundleSensor(const PluginHost& host, const BundleProblem& problem);

/// Sets BundleObservation::used to false if h is undefined or |z (-) h|^2 is not finite at the
/// values of the problem, otherwise to true. h is undefined for a point behind the camera. For a
/// projective camera, h is undefined only for a point in the plane of the camera. Returns the
/// number of excluded observations.
int ExcludeUndefined(const SensorModel& sensor, BundleProblem& problem);

/// Computes the residual z (-) h of each observation. The residual of an unused observation, an
/// undefined residual, and the elements beyond the size of z are NaN.
std::vector<std::array<double, 4>> BundleResiduals(const SensorModel& sensor,
                                                   const BundleProblem& problem);

/// Computes the unweighted RMS reprojection error of the used observations:
///
///   rms = sqrt(sum_i |z_i (-) h_i|^2 / n),   n = number of used observations
///
/// The unit is that of z, px. Returns 0 if no observation is used.
double BundleRms(const SensorModel& sensor, const BundleProblem& problem);

inline constexpr const char* kBundleAdjusterKind = "bundle adjuster";

/// Entry that a bundle adjustment plugin exports. It contains the adjustment function.
struct BundleAdjusterEntry {
  BundleResult (*adjust)(const SensorModel& sensor, BundleProblem& problem,
                         const BundleOptions& options);
};
constexpr CppEntry EntryOf(const BundleAdjusterEntry& adjuster) {
  return {kBundleAdjusterKind, "bundle", "", "", "", &adjuster};
}

/// Adjusts cameras, points and the free intrinsics of `problem` to minimise the cost. The pose of
/// the first used camera is constant. A sensor that measures at most two numbers does not determine
/// the scale. For such a sensor, the solution is scaled about the first camera to the initial
/// extent (BundleResult). The plugin of the Ceres solver computes the solution. This plugin is
/// loaded from `folder` at the first use, or from the folder of the library if `folder` is empty.
/// Errors: kPlugin if the plugin is missing; kNotTrusted; kBadData if no observation is used;
/// kUsage as for FixedElements(), and if the scale of the loss is out of bounds.
BundleResult AdjustBundle(const SensorModel& sensor, BundleProblem& problem,
                          const BundleOptions& options, const std::filesystem::path& folder = {});

/// Describes the quantities that the used observations do not determine. Each line describes one
/// quantity: the gauge, separate components, points observed once, directions without information.
std::vector<std::string> DescribeUndetermined(const BundleProblem& problem,
                                              const SensorModel& sensor,
                                              const BundleResult& result);

}  // namespace alidade

/// Exports the bundle adjustment of this plugin: ALIDADE_BUNDLE_PLUGIN(&Adjust)
#define ALIDADE_BUNDLE_PLUGIN(adjust) ALIDADE_CPP_PLUGIN(alidade::BundleAdjusterEntry, {adjust})
