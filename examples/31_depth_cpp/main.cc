// SPDX-License-Identifier: Apache-2.0
//
// The filter of example 05 in C++, without a config and without plugins. A stereo camera does not
// measure depths below 0.25 m, but the apparent size of the target still changes with the depth.
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
                                       {{"position", 0.3, 10.0}, {"velocity", 0.0, 10.0}});
  const auto model =
      problem.AddState("template", alidade::Constant<1>(1), {{"value", 1.0 / 0.3, 10.0}});
  const auto stereo = problem.AddSensor("stereo", alidade::StereoDisparity(400.0, 0.065, 1.0),
                                        {target["position"]});
  const auto scale = problem.AddSensor("scale", alidade::Scale2d::FromPixels(300.0, 1.0),
                                       {target["position"], model["value"]});
  alidade::Ekf filter(problem, {.gate = 0.9999});

  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int k = 0; k <= 150; ++k) {
    const double t_s = k / 30.0, depth = 0.3 + 0.1 * std::sin(2.5 * t_s),
                 size = 300.0 * 0.3 / depth;
    std::vector<alidade::Reading> readings;
    if (depth > 0.25) readings.push_back({stereo, {400.0 * 0.065 / depth + normal(random)}});
    readings.push_back({scale, {300.0 / (size + 2.0 * normal(random))}});
    filter.Push(alidade::TimestampFromSeconds(t_s), readings);
    const auto [value, sigma] = filter.Estimate(target["position"]);
    if (k % 15 == 0) {
      std::printf("%.1f s: %.4f +- %.4f m, truth %.4f m\n", t_s, value[0], sigma[0], depth);
    }
  }
}
