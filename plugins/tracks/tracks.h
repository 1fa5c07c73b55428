// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kTracksKeys =
    "path           rows frame,feature,dim,value: a file, a pipe, '-', or a folder with "
    "tracks.csv\n"
    "state_entry    state entry in the names of the truth; default cam";

/// Creates a source of features that another program has tracked through images. They are read from
/// rows `frame,feature,dim,value`.
///
///   dim   value                            frames come in order; a frame's rows in any order
///   0, 1  u, v, px                         a header line is optional
///   2, 3  u_right, v_right, px; or 2: the depth, m
///
/// The frames are those of `timestamps.csv` (`frame,t_s`) next to the file; without it, frame k has
/// the time k / rate_hz. These files next to it are optional: `odometry.csv` (a header with frame,
/// vx_m_s, vy_m_s, vz_m_s, wx_rad_s, wy_rad_s, wz_rad_s); `groundtruth.tum` or `truth.tum`
/// (world_from_cam); `known.csv`, rows of the same form with observations that determine depth;
/// `calibration.yaml`, see ReadCalibrationFile().
///
///   stream     size     values            when
///   tracks     2, 4, 3  as `measures`     a feature has all of them; its id is the landmark
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
