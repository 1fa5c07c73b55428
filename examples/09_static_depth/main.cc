// SPDX-License-Identifier: Apache-2.0
//
// The filter of example 05, composed at compile time. The models that the program `alidade` loads
// as plugins are plain structs here. This program uses no plugins, config, allocation or
// exceptions.
#include <cmath>
#include <cstdio>

#include "alidade/model/static_ekf.h"
#include "measurements.h"
#include "motion_models/constant.h"
#include "motion_models/constant_velocity.h"
#include "sensors/scale_2d.h"
#include "sensors/stereo_disparity.h"

namespace {

using namespace alidade;  // NOLINT(google-build-using-namespace): a program, not a library

// Indices of the blocks, in the order of the motion models.
using DepthFilter = StaticEkf<ConstantVelocity<1, false>, Constant<1>>;
constexpr int kDepth = 0, kRate = 1, kInverseDistance = 2;
constexpr double kGate = 15.1367;  // 99.99 % quantile of chi-square with 1 degree of freedom

}  // namespace

int main() {
  DepthFilter filter(ConstantVelocity<1, false>(1.0), Constant<1>(1));
  filter.Set<kDepth>(0.3, 10.0);
  filter.Set<kRate>(0.25132741228718347, 10.0);
  filter.Set<kInverseDistance>(1.0 / 0.3, 10.0);
  const StereoDisparity stereo(400.0, 0.065, 1.0);
  const Scale2d scale = Scale2d::FromPixels(300.0, 1.0);

  double t = 0.0, squares = 0.0;
  int count = 0, used = 0;
  std::printf("t_s    depth_m  sigma_m  truth_m\n");
  for (const static_depth::Row& row : static_depth::kRows) {
    if (count > 0 && filter.Predict(static_depth::kStep) != Status::kOk) return 1;
    // Without a disparity the outcome is kInvalid, and the filter does not change.
    const StaticOutcome stereo_outcome = filter.Update<kDepth>(stereo, &row.disparity_px, kGate);
    const StaticOutcome scale_outcome =
        filter.Update<kDepth, kInverseDistance>(scale, &row.inverse_scale, kGate);
    used +=
        (stereo_outcome == StaticOutcome::kAccepted) + (scale_outcome == StaticOutcome::kAccepted);

    const double truth = 0.3 + 0.1 * std::sin(0.8 * 3.14159265358979323846 * t);
    const double depth = *filter.value<kDepth>(), sigma = std::sqrt(filter.covariance()(0, 0));
    if (count % 5 == 0) std::printf("%.3f  %.6f %.6f %.6f\n", t, depth, sigma, truth);
    squares += (depth - truth) * (depth - truth);
    ++count;
    t = static_depth::kStep * count;
  }
  std::printf("%d rows, %d measurements used, rmse %.2f mm\n", count, used,
              1e3 * std::sqrt(squares / count));
  return 0;
}
