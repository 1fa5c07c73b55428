// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace alidade {

/// Pool of lists of names, in which equal lists are stored only once.
class SharedNames {
 public:
  using List = std::shared_ptr<const std::vector<std::string>>;

  /// Returns the stored list that equals `names`. If there is no such list, stores `names`.
  const List& Intern(const List& names) { return *lists_.insert(names).first; }

 private:
  struct LessByNames {
    bool operator()(const List& a, const List& b) const { return *a < *b; }
  };
  std::set<List, LessByNames> lists_;
};

/// Values by name, sorted by name. Most runs of a sweep have the same names. These runs share one
/// list of names, and each run stores only its values.
template <class Value>
class NamedValues {
 public:
  NamedValues() : NamedValues(std::map<std::string, Value>()) {}
  explicit NamedValues(const std::map<std::string, Value>& map) {
    std::vector<std::string> names;
    names.reserve(map.size());
    values_.reserve(map.size());
    for (const auto& [name, value] : map) {
      names.push_back(name);
      values_.push_back(value);
    }
    names_ = std::make_shared<const std::vector<std::string>>(std::move(names));
  }

  /// Returns the list of names. Objects that share a list return the same address.
  const std::vector<std::string>& names() const { return *names_; }
  const std::vector<Value>& values() const { return values_; }
  /// Returns the value with the given name, or null if there is no such value.
  const Value* Find(std::string_view name) const {
    const auto position = std::ranges::lower_bound(names(), name);
    if (position == names().end() || *position != name) return nullptr;
    return &values_[static_cast<std::size_t>(position - names().begin())];
  }

  /// Replaces the list of names by the equal list in the pool.
  void ShareNames(SharedNames& pool) { names_ = pool.Intern(names_); }

 private:
  SharedNames::List names_;
  std::vector<Value> values_;  ///< in the order of the names
};

}  // namespace alidade
