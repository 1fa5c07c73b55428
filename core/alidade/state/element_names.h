// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/state/manifold.h"

namespace alidade::internal {

/// Splits "x,y,z" at its commas; {""} for "".
std::vector<std::string> SplitNames(const std::string& names);
/// Names of the ambient elements: `names`, split, or those of the geometry, which is not a product
/// (w, x, y, z of a quaternion, numbers of a vector).
std::vector<std::string> ElementsOf(const std::string& names, const Geometry& geometry);

/// ColumnNames, or NumberedNames if the space does not name its elements.
std::vector<std::string> AmbientNames(const std::string& name, const Space& space);
/// `name` for one element, else `name.0`, `name.1` and so on.
std::vector<std::string> NumberedNames(const std::string& name, std::size_t size);

/// `name` or `name.element` for each tangent element: as ColumnNames for a vector, `name.rx`,
/// `name.ry`, `name.rz` for a rotation, `name.d0`, `name.d1` for a unit vector.
std::vector<std::string> TangentNames(const std::string& name, const Space& space);

}  // namespace alidade::internal
