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

/// Lists of names, each kept once.
class SharedNames {
 public:
  using List = std::shared_ptr<const std::vector<std::string>>;

  /// The first of those given that is the same.
  const List& Of(const List& names) { return *lists_.insert(names).first; }

 private:
  struct Before {
    bool operator()(const List& a, const List& b) const { return *a < *b; }
  };
  std::set<List, Before> lists_;
};

/// Values by name, in the order of the names. The runs of a sweep have the same names, mostly: they
/// share one list of them, and a run is a row of numbers.
template <class Value>
class NamedValues {
 public:
  NamedValues() : NamedValues(std::map<std::string, Value>()) {}
  explicit NamedValues(const std::map<std::string, Value>& from) {
    std::vector<std::string> names;
    names.reserve(from.size());
    values_.reserve(from.size());
    for (const auto& [name, value] : from) {
      names.push_back(name);
      values_.push_back(value);
    }
    names_ = std::make_shared<const std::vector<std::string>>(std::move(names));
  }

  /// By address the same for all that share it.
  const std::vector<std::string>& names() const { return *names_; }
  const std::vector<Value>& values() const { return values_; }
  /// Null: there is none of that name.
  const Value* Find(std::string_view name) const {
    const auto at = std::ranges::lower_bound(names(), name);
    if (at == names().end() || *at != name) return nullptr;
    return &values_[static_cast<std::size_t>(at - names().begin())];
  }

  /// Of several that have the same names all have one list then.
  void ShareNames(SharedNames& with) { names_ = with.Of(names_); }

 private:
  SharedNames::List names_;
  std::vector<Value> values_;  ///< by name
};

}  // namespace alidade
