// SPDX-License-Identifier: Apache-2.0
//
// A whole R, as docs/noise_models.md has it: in a model of one's own, and with each measurement.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "alidade/filter/ekf.h"
#include "alidade/host/in_process.h"
#include "alidade/run/run.h"
#include "sensors/inverse_depth_feature.h"

namespace alidade {
namespace {

/// The pixel of a landmark, whose u and v have noises of their own, and correlated ones.
template <class Representation>
struct CorrelatedPixel : LandmarkSensor<CorrelatedPixel<Representation>, Vec<2>, Representation> {
  static constexpr Quantity kMeasurement{"pixel", "px", "where the landmark is seen", "u,v"};
  static constexpr int kPrior = 1;

  InverseDepthFeature<Representation> pixel;  // its h, its limits and its inverse
  double sigma_u_px, sigma_v_px, correlation;

  CorrelatedPixel(const Camera& camera, double sigma_u, double sigma_v, double rho)
      : pixel(camera, 1.0), sigma_u_px(sigma_u), sigma_v_px(sigma_v), correlation(rho) {}

  template <class T>
  bool PredictInCamera(const T* h, const T& rho, T* z) const {
    return pixel.PredictInCamera(h, rho, z);
  }
  template <class T>
  void SqrtNoiseInCamera(const T*, const T&, T* L) const {  // R = L L', L row-major, zeroed before
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

TEST(FullNoise, OfAModelIsThatOfEachMeasurement) {
  const Config config =
      Config::FromFile(ALIDADE_SOURCE_DIR "/examples/12_slam_parameters/config.yaml");
  const PluginHost host;
  const std::unique_ptr<Source> source = std::move(BuildExperiment(config, host).source);
  System system = BuildSystem(config.root(), host, {"pixels"});
  const std::vector<StreamInfo> streams = source->streams();
  Ekf by_measurement(system, {}, streams);
  const Camera camera(640, 480, 525.0, 525.0, 320.0, 240.0);
  system.sensors.at(0).model =
      InProcessSensor(CorrelatedPixel<InverseDepth>(camera, 1.0, 2.0, 0.3), "correlated_pixel");
  Ekf by_model(system, {}, streams);

  int used = 0, frames = 0;
  for (SourceFrame frame; source->Next(frame) && frames < 40; ++frames) {
    by_model.Process(frame);
    for (Measurement& m : frame.measurements) {
      if (m.values.size() == 2) m.covariance = {1.0, 0.6, 0.6, 4.0};  // 0.3 * 1 px * 2 px
    }
    for (const MeasurementReport& m : by_measurement.Process(frame).measurements()) {
      used += m.outcome == Outcome::kAccepted ? 1 : 0;
    }
    const State &a = by_model.state(), &b = by_measurement.state();
    ASSERT_EQ(a.values().size(), b.values().size());
    for (std::size_t i = 0; i < a.values().size(); ++i) {
      ASSERT_NEAR(a.values()[i], b.values()[i], 1e-9) << "frame " << frames << ", element " << i;
    }
  }
  EXPECT_GT(used, 500);
}

}  // namespace
}  // namespace alidade
