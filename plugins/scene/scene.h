// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kSceneKeys =
    "points.list           [[x, y, z], ...], m; the ids are the places in it\n"
    "points.box            {min: [x, y, z], max}, m: drawn in its volume\n"
    "points.room           {min: [x, y, z], max}, m: drawn on its six faces\n"
    "points.shells         {centre, radii}, m: drawn on spheres\n"
    "points.count          how many are drawn\n"
    "trajectory.look_at    [{position, target, t_s}, ...]; also trajectory.up\n"
    "trajectory.keyframes  [{position, t_s, euler_deg | matrix | axis_angle_deg | quaternion}, "
    "...]\n"
    "trajectory.random     noise and start of quaternion_pose, which it is drawn from\n"
    "surfaces              [{box: {min, max}}, {rectangle: {corner, right, down}}, ...], m, each "
    "with grain_m: textured, for images of what the camera sees\n"
    "state_entry           the state entry whose blocks the truth is named after; default cam";

/// Points in space, seen by a camera that moves among them.
///
///   pixel      (u, v) = K(h) + n_px,   h = R_CW (p - r),   n_px ~ N(0, sigma_px^2 I)
///   stereo     (u, v, u - fx B / hz, v) + n_px: a rectified pair of pinholes, B camera.baseline_m
///   depth      (u, v, hz) + (n_px, n_d),   n_d ~ N(0, sigma_depth_m^2)
///   known      (u, v, hz (1 + n)),   n ~ N(0, known_points.sigma_depth_relative^2)
///   odometry   v, omega in cam, constant, that lead odometry_pose from this frame to the next,
///              + N(0, sigma^2)
///
///   stream     size     values            when
///   tracks     2, 4, 3  as `measures`     the point is seen; the landmark is its id
///   known      3        u, v, depth       in place of the first observation of each of the first
///                                         known_points.count points to be seen; with its
///                                         covariance, unless sigma_px is 0
///   odometry   6        vx vy vz wx wy wz every frame but the last, for the way to the next
///   relative_  7        as Keyframes has  keyframes, where there are any
///   poses               them
///
/// The camera looks along z, x to the right, y down. A point is seen where it lies ahead and both
/// its exact pixel and the noisy one lie on the image; nothing hides it, not the surfaces either,
/// which are seen in images alone. Of more points than max_features_per_frame those seen in the
/// frame before go first, then those with the smaller id. Truth is `cam.position`,
/// `cam.orientation` (world_from_cam), `cam.velocity` (world) and `cam.angular_velocity` (cam), the
/// velocities as in quaternion_pose; and the place of each point.
///
/// Points, path, pixels, odometry, the noise of images and relative poses are drawn from streams 0
/// to 5 of the seed; of the pixels four numbers for each point and frame, seen or not.
///
/// Keys         kSceneKeys; the camera by the keys of alidade/model/camera.h.
/// Errors       kBadConfig.
/// Source       [MonoSlam2015] sec. 3.
std::unique_ptr<Source> CreateScene(const SourceArguments& arguments);

}  // namespace alidade
