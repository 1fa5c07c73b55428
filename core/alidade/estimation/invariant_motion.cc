// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/invariant_motion.h"

#include <Eigen/Core>
#include <array>
#include <utility>

namespace alidade::internal {
namespace {

using MatrixMap =
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

/// Replaces the first rows A of `matrix` by `factor` A.
void MultiplyTop(const GroupMatrix& factor, MatrixMap& matrix) {
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    const GroupVector column = factor * matrix.col(j).head(factor.cols());
    matrix.col(j).head(factor.rows()) = column;
  }
}

/// Replaces the first columns A of `matrix` by A `factor`.
void MultiplyLeft(MatrixMap& matrix, const GroupMatrix& factor) {
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    const GroupVector row = factor.transpose() * matrix.row(i).head(factor.rows()).transpose();
    matrix.row(i).head(factor.cols()) = row.transpose();
  }
}

/// Motion model whose first block is the group element. The other blocks follow in the order of the
/// original model.
class InvariantMotion final : public MotionModel {
 public:
  InvariantMotion(SharedMotion model, GroupBlock group, std::vector<int> members,
                  const Space& element)
      : MotionModel(Describe(*model, members, element)),
        model_(std::move(model)),
        group_(std::move(group)),
        members_(std::move(members)) {
    // Row of each element of this model in the Jacobians of the original model.
    std::vector<int> order(static_cast<std::size_t>(group_.geometry().tangent)), remaining;
    int row = 0;
    for (std::size_t i = 0; i < members_.size(); ++i) {
      for (int k = 0; k < model_->blocks()[i].geometry.tangent; ++k, ++row) {
        if (members_[i] < 0) {
          remaining.push_back(row);
        } else {
          order.begin()[group_.Row(members_[i]) + k] = row;
        }
      }
    }
    order.insert(order.end(), remaining.begin(), remaining.end());
    for (int i = 0; i < std::ssize(order); ++i) {
      int moved = order[static_cast<std::size_t>(i)];
      while (moved < i) moved = order[static_cast<std::size_t>(moved)];
      if (moved != i) swaps_.emplace_back(i, moved);
    }
  }

 private:
  static Description Describe(const MotionModel& model, const std::vector<int>& members,
                              const Space& element) {
    Description description = model.description();
    description.blocks = {element};
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (members[i] < 0) description.blocks.push_back(model.blocks()[i]);
    }
    return description;
  }

  /// Returns the pointers to the blocks of the original model.
  template <class Pointer>
  std::array<Pointer, kMaxRoles> BlocksOf(Pointer const* blocks) const {
    std::array<Pointer, kMaxRoles> pointers{};
    int next = 1;
    for (std::size_t i = 0; i < members_.size(); ++i) {
      pointers[i] = members_[i] < 0 ? blocks[next++] : blocks[0] + group_.ValueOffset(members_[i]);
    }
    return pointers;
  }

  Status DoStep(const double* const* blocks, const double* input, const double* w, double dt_s,
                const Output& out) const override {
    const auto model_blocks = BlocksOf(blocks);
    Output model_out = out;
    std::array<double*, kMaxRoles> next{};
    if (out.next != nullptr) {
      next = BlocksOf(out.next);
      model_out.next = next.data();
    }
    const Status status = model_->Step(model_blocks.data(), input, w, dt_s, model_out);
    if (status == Status::kError) return RecordModelError(this, model_->error_text());
    if (status != Status::kOk || out.g == nullptr) return status;
    const GroupMatrix after = group_.MapsAt(out.next[0]).group_from_blocks;
    MatrixMap g(out.g, tangent_size(), noise_size());
    for (const auto& [a, b] : swaps_) g.row(a).swap(g.row(b));
    MultiplyTop(after, g);
    if (out.f == nullptr) return status;
    const GroupMatrix before = group_.MapsAt(blocks[0]).blocks_from_group;
    MatrixMap f(out.f, tangent_size(), tangent_size());
    for (const auto& [a, b] : swaps_) {
      f.row(a).swap(f.row(b));
      f.col(a).swap(f.col(b));
    }
    MultiplyTop(after, f);
    MultiplyLeft(f, before);
    return status;
  }

  SharedMotion model_;
  GroupBlock group_;
  std::vector<int> members_;
  /// Rows of the Jacobians of the original model to exchange, which yields those of this model.
  std::vector<std::pair<int, int>> swaps_;
};

}  // namespace

SharedMotion MakeInvariantMotion(SharedMotion model, const GroupBlock& group,
                                 std::vector<int> members, const Space& element) {
  return std::make_shared<InvariantMotion>(std::move(model), group, std::move(members), element);
}

}  // namespace alidade::internal
