// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/reprojection.h"

#include <algorithm>
#include <cmath>

#include "alidade/experiment/frame_innovation.h"
#include "alidade/io/csv_file.h"

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
  std::vector<std::vector<MeanErrors>> means;  // for each value
  for (const SweepResult& result : sweep.results) means.push_back(MeansOf(result));
  if (std::ranges::all_of(means, &std::vector<MeanErrors>::empty)) return;
  CsvFile csv(folder, "reprojection.csv",
              {sweep.variation.key, "estimator", "sensor", "unit", "frame", "runs", "rms"});
  for (std::size_t v = 0; v < means.size(); ++v) {
    for (const MeanErrors& errors : means[v]) {
      for (std::size_t k = 0; k < errors.runs.size(); ++k) {
        csv.Text(sweep.variation.values[v]).Text(errors.mean.estimator).Text(errors.mean.sensor);
        csv.Text(errors.mean.unit);
        csv.Integer(static_cast<std::int64_t>(k) + 1).Integer(errors.runs[k]);
        errors.runs[k] > 0 ? csv.Number(errors.mean.rms[k]) : csv.Empty();
        csv.EndRow();
      }
    }
  }
  csv.Close();
}

}  // namespace alidade::internal
