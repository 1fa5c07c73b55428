// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <new>
#include <vector>

#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Allocator whose memory begins at a cache line.
template <class T>
struct CacheLines {
  using value_type = T;  // NOLINT(readability-identifier-naming): standard name
  static constexpr std::align_val_t kLine{64};

  CacheLines() = default;
  template <class U>
  CacheLines(const CacheLines<U>& /*other*/) {}  // NOLINT(google-explicit-constructor): required
  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kLine));
  }
  void deallocate(T* data, std::size_t /*count*/) { ::operator delete(data, kLine); }
  friend bool operator==(const CacheLines& /*a*/, const CacheLines& /*b*/) { return true; }
};

/// Numbers in memory that begins at a cache line.
using AlignedNumbers = std::vector<double, CacheLines<double>>;

/// Scratch memory. A copy of the object that contains a Scratch does not copy the memory.
template <class T>
struct Scratch : T {
  Scratch() = default;
  Scratch(const Scratch& /*other*/) : T() {}
  Scratch& operator=(const Scratch& /*other*/) { return *this; }
};

/// Memory for the matrices of a step or an update. Later steps and updates reuse the memory. New
/// memory is allocated only if a step or update needs more or larger matrices than before.
class Workspace {
 public:
  using Matrix = Eigen::Map<Eigen::MatrixXd>;
  using Vector = Eigen::Map<Eigen::VectorXd>;

  /// Scope in which memory is used. The destructor releases the memory that Take returned after the
  /// construction of this object.
  class Use {
   public:
    explicit Use(Workspace& workspace) : workspace_(workspace), used_(workspace.used_) {}
    ~Use() { workspace_.used_ = used_; }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    Workspace& workspace_;
    std::size_t used_;
  };

  /// Returns an uninitialised matrix.
  Matrix Take(Eigen::Index rows, Eigen::Index columns) {
    return {Memory(rows * columns), rows, columns};
  }
  /// Returns an uninitialised vector.
  Vector Take(Eigen::Index size) { return {Memory(size), size}; }

 private:
  double* Memory(Eigen::Index size) {
    if (used_ == buffers_.size()) buffers_.emplace_back();
    Eigen::VectorXd& buffer = buffers_[used_++];
    if (buffer.size() < size) buffer.resize(std::max(size, buffer.size() + buffer.size() / 2));
    return buffer.data();
  }

  std::vector<Eigen::VectorXd> buffers_;  ///< buffers, of which the first used_ are in use
  std::size_t used_ = 0;
};

}  // namespace alidade
