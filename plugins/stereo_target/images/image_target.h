// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

/// Creates a source that measures one target in the images of a stereo pair or of one camera.
///
///   stream          size  values       when
///   disparity       1     d, px        both images show the target: see FindDisparity()
///   inverse_scale   1     s            the target is tracked: see TargetTracker
///
/// Each measurement has its own variance, unless `estimate_noise` is false:
///
///   variance of d   var(d) + sigma^2
///   variance of s   var(s) + (2 sigma s / w)^2,   w = sqrt(width height) of the target, px
///
/// sigma is sigma_systematic_px of the config. It covers errors of calibration, interpolation and
/// the target itself that are not visible in the residuals. var() is the variance of the alignment.
/// All values of s that are measured with one template share the error of this template. The
/// filters of alidade do not model this correlation.
///
/// If the target is lost, hidden or black, there is no measurement. The source then searches for
/// the target in each image.
///
/// Errors       those of ImageReader, TimestampRows, BoxRows, TruthRows, Rectification; kBadConfig.
std::unique_ptr<Source> CreateImageTarget(const SourceArguments& arguments);

}  // namespace alidade
