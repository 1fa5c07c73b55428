// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade::internal {

/// take(value in `from`, value in `to`) for each key of `from`; keys that `to` lacks it gets. Both
/// are maps in the order of their keys. Runs have the same keys as the ones before, mostly: one
/// comparison each, where a search takes several.
template <class From, class To, class Take>
void InStep(const From& from, To& to, const Take& take) {
  auto place = to.begin();
  for (const auto& [key, value] : from) {
    if (place == to.end() || place->first != key) place = to.try_emplace(place, key);
    take(value, place->second);
    ++place;
  }
}

}  // namespace alidade::internal
