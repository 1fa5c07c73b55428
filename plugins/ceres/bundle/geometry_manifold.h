// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/manifold.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "alidade/state/manifold.h"

namespace alidade::ceres_batch {

/// Values side by side in one parameter block, each moved as its geometry says, or constant.
///
///   x (+) d           of each part by Geometry::Plus
///   d(x (+) d)/dd  := [I; 0] of each part, its tangent into the first rows; none of a constant
//part /
/// That is not the derivative by the ambient values, which no model of alidade gives, but its
/// counterpart: a cost writes [J | 0], J in the tangent, and Ceres forms [J | 0] [I; 0] = J. Only
/// costs that do so, as SensorCost, may share a block with it; Ceres' own QuaternionManifold is
/// another convention.
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
  /// [I 0], the counterpart.
  bool MinusJacobian(const double*, double* j) const override {
    Select(j, 1, ambient_);
    return true;
  }

 private:
  /// j = 0, but 1 at (ambient row, tangent column) of each moved element.
  void Select(double* j, int row_stride, int column_stride) const {
    std::fill_n(j, ambient_ * tangent_, 0.0);
    int row = 0, column = 0;
    for (const Part& part : parts_) {
      const int moved = part.constant ? 0 : part.geometry.tangent;
      for (int i = 0; i < moved; ++i)
        j[(row + i) * row_stride + (column + i) * column_stride] = 1.0;
      row += part.geometry.ambient;
      column += moved;
    }
  }

  std::vector<Part> parts_;
  int ambient_ = 0, tangent_ = 0;
};

}  // namespace alidade::ceres_batch
