// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

/// Creates a source that measures one target in the images of a stereo pair or of one camera.
///
///   stream          size  values       when
///   disparity       1     d, px        both images show its texture: see FindDisparity()
///   inverse_scale   1     s            the target is tracked: see TargetTracker
///
/// Each measurement has its own variance, unless `estimate_noise` is false:
///
///   of d            var(d) + sigma^2
///   of s            var(s) + (2 sigma s / w)^2,   w = sqrt(width height) of the target in it
///
/// with sigma the config's sigma_systematic_px: errors of calibration, interpolation and the target
/// itself that are not visible in the residuals. var() is the variance of the alignment. All errors
/// of s since a template was recorded contain the error of that template, which no filter here
/// models.
///
/// A target that is lost, hidden or black has no measurement; each image is searched for it.
///
/// Errors       those of ImageReader, TimestampRows, BoxRows, TruthRows, Rectification; kBadConfig.
std::unique_ptr<Source> CreateImageTarget(const SourceArguments& arguments);

}  // namespace alidade
