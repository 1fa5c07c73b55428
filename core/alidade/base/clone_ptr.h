// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

namespace alidade {

/// Owning pointer. A copy of the pointer owns a copy of the T, created by T::Clone() if this
/// function exists, otherwise by the copy constructor. A moved-from pointer may only be assigned to
/// or destroyed. T must be complete only at calls of the constructor.
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
  // The value is never shared. Its pointer is a shared_ptr only because the deleter of a shared_ptr
  // also works for an incomplete T.
  std::shared_ptr<T> value_;
  std::shared_ptr<T> (*copy_)(const T&);
};

}  // namespace alidade
