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

/// Pool of lists of names that stores equal lists once.
class SharedNames {
 public:
  using List = std::shared_ptr<const std::vector<std::string>>;

  /// Returns the stored list that equals `names`; stores `names` if there is no such list.
  const List& Intern(const List& names) { return *lists_.insert(names).first; }

 private:
  struct LessByNames {
    bool operator()(const List& a, const List& b) const { return *a < *b; }
  };
  std::set<List, LessByNames> lists_;
};

/// Values by name, in the order of the names. Most runs of a sweep have the same names: they share
/// one list of names, and each stores a row of values only.
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
  /// Returns the value of that name, or null.
  const Value* Find(std::string_view name) const {
    const auto position = std::ranges::lower_bound(names(), name);
    if (position == names().end() || *position != name) return nullptr;
    return &values_[static_cast<std::size_t>(position - names().begin())];
  }

  /// Replaces the list of names by the equal one from the pool.
  void ShareNames(SharedNames& pool) { names_ = pool.Intern(names_); }

 private:
  SharedNames::List names_;
  std::vector<Value> values_;  ///< by name
};

}  // namespace alidade
