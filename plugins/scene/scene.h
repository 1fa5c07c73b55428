// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/experiment/source.h"

namespace alidade {

inline constexpr const char* kSceneKeys =
    "points.list           [[x, y, z], ...], m; the index of a point is its id\n"
    "points.box            {min: [x, y, z], max}, m: points are drawn inside a box\n"
    "points.room           {min: [x, y, z], max}, m: points are drawn on the faces of a box\n"
    "points.shells         {centre, radii}, m: points are drawn on spheres\n"
    "points.count          number of points that are drawn\n"
    "trajectory.look_at    [{position, target, t_s}, ...]; trajectory.up: upward direction\n"
    "trajectory.keyframes  [{position, t_s, rpy_deg | matrix | axis_angle_deg | quaternion}, "
    "...]\n"
    "trajectory.random     noise and initial state of quaternion_pose, for a random trajectory\n"
    "surfaces              [{box: {min, max}}, {rectangle: {corner, right, down}}, ...], m, each "
    "with grain_m: textured surfaces in the images of the camera\n"
    "state_entry           state entry to which the true values belong; default cam";

/// Simulates a moving camera that observes points in space.
///
///   pixel      (u, v) = K(h) + n_px,   h = R_CW (p - r),   n_px ~ N(0, sigma_px^2 I)
///   stereo     (u, v, u - fx B / hz, v) + n_px,   B camera.baseline_m: rectified pinhole pair
///   depth      (u, v, hz) + (n_px, n_d),   n_d ~ N(0, sigma_depth_m^2)
///   known      (u, v, hz (1 + n)),   n ~ N(0, known_points.sigma_depth_relative^2)
///   odometry   (v, omega) + n,   n ~ N(0, sigma^2): constant velocities in cam that move
///              odometry_pose from this frame to the next
///
///   stream     size     values            when
///   tracks     2, 4, 3  see `measures`    a point is seen; its id is the landmark
///   known      3        u, v, depth       a point is seen for the first time, and is one of the
///                                         first known_points.count points; replaces its
///                                         observation in tracks; has a covariance unless sigma_px
///                                         is 0
///   odometry   6        vx vy vz wx wy wz each frame except the last
///   relative_  7        see Keyframes     each keyframe, if keyframes are enabled
///   poses
///
/// The camera looks along z, with x to the right and y down. A point is seen if it is in front of
/// the camera and both its exact and its noisy pixel are in the image. Nothing hides a point:
/// surfaces only appear in images. If more than max_features_per_frame points are seen, points of
/// the previous frame have priority, then points with smaller ids. The true values are
/// `cam.position`, `cam.orientation` (world_from_cam), `cam.velocity` (world),
/// `cam.angular_velocity` (cam), and the position of each point. quaternion_pose defines the
/// velocities.
///
/// Random streams 0 to 5 of the seed provide, in this order, points, trajectory, pixels, odometry,
/// image noise and relative poses. Four numbers are drawn for the pixels of each point and frame,
/// whether or not the point is seen.
///
/// Keys         kSceneKeys; keys of the camera in alidade/model/camera.h.
/// Errors       kBadConfig.
/// Source       [MonoSlam2015] sec. 3.
std::unique_ptr<Source> CreateScene(const SourceArguments& arguments);

}  // namespace alidade
