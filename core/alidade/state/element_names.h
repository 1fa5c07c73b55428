// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/state/manifold.h"

namespace alidade::internal {

/// "x,y,z" in parts; {""} for "".
std::vector<std::string> SplitNames(const std::string& names);
/// Names of the ambient elements: `names` in parts, or those of the geometry, which is no product:
/// w, x, y, z of a quaternion, numbers of a vector.
std::vector<std::string> ElementsOf(const std::string& names, const Geometry& geometry);

/// ColumnNames, or numbers for names where the space names no elements.
std::vector<std::string> AmbientNames(const std::string& name, const Space& space);
/// `name`, or `name.0`, `name.1`, ... where there are several.
std::vector<std::string> NumberedNames(const std::string& name, std::size_t size);

/// `name` or `name.element`, for each tangent element: of a vector as in ColumnNames, of a rotation
/// `name.rx`, `name.ry`, `name.rz`, of a unit vector `name.d0`, `name.d1`.
std::vector<std::string> TangentNames(const std::string& name, const Space& space);

}  // namespace alidade::internal
