// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kModelsKeys =
    "start                 prior (default): the true state is drawn from the priors; mean: it is "
    "their mean\n"
    "initial               {ENTRY: {BLOCK: value}}: where the truth starts instead\n"
    "overrides             config of the truth, merged over that of the filters\n"
    "sensors               {SENSOR: {rate_hz, missing, outliers: {share, sigma_scale}, known}}; "
    "known: of a sensor that takes known numbers, a list of them for each measurement at one time\n"
    "inputs                {STATE_ENTRY: {mean, amplitude, frequency_hz}}: its control input\n"
    "landmarks             {count, box: {min, max}, max_per_frame}: points in the world, m";

/// Draws truth and measurements from the motion and sensor models of the config.
///
///   start      x_0 = mean (+) chol(P_0) n of the priors
///   step       x_{k+1} = f(x_k, u_k, w_k, dt),   w_k = Lq n,   dt = 1 / rate_hz
///   sensor     z = h(x_k) (+) s L n,   R = L L',   s = 1, of an outlier sigma_scale
///   input      u_i(t) = mean_i + amplitude_i sin(2 pi frequency_hz t)
///
/// with n ~ N(0, I), so that a filter of the same config is consistent. Discrete noise w is held
/// until something has been measured, as the filters take it (docs/noise_models.md).
///
/// A measurement is given at each time step, or at the sensor's own rate_hz, where h is defined and
/// the value valid; each is left out with the probability `missing`. Of several sensors on one
/// stream the first draws. Points are drawn uniformly in `box`; a frame has those that the sensor
/// sees, the smallest ids first where they are more than max_per_frame; those of `landmarks.known`
/// are drawn about their places. The first time step is at `initial_time_s`, or 0. Streams are
/// those of the sensors and inputs, truths the blocks.
///
/// Each noise has a stream of the seed of its own: 0 start, 1 points, 100 + i motion models,
/// 1000 + 2 i sensors, and one more for what is missing or an outlier.
///
/// Keys         kModelsKeys.
/// Errors       kBadConfig; kBadData where the truth leaves the domain of a motion model.
/// Source       [BarShalom2001] sec. 5.4: runs of the very model that the filter has.
std::unique_ptr<Source> CreateModels(const SourceArguments& arguments);

}  // namespace alidade
