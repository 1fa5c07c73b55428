// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "kkt_system.h"

/// Landmarks whose optimum is at the edge of where their models are defined, as that of a stereo
/// pair whose disparity wants to be negative. Such a one is held: it goes along the edge alone, and
/// what is solved for is the optimum of all others given that. With the outward normal n of the
/// edge, in the landmark's inputs l, and the gradient b of what it costs alone,
///
///   n' dl = 0,   n' b < 0:  it would cost less outside. Else it is let go.
namespace alidade::ceres_batch {
namespace {

constexpr double kFromEdge = 1e-9;  // sigma: where it is held

}  // namespace

bool KktSystem::IsDefined(const MapLandmark& landmark, const Eigen::VectorXd& l,
                          const std::vector<Point>& points) const {
  Inverse place;
  Eigen::VectorXd r;
  if (!run_.Place(landmark, l, points, place)) return false;
  return std::ranges::all_of(landmark.observations, [&](const MapLandmark::Observation& seen) {
    const Factor& factor = run_.epochs_[seen.epoch].factors[seen.factor];
    return factor.left_out ||
           run_.Residual(factor, run_.Joined(points[seen.epoch].x, place.y), r, nullptr);
  });
}

/// The t in [from, to] where l + t s leaves the domain, |s| = 1. Nothing where it does not.
std::optional<double> KktSystem::EdgeAlong(const MapLandmark& landmark, const Eigen::VectorXd& l,
                                           const Eigen::VectorXd& s, double from, double to,
                                           const std::vector<Point>& points) const {
  constexpr double kWithin = 1e-3 * kFromEdge;
  if (!IsDefined(landmark, l + from * s, points) || IsDefined(landmark, l + to * s, points)) {
    return {};
  }
  while (to - from > kWithin) {
    const double middle = 0.5 * (from + to);
    if (!(middle > from && middle < to)) break;
    (IsDefined(landmark, l + middle * s, points) ? from : to) = middle;
  }
  return from;
}

/// n where l + t s is at the edge: from l + d it is reached at another t, dt = -n' d / n' s.
std::optional<Eigen::VectorXd> KktSystem::NormalOfEdge(const MapLandmark& landmark,
                                                       const Eigen::VectorXd& l,
                                                       const Eigen::VectorXd& s, double t,
                                                       const std::vector<Point>& points) const {
  constexpr double kAside = 1e-3, kReach = 0.1;  // sigma
  Eigen::VectorXd n(l.size());
  for (Eigen::Index i = 0; i < l.size(); ++i) {
    const Eigen::VectorXd aside = l + kAside * Eigen::VectorXd::Unit(l.size(), i);
    const auto at = EdgeAlong(landmark, aside, s, t - kReach, t + kReach, points);
    if (!at) return {};
    n[i] = t - *at;
  }
  if (!(n.norm() > 0.0)) return {};
  return n.normalized();
}

void KktSystem::NoteUndefined(const Eigen::VectorXd& z) {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const MapLandmark& landmark = run_.landmarks_[i];
    const Eigen::VectorXd l = z.segment(points_[i].column, landmark.from.size());
    if (l.size() > 0 && !IsDefined(landmark, l, at_)) ++points_[i].refused;
  }
}

bool KktSystem::HoldAtEdge(Eigen::VectorXd& z) {
  constexpr int kPatience = 1;  // steps out of the domain; more of one that was let go
  const auto waits = [](const Point3& point) {
    return point.edge.size() > 0 || point.refused < kPatience << std::min(point.released, 20);
  };
  std::vector<Point> points;
  if (std::ranges::all_of(points_, waits)) return false;
  if (!run_.PointsOf(z.head(run_.inputs_), false, points)) return false;
  bool any = false;
  CondensedRun::Normal now, then;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Point3& point = points_[i];
    if (waits(point)) continue;
    const MapLandmark& landmark = run_.landmarks_[i];
    auto at = z.segment(point.column, landmark.from.size());
    const Eigen::VectorXd l = at;
    const auto normal_of = [&](const Eigen::VectorXd& of, CondensedRun::Normal& normal) {
      return run_.NormalOf(landmark, of, points, CondensedRun::Undefined::kFails, normal, nullptr);
    };
    if (!normal_of(l, now)) continue;
    const Eigen::VectorXd step = -now.c.llt().solve(now.b), s = step.normalized();
    const auto t = EdgeAlong(landmark, l, s, 0.0, step.norm(), points);
    if (!t) continue;
    const auto n = NormalOfEdge(landmark, l, s, *t, points);
    const Eigen::VectorXd held = l + std::max(0.0, *t - kFromEdge) * s;
    if (!n || !normal_of(held, then) || then.cost > now.cost || n->dot(then.b) >= 0.0) continue;
    at = held;
    point.edge = *n;
    any = true;
  }
  return any;
}

bool KktSystem::PutOnEdge(Eigen::VectorXd& z) {
  constexpr double kReach = 1.0;  // sigma
  std::vector<Point> points;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Point3& point = points_[i];
    if (point.edge.size() == 0) continue;
    if (points.empty() && !run_.PointsOf(z.head(run_.inputs_), false, points)) return false;
    const MapLandmark& landmark = run_.landmarks_[i];
    auto l = z.segment(point.column, landmark.from.size());
    const auto t = EdgeAlong(landmark, l, point.edge, -kReach, kReach, points);
    if (!t) {
      if (!IsDefined(landmark, l, points)) return false;
      continue;
    }
    const auto n = NormalOfEdge(landmark, l, point.edge, *t, points);
    l += (*t - kFromEdge) * point.edge;
    if (n) point.edge = *n;
  }
  return true;
}

bool KktSystem::LetGoOfEdge(const Eigen::VectorXd& z) {
  std::vector<Point> points;
  bool any = false;
  CondensedRun::Normal normal;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Point3& point = points_[i];
    if (point.edge.size() == 0) continue;
    if (points.empty() && !run_.PointsOf(z.head(run_.inputs_), false, points)) return false;
    const MapLandmark& landmark = run_.landmarks_[i];
    const Eigen::VectorXd l = z.segment(point.column, landmark.from.size());
    const bool stays =
        run_.NormalOf(landmark, l, points, CondensedRun::Undefined::kFails, normal, nullptr) &&
        point.edge.dot(normal.b) < 0.0 &&
        !IsDefined(landmark, l + 10.0 * kFromEdge * point.edge, points);
    if (stays) continue;
    point.edge.resize(0);
    point.refused = 0;
    ++point.released;
    any = true;
  }
  return any;
}

std::vector<std::int64_t> KktSystem::AtEdge() const {
  std::vector<std::int64_t> ids;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].edge.size() > 0) ids.push_back(run_.landmarks_[i].id);
  }
  return ids;
}

void KktSystem::FreeAtEdge() {
  for (Point3& point : points_) point.edge.resize(0);
}

}  // namespace alidade::ceres_batch
