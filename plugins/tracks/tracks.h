// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kTracksKeys =
    "path           file or pipe with rows frame,feature,dim,value; '-' for standard input; or a "
    "folder with tracks.csv\n"
    "state_entry    state entry to which the true values belong; default cam";

/// Creates a source of features that another program has tracked through images. The features are
/// read from rows `frame,feature,dim,value`.
///
///   dim   value
///   0, 1  u, v, px
///   2, 3  u_right, v_right, px; or 2: the depth, m
///
/// Frames must increase. The rows of a frame can be in any order. A header line is optional.
///
/// If `rate_hz` is 0, `timestamps.csv` (`frame,t_s`) next to the file lists the frames and their
/// times. Otherwise frame k has the time k / rate_hz. These files next to the file of tracks are
/// optional: `odometry.csv` (a header with frame, vx_m_s, vy_m_s, vz_m_s, wx_rad_s, wy_rad_s,
/// wz_rad_s); `groundtruth.tum` or `truth.tum` (world_from_cam); `known.csv` (rows
/// `frame,feature,dim,value` of observations that determine depth); `calibration.yaml`, see
/// ReadCalibrationFile().
///
///   stream     size     values            when
///   tracks     2, 4, 3  see `measures`    a feature has all values; its id is the landmark
///   odometry   6        vx vy vz wx wy wz the frame has a row
///   known      3        u, v, depth       known.csv has an observation
///
/// A feature without u or v is an error. A feature is omitted if another value of `measures` is
/// missing, or if the feature occurs in a frame before `features_from`. A frame is complete when
/// the first row of the next frame, or the end, has been read.
///
/// Keys         kTracksKeys.
/// Errors       kBadData with file, line and column of the first invalid row; kInputMissing; kIo if
///              a file changes while it is read; kBadConfig.
std::unique_ptr<Source> CreateTracks(const SourceArguments& arguments);

}  // namespace alidade
