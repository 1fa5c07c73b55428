// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/landmark_representation.h"

#include <algorithm>
#include <iterator>

#include "alidade/model/landmark.h"

namespace alidade {
namespace {

/// Whether the landmark roles are those of the representation.
template <class Representation>
bool Writes(const std::vector<Space>& roles) {
  constexpr int count = detail::Blocks<Representation>::kCount;
  bool same = std::ssize(roles) == count;
  const auto compare = [&](auto index) {
    constexpr int i = decltype(index)::value;
    using G = detail::SpaceAt<i, Representation>;
    if (!same) return;
    const Space& role = roles[static_cast<std::size_t>(i)];
    same = role.name == Representation::kRoles[static_cast<std::size_t>(i)].name &&
           role.geometry == Geometry::Of<G>();
  };
  detail::ForEach(compare, typename detail::Blocks<Representation>::Indices{});
  return same;
}

}  // namespace

const char* ToString(LandmarkRepresentation representation) {
  return kLandmarkRepresentations[static_cast<int>(representation)];
}

bool IsXyz(LandmarkRepresentation representation) {
  return representation == LandmarkRepresentation::kXyz;
}

std::optional<LandmarkRepresentation> RepresentationOf(const std::vector<Space>& roles) {
  std::vector<Space> own;
  std::ranges::copy_if(roles, std::back_inserter(own), &Space::landmark);
  if (Writes<InverseDepth>(own)) return LandmarkRepresentation::kInverseDepth;
  if (Writes<Anchored>(own)) return LandmarkRepresentation::kAnchored;
  if (Writes<Xyz>(own)) return LandmarkRepresentation::kXyz;
  return std::nullopt;
}

std::optional<internal::LandmarkPoint> internal::PointOf(LandmarkRepresentation representation,
                                                         const double* const* blocks) {
  return WithRepresentation(representation, [&](auto chosen) -> std::optional<LandmarkPoint> {
    using Representation = decltype(chosen);
    constexpr int n = detail::Blocks<Representation>::kTangent;
    LandmarkPoint point;
    Eigen::Matrix<double, 3, n, Eigen::RowMajor> jacobian;
    if (ConvertToXyz<Representation>(blocks, point.position.data(), {jacobian.data(), n}) !=
        Status::kOk) {
      return std::nullopt;
    }
    point.jacobian = jacobian;
    return point;
  });
}

LandmarkRepresentation internal::XyzRepresentation() { return LandmarkRepresentation::kXyz; }

double internal::LinearityOf(LandmarkRepresentation representation, const double* const* blocks,
                             double sigma, const double* camera) {
  return WithRepresentation(representation, [&](auto chosen) {
    return LinearityIndex(RayOf<decltype(chosen)>(blocks), sigma, camera);
  });
}

}  // namespace alidade
