// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace alidade::cli {

/// Returns the line of a file to which an error message refers, and a second line with `^` below
/// the column. `message` begins with `FILE:LINE:COL`. Returns "" if it does not, or if FILE is not
/// a regular file that contains this line.
std::string Excerpt(std::string_view message);

}  // namespace alidade::cli
