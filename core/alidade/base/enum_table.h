// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace alidade::internal {

/// Returns whether `table` has one entry for each enumerator up to `last`, in the order of the
/// enumeration. `member` is the member of an entry that holds the enumerator.
template <class Table, class Entry, class Enum>
consteval bool HasEntryForEach(const Table& table, Enum Entry::*member, Enum last) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table[i].*member != static_cast<Enum>(i)) return false;
  }
  return table.back().*member == last;
}

}  // namespace alidade::internal
