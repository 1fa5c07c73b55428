// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/invariant_group.h"

#include <algorithm>
#include <array>
#include <utility>

namespace alidade::internal {
namespace {

/// Computes M(X). X = X^ Exp(xi) moves positions and velocities by R xi, and the rotation by xi.
/// The right error is Ad_X times the left error.
template <class Group>
Maps MapsOf(const double* x, ErrorSide side) {
  constexpr int n = Group::kTangent;
  GroupMatrix frames(n, n);
  Group::Rotations(x, frames.data());
  if constexpr (n > 3) {
    frames.template block<3, 3>(3, 3).setIdentity();  // both tangents are in the frame of the body
  }
  if (side == ErrorSide::kLeft) return {frames, frames.transpose()};
  std::array<double, Group::kAmbient> inverse;
  GroupMatrix adjoint(n, n), inverse_adjoint(n, n);
  Group::Inverse(x, inverse.data());
  Group::Adjoint(x, adjoint.data());
  Group::Adjoint(inverse.data(), inverse_adjoint.data());
  return {frames * inverse_adjoint, adjoint * frames.transpose()};
}

template <class Group>
GroupInfo InfoOfGroup(std::vector<Geometry> blocks, const char* text) {
  return {std::move(blocks), text, Group::kLeftNumber, Group::kRightNumber, MapsOf<Group>};
}

}  // namespace

const std::vector<GroupInfo>& Groups() {
  static const std::vector<GroupInfo> groups{
      InfoOfGroup<Se2>({Geometry::Vector(2), Geometry::Angle()},
                       "a position in the plane and a heading"),
      InfoOfGroup<Se3>({Geometry::Vector(3), Geometry::UnitQuaternion()},
                       "a position and an orientation"),
      InfoOfGroup<Se23>({Geometry::Vector(3), Geometry::UnitQuaternion(), Geometry::Vector(3)},
                        "a position, an orientation and a velocity")};
  return groups;
}

const GroupInfo* FindGroup(const InvariantError& error, const Problem& problem) {
  std::vector<Geometry> geometries;
  for (const BlockId id : error.blocks) geometries.push_back(problem.layout[id].geometry());
  const auto found = std::ranges::find(Groups(), geometries, &GroupInfo::blocks);
  return found == Groups().end() ? nullptr : &*found;
}

}  // namespace alidade::internal
