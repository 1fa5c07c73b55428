// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "alidade/base/random.h"
#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/ekf.h"
#include "support/landmark_sensors.h"

/// Small estimation problems that contain landmarks, composed in C++ for tests.
namespace alidade::testing {

/// Returns a problem with the block `cam.position` and the sensor `tracks`. The prior of the block
/// has the standard deviation `sigma_0`.
template <class Model>
Problem MapSystem(const Model& model, const LandmarkOptions& options, double sigma_0 = 0.0) {
  Problem problem;
  const SharedMotion walk = MakeMotion(Walk(0.1), "walk");
  const BlockId id = problem.layout.Declare("cam.position", "cam", walk->blocks()[0]);
  problem.motions.push_back({"cam", walk, {id}});
  Prior prior;
  prior.block = id;
  prior.mean = {0.0, 0.0, 0.0};
  prior.covariance = sigma_0 * sigma_0 * Eigen::Matrix3d::Identity();
  problem.priors.push_back(prior);
  SensorBinding binding{"tracks", "tracks", MakeSensor(model, "tracks"), {}};
  binding.roles.resize(binding.model->roles().size());
  binding.roles[0].block = id;
  if constexpr (Model::Measurement::kAmbient == 2) {
    binding.xyz = MakeSensor(XyzPixels(model.sigma), "xyz");
  }
  problem.sensors.push_back(binding);
  problem.landmarks = options;
  return problem;
}

inline LandmarkOptions WithPrior(double inverse_distance = 0.5, double sigma = 0.25) {
  LandmarkOptions options;
  options.prior = LandmarkOptions::Prior{inverse_distance, sigma, 0};
  return options;
}

/// Measurement of one landmark.
struct Observation {
  std::int64_t id;
  std::vector<double> z;
};
/// Returns a frame of stream 0 with the given observations.
inline Frame FrameOf(double t_s, const std::vector<Observation>& observations) {
  Frame frame;
  frame.timestamp = TimestampFromSeconds(t_s);
  for (const Observation& observation : observations) {
    frame.measurements.push_back({frame.timestamp, 0, observation.id, observation.z, {}});
  }
  return frame;
}

/// Returns the filter of a problem whose source has only the stream `tracks`.
inline Ekf EkfOf(const Problem& problem, const EkfOptions& options = {}) {
  return {problem, options, {{"tracks", problem.sensors[0].model->measurement().geometry.ambient}}};
}

/// Returns the outcome of the measurement of a landmark. Returns kFailed if the report does not
/// contain this measurement.
inline Outcome OutcomeFor(const UpdateReport& report, std::int64_t id) {
  const auto found = std::ranges::find(report.measurements(), id, &MeasurementReport::landmark);
  return found == report.measurements().end() ? Outcome::kFailed : found->outcome;
}

/// Returns the estimate of a landmark, or null if the landmark does not exist.
inline const LandmarkEstimate* Find(const std::vector<LandmarkEstimate>& landmarks,
                                    std::int64_t id) {
  const auto found = std::ranges::find(landmarks, id, &LandmarkEstimate::id);
  return found == landmarks.end() ? nullptr : &*found;
}

inline Eigen::Vector3d PositionOf(const Estimator& filter) {
  const State& state = filter.state();
  return Eigen::Map<const Eigen::Vector3d>(state.value(state.layout().Find("cam.position")));
}

}  // namespace alidade::testing
