// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/direct_models.h"

#include "alidade/base/error.h"
#include "alidade/state/element_names.h"

namespace alidade::detail {
namespace {

/// Returns the diagonal matrix of the elements, row-major.
std::vector<double> Diagonal(const std::vector<double>& elements) {
  const std::size_t n = elements.size();
  std::vector<double> matrix(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) matrix[i * n + i] = elements[i];
  return matrix;
}

}  // namespace

Space SpaceOf(const Quantity& quantity, const Geometry& geometry, const std::vector<Space>& parts) {
  Space space;
  space.name = quantity.name;
  space.unit = quantity.unit;
  space.doc = quantity.doc;
  space.geometry = geometry;
  space.flags = quantity.flags;
  for (const Space& part : parts) {
    space.parts.push_back(part.name);
    space.part_units.push_back(part.unit);
    for (const std::string& name : ColumnNames(part.name, part)) space.elements.push_back(name);
  }
  if (parts.empty()) space.elements = internal::ElementsOf(quantity.elements, geometry);
  return space;
}

OwnedRole OwnedRoleOf(const Owned& owned, const Space& role) {
  OwnedRole result{owned.mean, Diagonal(owned.sigma), static_cast<OwnedDynamics>(owned.dynamics),
                   Diagonal(owned.density), owned.time_constant_s};
  const std::string defect = internal::CheckOwned(role.geometry, result);
  if (!defect.empty()) {
    throw Error(ExitCode::kPlugin, "the prior or dynamics of role '" + role.name + "' " + defect);
  }
  return result;
}

}  // namespace alidade::detail
