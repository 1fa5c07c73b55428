// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

/// Simulates a target that oscillates along the optical axis. A stereo pair measures its disparity,
/// and a tracker measures the size of its image.
///
///   truth      Z(t) = Zm + A sin(2 pi f t),   Zdot = dZ/dt,   lambda = 1 / Z0
///   stereo     d = F B / Z + sigma_d n1,   n1 ~ N(0, 1);   emitted unless d > F B / Zn
///   size       scale = Z0 / Z + (2 sigma_e / (w Z0 / Z)) n2,   n2 ~ N(0, 1);   emitted: 1 / scale
///
///   symbol   parameter           unit  frame  2017   meaning
///   Zm       depth_mean_m        m     cam    0.3    mean depth; > 0
///   A        amplitude_m         m     cam    0.1    amplitude; 0 <= A < Zm
///   f        frequency_hz        Hz    -      0.4    frequency of the motion
///   t        rate_hz             Hz    -      30.3   samples per second: t = 0, 1 / rate_hz, ...
///            duration_s          s     -      5      upper limit of t
///   F        focal_px            px    -      400    rectified focal length
///   B        baseline_m          m     -      0.065  stereo baseline
///   sigma_d  sigma_disparity_px  px    left   1      disparity noise, 1 sigma
///   Zn       min_range_m         m     left   0.3    minimum depth of stereo; 0: no limit
///   w        template_px         px    cam    300    width of the template
///   Z0       template_depth_m    m     cam    0.3    depth at which the template was recorded
///   sigma_e  sigma_edge_px      px    cam    1      noise of one edge of the target, 1 sigma
///            missing             1     -      0      probability that the disparity is missing
///            outliers.share      1     -      0      probability of d ~ U(0, F B / (Zm - A))
///
///   stream                  size  unit  when
///   disparity               1     px    stereo measures, and the disparity is not missing
///   disparity_all           1     px    the disparity is not missing; for a sensor that checks
///                                       itself whether the disparity is valid
///   inverse_scale           1     -     always
///   inverse_scale_seeing    1     -     stereo measures; same value as inverse_scale
///   inverse_scale_blind     1     -     stereo does not measure; same value as inverse_scale
///
/// n1 and n2 come from streams 0 and 1 of the seed. Each sample draws both, regardless of the
/// measurements that are emitted.
///
/// In the images the target is a textured square of w Z0 / F metres that faces the pair. The square
/// is on the axis of the left camera, in front of a textured wall. Images have image.width times
/// image.height pixels and their principal points in the middle. Image noise comes from stream 2 of
/// the seed; missing and wrong disparities come from stream 3.
///
/// Differences from the notebook of [Ekf2017]: the notebook compares the noisy disparity with the
/// limit, as `blind_test: measured` does. This biases the accepted disparities: by -0.85 px if F B
/// / Z is within 1 px of the limit, by -0.33 px within 3 px (sigma_d 1 px, example 01).
/// `blind_test: true_depth` compares F B / Z with the limit instead. The text of the notebook
/// states 25 cm and 1 Hz. The code of the notebook uses 30 cm and 0.4 Hz, which are the defaults
/// here. The notebook replaces a blind disparity by 1e9 px; here it is missing. In both, the noise
/// of the scale contains the sum of the errors of both edges: 2 sigma_e.
///
/// Defined for  A < Zm; else the configuration is rejected.
/// Source       [Ekf2017] sec. 2-4.
std::unique_ptr<Source> CreateDepthTarget(const SourceArguments& arguments);

}  // namespace alidade
