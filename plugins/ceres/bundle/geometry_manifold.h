// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/manifold.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "alidade/state/manifold.h"

namespace alidade::ceres_batch {

/// Manifold of a parameter block that consists of several parts. Each part moves on its geometry,
/// or is constant.
///
///   x (+) d           Geometry::Plus for each part
///   d(x (+) d)/dd  := [I; 0] for each part, I of the tangent size; no columns for a constant part
///
/// [I; 0] is not the derivative of the ambient values, which models of alidade do not provide. It
/// is the counterpart of the Jacobian [J | 0] that a cost writes, with J in the tangent: Ceres
/// computes [J | 0] [I; 0] = J. Only costs that write [J | 0], such as SensorCost, may use a block
/// with this manifold. Ceres' own QuaternionManifold has another convention.
class GeometryManifold : public ceres::Manifold {
 public:
  struct Part {
    Geometry geometry;
    bool constant = false;
  };
  explicit GeometryManifold(std::vector<Part> parts) : parts_(std::move(parts)) {
    for (const Part& part : parts_) {
      ambient_ += part.geometry.ambient;
      tangent_ += part.constant ? 0 : part.geometry.tangent;
    }
  }

  int AmbientSize() const override { return ambient_; }
  int TangentSize() const override { return tangent_; }
  bool Plus(const double* x, const double* d, double* y) const override {
    for (const Part& part : parts_) {
      const int n = part.geometry.ambient;
      if (part.constant) {
        std::copy_n(x, n, y);
      } else {
        part.geometry.Plus(x, d, y);
        d += part.geometry.tangent;
      }
      x += n;
      y += n;
    }
    return true;
  }
  bool PlusJacobian(const double*, double* j) const override {
    Select(j, tangent_, 1);
    return true;
  }
  bool Minus(const double* y, const double* x, double* d) const override {
    for (const Part& part : parts_) {
      if (!part.constant) {
        part.geometry.Minus(y, x, d);
        d += part.geometry.tangent;
      }
      x += part.geometry.ambient;
      y += part.geometry.ambient;
    }
    return true;
  }
  /// Computes [I 0], the counterpart of PlusJacobian.
  bool MinusJacobian(const double*, double* j) const override {
    Select(j, 1, ambient_);
    return true;
  }

 private:
  /// Sets the elements of j to 0. Then sets the element at (ambient row, tangent column) to 1 for
  /// each element that is not constant.
  void Select(double* j, int row_stride, int column_stride) const {
    std::fill_n(j, ambient_ * tangent_, 0.0);
    int row = 0, column = 0;
    for (const Part& part : parts_) {
      const int free_size = part.constant ? 0 : part.geometry.tangent;
      for (int i = 0; i < free_size; ++i)
        j[(row + i) * row_stride + (column + i) * column_stride] = 1.0;
      row += part.geometry.ambient;
      column += free_size;
    }
  }

  std::vector<Part> parts_;
  int ambient_ = 0, tangent_ = 0;
};

}  // namespace alidade::ceres_batch
