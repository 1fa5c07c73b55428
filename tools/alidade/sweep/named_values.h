// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace alidade {

/// Values by name, in the order of the names. The runs of a sweep have the same names, mostly: they
/// share one list of them, and a run is a row of numbers.
template <class Value>
class NamedValues {
 public:
  using Names = std::vector<std::string>;

  NamedValues() = default;
  /// `like`: its names are shared where they are the same.
  explicit NamedValues(const std::map<std::string, Value>& from, const NamedValues& like = {}) {
    const auto is_named = [](const auto& one, const std::string& name) {
      return one.first == name;
    };
    values_.reserve(from.size());
    for (const auto& [name, value] : from) values_.push_back(value);
    if (std::ranges::equal(from, like.names(), is_named)) {
      names_ = like.names_;
      return;
    }
    Names names;
    for (const auto& [name, value] : from) names.push_back(name);
    names_ = std::make_shared<const Names>(std::move(names));
  }

  /// By address the same for all that share it.
  const Names& names() const {
    static const Names none;
    return names_ == nullptr ? none : *names_;
  }
  const std::vector<Value>& values() const { return values_; }
  /// Null: there is none of that name.
  const Value* Find(std::string_view name) const {
    const auto at = std::ranges::lower_bound(names(), name);
    if (at == names().end() || *at != name) return nullptr;
    return &values_[static_cast<std::size_t>(at - names().begin())];
  }

  /// Whether both have the same names, which they share from now on.
  bool ShareNames(const NamedValues& like) {
    if (&names() == &like.names()) return true;
    if (names() != like.names()) return false;
    names_ = like.names_;
    return true;
  }

 private:
  std::shared_ptr<const Names> names_;  ///< null: none
  std::vector<Value> values_;           ///< by name
};

}  // namespace alidade
