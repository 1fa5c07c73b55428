// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <new>
#include <vector>

#include "alidade/state/eigen_alignment.h"

namespace alidade {

/// Allocates whole cache lines.
template <class T>
struct CacheLines {
  using value_type = T;  // NOLINT(readability-identifier-naming): of an allocator
  static constexpr std::align_val_t kLine{64};

  CacheLines() = default;
  template <class U>
  CacheLines(const CacheLines<U>& /*other*/) {}  // NOLINT(google-explicit-constructor): as well
  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kLine));
  }
  void deallocate(T* data, std::size_t /*count*/) { ::operator delete(data, kLine); }
  friend bool operator==(const CacheLines& /*a*/, const CacheLines& /*b*/) { return true; }
};

/// Numbers in whole cache lines.
using AlignedNumbers = std::vector<double, CacheLines<double>>;

/// Memory that a copy does not take along.
template <class T>
struct Scratch : T {
  Scratch() = default;
  Scratch(const Scratch& /*other*/) : T() {}
  Scratch& operator=(const Scratch& /*other*/) { return *this; }
};

/// Memory for the matrices of a step or an update, kept from one to the next: where no more and no
/// larger ones are taken than before, nothing is allocated.
class Workspace {
 public:
  using Matrix = Eigen::Map<Eigen::MatrixXd>;
  using Vector = Eigen::Map<Eigen::VectorXd>;

  /// Gives back at its end what was taken while it lived.
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

  /// rows x columns numbers of any value.
  Matrix Take(Eigen::Index rows, Eigen::Index columns) {
    return {Memory(rows * columns), rows, columns};
  }
  /// `size` numbers of any value.
  Vector Take(Eigen::Index size) { return {Memory(size), size}; }

 private:
  double* Memory(Eigen::Index size) {
    if (used_ == pieces_.size()) pieces_.emplace_back();
    Eigen::VectorXd& piece = pieces_[used_++];
    if (piece.size() < size) piece.resize(std::max(size, piece.size() + piece.size() / 2));
    return piece.data();
  }

  std::vector<Eigen::VectorXd> pieces_;  ///< the first used_ are taken
  std::size_t used_ = 0;
};

}  // namespace alidade
