// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/landmark_representation.h"

#include <algorithm>
#include <iterator>

#include "alidade/model/landmark.h"

namespace alidade {
namespace {

static_assert(detail::RepresentationTraits<LandmarkRepresentations>::kMaxTangent <=
              internal::kMaxLandmarkTangent);

/// Returns whether the landmark roles equal the roles of the representation.
template <class Representation>
bool HasRoles(const std::vector<Space>& roles) {
  constexpr int count = detail::Blocks<Representation>::kCount;
  bool is_same = std::ssize(roles) == count;
  const auto compare = [&](auto index) {
    constexpr int i = decltype(index)::value;
    using G = detail::SpaceAt<i, Representation>;
    if (!is_same) return;
    const Space& role = roles[static_cast<std::size_t>(i)];
    is_same = role.name == Representation::kRoles[static_cast<std::size_t>(i)].name &&
              role.geometry == Geometry::Of<G>();
  };
  detail::ForEach(compare, typename detail::Blocks<Representation>::Indices{});
  return is_same;
}

}  // namespace

const char* ToString(LandmarkRepresentation representation) {
  return kLandmarkRepresentations[static_cast<std::size_t>(representation)];
}

bool IsXyz(LandmarkRepresentation representation) {
  return WithRepresentation(representation, [](auto traits) { return decltype(traits)::kIsXyz; });
}

std::optional<LandmarkRepresentation> RepresentationOf(const std::vector<Space>& roles) {
  std::vector<Space> landmark_roles;
  std::ranges::copy_if(roles, std::back_inserter(landmark_roles), &Space::landmark);
  for (std::size_t i = 0; i < kLandmarkRepresentations.size(); ++i) {
    const auto representation = static_cast<LandmarkRepresentation>(i);
    const bool is_same = WithRepresentation(
        representation, [&](auto traits) { return HasRoles<decltype(traits)>(landmark_roles); });
    if (is_same) return representation;
  }
  return std::nullopt;
}

std::optional<internal::LandmarkPoint> internal::PointOf(LandmarkRepresentation representation,
                                                         const double* const* blocks) {
  return WithRepresentation(representation, [&](auto traits) -> std::optional<LandmarkPoint> {
    using Representation = decltype(traits);
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
  return WithRepresentation(representation, [&](auto traits) {
    return LinearityIndex(RayOf<decltype(traits)>(blocks), sigma, camera);
  });
}

}  // namespace alidade
