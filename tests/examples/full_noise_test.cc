// SPDX-License-Identifier: Apache-2.0
//
// Tests a full matrix R as in docs/noise_models.md. R is set in the config, computed by a user's
// own model, or supplied with each measurement.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "alidade/estimation/direct_models.h"
#include "alidade/estimation/ekf.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/short_forms.h"
#include "sensors/inverse_depth_feature.h"

namespace alidade {
namespace {

/// Measures the pixel of a landmark. The noises of u and v have different sigmas and are
/// correlated.
template <class Representation>
struct CorrelatedPixel : LandmarkSensor<CorrelatedPixel<Representation>, Vec<2>, Representation> {
  static constexpr Quantity kMeasurement{"pixel", "px", "image of the landmark", "u,v"};
  static constexpr int kPrior = 1;

  InverseDepthFeature<Representation> pixel;  // computes h, the valid domain and the inverse model
  double sigma_u_px, sigma_v_px, correlation;

  CorrelatedPixel(const Camera& camera, double sigma_u, double sigma_v, double rho)
      : pixel(camera, 1.0), sigma_u_px(sigma_u), sigma_v_px(sigma_v), correlation(rho) {}

  template <class T>
  bool PredictInCamera(const T* h, const T& rho, T* z) const {
    return pixel.PredictInCamera(h, rho, z);
  }
  // Returns L of R = L L'. L is row-major and zero before the call.
  template <class T>
  void SqrtNoiseInCamera(const T*, const T&, T* L) const {
    L[0] = T(sigma_u_px);
    L[2] = T(correlation * sigma_v_px);
    L[3] = T(std::sqrt(1.0 - correlation * correlation) * sigma_v_px);
  }
  bool Valid(const double* z) const { return pixel.Valid(z); }
  template <class T>
  bool Initialise(const T* position, const T* orientation, const T* z, const T* prior,
                  T* landmark) const {
    return pixel.Initialise(position, orientation, z, prior, landmark);
  }
};

/// Returns the config of example 12, with R given by `covariance` instead of `sigma_px`, and with
/// expanded short forms.
Config WithCovariance(const std::string& covariance, const PluginHost& host) {
  const std::string path = ALIDADE_SOURCE_DIR "/examples/12_slam_parameters/config.yaml";
  std::ifstream file(path);
  std::string text(std::istreambuf_iterator<char>(file), {});
  const std::size_t at = text.find("    sigma_px: 1.0", text.find("  pixels:"));
  EXPECT_NE(at, std::string::npos);
  text.replace(at, text.find('\n', at) - at, "    covariance: " + covariance);
  Config config = Config::FromText(text, path);
  ExpandShortForms(config, host);
  return config;
}

TEST(FullNoise, OfAConfigAndOfAModelIsThatOfEachMeasurement) {
  const PluginHost host;
  const Config config = WithCovariance("[[1, 0.6], [0.6, 4]]", host);
  const std::unique_ptr<Source> source = std::move(BuildExperiment(config, host).source);
  Problem problem = ReadProblem(config.root(), host, std::vector<std::string>{"pixels"});
  const std::vector<StreamInfo> streams = source->streams();
  Ekf by_config(problem, {}, streams);
  const Config other = WithCovariance("[[9, 0], [0, 9]]", host);
  Ekf by_measurement(ReadProblem(other.root(), host, std::vector<std::string>{"pixels"}), {},
                     streams);
  const Camera camera(640, 480, 525.0, 525.0, 320.0, 240.0);
  problem.sensors.at(0).model =
      MakeSensor(CorrelatedPixel<InverseDepth>(camera, 1.0, 2.0, 0.3), "correlated_pixel");
  Ekf by_model(problem, {}, streams);

  int used = 0, frames = 0;
  for (SourceFrame frame; source->Next(frame) && frames < 40; ++frames) {
    by_model.Process(frame);
    by_config.Process(frame);
    for (Measurement& m : frame.measurements) {
      if (m.values.size() == 2) m.covariance = {1.0, 0.6, 0.6, 4.0};  // 0.6 = 0.3 * 1 px * 2 px
    }
    for (const MeasurementReport& m : by_measurement.Process(frame).measurements()) {
      used += m.outcome == Outcome::kAccepted ? 1 : 0;
    }
    const std::vector<double>& values = by_measurement.state().values();
    for (const Ekf* one : {&by_model, &by_config}) {
      ASSERT_EQ(one->state().values().size(), values.size());
      for (std::size_t i = 0; i < values.size(); ++i) {
        ASSERT_NEAR(one->state().values()[i], values[i], 1e-9) << frames << ", element " << i;
      }
    }
  }
  EXPECT_GT(used, 500);
}

}  // namespace
}  // namespace alidade
