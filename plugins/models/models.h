// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kModelsKeys =
    "start                 prior (default): the initial true state is drawn from the priors; mean: "
    "the initial true state is the mean of the priors\n"
    "initial               {ENTRY: {BLOCK: value}}: initial true values, which replace those of "
    "`start`\n"
    "overrides             keys of the config that have other values for the truth than for the "
    "filters\n"
    "sensors               {SENSOR: {rate_hz, missing, outliers: {share, sigma_scale}, known}}; "
    "known: the known numbers of the sensor, one list for each measurement of a time step\n"
    "inputs                {STATE_ENTRY: {mean, amplitude, frequency_hz}}: control "
    "input of the state entry\n"
    "landmarks             {count, box: {min, max}, max_per_frame}: points in the world, m";

/// Simulates truth and measurements with the motion and sensor models of the config.
///
///   start      x_0 = mean (+) chol(P_0) n of the priors
///   step       x_{k+1} = f(x_k, u_k, w_k, dt),   w_k = Lq n,   dt = 1 / rate_hz
///   sensor     z = h(x_k) (+) s L n,   R = L L',   s = 1, or sigma_scale for an outlier
///   input      u_i(t) = mean_i + amplitude_i sin(2 pi frequency_hz t)
///
/// Here n ~ N(0, I). A filter with the same config is therefore consistent. Discrete noise w stays
/// constant until the next measurement, as the filters assume (docs/noise_models.md).
///
/// A sensor measures at each time step, or at its own rate_hz, provided that h is defined and the
/// value is valid. Each measurement is omitted with the probability `missing`. If several sensors
/// use one stream, the first of these sensors simulates it. Points are drawn uniformly in `box`;
/// points of `landmarks.known` are drawn about their given positions. A frame contains the points
/// that the sensor sees, at most max_per_frame. If the sensor sees more points, those with the
/// smallest ids are used. Headings of landmarks in the plane are uniform. The first time step is at
/// `initial_time_s`, or 0. The streams are those of the sensors and inputs. The true values are
/// those of all blocks.
///
/// Each noise has its own random stream of the seed: 0 start, 1 points, 2 orientations of
/// landmarks, 100 + i motion models, 1000 + 2 i sensors, 1001 + 2 i their missing measurements and
/// outliers.
///
/// Keys         kModelsKeys.
/// Errors       kBadConfig; kBadData if the truth leaves the domain of a motion model.
/// Source       [BarShalom2001] sec. 5.4: simulation with the model of the filter.
std::unique_ptr<Source> CreateModels(const SourceArguments& arguments);

}  // namespace alidade
