// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/reprojection.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "alidade/experiment/frame_innovation.h"
#include "alidade/io/csv_file.h"
#include "alidade/record/figure_script.h"
#include "alidade/record/figures.h"
#include "alidade/sweep/value_labels.h"

namespace alidade::internal {
namespace {

constexpr std::size_t kMaxFrames = 500;

/// Mean errors of one estimator and sensor over the runs of one value.
struct MeanErrors {
  FrameErrors mean;
  std::vector<int> runs = {};  ///< number of runs in each frame
};

bool HaveSameSensor(const FrameErrors& a, const FrameErrors& b) {
  return a.estimator == b.estimator && a.sensor == b.sensor;
}

void AddTo(MeanErrors& sum, const FrameErrors& errors) {
  sum.mean.rms.resize(std::max(sum.mean.rms.size(), errors.rms.size()), 0.0);
  sum.runs.resize(sum.mean.rms.size(), 0);
  for (std::size_t k = 0; k < errors.rms.size(); ++k) {
    if (std::isnan(errors.rms[k])) continue;
    sum.mean.rms[k] += errors.rms[k];
    ++sum.runs[k];
  }
}

/// Returns the mean errors of each estimator and sensor for one value.
std::vector<MeanErrors> MeansOf(const SweepResult& result) {
  std::vector<MeanErrors> means;
  for (const SweepRun& run : result.done) {
    for (const SweepRow& estimator : run.estimators) {
      if (!run.UsesMetricsOf(estimator)) continue;
      for (const FrameErrors& errors : run.reprojection) {
        if (errors.estimator != estimator.name) continue;
        auto mean = std::ranges::find_if(
            means, [&](const MeanErrors& entry) { return HaveSameSensor(entry.mean, errors); });
        if (mean == means.end()) {
          mean = means.insert(mean,
                              MeanErrors{{errors.estimator, errors.sensor, errors.unit, {}}, {}});
        }
        AddTo(*mean, errors);
      }
    }
  }
  for (MeanErrors& entry : means) {
    for (std::size_t k = 0; k < entry.runs.size(); ++k) entry.mean.rms[k] /= entry.runs[k];
  }
  return means;
}

/// Returns the mean errors of each estimator and sensor for each value, in the order of
/// `reprojection.csv`.
std::vector<std::vector<MeanErrors>> MeansOf(const VariedSweep& sweep) {
  std::vector<std::vector<MeanErrors>> means;
  for (const SweepResult& result : sweep.results) means.push_back(MeansOf(result));
  return means;
}

/// Returns the gnuplot condition that selects `count` rows from row `first`.
std::string Rows(std::size_t first, std::size_t count) {
  return "column(0) >= " + std::to_string(first) + " && column(0) < " +
         std::to_string(first + count);
}

/// Adds the panel of one estimator and sensor, with one curve for each value.
void AddPanel(FigureScript& script, const std::vector<std::vector<MeanErrors>>& means,
              const FrameErrors& panel, const std::vector<std::string>& labels) {
  script.Panel(panel.estimator + ", " + panel.sensor + ": rms of z - h, mean over the runs",
               InBrackets(panel.unit));
  script.Set("set logscale y 2\nset format y '%g'\nset xrange [1:*]");
  std::size_t row = 0;
  for (std::size_t v = 0; v < means.size(); ++v) {
    for (const MeanErrors& errors : means[v]) {
      const std::size_t first = row;
      row += errors.runs.size();
      if (!HaveSameSensor(errors.mean, panel) || v >= kMaxCurves) continue;
      script.Curve({"reprojection.csv", 0},
                   "(column('frame')):(" + Rows(first, errors.runs.size()) +
                       " ? column('rms') : NaN) with lines ls " + std::to_string(v + 1),
                   labels[v]);
    }
  }
}

FigureScript ReprojectionFigure(const VariedSweep& sweep) {
  const std::vector<std::string>& values = sweep.variation.values;
  const std::string selection = values.size() <= kMaxCurves
                                    ? ""
                                    : ": the first " + std::to_string(kMaxCurves) + " of " +
                                          std::to_string(values.size()) + " values";
  FigureScript script("reprojection",
                      "reprojection error of each frame, by " + sweep.variation.key + selection,
                      "frame");
  const std::vector<std::vector<MeanErrors>> means = MeansOf(sweep);
  const std::vector<std::string> labels = ValueLabels(values);
  std::vector<FrameErrors> panels;
  for (const std::vector<MeanErrors>& value_means : means) {
    for (const MeanErrors& errors : value_means) {
      const auto is_same = [&](const FrameErrors& panel) {
        return HaveSameSensor(panel, errors.mean);
      };
      if (panels.size() == kMaxPanels || std::ranges::any_of(panels, is_same)) continue;
      panels.push_back(errors.mean);
      AddPanel(script, means, errors.mean, labels);
    }
  }
  return script;
}

}  // namespace

void ReprojectionRecorder::Begin(const Experiment& experiment) {
  for (std::size_t e = 0; e < experiment.estimators.size(); ++e) {
    const EstimatorSpec& spec = experiment.estimators[e];
    for (std::size_t s = 0; s < spec.problem.sensors.size(); ++s) {
      const SensorBinding& sensor = spec.problem.sensors[s];
      if (!HasReprojection(sensor)) continue;
      sensors_.push_back({static_cast<int>(e), static_cast<int>(s)});
      errors_.push_back({spec.name, sensor.name, sensor.model->measurement().unit, {}});
    }
  }
}

void ReprojectionRecorder::OnEstimate(int estimator, const SourceFrame& /*frame*/,
                                      const State& /*state*/, const UpdateReport& report) {
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    if (sensors_[i].estimator != estimator || errors_[i].rms.size() == kMaxFrames) continue;
    errors_[i].rms.push_back(FrameInnovationOf(report, sensors_[i].sensor).rms);
  }
}

void WriteReprojection(const OutputFolder& folder, const VariedSweep& sweep) {
  const std::vector<std::vector<MeanErrors>> means = MeansOf(sweep);
  if (std::ranges::all_of(means, &std::vector<MeanErrors>::empty)) return;
  CsvFile csv(folder, "reprojection.csv",
              {sweep.variation.key, "estimator", "sensor", "frame", "runs", "rms"});
  for (std::size_t v = 0; v < means.size(); ++v) {
    for (const MeanErrors& errors : means[v]) {
      for (std::size_t k = 0; k < errors.runs.size(); ++k) {
        csv.Text(sweep.variation.values[v]).Text(errors.mean.estimator).Text(errors.mean.sensor);
        csv.Integer(static_cast<std::int64_t>(k) + 1).Integer(errors.runs[k]);
        errors.runs[k] > 0 ? csv.Number(errors.mean.rms[k]) : csv.Empty();
        csv.EndRow();
      }
    }
  }
  csv.Close();
}

std::string DrawReprojection(const OutputFolder& folder, const VariedSweep& sweep,
                             const std::function<bool()>& stop) {
  const FigureScript script = ReprojectionFigure(sweep);
  if (sweep.stopped() || script.empty()) return "";
  folder.Write("figures/reprojection.gp", script.Text());
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  const GnuplotResult result =
      DrawFigure(folder, "reprojection.svg", {"figures/reprojection.gp"}, DrawingLimits{stop, end});
  if (result.end == GnuplotResult::End::kFailed) return result.complaint;
  return Obstacle(result.end);
}

}  // namespace alidade::internal
