// SPDX-License-Identifier: Apache-2.0
#include "trajectory.h"

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "motion_models/quaternion_pose.h"
#include "points.h"

namespace alidade::scene {
namespace {

/// Function that returns the pose at a time. The velocities of a frame are those that move the
/// camera from the previous frame to this frame:
///
///   v = (r(t) - r(t - dt)) / dt,   omega = Log(q(t - dt)^-1 q(t)) / dt
///
/// With these velocities quaternion_pose reproduces the poses exactly.
using PoseAt = std::function<std::pair<Eigen::Vector3d, Quaternion>(double t_s)>;

/// Returns the times of the items of a list. Either all items have `t_s`, or no item has `t_s`.
/// Times `t_s` must start at 0, increase, and reach last_s. Without `t_s` the times are spread
/// evenly over [0, last_s].
std::vector<double> ReadTimes(const Node& list, const std::vector<Node>& items, double last_s) {
  if (items.empty()) list.Fail("the list is empty", "at least one item");
  std::vector<double> times;
  for (const Node& item : items) {
    const auto time = item.Find("t_s");
    const bool first = times.empty();
    if (!first && time.has_value() != (items.front().Find("t_s").has_value())) {
      item.Fail("only some items have 't_s'", "'t_s' in all items, or in no item");
    }
    if (!time) {
      const double fraction = first ? 0.0 : double(times.size()) / double(items.size() - 1);
      times.push_back(fraction * std::max(last_s, 1e-9));
      continue;
    }
    times.push_back(time->Number());
    if (first && times.back() != 0.0) time->Fail("the first time is not 0", "0 in the first item");
    if (!first && !(times.back() > times[times.size() - 2])) {
      time->Fail("this time is not later than the time of the previous item", "increasing times");
    }
  }
  const auto last_time = items.back().Find("t_s");
  if (last_time && items.size() > 1 && times.back() < last_s * (1.0 - 1e-9)) {
    last_time->Fail("the trajectory ends before the last frame",
                    "at least " + std::to_string(last_s) + " s, or fewer frames");
  }
  return times;
}

std::vector<CameraState> Sample(const PoseAt& pose, std::size_t count, double dt_s) {
  std::vector<CameraState> states;
  auto [previous, q_previous] = pose(-dt_s);
  for (std::size_t k = 0; k < count; ++k) {
    const auto [position, orientation] = pose(static_cast<double>(k) * dt_s);
    CameraState state;
    state.position = ToArray(position);
    state.orientation = orientation;
    state.velocity = ToArray(Eigen::Vector3d((position - previous) / dt_s));
    UnitQuaternion::Minus(orientation.data(), q_previous.data(), state.angular_velocity.data());
    for (double& rate : state.angular_velocity) rate /= dt_s;
    states.push_back(state);
    previous = position;
    q_previous = orientation;
  }
  return states;
}

/// Reads `[{position, target, t_s}, ...]`. Interpolates positions and targets by CubicSpline.
std::vector<CameraState> ReadLookAt(const Node& list, const Eigen::Vector3d& up_direction,
                                    std::size_t count, double dt_s) {
  const std::vector<Node> items = list.Items();
  const std::vector<double> times = ReadTimes(list, items, static_cast<double>(count - 1) * dt_s);
  std::vector<Eigen::Vector3d> positions, targets;
  for (const Node& item : items) {
    positions.push_back(ReadVector(item.At("position", "a way-point")));
    targets.push_back(ReadVector(item.At("target", "a way-point")));
    item.RejectUnread();
  }
  const CubicSpline position(times, positions), target(times, targets);
  const PoseAt pose = [&](double t_s) {
    const Eigen::Vector3d camera = position.At(t_s);
    Quaternion orientation;
    if (!LookAt(camera, target.At(t_s), up_direction, orientation)) {
      list.Fail("at " + std::to_string(t_s) + " s the orientation of the camera is not defined",
                "targets that differ from the position of the camera, and are not directly above "
                "or below it");
    }
    return std::pair(camera, orientation);
  };
  return Sample(pose, count, dt_s);
}

/// Reads `[{position, ORIENTATION, t_s}, ...]`. Interpolates positions by CubicSpline, and
/// orientations by RotationCurve.
std::vector<CameraState> ReadKeyframes(const Node& list, std::size_t count, double dt_s) {
  const std::vector<Node> items = list.Items();
  const std::vector<double> times = ReadTimes(list, items, static_cast<double>(count - 1) * dt_s);
  std::vector<Eigen::Vector3d> positions;
  std::vector<Quaternion> orientations;
  for (const Node& item : items) {
    positions.push_back(ReadVector(item.At("position", "a keyframe")));
    orientations.push_back(ReadOrientation(item));
    item.RejectUnread();
  }
  const CubicSpline position(times, positions);
  const RotationCurve orientation(times, orientations);
  return Sample([&](double t) { return std::pair(position.At(t), orientation.At(t)); }, count,
                dt_s);
}

/// Reads one number for all axes, or three numbers, one for each axis. The numbers must not be
/// negative.
Vector ReadSigmas(const Node& node) {
  const std::vector<double> values = node.Numbers();
  if (values.size() != 1 && values.size() != 3) {
    node.Fail("the list has the wrong length", "one number, or three");
  }
  for (const double value : values) {
    if (value < 0.0) node.Fail("a standard deviation is negative", "numbers of 0 or more");
  }
  return {values.front(), values[values.size() / 2], values.back()};
}

/// Draws a random trajectory with the discrete steps of quaternion_pose.
std::vector<CameraState> DrawTrajectory(const Node& node, std::size_t count, double dt_s,
                                        Random& random) {
  const QuaternionPose model(ReadSigmas(node.At("linear_acceleration", "a random trajectory")),
                             ReadSigmas(node.At("angular_acceleration", "a random trajectory")));
  CameraState state;
  const auto read = [&](const char* key, Vector& destination) {
    if (const auto entry = node.Find(key)) destination = ToArray(ReadVector(*entry));
  };
  read("position", state.position);
  read("velocity", state.velocity);
  read("angular_velocity", state.angular_velocity);
  if (const auto q = node.Find("orientation")) state.orientation = ReadQuaternion(*q);
  node.RejectUnread();
  std::vector<CameraState> states{state};
  while (states.size() < count) {
    const CameraState current = states.back();
    double w[6];
    for (std::size_t i = 0; i < 6; ++i) {
      w[i] = (i < 3 ? model.sigma_a[i] : model.sigma_alpha[i - 3]) * random.Normal();
    }
    CameraState next;
    model.Step(current.position.data(), current.orientation.data(), current.velocity.data(),
               current.angular_velocity.data(), w, dt_s, next.position.data(),
               next.orientation.data(), next.velocity.data(), next.angular_velocity.data());
    UnitQuaternion::Normalise(next.orientation.data());
    states.push_back(next);
  }
  return states;
}

}  // namespace

std::vector<CameraState> ReadTrajectory(const Node& node, std::size_t count, double dt_s,
                                        Random& random) {
  const auto up_node = node.Find("up");
  const auto [kind, value] = OneOf(node, {"look_at", "keyframes", "random"});
  if (up_node && kind != "look_at")
    up_node->Fail("this key has no effect without 'look_at'", "'up' only with 'look_at'");
  const Eigen::Vector3d up_direction =
      up_node ? ReadVector(*up_node) : Eigen::Vector3d(0.0, -1.0, 0.0);
  if (!(up_direction.norm() > 0.0)) {
    up_node->Fail("the vector has length 0", "a vector that is not 0");
  }
  if (kind == "look_at") return ReadLookAt(value, up_direction, count, dt_s);
  if (kind == "keyframes") return ReadKeyframes(value, count, dt_s);
  return DrawTrajectory(value, count, dt_s, random);
}

}  // namespace alidade::scene
