// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

/// Creates a source of features that are found in the images of one camera and tracked through
/// them.
///
/// These files are in the folder of the images or of the video:
///
///   times        `timestamps.csv` (`frame,t_s`, frames counted from 0), or a table that
///                ImageTimes::FindNextTo() reads; else image k has the time k / rate_hz
///   true poses   `groundtruth.tum` or `truth.tum` (world_from_cam), or TUM's `groundtruth.txt`
///   calibration  `calibration.yaml`, or EuRoC's `sensor.yaml`, see ReadCalibrationFile()
///
/// The images of a live camera have the times of their capture, from 0.
///
///   stream   size  values       when
///   tracks   2     u, v         a feature is tracked; its id is the landmark
///   known    3     u, v, depth  points of a table `known` in the first image, instead of their
///                               first observation
///
/// With `guide`, features are searched for at the positions that this filter expects:
/// FeatureTracker.
///
/// With `estimate_noise` each measurement of `tracks` has its own covariance,
///
///   R = C + sigma^2 I
///
/// with C from FoundPatch, and sigma the config's sigma_systematic_px.
///
/// Keys         kImageTracksKeys in tracks_plugin.cc, those of TrackerOptions.
/// Errors       those of ImageReader, TimestampRows and TumRows; kBadConfig.
std::unique_ptr<Source> CreateImageTracks(const SourceArguments& arguments);

}  // namespace alidade
