// SPDX-License-Identifier: Apache-2.0
#include "kkt_covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

#include "alidade/state/dense_algebra.h"

namespace alidade::ceres_batch {

Eigen::MatrixXd Clipped(const Eigen::MatrixXd& p) {
  if (p.size() == 0) return p;
  Eigen::MatrixXd symmetric = 0.5 * (p + p.transpose());
  if (symmetric.ldlt().vectorD().minCoeff() >= 0.0) return symmetric;
  const internal::SymmetricEigen eigen = internal::EigenOf(symmetric);
  const Eigen::VectorXd positive = eigen.values.cwiseMax(0.0);
  return internal::ProductTransposed(eigen.vectors * positive.asDiagonal(), eigen.vectors);
}

KktSystem::Covariances::Covariances(KktSystem& of) : s_(of) {
  std::vector<std::pair<int, int>> wanted;
  const auto want = [&](int i, int j) {
    if (i < 0 || j < 0) return;
    if (found_.try_emplace(KeyOf(std::max(i, j), std::min(i, j)), wanted.size()).second) {
      wanted.emplace_back(std::max(i, j), std::min(i, j));
    }
  };
  for (std::size_t k = 0; k < s_.nodes_.size(); ++k) {
    const Node& node = s_.nodes_[k];
    const std::vector<Part> parts = s_.PartsOf(k);
    for (const Part& a : parts) {
      for (const Part& b : parts) want(a.variable, b.variable);
    }
    if (node.first == node.last) continue;
    std::vector<int> multipliers{node.multiplier};
    for (const std::size_t i : node.born) multipliers.push_back(s_.constants_[i].multiplier);
    for (const int i : multipliers) {
      for (const int j : multipliers) want(i, j);
      if (k == 0) continue;
      for (const Part& part : s_.PartsOf(k - 1)) want(i, part.variable);
    }
  }
  for (std::size_t i = 0; i < s_.points_.size(); ++i) {
    const MapLandmark& landmark = s_.run_.landmarks_[i];
    const std::vector<int> own = s_.ConstantsOf(landmark);
    for (const int a : own) {
      for (const int b : own) {
        want(s_.constants_[static_cast<std::size_t>(a)].value,
             s_.constants_[static_cast<std::size_t>(b)].value);
      }
    }
    want(s_.points_[i].variable, s_.points_[i].variable);
    if (!landmark.first) continue;
    want(s_.points_[i].variable, s_.nodes_[s_.node_of_[landmark.first->epoch]].read);
    for (const int constant : s_.landmark_constants_) {
      want(s_.points_[i].variable, s_.constants_[static_cast<std::size_t>(constant)].value);
    }
  }
  inverse_ = of.ldl_.Inverse(wanted);
}

double KktSystem::Covariances::Inexactness() const {
  const auto read = std::ssize(s_.read_rows_);
  Eigen::VectorXd squared = Eigen::VectorXd::Zero(read), p = squared;
  for (const Node& node : s_.nodes_) {
    if (node.read < 0) continue;
    const auto own = s_.block_of_.find(KeyOf(node.read, node.read));
    if (own == s_.block_of_.end()) continue;
    squared += s_.ldl_.Block(own->second).diagonal().cwiseAbs2();
    p = p.cwiseMax(Found(node.read, node.read).diagonal());
  }
  const Eigen::VectorXd share = squared.cwiseSqrt().cwiseProduct(p);
  return read == 0 ? 0.0 : std::numeric_limits<double>::epsilon() * share.maxCoeff();
}

/// The covariance of two variables.
Eigen::MatrixXd KktSystem::Covariances::Found(int i, int j) const {
  const Eigen::MatrixXd& block = inverse_[found_.at(KeyOf(std::max(i, j), std::min(i, j)))];
  return i >= j ? block : Eigen::MatrixXd(block.transpose());
}

/// The covariance of variables side by side.
Eigen::MatrixXd KktSystem::Covariances::JointOf(const std::vector<int>& variables) const {
  Eigen::Index size = 0, row = 0;
  for (const int v : variables) size += s_.ldl_.SizeOf(v);
  Eigen::MatrixXd p(size, size);
  for (const int a : variables) {
    Eigen::Index column = 0;
    for (const int b : variables) {
      p.block(row, column, s_.ldl_.SizeOf(a), s_.ldl_.SizeOf(b)) = Found(a, b);
      column += s_.ldl_.SizeOf(b);
    }
    row += s_.ldl_.SizeOf(a);
  }
  return p;
}

/// P of node k, with zeros for landmarks.
Eigen::MatrixXd KktSystem::Covariances::JointOf(std::size_t k) const {
  const auto n = Eigen::Index{s_.run_.initial_.covariance().size()};
  Eigen::MatrixXd p = Eigen::MatrixXd::Zero(n, n);
  const std::vector<Part> parts = s_.PartsOf(k);
  for (const Part& a : parts) {
    for (const Part& b : parts) p(*a.rows, *b.rows) = Found(a.variable, b.variable);
  }
  if (k > 0) return p;
  // What the prior knows exactly has no variance, not that of rounding.
  for (std::size_t i = 0; i < s_.rows_.size(); ++i) {
    if (s_.nodes_[0].b.row(static_cast<Eigen::Index>(i)).any()) continue;
    p.row(s_.rows_[i]).setZero();
    p.col(s_.rows_[i]).setZero();
  }
  return p;
}

/// Of a frame inside a node, x = F x_{k-1} + B w:  Cov(w) = I + B' L B, Cov(x_{k-1}, w) = M B,
/// where L and M are the blocks of the inverse of lambda_k, and of x_{k-1} and lambda_k.
Eigen::MatrixXd KktSystem::Covariances::OfFrame(std::size_t frame) const {
  const std::size_t k = s_.node_of_[frame];
  const Node& node = s_.nodes_[k];
  const auto size = s_.run_.binding_.initial.covariance().size();
  if (frame == node.last) return Clipped(JointOf(k).topLeftCorner(size, size));
  const auto n = Eigen::Index{s_.run_.initial_.covariance().size()};
  std::vector<int> multipliers;
  if (node.multiplier >= 0) multipliers.push_back(node.multiplier);
  for (const std::size_t i : node.born) multipliers.push_back(s_.constants_[i].multiplier);
  Eigen::MatrixXd of_w = Eigen::MatrixXd::Identity(node.columns, node.columns);
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(n, node.columns);
  Eigen::Index at = 0;
  for (const int i : multipliers) {
    const auto b_i = node.b.middleRows(at, s_.ldl_.SizeOf(i));
    Eigen::Index other = 0;
    for (const int j : multipliers) {
      const auto b_j = node.b.middleRows(other, s_.ldl_.SizeOf(j));
      const Eigen::MatrixXd of_pair = internal::TransposedProduct(b_i, Found(i, j));
      of_w += s_.alpha_ * s_.alpha_ * internal::Product(of_pair, b_j);
      other += b_j.rows();
    }
    if (k > 0) {
      for (const Part& part : s_.PartsOf(k - 1)) {
        const Eigen::MatrixXd tie = internal::Product(Found(part.variable, i), b_i);
        cross(*part.rows, Eigen::all) += s_.alpha_ * tie;
      }
    }
    at += b_i.rows();
  }
  const Eigen::MatrixXd& s = s_.at_[frame].s;
  const Eigen::MatrixXd by_w = s.rightCols(node.columns);
  Eigen::MatrixXd p = internal::Congruence(by_w, of_w);
  if (k > 0) {
    const Eigen::MatrixXd f = s.leftCols(n);
    const Eigen::MatrixXd fc = internal::ProductTransposed(internal::Product(f, cross), by_w);
    p += internal::Congruence(f, JointOf(k - 1)) + fc + fc.transpose();
  }
  return Clipped(p.topLeftCorner(size, size));
}

Eigen::MatrixXd KktSystem::Covariances::OfLandmark(std::size_t i) const {
  const MapLandmark& landmark = s_.run_.landmarks_[i];
  if (landmark.in_state()) {
    const StateLayout& layout = s_.run_.initial_.layout();
    const int first = layout[landmark.blocks.front()].tangent_offset;
    const Block& last = layout[landmark.blocks.back()];
    const int size = last.tangent_offset + last.geometry().tangent - first;
    std::vector<int> variables, rows;  // the others stay
    for (const int own : s_.ConstantsOf(landmark)) {
      const Constant& constant = s_.constants_[static_cast<std::size_t>(own)];
      variables.push_back(constant.value);
      for (const int row : constant.rows) rows.push_back(row - first);
    }
    Eigen::MatrixXd p = Eigen::MatrixXd::Zero(size, size);
    if (!rows.empty()) p(rows, rows) = Clipped(JointOf(variables));
    return p;
  }
  const Point3& point = s_.points_[i];
  const Eigen::MatrixXd own = Found(point.variable, point.variable);
  const Eigen::MatrixXd& by_l = point.place.by_d;
  if (!landmark.first) return Clipped(internal::Congruence(by_l, own));
  std::vector<int> variables{s_.nodes_[s_.node_of_[landmark.first->epoch]].read};
  for (const int constant : s_.landmark_constants_) {
    variables.push_back(s_.constants_[static_cast<std::size_t>(constant)].value);
  }
  std::erase(variables, -1);
  variables.insert(variables.begin(), point.variable);
  Eigen::MatrixXd j(by_l.rows(), by_l.cols() + point.c.cols());
  j << by_l, point.place.by_x - internal::Product(by_l, point.c);
  return Clipped(internal::Congruence(j, JointOf(variables)));
}

void KktSystem::Covariances::PutMap(std::vector<LandmarkEstimate>& map) const {
  for (LandmarkEstimate& estimate : map) {
    const auto found = std::ranges::find_if(s_.run_.landmarks_, [&](const MapLandmark& landmark) {
      return landmark.id == estimate.id && landmark.generation == estimate.generation;
    });
    if (found == s_.run_.landmarks_.end()) continue;
    if (found->from.size() == 0 && !found->in_state()) continue;  // known exactly
    const auto i = static_cast<std::size_t>(found - s_.run_.landmarks_.begin());
    s_.run_.Describe(*found, OfLandmark(i), estimate);
  }
}

}  // namespace alidade::ceres_batch
