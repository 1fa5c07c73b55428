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

constexpr std::size_t kMostFrames = 500;

/// The runs of one value for one estimator and sensor.
struct MeanErrors {
  FrameErrors mean;
  std::vector<int> runs = {};  ///< by frame
};

bool IsOf(const FrameErrors& one, const FrameErrors& another) {
  return one.estimator == another.estimator && one.sensor == another.sensor;
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

/// By estimator and sensor.
std::vector<MeanErrors> MeansOf(const SweepResult& result) {
  std::vector<MeanErrors> means;
  for (const SweepRun& run : result.done) {
    for (const SweepRow& estimator : run.estimators) {
      if (!run.Uses(estimator)) continue;
      for (const FrameErrors& errors : run.reprojection) {
        if (errors.estimator != estimator.name) continue;
        auto mean = std::ranges::find_if(
            means, [&](const MeanErrors& one) { return IsOf(one.mean, errors); });
        if (mean == means.end()) {
          mean = means.insert(mean,
                              MeanErrors{{errors.estimator, errors.sensor, errors.unit, {}}, {}});
        }
        AddTo(*mean, errors);
      }
    }
  }
  for (MeanErrors& one : means) {
    for (std::size_t k = 0; k < one.runs.size(); ++k) one.mean.rms[k] /= one.runs[k];
  }
  return means;
}

/// By value, estimator and sensor: the order of the rows of `reprojection.csv`.
std::vector<std::vector<MeanErrors>> MeansOf(const VariedSweep& sweep) {
  std::vector<std::vector<MeanErrors>> means;
  for (const SweepResult& result : sweep.results) means.push_back(MeansOf(result));
  return means;
}

/// The rows of one value, estimator and sensor.
std::string Rows(std::size_t first, std::size_t count) {
  return "column(0) >= " + std::to_string(first) + " && column(0) < " +
         std::to_string(first + count);
}

/// The curves of one estimator and sensor, one for each value.
void AddPanel(FigureScript& script, const std::vector<std::vector<MeanErrors>>& means,
              const FrameErrors& panel, const std::vector<std::string>& labels) {
  script.Panel(panel.estimator + ", " + panel.sensor + ": rms of z - h, mean over the runs",
               InBrackets(panel.unit));
  script.Set("set logscale y 2\nset format y '%g'\nset xrange [1:*]");
  std::size_t row = 0;
  for (std::size_t v = 0; v < means.size(); ++v) {
    for (const MeanErrors& one : means[v]) {
      const std::size_t first = row;
      row += one.runs.size();
      if (!IsOf(one.mean, panel) || v >= kMaxCurves) continue;
      script.Curve({"reprojection.csv", 0},
                   "(column('frame')):(" + Rows(first, one.runs.size()) +
                       " ? column('rms') : NaN) with lines ls " + std::to_string(v + 1),
                   labels[v]);
    }
  }
}

FigureScript ReprojectionFigure(const VariedSweep& sweep) {
  const std::vector<std::string>& values = sweep.variation.values;
  const std::string some = values.size() <= kMaxCurves
                               ? ""
                               : ": the first " + std::to_string(kMaxCurves) + " of " +
                                     std::to_string(values.size()) + " values";
  FigureScript script("reprojection",
                      "reprojection error of each frame, by " + sweep.variation.key + some,
                      "frame");
  const std::vector<std::vector<MeanErrors>> means = MeansOf(sweep);
  const std::vector<std::string> labels = ValueLabels(values);
  std::vector<FrameErrors> panels;
  for (const std::vector<MeanErrors>& of_value : means) {
    for (const MeanErrors& one : of_value) {
      const auto same = [&](const FrameErrors& other) { return IsOf(other, one.mean); };
      if (panels.size() == kMaxPanels || std::ranges::any_of(panels, same)) continue;
      panels.push_back(one.mean);
      AddPanel(script, means, one.mean, labels);
    }
  }
  return script;
}

}  // namespace

void ReprojectionOfRun::Begin(const Experiment& experiment) {
  for (std::size_t e = 0; e < experiment.estimators.size(); ++e) {
    const EstimatorSpec& spec = experiment.estimators[e];
    for (std::size_t s = 0; s < spec.problem.sensors.size(); ++s) {
      const SensorBinding& sensor = spec.problem.sensors[s];
      if (!HasReprojection(sensor)) continue;
      places_.push_back({static_cast<int>(e), static_cast<int>(s)});
      errors_.push_back({spec.name, sensor.name, sensor.model->measurement().unit, {}});
    }
  }
}

void ReprojectionOfRun::OnEstimate(int estimator, const SourceFrame& /*frame*/,
                                   const State& /*state*/, const UpdateReport& report) {
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (places_[i].estimator != estimator || errors_[i].rms.size() == kMostFrames) continue;
    errors_[i].rms.push_back(FrameInnovationOf(report, places_[i].sensor).rms);
  }
}

void WriteReprojection(const OutputFolder& folder, const VariedSweep& sweep) {
  const std::vector<std::vector<MeanErrors>> means = MeansOf(sweep);
  if (std::ranges::all_of(means, &std::vector<MeanErrors>::empty)) return;
  CsvFile csv(folder, "reprojection.csv",
              {sweep.variation.key, "estimator", "sensor", "frame", "runs", "rms"});
  for (std::size_t v = 0; v < means.size(); ++v) {
    for (const MeanErrors& one : means[v]) {
      for (std::size_t k = 0; k < one.runs.size(); ++k) {
        csv.Text(sweep.variation.values[v]).Text(one.mean.estimator).Text(one.mean.sensor);
        csv.Integer(static_cast<std::int64_t>(k) + 1).Integer(one.runs[k]);
        one.runs[k] > 0 ? csv.Number(one.mean.rms[k]) : csv.Empty();
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
