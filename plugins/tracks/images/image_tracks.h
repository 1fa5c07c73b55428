// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

/// Features that are found in the images of one camera and followed through them.
///
/// Beside the images, in their folder or that of the video, may be `timestamps.csv` (`frame,t_s`,
/// frames counted from 0), or a table that ImageTimes::Beside knows, or else rate_hz gives image k
/// the time k / rate; `groundtruth.tum` or `truth.tum` (world_from_cam), or the `groundtruth.txt`
/// of TUM; and `calibration.yaml`, or the `sensor.yaml` of EuRoC, see
/// ReadCalibrationFile(). Images of a camera have the times at which they came, from 0.
///
///   stream   size  values       when
///   tracks   2     u, v         a feature is followed; the landmark is its id
///   known    3     u, v, depth  of the points of a table `known` in the first image, in place of
///                               their first observation
///
/// Under `guide` the features are looked for where that filter expects them, see FeatureTracker.
///
/// With `estimate_noise` each measurement of `tracks` brings its covariance,
///
///   R = C + sigma^2 I
///
/// with C that of FoundPatch, and sigma the config's sigma_systematic_px.
///
/// Keys         kImageTracksKeys in tracks_plugin.cc, those of TrackerOptions.
/// Errors       those of ImageReader, TimestampRows and TumRows; kBadConfig.
std::unique_ptr<Source> CreateImageTracks(const SourceArguments& arguments);

}  // namespace alidade
