// SPDX-License-Identifier: Apache-2.0
//
// Filters late measurements. The apparent size of the target arrives without delay, but the
// disparity of an image arrives 0.1 s after the image.
#include <alidade/estimation.h>
#include <alidade/motion_models/constant.h>
#include <alidade/motion_models/constant_velocity.h>
#include <alidade/sensors/scale_2d.h>
#include <alidade/sensors/stereo_disparity.h>

#include <cmath>
#include <cstdio>
#include <random>

int main() {
  alidade::Problem problem;
  const auto target = problem.AddState("target", alidade::ConstantVelocity<1, false>(1.0),
                                       {{"position", 0.3, 0.1}, {"velocity", 0.0, 1.0}});
  const auto model = problem.AddState("template", alidade::Constant<1>(1), {{"value", 3.3, 0.1}});
  const auto stereo = problem.AddSensor("stereo", alidade::StereoDisparity(400.0, 0.065, 1.0),
                                        {target["position"]});
  const auto scale = problem.AddSensor("scale", alidade::Scale2d::FromPixels(300.0, 1.0),
                                       {target["position"], model["value"]});
  alidade::Rollback late(alidade::Ekf(problem), 0.2);

  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto depth_at = [](double t_s) { return 0.3 + 0.05 * std::sin(2.5 * t_s); };
  int processed = 0;
  for (int k = 0; k <= 150; ++k) {
    const double t_s = k / 30.0, image_s = t_s - 0.1;
    const double size_px = 300.0 * 0.3 / depth_at(t_s) + normal(random);
    late.Push(alidade::TimestampFromSeconds(t_s), {{scale, {300.0 / size_px}}});
    const double disparity_px = 400.0 * 0.065 / depth_at(image_s) + normal(random);
    const auto again =
        late.Push(alidade::TimestampFromSeconds(image_s), {{stereo, {disparity_px}}});
    for (const alidade::ProcessedFrame& one : again) {
      for (const alidade::Event& event : one.report.events) std::puts(event.text.c_str());
      ++processed;
    }
  }
  const auto [value, sigma] = late.filter().Estimate(target["position"]);
  std::printf("%d frames again: %.4f +- %.4f m, truth %.4f m\n", processed, value[0], sigma[0],
              depth_at(5.0));
}
