// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kSceneKeys =
    "points.list           [[x, y, z], ...], m; the index of a point is its id\n"
    "points.box            {min: [x, y, z], max}, m: drawn inside a box\n"
    "points.room           {min: [x, y, z], max}, m: drawn on the six faces of a box\n"
    "points.shells         {centre, radii}, m: drawn on spheres\n"
    "points.count          number of points that are drawn\n"
    "trajectory.look_at    [{position, target, t_s}, ...]; also trajectory.up\n"
    "trajectory.keyframes  [{position, t_s, euler_deg | matrix | axis_angle_deg | quaternion}, "
    "...]\n"
    "trajectory.random     noise and initial state of quaternion_pose, which draws the trajectory\n"
    "surfaces              [{box: {min, max}}, {rectangle: {corner, right, down}}, ...], m, each "
    "with grain_m: textured, for the images of the camera\n"
    "state_entry           state entry in the names of the truth; default cam";

/// Simulates points in space, seen by a moving camera.
///
///   pixel      (u, v) = K(h) + n_px,   h = R_CW (p - r),   n_px ~ N(0, sigma_px^2 I)
///   stereo     (u, v, u - fx B / hz, v) + n_px,   B camera.baseline_m: rectified pinhole pair
///   depth      (u, v, hz) + (n_px, n_d),   n_d ~ N(0, sigma_depth_m^2)
///   known      (u, v, hz (1 + n)),   n ~ N(0, known_points.sigma_depth_relative^2)
///   odometry   (v, omega) + n,   n ~ N(0, sigma^2): constant velocities in cam, with which
///              odometry_pose moves from this frame to the next
///
///   stream     size     values            when
///   tracks     2, 4, 3  as `measures`     a point is seen; its id is the landmark
///   known      3        u, v, depth       instead of the first observation of each of the first
///                                         known_points.count points that are seen; has a
///                                         covariance unless sigma_px is 0
///   odometry   6        vx vy vz wx wy wz every frame but the last
///   relative_  7        see Keyframes     keyframes, if enabled
///   poses
///
/// The camera looks along z, with x to the right and y down. A point is seen if it is in front of
/// the camera and both its exact and its noisy pixel are in the image. Nothing hides a point:
/// surfaces only appear in images. If more than max_features_per_frame points are seen, points of
/// the previous frame have priority, then points with smaller ids. The true values are
/// `cam.position`, `cam.orientation` (world_from_cam), `cam.velocity` (world) and
/// `cam.angular_velocity` (cam), with the velocities defined as in quaternion_pose, and the
/// position of each point.
///
/// Random streams 0 to 5 of the seed provide points, trajectory, pixels, odometry, image noise and
/// relative poses. Four numbers are drawn for the pixels of each point and frame, whether or not
/// the point is seen.
///
/// Keys         kSceneKeys; keys of the camera in alidade/model/camera.h.
/// Errors       kBadConfig.
/// Source       [MonoSlam2015] sec. 3.
std::unique_ptr<Source> CreateScene(const SourceArguments& arguments);

}  // namespace alidade
