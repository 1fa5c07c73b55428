// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace alidade::internal {

/// Width of text that is not printed on a terminal.
inline constexpr std::size_t kDefaultTextWidth = 100;

/// Wraps each line that is wider than `width` at its blanks. A word is never divided. The
/// continuation lines are indented to the last column of the line if this column begins in its
/// first half; a column begins after two or more blanks. Otherwise they are indented by `indent`
/// more blanks than the line.
std::string WrapText(std::string_view text, std::size_t width, std::size_t indent = 2);

}  // namespace alidade::internal
