// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alidade/base/eigen_alignment.h"

namespace alidade {

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
    std::vector<double>& piece = pieces_[used_++];
    if (std::ssize(piece) < size) piece.resize(static_cast<std::size_t>(size));
    return piece.data();
  }

  std::vector<std::vector<double>> pieces_;  ///< the first used_ are taken
  std::size_t used_ = 0;
};

}  // namespace alidade
