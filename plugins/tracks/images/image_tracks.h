// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

/// Creates a source of features. It finds features in the images of one camera, and tracks them
/// from image to image.
///
/// These files are read from the folder of the images, or from the folder that contains the video:
///
///   times        `timestamps.csv` (`frame,t_s`, frames counted from 0), or a table that
///                ImageTimes::FindNextTo() reads; else image k has the time k / rate_hz
///   true poses   `groundtruth.tum` or `truth.tum` (world_from_cam), or TUM's `groundtruth.txt`
///   calibration  `calibration.yaml`, or EuRoC's `sensor.yaml`, see ReadCalibrationFile()
///
/// The times of the images of a live camera are the times of capture. They start at 0.
///
///   stream   size  values       when
///   tracks   2     u, v         a feature is tracked; its id is the landmark
///   known    3     u, v, depth  the first image, for each point of the table `known`; replaces the
///                               first observation of the point
///
/// With the key `guide`, features are searched for at the positions that the filter `guide`
/// expects: see FeatureTracker.
///
/// With `estimate_noise` each measurement of `tracks` has its own covariance,
///
///   R = C + sigma^2 I
///
/// C is FoundPatch::Covariance(), and sigma is sigma_systematic_px of the config.
///
/// Keys         kImageTracksKeys in tracks_plugin.cc, and those of TrackerOptions.
/// Errors       those of ImageReader, TimestampRows and TumRows; kBadConfig.
std::unique_ptr<Source> CreateImageTracks(const SourceArguments& arguments);

}  // namespace alidade
