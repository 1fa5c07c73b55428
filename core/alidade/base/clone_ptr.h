// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

namespace alidade {

/// Owning pointer whose copy owns a copy of the T, made by T::Clone() if T has this function. A
/// moved-from pointer may only be assigned to or destroyed. T may be incomplete, except when the
/// constructor is called.
template <class T>
class ClonePtr {
 public:
  explicit ClonePtr(std::unique_ptr<T> value)
      : value_(std::move(value)), copy_([](const T& source) -> std::shared_ptr<T> {
          if constexpr (requires { source.Clone(); }) {
            return source.Clone();
          } else {
            return std::make_shared<T>(source);
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
  // Has one owner; the deleter of a shared_ptr also works for an incomplete T.
  std::shared_ptr<T> value_;
  std::shared_ptr<T> (*copy_)(const T&);
};

}  // namespace alidade
