// SPDX-License-Identifier: Apache-2.0
#include "alidade/system/landmark_form.h"

#include <algorithm>
#include <iterator>

#include "alidade/model/landmark.h"

namespace alidade {
namespace {

/// Whether the landmark roles are those of the form.
template <class Form>
bool Writes(const std::vector<Space>& roles) {
  constexpr int count = detail::Blocks<Form>::kCount;
  bool same = std::ssize(roles) == count;
  const auto compare = [&](auto index) {
    constexpr int i = decltype(index)::value;
    using G = detail::SpaceAt<i, Form>;
    if (!same) return;
    const Space& role = roles[static_cast<std::size_t>(i)];
    same = role.name == Form::kRoles[static_cast<std::size_t>(i)].name &&
           role.geometry ==
               Geometry{static_cast<GeometryKind>(G::kGeometry), G::kAmbient, G::kTangent};
  };
  detail::ForEach(compare, typename detail::Blocks<Form>::Indices{});
  return same;
}

}  // namespace

const char* ToString(LandmarkForm form) { return kLandmarkForms[static_cast<int>(form)]; }

bool IsXyz(LandmarkForm form) { return form == LandmarkForm::kXyz; }

std::optional<LandmarkForm> FormOf(const std::vector<Space>& roles) {
  std::vector<Space> own;
  std::ranges::copy_if(roles, std::back_inserter(own), &Space::landmark);
  if (Writes<InverseDepth>(own)) return LandmarkForm::kInverseDepth;
  if (Writes<Anchored>(own)) return LandmarkForm::kAnchored;
  if (Writes<Xyz>(own)) return LandmarkForm::kXyz;
  return std::nullopt;
}

std::optional<internal::LandmarkPoint> internal::PointOf(LandmarkForm form,
                                                         const double* const* blocks) {
  return WithForm(form, [&](auto chosen) -> std::optional<LandmarkPoint> {
    using Form = decltype(chosen);
    constexpr int n = detail::Blocks<Form>::kTangent;
    LandmarkPoint point;
    Eigen::Matrix<double, 3, n, Eigen::RowMajor> jacobian;
    if (ToXyz<Form>(blocks, point.position.data(), {jacobian.data(), n}) != Status::kOk) {
      return std::nullopt;
    }
    point.jacobian = jacobian;
    return point;
  });
}

LandmarkForm internal::XyzForm() { return LandmarkForm::kXyz; }

double internal::LinearityOf(LandmarkForm form, const double* const* blocks, double sigma,
                             const double* camera) {
  return WithForm(form, [&](auto chosen) {
    return LinearityIndex(RayOf<decltype(chosen)>(blocks), sigma, camera);
  });
}

}  // namespace alidade
