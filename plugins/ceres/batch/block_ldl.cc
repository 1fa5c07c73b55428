// SPDX-License-Identifier: Apache-2.0
#include "block_ldl.h"

#include <algorithm>
#include <utility>

#include "dense_front.h"

namespace alidade::ceres_batch {

int BlockLdl::AddVariable(int size) {
  graph_.size.push_back(size);
  rows_.push_back(size_);
  size_ += size;
  return static_cast<int>(rows_.size()) - 1;
}

std::size_t BlockLdl::AddBlock(int i, int j) {
  if (i != j) graph_.edges.emplace_back(i, j);
  places_.push_back({i, j, used_});
  used_ += Eigen::Index{SizeOf(i)} * SizeOf(j);
  return places_.size() - 1;
}

Eigen::Map<Eigen::MatrixXd> BlockLdl::Block(std::size_t block) {
  const Place& place = places_[block];
  return {values_.data() + place.at, SizeOf(place.i), SizeOf(place.j)};
}

Eigen::Map<const Eigen::MatrixXd> BlockLdl::Block(std::size_t block) const {
  const Place& place = places_[block];
  return {values_.data() + place.at, SizeOf(place.i), SizeOf(place.j)};
}

void BlockLdl::Use(Elimination elimination) {
  elimination_ = std::move(elimination);
  values_.setZero(used_);
  factors_.assign(elimination_.fronts.size(), {});
  local_.assign(rows_.size(), 0);
  std::vector<std::size_t> front(rows_.size());
  for (std::size_t a = 0; a < factors_.size(); ++a) {
    for (const int v : elimination_.fronts[a].pivots) front[static_cast<std::size_t>(v)] = a;
  }
  for (std::size_t b = 0; b < places_.size(); ++b) {
    const auto [i, j, at] = places_[b];
    factors_[std::min(front[static_cast<std::size_t>(i)], front[static_cast<std::size_t>(j)])]
        .blocks.push_back(b);
  }
}

/// Gives each variable its first row among those given, one after the other.
template <class Visit>
void BlockLdl::ForEachPart(const std::vector<int>& variables, Visit visit) const {
  int at = 0;
  for (const int v : variables) {
    visit(v, at);
    at += SizeOf(v);
  }
}

void BlockLdl::Locate(const Front& front) {
  const auto place = [&](int shift) {
    return [this, shift](int v, int at) { local_[static_cast<std::size_t>(v)] = shift + at; };
  };
  ForEachPart(front.pivots, place(0));
  ForEachPart(front.border, place(front.p));
}

/// Adds the update of a child to the front that was located last.
void BlockLdl::Extend(const Front& child, const Eigen::MatrixXd& update,
                      Eigen::MatrixXd& into) const {
  std::vector<RowRun> runs;
  ForEachPart(child.border, [&](int v, int at) {
    Append({at, local_[static_cast<std::size_t>(v)], SizeOf(v)}, runs);
  });
  AddByRuns(runs, update, into);
}

bool BlockLdl::Factorise() {
  Eigen::MatrixXd f;
  for (std::size_t a = 0; a < factors_.size(); ++a) {
    const Front& front = elimination_.fronts[a];
    Factor& factor = factors_[a];
    const int p = front.p, m = front.m;
    Locate(front);
    f.setZero(p + m, p + m);  // the lower triangle counts
    for (const std::size_t b : factor.blocks) {
      const auto [vi, vj, at] = places_[b];
      const auto block = Block(b);
      const int i = local_[static_cast<std::size_t>(vi)], j = local_[static_cast<std::size_t>(vj)];
      if (i >= j) {
        f.block(i, j, block.rows(), block.cols()) += block;
      } else {
        f.block(j, i, block.cols(), block.rows()) += block.transpose();
      }
    }
    for (const int c : front.children) {
      Factor& child = factors_[static_cast<std::size_t>(c)];
      Extend(elimination_.fronts[static_cast<std::size_t>(c)], child.update, f);
      child.update.resize(0, 0);
    }
    if (!Eliminate(f, p, factor.d, factor.x, factor.update)) return false;
  }
  return true;
}

Eigen::VectorXd BlockLdl::Gather(const std::vector<int>& variables, int rows,
                                 const Eigen::VectorXd& from) const {
  Eigen::VectorXd part(rows);
  ForEachPart(variables, [&](int v, int at) {
    part.segment(at, SizeOf(v)) = from.segment(RowOf(v), SizeOf(v));
  });
  return part;
}

void BlockLdl::SolveOnce(Eigen::VectorXd& b) const {
  for (std::size_t a = 0; a < factors_.size(); ++a) {
    const Front& front = elimination_.fronts[a];
    const Factor& factor = factors_[a];
    Eigen::VectorXd own = Gather(front.pivots, front.p, b);
    if (front.m > 0) {
      const Eigen::VectorXd border = factor.x.transpose() * own;
      ForEachPart(front.border, [&](int v, int at) {
        b.segment(RowOf(v), SizeOf(v)) -= border.segment(at, SizeOf(v));
      });
    }
    own = factor.d.solve(own).eval();
    ForEachPart(front.pivots, [&](int v, int at) {
      b.segment(RowOf(v), SizeOf(v)) = own.segment(at, SizeOf(v));
    });
  }
  for (std::size_t a = factors_.size(); a-- > 0;) {
    const Front& front = elimination_.fronts[a];
    if (front.m == 0) continue;
    const Eigen::VectorXd own = factors_[a].x * Gather(front.border, front.m, b);
    ForEachPart(front.pivots, [&](int v, int at) {
      b.segment(RowOf(v), SizeOf(v)) -= own.segment(at, SizeOf(v));
    });
  }
}

Eigen::VectorXd BlockLdl::Multiply(const Eigen::VectorXd& x) const {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(size_);
  for (const auto& [i, j, at] : places_) {
    const int a = SizeOf(i), b = SizeOf(j);
    const Eigen::Map<const Eigen::MatrixXd> block(values_.data() + at, a, b);
    y.segment(RowOf(i), a) += block * x.segment(RowOf(j), b);
    if (i != j) y.segment(RowOf(j), b) += block.transpose() * x.segment(RowOf(i), a);
  }
  return y;
}

Eigen::VectorXd BlockLdl::Solve(const Eigen::VectorXd& b, int refinements) const {
  Eigen::VectorXd x = b, left;
  SolveOnce(x);
  for (int i = 0; i < refinements; ++i) {
    left = b - Multiply(x);
    SolveOnce(left);
    x += left;
  }
  return x;
}

/// Of a front with Z its part of M^-1, from that of its parent:
///
///   Z_pm = -X Z_mm,   Z_pp = D^-1 - Z_pm X'
std::vector<Eigen::MatrixXd> BlockLdl::Inverse(const std::vector<std::pair<int, int>>& blocks) {
  const std::size_t count = factors_.size();
  std::vector<std::size_t> front_of(rows_.size());
  for (std::size_t a = 0; a < count; ++a) {
    for (const int v : elimination_.fronts[a].pivots) front_of[static_cast<std::size_t>(v)] = a;
  }
  std::vector<std::vector<std::size_t>> wanted(count);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    wanted[std::min(front_of[static_cast<std::size_t>(blocks[b].first)],
                    front_of[static_cast<std::size_t>(blocks[b].second)])]
        .push_back(b);
  }
  std::vector<Eigen::MatrixXd> found(blocks.size()), z(count);
  std::vector<std::size_t> waiting(count);  // children that still need z
  for (std::size_t a = 0; a < count; ++a) waiting[a] = elimination_.fronts[a].children.size();
  for (std::size_t a = count; a-- > 0;) {
    const Front& front = elimination_.fronts[a];
    const Factor& factor = factors_[a];
    const int p = front.p, m = front.m;
    Eigen::MatrixXd own(p + m, p + m);
    own.topLeftCorner(p, p) = factor.d.inverse();
    if (m > 0) {
      const auto parent = static_cast<std::size_t>(front.parent);
      Locate(elimination_.fronts[parent]);
      std::vector<int> at;
      for (const int v : front.border) {
        for (int i = 0; i < SizeOf(v); ++i) at.push_back(local_[static_cast<std::size_t>(v)] + i);
      }
      own.bottomRightCorner(m, m) = z[parent](at, at);
      own.topRightCorner(p, m).noalias() = -factor.x * own.bottomRightCorner(m, m);
      own.bottomLeftCorner(m, p) = own.topRightCorner(p, m).transpose();
      own.topLeftCorner(p, p) -= own.topRightCorner(p, m) * factor.x.transpose();
      if (--waiting[parent] == 0) z[parent].resize(0, 0);
    }
    Locate(front);
    for (const std::size_t b : wanted[a]) {
      const auto [i, j] = blocks[b];
      found[b] = own.block(local_[static_cast<std::size_t>(i)], local_[static_cast<std::size_t>(j)],
                           SizeOf(i), SizeOf(j));
    }
    if (waiting[a] > 0) z[a] = std::move(own);
  }
  return found;
}

}  // namespace alidade::ceres_batch
