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

/// Bundle adjustment: cameras and the points that they see, estimated together from the pixels.
///
///   argmin  sum_i rho(|r_i|),   r_i = L^-1 (z_i (-) h(camera_i, point_i)),   R = L L'
///
/// h is a sensor model: its roles `position`, `orientation`, where it has one `intrinsics`, and one
/// more, the point. rho(d) = d^2 / 2, or the robust loss.
namespace alidade {

/// Where a camera stands, and which intrinsics it has.
struct BundleCamera {
  std::array<double, 3> position{};               ///< in the world
  std::array<double, 4> orientation{1, 0, 0, 0};  ///< world_from_cam, w x y z
  int intrinsics = 0;                             ///< index into BundleProblem::intrinsics
};

/// Camera `camera` sees point `point` at `z`, of which the sensor's measurement says the size.
struct BundleObservation {
  int camera = 0, point = 0;
  std::array<double, 4> z{};
  bool used = true;  ///< false: left out, see LeaveOutUndefined
};

struct BundleProblem {
  /// The sensor as a config writes it, YAML: `model` and its parameters.
  std::string sensor;
  std::vector<BundleCamera> cameras;
  std::vector<std::vector<double>> intrinsics;  ///< empty where the sensor has no such role
  std::vector<std::array<double, 3>> points;    ///< in the world
  std::vector<BundleObservation> observations;
};

/// The scales of a robust loss that an adjustment accepts, in standard deviations. Below them all
/// residuals lie beyond the scale and the gradient vanishes; above them none does.
inline constexpr double kBundleLossScaleMin = 1e-3, kBundleLossScaleMax = 1e6;

struct BundleOptions {
  int max_iterations = 500;
  /// Converged where a step changes the cost by no more than this fraction. A change within the
  /// rounding of the cost counts as none, whatever the tolerance.
  double function_tolerance = 1e-8;
  RobustLoss loss;
  std::vector<std::string> fixed;     ///< elements of the intrinsics, or `intrinsics`: all of them
  std::function<bool()> stop;         ///< true: end after the iteration
  std::function<void(int)> progress;  ///< iterations done
};

enum class BundleEnd { kConverged, kOutOfIterations, kStopped, kFailed };
/// `converged`, `out_of_iterations`, `stopped`, `failed`.
const char* ToString(BundleEnd end);

/// What became of an adjustment.
struct BundleResult {
  BundleEnd end = BundleEnd::kFailed;
  std::string message;  ///< of the solver
  int iterations = 0;   ///< steps tried
  double cost_before = 0.0, cost_after = 0.0;
  int residuals = 0;  ///< scalars
  int unknowns = 0;   ///< tangent elements that were estimated, the constant first pose left out
  /// Median distance from the first camera to the other cameras, or where these stand at one place
  /// to the points, of those used; 0: there is none.
  double extent_before = 0.0, extent_after = 0.0;
  /// Of the Jacobian at the solution; -1: of more than kBundleRankUnknowns, or where that has no
  /// finite one.
  int rank = -1;
};
inline constexpr int kBundleRankUnknowns = 600;

/// Which of a sensor's roles is what.
struct BundleRoles {
  std::size_t position, orientation, point;
  int intrinsics = -1;  ///< -1: it has none
};
/// Roles by their names; the point is the one that is called otherwise. Error: kInternal where a
/// sensor is no camera, or measures other than 1 to 4 numbers.
BundleRoles RolesOf(const SensorModel& sensor);
/// The values of an observation's roles, in the order of the sensor; they live in `problem`.
std::vector<const double*> RoleValues(const BundleRoles& roles, const BundleProblem& problem,
                                      const BundleObservation& seen);

/// Whether each element of the intrinsics is fixed; empty where the sensor has no such role. Error:
/// kUsage where `fixed` names another.
std::vector<bool> FixedElements(const SensorModel& sensor, const std::vector<std::string>& fixed);

/// The sensor that `problem` names. Errors: kPlugin, kBadConfig.
SharedSensor BundleSensor(const PluginHost& host, const BundleProblem& problem);

/// Leaves out, by BundleObservation::used, the observations for which the sensor is not defined at
/// the problem's values (a point behind its camera; for a projective camera, in its plane), and
/// those whose |z (-) h|^2 is not finite. Returns how many.
int LeaveOutUndefined(const SensorModel& sensor, BundleProblem& problem);

/// Errors of the observations used, all measured values alike:
///
///   rms = sqrt(sum_i |z_i (-) h_i|^2 / n),   n the number of observations
///
/// in the unit of z, px; 0 where none is used.
double BundleRms(const SensorModel& sensor, const BundleProblem& problem);

inline constexpr const char* kBundleAdjusterKind = "bundle adjuster";

/// The factory of a bundle adjustment: the adjustment itself.
struct BundleAdjusterEntry {
  BundleResult (*adjust)(const SensorModel& sensor, BundleProblem& problem,
                         const BundleOptions& options);
};
constexpr CppEntry EntryOf(const BundleAdjusterEntry& adjuster) {
  return {kBundleAdjusterKind, "bundle", "", "", "", &adjuster};
}

/// Moves cameras, points and, but for what is fixed, intrinsics of `problem` to the minimum. The
/// pose of the first camera that is used stays. If the sensor measures two numbers, which cannot
/// determine the scale, cameras and points are scaled about the first camera after the solution, so
/// that the extent (BundleResult) is that of the start. Done by the plugin of the Ceres solver,
/// loaded when it is first asked for, from `folder`, or if that is "" from next to the library.
/// Errors: kPlugin where there is none, kNotTrusted; kBadData where no observation is used; kUsage
/// as FixedElements, and for a scale of the loss out of its bounds.
BundleResult AdjustBundle(const SensorModel& sensor, BundleProblem& problem,
                          const BundleOptions& options, const std::filesystem::path& folder = {});

/// What the observations used do not determine, in words, a line each: the gauge, parts that share
/// no observation, points seen once, directions without any information.
std::vector<std::string> Undetermined(const BundleProblem& problem, const SensorModel& sensor,
                                      const BundleResult& result);

}  // namespace alidade

/// Exports the bundle adjustment of this plugin: ALIDADE_BUNDLE_PLUGIN(&Adjust)
#define ALIDADE_BUNDLE_PLUGIN(adjust) ALIDADE_CPP_PLUGIN(alidade::BundleAdjusterEntry, {adjust})
