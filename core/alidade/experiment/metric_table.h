// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

namespace alidade {

/// Kind of subject that the key of a metric names.
enum class MetricSubject { kRun, kBlock, kOwner, kSensor };

/// Unit of a metric.
enum class MetricUnit {
  kNone,
  kSubject,  ///< unit of the block, or of the block that the sensor implies
  kMetre,
  kMillisecond,
  kMicrosecond,
  kFrames,
  kShare,  ///< 0 to 1, displayed in %
};

/// Best value of a metric.
enum class MetricGoal { kNone, kZero, kOne, k95Percent };

/// How the samples of a run are reduced to the metric.
enum class MetricReduction { kMean, kRootMean, kSum, kLast };

/// Section of a comparison that shows a metric.
enum class MetricSection {
  kNone,
  kAlong,  ///< value over the run
  kFinal,  ///< value at the end of the run
};

/// Error of a block at one timestamp.
struct BlockSample {
  double square;                ///< |e|^2, infinite if e is not finite
  double error;                 ///< first element of e
  std::optional<double> sigma;  ///< sigma of e; set only for a scalar block with a variance
};
/// Joint error of the blocks of an owner at one timestamp.
struct OwnerSample {
  double nees;
  int dof;
  double bound95;  ///< chi2(0.95, dof)
};
/// Innovation of one measurement that was accepted, or that the gate rejected.
struct SensorSample {
  double nis;
  int dof;
  double log_det_s;
  bool is_accepted;
};
/// Error of the state that one measurement implies without a filter.
struct ImpliedSample {
  double square;
};

/// Description of a metric: its meaning, its accumulation over a run, and the tables that show it.
/// A sampled metric has exactly one of the four sample functions. Separate code computes the other
/// metrics.
struct MetricInfo {
  const char* name;
  const char* meaning;  ///< description in the documentation, in Markdown
  MetricSubject subject;
  MetricUnit unit = MetricUnit::kNone;
  MetricGoal goal = MetricGoal::kNone;
  bool needs_truth = true;

  // Sample functions: each function returns the value of the metric for one timestamp or
  // measurement, or nullopt if there is no value.
  std::optional<double> (*block)(const BlockSample&) = nullptr;
  std::optional<double> (*owner)(const OwnerSample&) = nullptr;
  std::optional<double> (*sensor)(const SensorSample&) = nullptr;
  std::optional<double> (*implied)(const ImpliedSample&) = nullptr;
  MetricReduction reduction = MetricReduction::kMean;
  bool has_segments = false;  ///< true if the metric is also computed for each segment

  bool is_shown = false;             ///< true if the tables of `run` and `sweep` show the metric
  bool is_shown_by_segment = false;  ///< true if these tables also show each segment
  int priority = 0;                  ///< relevance for the table of `run`, from 1; 0: not relevant

