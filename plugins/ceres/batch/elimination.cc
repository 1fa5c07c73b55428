// SPDX-License-Identifier: Apache-2.0
#include "elimination.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cstddef>
#include <numeric>

namespace alidade::ceres_batch {
namespace {

constexpr int kMostPivots = 96;      // of a merged front
constexpr double kMostWider = 1.15;  // border and pivots of the next group over the border
constexpr double kMostFlops = 1.3;   // of a merged front over those of its two parts

/// Of a front of p pivots and m rows of border, as Eliminate takes it: B D^-1 B', D^-1 B', D^-1.
double FlopsOf(double p, double m) { return p * m * m + 2.0 * p * p * m + 2.0 / 3.0 * p * p * p; }

/// The tree of the groups, one front each.
struct Tree {
  std::vector<std::vector<int>> border, children;  ///< by group
  std::vector<int> parent;
};

std::vector<int> GroupOf(const Groups& groups, std::size_t variables) {
  std::vector<int> of(variables);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (const int v : groups[g]) of[static_cast<std::size_t>(v)] = static_cast<int>(g);
  }
  return of;
}

Tree TreeOf(const std::vector<std::vector<int>>& adjacent, const Groups& groups) {
  const std::size_t count = groups.size();
  const std::vector<int> group = GroupOf(groups, adjacent.size());
  Tree tree{std::vector<std::vector<int>>(count), std::vector<std::vector<int>>(count),
            std::vector<int>(count, -1)};
  std::vector<int> marked(adjacent.size(), -1);
  const auto at = [&](int v) { return group[static_cast<std::size_t>(v)]; };
  for (std::size_t g = 0; g < count; ++g) {
    const int now = static_cast<int>(g);
    std::vector<int>& border = tree.border[g];
    const auto put = [&](int v) {
      int& mark = marked[static_cast<std::size_t>(v)];
      if (at(v) <= now || mark == now) return;
      mark = now;
      border.push_back(v);
    };
    for (const int v : groups[g]) std::ranges::for_each(adjacent[static_cast<std::size_t>(v)], put);
    for (const int child : tree.children[g]) {
      std::ranges::for_each(tree.border[static_cast<std::size_t>(child)], put);
    }
    std::ranges::sort(border, {}, [&](int v) { return std::pair(at(v), v); });
    if (border.empty()) continue;
    tree.parent[g] = at(border.front());
    tree.children[static_cast<std::size_t>(tree.parent[g])].push_back(now);
  }
  return tree;
}

/// The groups, children before their parents and each subtree on end.
Groups Postordered(const Groups& groups, const Tree& tree) {
  Groups ordered;
  std::vector<std::pair<int, std::size_t>> open;  // group, and its children that are done
  for (std::size_t root = 0; root < groups.size(); ++root) {
    if (tree.parent[root] >= 0) continue;
    open.emplace_back(static_cast<int>(root), 0);
    while (!open.empty()) {
      auto& [g, done] = open.back();
      const std::vector<int>& children = tree.children[static_cast<std::size_t>(g)];
      if (done < children.size()) {
        open.emplace_back(children[done++], 0);
      } else {
        ordered.push_back(groups[static_cast<std::size_t>(g)]);
        open.pop_back();
      }
    }
  }
  return ordered;
}

}  // namespace

