// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/state/manifold.h"

namespace alidade::testing {

using Blocks = std::vector<std::vector<double>>;

inline int TangentSize(const std::vector<Space>& spaces) {
  int size = 0;
  for (const Space& space : spaces) size += space.geometry.tangent;
  return size;
}

inline std::vector<const double*> Pointers(const Blocks& blocks) {
  std::vector<const double*> pointers;
  for (const auto& block : blocks) pointers.push_back(block.empty() ? nullptr : block.data());
  return pointers;
}
inline std::vector<double*> Pointers(Blocks& blocks) {
  std::vector<double*> pointers;
  for (auto& block : blocks) pointers.push_back(block.data());
  return pointers;
}

/// Blocks that hold `value` everywhere.
inline Blocks Filled(const std::vector<Space>& spaces, double value) {
  Blocks blocks;
  for (const Space& space : spaces) {
    blocks.emplace_back(static_cast<std::size_t>(space.geometry.ambient), value);
  }
  return blocks;
}

/// d f / d x in the tangent of both, row-major, by central differences through (+) and (-) with one
/// Richardson step: (4 D(h/2) - D(h)) / 3, whose error is of order h^4 f'''''.
template <class F>
std::vector<double> NumericJacobian(const std::vector<Space>& from, const Blocks& x,
                                    const std::vector<Space>& to, const F& f, double h = 1e-3) {
  const int rows = TangentSize(to), columns = TangentSize(from);
  std::vector<double> j(static_cast<std::size_t>(rows * columns));
  const Blocks center = f(x);
  const auto add = [&](std::size_t block, int k, double step, int column, double weight) {
    Blocks moved = x;
    std::vector<double> d(static_cast<std::size_t>(from[block].geometry.tangent));
    d[static_cast<std::size_t>(k)] = step;
    from[block].geometry.Plus(x[block].data(), d.data(), moved[block].data());
    const Blocks y = f(moved);
    int row = 0;
    for (std::size_t i = 0; i < to.size(); ++i) {
      std::vector<double> difference(static_cast<std::size_t>(to[i].geometry.tangent));
      to[i].geometry.Minus(y[i].data(), center[i].data(), difference.data());
      for (const double element : difference) {
        j[static_cast<std::size_t>(row++ * columns + column)] += weight * element;
      }
    }
  };
  int column = 0;
  for (std::size_t block = 0; block < from.size(); ++block) {
    for (int k = 0; k < from[block].geometry.tangent; ++k, ++column) {
      for (const double sign : {1.0, -1.0}) {
        add(block, k, sign * h / 2, column, sign * 4.0 / (3.0 * h));
        add(block, k, sign * h, column, -sign / (6.0 * h));
      }
    }
  }
  return j;
}

}  // namespace alidade::testing
