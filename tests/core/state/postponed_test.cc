// SPDX-License-Identifier: Apache-2.0
//
// A state whose blocks are postponed and recalled, beside one that is always whole: steps, updates,
// blocks that enter, leave and take the place of others.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "alidade/base/random.h"
#include "alidade/state/projection.h"
#include "alidade/state/state.h"

namespace alidade {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Space Numbers(const char* name, int size) {
  return {name, "m", "", std::vector<std::string>(static_cast<std::size_t>(size)),
          Geometry::Vector(size)};
}

/// An update of a state by m rows of H, which has `blocks` side by side.
void Update(State& state, const std::vector<BlockId>& blocks, const RowMajor& h, double r,
            const VectorXd& innovation) {
  std::vector<JacobianPart> parts;
  int column = 0;
  for (const BlockId id : blocks) {
    const Block& block = state.layout()[id];
    parts.push_back({block.tangent_offset, block.geometry().tangent, column});
    column += block.geometry().tangent;
  }
  const int n = state.covariance().size(), m = static_cast<int>(h.rows());
  const JacobianRows rows{h.data(), m, column, parts};
  Workspace memory;
  Workspace::Matrix w = memory.Take(n, m),
                    g = memory.Take(state.covariance().outside().columns(), m);
  Workspace::Vector y = memory.Take(m);
  RowMajor s = r * RowMajor::Identity(m, m);
  Project(state.covariance(), rows, w.data(), s.data());
  state.covariance().outside().Project(rows, g.data());
  const Eigen::LLT<MatrixXd> llt{MatrixXd(s)};
  const MatrixXd l = llt.matrixL();
  l.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(w);
  if (g.rows() > 0) l.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(g);
  y = l.triangularView<Eigen::Lower>().solve(innovation);
  const VectorXd dx = w * y;
  std::vector<double> moved;
  state.Retract(dx.data(), moved);
  state.covariance().lower().triangularView<Eigen::Lower>() -= w * w.transpose();
  if (Postponed* const rest = state.postponed()) rest->Correct(state.covariance(), g, w, y);
  state.MoveTo(moved);
}

/// The values and covariances of all blocks that are there, by id.
std::pair<VectorXd, MatrixXd> WholeOf(State state) {
  state.Recall();
  std::vector<double> x;
  std::vector<int> rows;
  for (std::size_t i = 0; i < state.layout().blocks().size(); ++i) {
    const Block& block = state.layout().blocks()[i];
    if (!block.present) continue;
    const double* const value = state.value(static_cast<BlockId>(i));
    x.insert(x.end(), value, value + block.geometry().ambient);
    for (int k = 0; k < block.geometry().tangent; ++k) rows.push_back(block.tangent_offset + k);
  }
  const MatrixXd p = state.covariance().Dense();
  return {Eigen::Map<VectorXd>(x.data(), std::ssize(x)), p(rows, rows)};
}

class PostponedState : public ::testing::Test {
 protected:
  PostponedState() {
    for (State* const state : {&whole_, &postponed_}) {
      const BlockId camera = state->Declare("camera", "", Numbers("camera", 3));
      state->Add(camera, std::vector{0.1, 0.2, 0.3}.data(), 0.1 * MatrixXd::Identity(3, 3));
    }
  }
  MatrixXd Draw(int rows, int columns) {
    return MatrixXd::NullaryExpr(rows, columns, [&] { return random_.Normal(); });
  }
  int Choose(int count) { return static_cast<int>(count * random_.Uniform()); }

