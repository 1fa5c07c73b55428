// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/state/manifold.h"

namespace alidade::internal {

/// Splits a text such as "x,y,z" at its commas and removes spaces. Returns {""} for "".
std::vector<std::string> SplitNames(const std::string& names);
/// Returns the names of the ambient elements. These are the parts of `names`, or the default names
/// of the geometry if `names` is "". The default names are w, x, y, z for a quaternion, numbers for
/// a vector, and "" for a scalar. The geometry must not be a product.
std::vector<std::string> ElementsOf(const std::string& names, const Geometry& geometry);

/// Returns ColumnNames(), or NumberedNames() if the space does not name its elements.
std::vector<std::string> AmbientNames(const std::string& name, const Space& space);
/// Returns `name` if `size` is 1, else `name.0`, `name.1` and so on.
std::vector<std::string> NumberedNames(const std::string& name, std::size_t size);

/// Returns a name for each tangent element: ColumnNames() for a vector, `name.rx`, `name.ry`,
/// `name.rz` for a rotation, `name.d0`, `name.d1` for a unit vector.
std::vector<std::string> TangentNames(const std::string& name, const Space& space);

}  // namespace alidade::internal
