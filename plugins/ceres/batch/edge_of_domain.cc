// SPDX-License-Identifier: Apache-2.0
#include "edge_of_domain.h"

#include <algorithm>
#include <cmath>

#include "alidade/state/dense_algebra.h"

namespace alidade::ceres_batch {
namespace {

constexpr double kFromEdge = 1e-9;  // sigma: where it is held

}  // namespace

bool EdgeOfDomain::IsDefined(const MapLandmark& landmark, const Eigen::VectorXd& l,
                             const std::vector<Point>& points) const {
  CondensedRun::Inverse place;
  Eigen::VectorXd r;
  if (!run_.Place(landmark, l, points, place)) return false;
  return std::ranges::all_of(landmark.observations, [&](const MapLandmark::Observation& seen) {
    const Factor& factor = run_.epochs_[seen.epoch].factors[seen.factor];
    return factor.left_out ||
           run_.Residual(factor, run_.Joined(points[seen.epoch].x, place.y), r, nullptr);
  });
}

/// The t in [from, to] where l + t s leaves the domain, |s| = 1. Nothing where it does not.
std::optional<double> EdgeOfDomain::EdgeAlong(const MapLandmark& landmark, const Eigen::VectorXd& l,
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
std::optional<Eigen::VectorXd> EdgeOfDomain::NormalOfEdge(const MapLandmark& landmark,
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

/// take(landmark, what is known of its edge, first column of its inputs in z), for each.
template <class Take>
void EdgeOfDomain::ForEach(const Take& take) {
  Eigen::Index column = run_.inputs_;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    take(run_.landmarks_[i], landmarks_[i], column);
    column += run_.landmarks_[i].from.size();
  }
}

bool EdgeOfDomain::HoldsAny() const {
  return std::ranges::any_of(landmarks_,
                             [](const Landmark& known) { return known.normal.size() > 0; });
}

void EdgeOfDomain::NoteUndefined(const Eigen::VectorXd& z, const std::vector<Point>& points) {
  ForEach([&](const MapLandmark& landmark, Landmark& known, Eigen::Index column) {
    const Eigen::VectorXd l = z.segment(column, landmark.from.size());
    if (l.size() > 0 && !IsDefined(landmark, l, points)) ++known.refused;
  });
}

bool EdgeOfDomain::Hold(Eigen::VectorXd& z) {
  constexpr int kPatience = 1;  // steps out of the domain; more of one that was let go
  const auto waits = [](const Landmark& known) {
    return known.normal.size() > 0 || known.refused < kPatience << std::min(known.released, 20);
  };
  std::vector<Point> points;
  if (std::ranges::all_of(landmarks_, waits)) return false;
  if (!run_.PointsOf(z.head(run_.inputs_), false, points)) return false;
  bool any = false;
  CondensedRun::Normal now, then;
  ForEach([&](const MapLandmark& landmark, Landmark& known, Eigen::Index column) {
    if (waits(known)) return;
    auto at = z.segment(column, landmark.from.size());
    const Eigen::VectorXd l = at;
    const auto normal_of = [&](const Eigen::VectorXd& of, CondensedRun::Normal& normal) {
      return run_.NormalOf(landmark, of, points, CondensedRun::Undefined::kFails, normal, nullptr);
    };
    if (!normal_of(l, now)) return;
    const Eigen::VectorXd step = -internal::SolvePositive(now.c, now.b), s = step.normalized();
    const auto t = EdgeAlong(landmark, l, s, 0.0, step.norm(), points);
    if (!t) return;
    const auto n = NormalOfEdge(landmark, l, s, *t, points);
    const Eigen::VectorXd held = l + std::max(0.0, *t - kFromEdge) * s;
    if (!n || !normal_of(held, then) || then.cost > now.cost || n->dot(then.b) >= 0.0) return;
    at = held;
    known.normal = *n;
    any = true;
  });
  return any;
}

bool EdgeOfDomain::PutBack(Eigen::VectorXd& z) {
  constexpr double kReach = 1.0;  // sigma
  if (!HoldsAny()) return true;
  std::vector<Point> points;
  if (!run_.PointsOf(z.head(run_.inputs_), false, points)) return false;
  bool defined = true;
  ForEach([&](const MapLandmark& landmark, Landmark& known, Eigen::Index column) {
    if (known.normal.size() == 0 || !defined) return;
    auto l = z.segment(column, landmark.from.size());
    const auto t = EdgeAlong(landmark, l, known.normal, -kReach, kReach, points);
    if (!t) {
      defined = IsDefined(landmark, l, points);
      return;
    }
    const auto n = NormalOfEdge(landmark, l, known.normal, *t, points);
    l += (*t - kFromEdge) * known.normal;
    if (n) known.normal = *n;
  });
  return defined;
}

bool EdgeOfDomain::LetGo(const Eigen::VectorXd& z) {
  std::vector<Point> points;
  if (!HoldsAny() || !run_.PointsOf(z.head(run_.inputs_), false, points)) return false;
  bool any = false;
  CondensedRun::Normal normal;
  ForEach([&](const MapLandmark& landmark, Landmark& known, Eigen::Index column) {
    if (known.normal.size() == 0) return;
    const Eigen::VectorXd l = z.segment(column, landmark.from.size());
    const bool stays =
        run_.NormalOf(landmark, l, points, CondensedRun::Undefined::kFails, normal, nullptr) &&
        known.normal.dot(normal.b) < 0.0 &&
        !IsDefined(landmark, l + 10.0 * kFromEdge * known.normal, points);
    if (stays) return;
    known.normal.resize(0);
    known.refused = 0;
    ++known.released;
    any = true;
  });
  return any;
}

std::vector<std::int64_t> EdgeOfDomain::Held() const {
  std::vector<std::int64_t> ids;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (holds(i)) ids.push_back(run_.landmarks_[i].id);
  }
  return ids;
}

void EdgeOfDomain::Free() {
  for (Landmark& known : landmarks_) known.normal.resize(0);
}

}  // namespace alidade::ceres_batch
