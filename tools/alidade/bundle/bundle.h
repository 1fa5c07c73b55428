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
/// h is a sensor model with the roles `position`, `orientation`, optionally `intrinsics`, and one
/// more role, the point. rho(d) = d^2 / 2, or the robust loss.
namespace alidade {

/// Pose of a camera and the index of its intrinsics.
struct BundleCamera {
  std::array<double, 3> position{};               ///< in the world
  std::array<double, 4> orientation{1, 0, 0, 0};  ///< world_from_cam, w x y z
  int intrinsics = 0;                             ///< index into BundleProblem::intrinsics
};

/// Measurement `z` of point `point` by camera `camera`. The sensor model determines the size of z.
struct BundleObservation {
  int camera = 0, point = 0;
  std::array<double, 4> z{};
  bool used = true;  ///< false: excluded by ExcludeUndefined
};

struct BundleProblem {
  /// Sensor in YAML, as in a config: `model` and its parameters.
  std::string sensor;
  std::vector<BundleCamera> cameras;
  std::vector<std::vector<double>> intrinsics;  ///< empty if the sensor has no such role
  std::vector<std::array<double, 3>> points;    ///< in the world
  std::vector<BundleObservation> observations;
};

/// Bounds of the scale of a robust loss, in standard deviations. Below the lower bound all
/// residuals exceed the scale and the gradient vanishes; above the upper bound no residual does.
inline constexpr double kBundleLossScaleMin = 1e-3, kBundleLossScaleMax = 1e6;

struct BundleOptions {
  int max_iterations = 500;
  /// The solution has converged if a step changes the cost by at most this fraction. A change
  /// within the rounding error of the cost counts as no change, whatever the tolerance.
  double function_tolerance = 1e-8;
  RobustLoss loss;
  std::vector<std::string> fixed;     ///< constant elements of the intrinsics; `intrinsics`: all
  std::function<bool()> stop;         ///< returns true to end after the current iteration
  std::function<void(int)> progress;  ///< receives the number of completed iterations
};

enum class BundleEnd { kConverged, kOutOfIterations, kStopped, kFailed };
/// Returns `converged`, `out_of_iterations`, `stopped` or `failed`.
const char* ToString(BundleEnd end);

/// Result of a bundle adjustment.
struct BundleResult {
  BundleEnd end = BundleEnd::kFailed;
  std::string message;  ///< of the solver
  int iterations = 0;   ///< steps tried
  double cost_before = 0.0, cost_after = 0.0;
  int residuals = 0;  ///< scalars
  int unknowns = 0;   ///< estimated tangent elements, without the constant first pose
  /// Median distance from the first used camera to the other used cameras. If these are all at one
  /// position, the median distance to the used points. 0 if there are no distances.
  double extent_before = 0.0, extent_after = 0.0;
  /// Rank of the Jacobian at the solution. -1 if it was not computed: more unknowns than
  /// kBundleRankUnknowns, or a Jacobian that is not finite.
  int rank = -1;
};
inline constexpr int kBundleRankUnknowns = 600;

/// Indices of a camera's roles among the roles of its sensor model.
struct BundleRoles {
  std::size_t position, orientation, point;
  int intrinsics = -1;  ///< -1: the sensor has no such role
};
/// Finds the roles by name; the point is the role with any other name. Error: kInternal if the
/// sensor is not a camera, or does not measure 1 to 4 numbers.
BundleRoles RolesOf(const SensorModel& sensor);
/// Returns pointers into `problem` to the values of an observation's roles, in the sensor's order.
std::vector<const double*> RoleValues(const BundleRoles& roles, const BundleProblem& problem,
                                      const BundleObservation& observation);

/// Returns for each element of the intrinsics whether it is fixed; empty if the sensor has no such
/// role. Error: kUsage if `fixed` names an unknown element.
std::vector<bool> FixedElements(const SensorModel& sensor, const std::vector<std::string>& fixed);

/// Creates the sensor of `problem`. Errors: kPlugin, kBadConfig.
SharedSensor BundleSensor(const PluginHost& host, const BundleProblem& problem);

/// Clears BundleObservation::used for observations whose h is undefined at the problem's values (a
/// point behind its camera; for a projective camera, a point in the camera's plane), and for those
/// whose |z (-) h|^2 is not finite. Returns the number of excluded observations.
int ExcludeUndefined(const SensorModel& sensor, BundleProblem& problem);

/// Computes the unweighted RMS reprojection error of the used observations:
///
///   rms = sqrt(sum_i |z_i (-) h_i|^2 / n),   n the number of observations
///
/// in the unit of z, px; 0 if no observation is used.
double BundleRms(const SensorModel& sensor, const BundleProblem& problem);

inline constexpr const char* kBundleAdjusterKind = "bundle adjuster";

/// Factory that a bundle adjustment plugin exports: the adjustment function itself.
struct BundleAdjusterEntry {
  BundleResult (*adjust)(const SensorModel& sensor, BundleProblem& problem,
                         const BundleOptions& options);
};
constexpr CppEntry EntryOf(const BundleAdjusterEntry& adjuster) {
  return {kBundleAdjusterKind, "bundle", "", "", "", &adjuster};
}

/// Adjusts cameras, points and the free intrinsics of `problem` to minimise the cost. The pose of
/// the first used camera is constant. Two measured numbers do not determine the scale: cameras and
/// points are then scaled about the first camera after the solution, to restore the initial extent
/// (BundleResult). The plugin of the Ceres solver computes the solution. It is loaded at the first
/// use, from `folder`, or if that is "" from the folder of the library.
/// Errors: kPlugin if the plugin is missing; kNotTrusted; kBadData if no observation is used;
/// kUsage as FixedElements, and if the scale of the loss is out of bounds.
BundleResult AdjustBundle(const SensorModel& sensor, BundleProblem& problem,
                          const BundleOptions& options, const std::filesystem::path& folder = {});

/// Describes the quantities that the used observations do not determine, in one line each: the
/// gauge, separate components, points observed once, directions without information.
std::vector<std::string> DescribeUndetermined(const BundleProblem& problem,
                                              const SensorModel& sensor,
                                              const BundleResult& result);

}  // namespace alidade

/// Exports the bundle adjustment of this plugin: ALIDADE_BUNDLE_PLUGIN(&Adjust)
#define ALIDADE_BUNDLE_PLUGIN(adjust) ALIDADE_CPP_PLUGIN(alidade::BundleAdjusterEntry, {adjust})