  void Step() {
    const RowMajor f = RowMajor::Identity(3, 3) + 0.1 * Draw(3, 3), l = 0.05 * Draw(3, 3),
                   q = l * l.transpose();
    for (State* const state : {&whole_, &postponed_}) {
      const JacobianPart part{state->layout()[0].tangent_offset, 3, 0};
      state->covariance().Propagate({&part, 1}, f.data(), q.data());
    }
  }
  void Enter() {
    const int size = 1 + Choose(3);
    const RowMajor j = Draw(size, 3);
    const VectorXd value = Draw(size, 1);
    BlockId id = -1;
    for (State* const state : {&whole_, &postponed_}) {
      id = state->Declare("point " + std::to_string(names_), "", Numbers("point", size));
      const BlockId camera = 0;
      state->Initialise({&id, 1}, value.data(), {&camera, 1}, j, MatrixXd::Identity(size, size));
    }
    ++names_;
    points_.push_back(id);
  }
  void Leave() {
    const auto one = points_.begin() + Choose(static_cast<int>(points_.size()));
    whole_.Drop(*one);
    postponed_.Drop(*one);
    points_.erase(one);
  }
  /// One point takes the place of another, as of a landmark that is converted.
  void Convert() {
    BlockId& from = points_[static_cast<std::size_t>(Choose(static_cast<int>(points_.size())))];
    const RowMajor j = Draw(2, whole_.layout()[from].geometry().tangent);
    const VectorXd value = Draw(2, 1);
    if (postponed_.layout()[from].postponed) postponed_.Recall(from);
    BlockId to = -1;
    for (State* const state : {&whole_, &postponed_}) {
      to = state->Declare("point " + std::to_string(names_), "", Numbers("point", 2));
      state->Initialise({&to, 1}, value.data(), {&from, 1}, j, 0.1 * MatrixXd::Identity(2, 2));
      state->Drop(from);
    }
    ++names_;
    from = to;
  }
  /// The camera takes a value anew, uncorrelated with the rest.
  void Reset() {
    const std::vector<double> value = {0.3, 0.1, 0.2};
    whole_.Add(0, value.data(), MatrixXd::Identity(3, 3));
    postponed_.Add(0, value.data(), MatrixXd::Identity(3, 3));
  }
  void Measure() {
    std::vector<BlockId> blocks = {0};
    for (int k = 0; k < 3; ++k) {
      const BlockId id =
          points_[static_cast<std::size_t>(Choose(static_cast<int>(points_.size())))];
      if (std::ranges::find(blocks, id) == blocks.end()) blocks.push_back(id);
    }
    int width = 0;
    for (const BlockId id : blocks) {
      width += whole_.layout()[id].geometry().tangent;
      if (postponed_.layout()[id].postponed) postponed_.Recall(id);
    }
    const RowMajor h = Draw(4, width);
    const VectorXd innovation = Draw(4, 1);
    Update(whole_, blocks, h, 0.5, innovation);
    Update(postponed_, blocks, h, 0.5, innovation);
  }
  /// All but some of the points leave the active part.
  void Postpone() {
    std::vector<BlockId> leaving;
    for (const BlockId id : points_) {
      if (postponed_.layout()[id].present && random_.Uniform() < 0.7) leaving.push_back(id);
    }
    postponed_.Postpone(leaving);
  }
  void ExpectTheSame() {
    const auto [x, p] = WholeOf(whole_);
    const auto [y, q] = WholeOf(postponed_);
    ASSERT_EQ(x.size(), y.size());
    EXPECT_LT((x - y).norm(), 1e-12 * x.norm());
    EXPECT_LT((p - q).norm(), 1e-12 * p.norm());
  }

  State whole_, postponed_;
  std::vector<BlockId> points_;
  Random random_{3};
  int names_ = 0;
};

TEST_F(PostponedState, IsThatWhichWasAlwaysWhole) {
  for (int i = 0; i < 12; ++i) Enter();
  int most = 0;
  for (int frame = 0; frame < 300; ++frame) {
    Step();
    Measure();
    const double what = random_.Uniform();
    if (what < 0.1 || points_.size() < 6) {
      Enter();
    } else if (what < 0.2) {
      Leave();
    } else if (what < 0.25) {
      Convert();
    } else if (what < 0.27) {
      Reset();
    }
    if (frame % 7 == 3) Postpone();
    if (frame % 50 == 49) postponed_.Recall();
    ASSERT_NO_FATAL_FAILURE(ExpectTheSame()) << "frame " << frame;
    most = std::max(most, whole_.covariance().size());
  }
  // Rows of what has left are used again.
  postponed_.Recall();
  EXPECT_LE(postponed_.covariance().size(), 2 * most);
}

TEST_F(PostponedState, HasTheActivePartAlone) {
  for (int i = 0; i < 12; ++i) Enter();
  Measure();
  const std::vector<BlockId> leaving(points_.begin() + 2, points_.end());
  postponed_.Postpone(leaving);
  const Block& first = postponed_.layout()[points_[0]];
  const Block& second = postponed_.layout()[points_[1]];
  const int size = 3 + first.geometry().tangent + second.geometry().tangent;
  EXPECT_EQ(postponed_.covariance().size(), size);
  EXPECT_EQ(postponed_.values().size(), static_cast<std::size_t>(size));
  EXPECT_EQ(postponed_.layout()[0].tangent_offset, 0);
  EXPECT_TRUE(postponed_.layout()[leaving[0]].postponed);
  EXPECT_FALSE(postponed_.layout()[leaving[0]].present);
  postponed_.Recall(leaving[0]);
  EXPECT_TRUE(postponed_.layout()[leaving[0]].present);
  EXPECT_EQ(postponed_.postponed()->basis(), postponed_.covariance().size());
}

TEST_F(PostponedState, MayLeaveNothingActive) {
  for (int i = 0; i < 3; ++i) Enter();
  Measure();
  std::vector<BlockId> all = points_;
  all.push_back(0);
  postponed_.Postpone(all);
  EXPECT_EQ(postponed_.covariance().size(), 0);
  const double value = 4.0;
  for (State* const state : {&whole_, &postponed_}) {
    const BlockId id = state->Declare("late", "", Numbers("late", 1));
    state->Add(id, &value, MatrixXd::Identity(1, 1));
  }
  ExpectTheSame();
}

TEST_F(PostponedState, GoesOnFromACopy) {
  for (int i = 0; i < 8; ++i) Enter();
  Measure();
  Postpone();
  Measure();
  State copy = postponed_;
  Measure();  // changes nothing of the copy
  std::swap(copy, postponed_);
  State whole = postponed_;
  whole.Recall();
  std::swap(whole, whole_);
  Measure();
  ExpectTheSame();
}

}  // namespace
}  // namespace alidade