  MetricSection section = MetricSection::kNone;
  const char* label = "";  ///< name of the metric in a comparison
  bool is_main = false;    ///< true if the short form of a comparison shows it
  bool has_ratio = false;  ///< true if a comparison shows its ratio to the reference
  bool is_ratio = false;   ///< true if the metric is a ratio of means over the runs
  bool is_cost = false;    ///< true if the metric is a cost, which does not depend on the estimate
};

/// All metrics, in the order of the tables. To add a sampled metric, add one entry.
inline constexpr std::array kMetrics = {
    MetricInfo{.name = "rmse",
               .meaning = "sqrt(mean \\|e\\|^2); infinite if an estimate is not finite",
               .subject = MetricSubject::kBlock,
               .unit = MetricUnit::kSubject,
               .goal = MetricGoal::kZero,
               .block = [](const BlockSample& s) -> std::optional<double> { return s.square; },
               .reduction = MetricReduction::kRootMean,
               .has_segments = true,
               .is_shown = true,
               .is_shown_by_segment = true,
               .priority = 1,
               .section = MetricSection::kAlong,
               .label = "rmse",
               .is_main = true,
               .has_ratio = true},
    MetricInfo{.name = "mse_by_bound",
               .meaning = "`compare`: mean square error divided by the Cramer-Rao bound",
               .subject = MetricSubject::kBlock,
               .goal = MetricGoal::kOne,
               .section = MetricSection::kAlong,
               .label = "MSE / Cramer-Rao bound,",
               .is_main = true,
               .is_ratio = true},
    MetricInfo{.name = "implied.rmse",
               .meaning =
                   "RMSE of the block values that single measurements of the sensor imply "
                   "without a filter (`implied_states.csv`). The RMSE of a useful filter is "
                   "smaller. Includes gated measurements; all other roles have their true values",
               .subject = MetricSubject::kSensor,
               .unit = MetricUnit::kSubject,
               .goal = MetricGoal::kZero,
               .implied = [](const ImpliedSample& s) -> std::optional<double> { return s.square; },
               .reduction = MetricReduction::kRootMean,
               .has_segments = true,
               .is_shown = true,
               .section = MetricSection::kAlong,
               .label = "rmse of single measurements,"},
    MetricInfo{.name = "trajectory.sim3.rmse",
               .meaning = "for a problem with landmarks: RMSE of the position after alignment by "
                          "the similarity that minimises this RMSE [Umeyama1991]",
               .subject = MetricSubject::kRun,
               .unit = MetricUnit::kMetre,
               .goal = MetricGoal::kZero,
               .section = MetricSection::kAlong,
               .label = "Sim3-aligned trajectory",
               .is_main = true,
               .has_ratio = true},
    MetricInfo{.name = "trajectory.sim3.scale",
               .meaning = "scale of the similarity of `trajectory.sim3.rmse`, which maps the "
                          "estimate to truth",
               .subject = MetricSubject::kRun,
               .goal = MetricGoal::kOne,
               .section = MetricSection::kAlong,
               .label = "trajectory, scale"},
    MetricInfo{.name = "rmsd",
               .meaning = "`compare`: root mean square difference from the reference estimator",
               .subject = MetricSubject::kBlock,
               .unit = MetricUnit::kSubject,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .section = MetricSection::kAlong,
               .label = "RMSD",
               .is_main = true},
    MetricInfo{.name = "trajectory.sim3.rmsd",
               .meaning = "`compare`: RMSD of the Sim(3)-aligned trajectory, if the scale of the "
                          "problem is not observable",
               .subject = MetricSubject::kRun,
               .unit = MetricUnit::kMetre,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .section = MetricSection::kAlong,
               .label = "RMSD, Sim3-aligned trajectory",
               .is_main = true},
    MetricInfo{.name = "rmsd.sigmas",
               .meaning = "`compare`: RMSD in sigmas of the reference estimator",
               .subject = MetricSubject::kOwner,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .section = MetricSection::kAlong,
               .label = "RMSD in sigmas",
               .is_main = true},
    MetricInfo{.name = "lag_ms",
               .meaning =
                   "delay of the estimate relative to truth, see [Lag](metrics.md#lag); positive "
                   "if the estimate is late; only for scalar blocks",
               .subject = MetricSubject::kBlock,
               .unit = MetricUnit::kMillisecond,
               .goal = MetricGoal::kZero,
               .is_shown = true},
    MetricInfo{.name = "coverage95",
               .meaning = "share of timestamps with \\|e\\| <= 1.96 sigma; only for scalar blocks",
               .subject = MetricSubject::kBlock,
               .unit = MetricUnit::kShare,
               .goal = MetricGoal::k95Percent,
               .block = [](const BlockSample& s) -> std::optional<double> {
                 constexpr double kNormal95 = 1.959963984540054;
                 if (!s.sigma) return std::nullopt;
                 return std::abs(s.error) <= kNormal95 * *s.sigma ? 1.0 : 0.0;
               },
               .has_segments = true,
               .is_shown = true,
               .is_shown_by_segment = true,
               .priority = 8},
    MetricInfo{
        .name = "nees.mean",
        .meaning = "mean of e' C^-1 e / dof; e contains the errors of all estimated blocks of "
                   "the owner that have truth",
        .subject = MetricSubject::kOwner,
        .goal = MetricGoal::kOne,
        .owner = [](const OwnerSample& s) -> std::optional<double> { return s.nees / s.dof; },
        .has_segments = true,
        .is_shown = true,
        .priority = 2,
        .section = MetricSection::kAlong,
        .label = "NEES",
        .is_main = true},
    MetricInfo{.name = "nees.low",
               .meaning = "lower 95 % bound of `nees.mean`, see "
                          "[Bounds](metrics.md#bounds-of-nees-and-nis)",
               .subject = MetricSubject::kOwner},
    MetricInfo{.name = "nees.high",
               .meaning = "upper 95 % bound of `nees.mean`",
               .subject = MetricSubject::kOwner},
    MetricInfo{.name = "nees.dof",
               .meaning = "mean number of error elements in the NEES over the timestamps",
               .subject = MetricSubject::kOwner,
               .owner = [](const OwnerSample& s) -> std::optional<double> { return s.dof; }},
    MetricInfo{.name = "nees.within95",
               .meaning = "share of timestamps with e' C^-1 e <= chi2(0.95, dof)",
               .subject = MetricSubject::kOwner,
               .unit = MetricUnit::kShare,
               .goal = MetricGoal::k95Percent,
               .owner = [](const OwnerSample& s) -> std::optional<double> {
                 return s.nees <= s.bound95 ? 1.0 : 0.0;
               },
               .has_segments = true,
               .is_shown = true,
               .is_shown_by_segment = true,
               .section = MetricSection::kAlong,
               .label = "in the 95 % region"},
    MetricInfo{.name = "nis.mean",
               .meaning = "mean of r' S^-1 r / dof over accepted measurements",
               .subject = MetricSubject::kSensor,
               .goal = MetricGoal::kOne,
               .needs_truth = false,
               .sensor = [](const SensorSample& s) -> std::optional<double> {
                 if (!s.is_accepted) return std::nullopt;
                 return s.nis / s.dof;
               },
               .has_segments = true,
               .is_shown = true,
               .priority = 3,
               .section = MetricSection::kAlong,
               .label = "NIS"},
    MetricInfo{
        .name = "nis.all",
        .meaning = "mean of r' S^-1 r / dof over all measurements, also those that the gate "
                   "rejected",
        .subject = MetricSubject::kSensor,
        .goal = MetricGoal::kOne,
        .needs_truth = false,
        .sensor = [](const SensorSample& s) -> std::optional<double> { return s.nis / s.dof; },
        .has_segments = true,
        .is_shown = true},
    MetricInfo{.name = "log_likelihood",
               .meaning = "-1/2 sum (dof log 2 pi + log det S + r' S^-1 r) over all measurements, "
                          "also those that the gate rejected",
               .subject = MetricSubject::kSensor,
               .needs_truth = false,
               .sensor = [](const SensorSample& s) -> std::optional<double> {
                 constexpr double kLog2Pi = 1.8378770664093453;
                 if (std::isnan(s.log_det_s)) return std::nullopt;
                 return -0.5 * (s.dof * kLog2Pi + s.log_det_s + s.nis);
               },
               .reduction = MetricReduction::kSum,
               .has_segments = true},
    MetricInfo{.name = "nis.low",
               .meaning = "lower 95 % bound of `nis.mean`, see "
                          "[Bounds](metrics.md#bounds-of-nees-and-nis)",
               .subject = MetricSubject::kSensor,
               .needs_truth = false},
    MetricInfo{.name = "nis.high",
               .meaning = "upper 95 % bound of `nis.mean`",
               .subject = MetricSubject::kSensor,
               .needs_truth = false},
    MetricInfo{.name = "cpu_us",
               .meaning = "`compare`: CPU time per frame",
               .subject = MetricSubject::kRun,
               .unit = MetricUnit::kMicrosecond,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .section = MetricSection::kAlong,
               .label = "CPU time [us/frame]",
               .is_main = true,
               .is_cost = true},
    MetricInfo{.name = "cpu_us.start",
               .meaning = "`compare`: CPU time per frame of the filter that initialises a batch",
               .subject = MetricSubject::kRun,
               .unit = MetricUnit::kMicrosecond,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .section = MetricSection::kAlong,
               .label = "  of the initial filter",
               .is_main = true,
               .is_cost = true},
    MetricInfo{.name = "time_us",
               .meaning = "`compare`: wall-clock time per measurement, if the CPU time is unknown",
               .subject = MetricSubject::kRun,
               .unit = MetricUnit::kMicrosecond,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .section = MetricSection::kAlong,
               .label = "wall clock [us/measurement]",
               .is_main = true,
               .is_cost = true},
    MetricInfo{
        .name = "final_error",
        .meaning = "\\|e\\| at the last timestamp with truth",
        .subject = MetricSubject::kBlock,
        .unit = MetricUnit::kSubject,
        .goal = MetricGoal::kZero,
        .block = [](const BlockSample& s) -> std::optional<double> { return std::sqrt(s.square); },
        .reduction = MetricReduction::kLast,
        .section = MetricSection::kFinal,
        .label = "error",
        .has_ratio = true},
    MetricInfo{.name = "final_difference",
               .meaning = "`compare`: difference from the reference estimator at the end",
               .subject = MetricSubject::kBlock,
               .unit = MetricUnit::kSubject,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .section = MetricSection::kFinal,
               .label = "difference"},
    MetricInfo{.name = "final_difference.sigmas",
               .meaning = "`compare`: final difference in sigmas of the reference estimator",
               .subject = MetricSubject::kOwner,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .section = MetricSection::kFinal,
               .label = "difference in sigmas"},
    MetricInfo{.name = "map.rmse",
               .meaning = "sqrt(mean \\|p - p_true\\|^2) over the landmarks of the final state "
                          "whose true position the source provides",
               .subject = MetricSubject::kRun,
               .unit = MetricUnit::kMetre,
               .goal = MetricGoal::kZero,
               .is_shown = true,
               .priority = 5,
               .section = MetricSection::kFinal,
               .label = "map",
               .is_main = true,
               .has_ratio = true},
    MetricInfo{.name = "map.sim3.rmse",
               .meaning = "`map.rmse` after alignment by the similarity that minimises this RMSE "
                          "[Umeyama1991]",
               .subject = MetricSubject::kRun,
               .unit = MetricUnit::kMetre,
               .goal = MetricGoal::kZero,
               .is_shown = true,
               .priority = 9,
               .section = MetricSection::kFinal,
               .label = "Sim3-aligned map",
               .is_main = true,
               .has_ratio = true},
    MetricInfo{.name = "map.sim3.scale",
               .meaning = "scale of the similarity of `map.sim3.rmse`, which maps the estimate to "
                          "truth",
               .subject = MetricSubject::kRun,
               .goal = MetricGoal::kOne,
               .is_shown = true,
               .section = MetricSection::kFinal,
               .label = "map, scale"},
    MetricInfo{.name = "map.rmsd",
               .meaning = "`compare`: root mean square difference between the landmarks of the "
                          "estimator and of the reference estimator",
               .subject = MetricSubject::kRun,
               .unit = MetricUnit::kMetre,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .section = MetricSection::kFinal,
               .label = "RMSD, map",
               .is_main = true},
    MetricInfo{
        .name = "map.sim3.rmsd",
        .meaning = "`compare`: `map.rmsd` after alignment by the similarity that minimises this "
                   "RMSD",
        .subject = MetricSubject::kRun,
        .unit = MetricUnit::kMetre,
        .goal = MetricGoal::kZero,
        .needs_truth = false,
        .section = MetricSection::kFinal,
        .label = "RMSD, Sim3-aligned map",
        .is_main = true},
    MetricInfo{.name = "reprojection",
               .meaning = "for a sensor of landmarks: median of the rms of accepted innovations in "
                          "`NAME/reprojection.csv` over the second half of the frames",
               .subject = MetricSubject::kSensor,
               .unit = MetricUnit::kNone,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .is_shown = true,
               .priority = 7},
    MetricInfo{.name = "settling_frames",
               .meaning = "number, counted from 1, of the frame from which the centred rms over at "
                          "most 9 frames stays within 20 % of `reprojection`; infinite if the "
                          "last centred rms is outside this band",
               .subject = MetricSubject::kSensor,
               .unit = MetricUnit::kFrames,
               .goal = MetricGoal::kZero,
               .needs_truth = false,
               .is_shown = true,
               .priority = 6},
};

/// Returns the entry of a metric; null if no metric has that name.
constexpr const MetricInfo* FindMetric(std::string_view name) {
  for (const MetricInfo& metric : kMetrics) {
    if (name == metric.name) return &metric;
  }
  return nullptr;
}

}  // namespace alidade