Elimination::Elimination(const BlockGraph& graph, const Groups& order) {
  std::vector<std::vector<int>> adjacent(graph.size.size());
  for (const auto& [i, j] : graph.edges) {
    adjacent[static_cast<std::size_t>(i)].push_back(j);
    adjacent[static_cast<std::size_t>(j)].push_back(i);
  }
  const Groups groups = Postordered(order, TreeOf(adjacent, order));
  Tree tree = TreeOf(adjacent, groups);
  const auto rows = [&](const std::vector<int>& variables) {
    return std::accumulate(variables.begin(), variables.end(), 0, [&](int sum, int v) {
      return sum + graph.size[static_cast<std::size_t>(v)];
    });
  };
  std::vector<int> front_of(groups.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    Front front;
    for (;; ++g) {  // the group, and as long as it pays its parent, which comes next
      front_of[g] = static_cast<int>(fronts.size());
      front.pivots.insert(front.pivots.end(), groups[g].begin(), groups[g].end());
      front.p += rows(groups[g]);
      front.m = rows(tree.border[g]);
      const std::size_t next = g + 1;
      if (tree.parent[g] != static_cast<int>(next)) break;
      const int more = rows(groups[next]), border = rows(tree.border[next]);
      if (front.p + more > kMostPivots || more + border > kMostWider * front.m) break;
      const double apart = FlopsOf(front.p, front.m) + FlopsOf(more, border);
      if (FlopsOf(front.p + more, border) > kMostFlops * apart) break;
    }
    front.border = std::move(tree.border[g]);
    front.parent = tree.parent[g];  // a group, as yet
    flops += FlopsOf(front.p, front.m);
    numbers += double(front.p) * (front.p + front.m);
    fronts.push_back(std::move(front));
  }
  for (std::size_t a = 0; a < fronts.size(); ++a) {
    if (fronts[a].parent < 0) continue;
    fronts[a].parent = front_of[static_cast<std::size_t>(fronts[a].parent)];
    fronts[static_cast<std::size_t>(fronts[a].parent)].children.push_back(static_cast<int>(a));
  }
}

Groups MinimumDegree(const BlockGraph& graph, const Groups& groups) {
  constexpr int kRowsOfANode = 3;
  const std::vector<int> group = GroupOf(groups, graph.size.size());
  std::vector<int> first{0}, owner;  // a group is so many nodes that all see the same
  for (std::size_t g = 0; g < groups.size(); ++g) {
    int rows = 0;
    for (const int v : groups[g]) rows += graph.size[static_cast<std::size_t>(v)];
    owner.insert(owner.end(), static_cast<std::size_t>(std::max(1, rows / kRowsOfANode)),
                 static_cast<int>(g));
    first.push_back(static_cast<int>(owner.size()));
  }
  const int last = static_cast<int>(groups.size()) - 1;
  std::vector<std::pair<int, int>> ties;
  for (std::size_t g = 0; g < groups.size(); ++g) ties.emplace_back(g, g);
  for (const auto& [i, j] : graph.edges) {
    const int a = group[static_cast<std::size_t>(i)], b = group[static_cast<std::size_t>(j)];
    if (a != b && a != last && b != last) ties.emplace_back(std::min(a, b), std::max(a, b));
  }
  std::ranges::sort(ties);
  ties.erase(std::unique(ties.begin(), ties.end()), ties.end());
  std::vector<Eigen::Triplet<char>> triplets;
  const auto at = [&](int g) { return first[static_cast<std::size_t>(g)]; };
  for (const auto& [a, b] : ties) {
    for (int i = at(a); i < at(a + 1); ++i) {
      for (int j = at(b); j < at(b + 1); ++j) {
        triplets.emplace_back(i, j, 1);
        if (a != b) triplets.emplace_back(j, i, 1);
      }
    }
  }
  const auto size = static_cast<int>(owner.size());
  Eigen::SparseMatrix<char> pattern(size, size);
  pattern.setFromTriplets(triplets.begin(), triplets.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  Groups ordered;
  std::vector<bool> taken(groups.size(), false);
  taken.back() = true;
  for (int i = 0; i < size; ++i) {
    const auto g =
        static_cast<std::size_t>(owner[static_cast<std::size_t>(permutation.indices()[i])]);
    if (taken[g]) continue;
    taken[g] = true;
    ordered.push_back(groups[g]);
  }
  ordered.push_back(groups.back());
  return ordered;
}

}  // namespace alidade::ceres_batch
