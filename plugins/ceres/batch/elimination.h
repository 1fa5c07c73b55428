// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

namespace alidade::ceres_batch {

/// Which blocks of a symmetric matrix are not zero. A variable is some rows on end.
struct BlockGraph {
  std::vector<int> size;                   ///< rows of each variable
  std::vector<std::pair<int, int>> edges;  ///< off the diagonal, in any order, also more than once
};

/// Variables that are eliminated at once, and the order of such groups; each variable is in one.
using Groups = std::vector<std::vector<int>>;

/// The elimination of a BlockGraph as a tree of dense fronts [Duff1983], in postorder:
///
///   front    [D  B'; B  C]   D: p x p of the pivots, C: m x m of the border
///   update   C - B D^-1 B'   is added to the front of the parent
///
/// Groups that follow one another in a chain are one front where few zeros come of it, up to 96
/// pivots.
struct Elimination {
  struct Front {
    std::vector<int> pivots, border;  ///< variables
    int p = 0, m = 0;                 ///< their rows
    int parent = -1;                  ///< -1: a root
    std::vector<int> children;
  };
  std::vector<Front> fronts;
  double flops = 0.0;    ///< of one factorisation
  double numbers = 0.0;  ///< that the factor holds

  Elimination() = default;
  Elimination(const BlockGraph& graph, const Groups& order);
};

/// The groups, one at least, in an order of approximate minimum degree [Amestoy1996], but for the
/// last, which stays there; a group weighs as much as it has rows.
Groups MinimumDegree(const BlockGraph& graph, const Groups& groups);

}  // namespace alidade::ceres_batch
