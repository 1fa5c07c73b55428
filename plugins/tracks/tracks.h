// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kTracksKeys =
    "path           rows frame,feature,dim,value: a file, a pipe, '-', or a folder of tracks.csv\n"
    "state_entry    the state entry whose blocks the truth is named after; default cam";

/// Features that were followed through images, from rows `frame,feature,dim,value`.
///
///   dim   value                            frames come in order; a frame's rows in any order
///   0, 1  u, v, px                         a header line may stand first
///   2, 3  u_right, v_right, px; or 2: the depth, m
///
/// Beside the file are `timestamps.csv` (`frame,t_s`), which then says what frames there are, or
/// else rate_hz gives frame k the time k / rate; and maybe `odometry.csv` (a header that
/// names frame, vx_m_s, vy_m_s, vz_m_s, wx_rad_s, wy_rad_s, wz_rad_s) and `groundtruth.tum` or
/// `truth.tum` (world_from_cam); and `known.csv`, rows of the same form: observations that tell
/// depth; and `calibration.yaml`, see ReadCalibrationFile().
///
///   stream     size     values            when
///   tracks     2, 4, 3  as `measures`     a feature has all of them; the landmark is its id
///   odometry   6        vx vy vz wx wy wz there is a row of the frame
///   known      3        u, v, depth       there is a known.csv, and an observation in it
///
/// A feature without u or v is an error; one without what `measures` asks for besides is left out,
/// and so is one that a frame before `features_from` has. A frame is given out once the first row
/// of the next is there, or the end.
///
/// Keys         kTracksKeys.
/// Errors       kBadData with file, line and column of the first thing that is wrong;
///              kInputMissing; kIo where a file changes while it is read; kBadConfig.
std::unique_ptr<Source> CreateTracks(const SourceArguments& arguments);

}  // namespace alidade
