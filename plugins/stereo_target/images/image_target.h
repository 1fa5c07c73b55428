// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

/// One target in the images of a stereo pair, or of one camera.
///
///   stream          size  values       when
///   disparity       1     d, px        its texture is found in both images: see FindDisparity()
///   inverse_scale   1     s            the target is followed: see TargetTracker
///
/// Each comes with its variance, unless `estimate_noise` is false:
///
///   of d            var(d) + sigma^2
///   of s            var(s) + (2 sigma s / w)^2,   w = sqrt(width height) of the target in it
///
/// with sigma the config's sigma_systematic_px: what calibration, interpolation and the target
/// itself are off by, which no residual tells. var() is that of the alignment. The errors of s
/// since the template was taken have that of the template in common, which no filter here models.
///
/// A target that is lost, hidden or black gives no measurement, and is looked for in each image.
///
/// Errors       those of ImageReader, TimestampRows, BoxRows, TruthRows, Rectification; kBadConfig.
std::unique_ptr<Source> CreateImageTarget(const SourceArguments& arguments);

}  // namespace alidade
