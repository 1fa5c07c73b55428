// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

namespace alidade {

/// A T somewhere else in memory that is copied with its holder, by T::Clone where it has one. What
/// was moved from may be assigned to or destroyed. T may be incomplete but where one is made.
template <class T>
class ClonePtr {
 public:
  explicit ClonePtr(std::unique_ptr<T> value)
      : value_(std::move(value)), copy_([](const T& of) -> std::shared_ptr<T> {
          if constexpr (requires { of.Clone(); }) {
            return of.Clone();
          } else {
            return std::make_shared<T>(of);
          }
        }) {}
  ClonePtr(const ClonePtr& other) : value_(other.copy_(*other.value_)), copy_(other.copy_) {}
  ClonePtr& operator=(const ClonePtr& other) { return *this = ClonePtr(other); }
  ClonePtr(ClonePtr&& other) noexcept = default;
  ClonePtr& operator=(ClonePtr&& other) noexcept = default;
  ~ClonePtr() = default;

  T& operator*() { return *value_; }
  const T& operator*() const { return *value_; }
  T* operator->() { return value_.get(); }
  const T* operator->() const { return value_.get(); }

 private:
  std::shared_ptr<T> value_;  // never shared: it knows how to delete a T that is incomplete here
  std::shared_ptr<T> (*copy_)(const T&);
};

}  // namespace alidade
