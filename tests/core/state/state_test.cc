// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/state.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>

#include "alidade/base/error.h"

namespace alidade {
namespace {

void Move(State& state, const Eigen::VectorXd& dx) {
  std::vector<double> moved;
  state.Retract(dx.data(), moved);
  state.MoveTo(moved);
}

Space Named(const Geometry& geometry) { return {"value", "m", "", {""}, geometry, 0}; }

/// Returns a state with the correlated blocks a (2 elements), b (1 element) and c (2 elements).
State Abc() {
  State state;
  const double zero[2] = {1.0, 2.0};
  const BlockId a = state.Declare("s.a", "s", Named(Geometry::Vector(2)));
  const BlockId b = state.Declare("s.b", "s", Named(Geometry::Vector(1)));
  const BlockId c = state.Declare("s.c", "s", Named(Geometry::Vector(2)));
  for (const BlockId id : {a, b, c}) {
    const int n = state.layout()[id].geometry().tangent;
    state.Add(id, zero, Eigen::MatrixXd::Identity(n, n));
  }
  Eigen::MatrixXd root(5, 5);
  root << 2, 0, 0, 0, 0, 1, 3, 0, 0, 0, .5, -1, 1, 0, 0, .2, .1, .7, 2, 0, -1, .4, .3, .2, 1;
  state.covariance().SetBlock(0, 0, root * root.transpose());
  return state;
}

Eigen::MatrixXd Cross(const State& state, const char* a, const char* b) {
  const Block& x = state.layout()[state.layout().Find(a)];
  const Block& y = state.layout()[state.layout().Find(b)];
  return state.covariance().Block(x.tangent_offset, x.geometry().tangent, y.tangent_offset,
                                  y.geometry().tangent);
}

TEST(State, InitialiseCarriesTheCorrelationsOfWhatItCameFrom) {
  State state = Abc();
  const BlockId a = state.layout().Find("s.a"), b = state.layout().Find("s.b");
  const BlockId y = state.Declare("s.y", "s", Named(Geometry::Vector(1)));
  // Adds y = (1, -2) a + 3 b + n, n ~ N(0, 0.25).
  const Eigen::RowVector3d j(1.0, -2.0, 3.0);
  const double value = 7.0;
  state.Initialise(std::array{y}, &value, std::array{a, b}, j,
                   Eigen::MatrixXd::Constant(1, 1, 0.25));
  const Eigen::MatrixXd expected_cross =
      j.head<2>() * Cross(state, "s.a", "s.c") + j.tail<1>() * Cross(state, "s.b", "s.c");
  EXPECT_LT((Cross(state, "s.y", "s.c") - expected_cross).norm(), 1e-13);
  const double variance = (j * state.covariance().Block(0, 3, 0, 3) * j.transpose())(0) + 0.25;
  EXPECT_NEAR(Cross(state, "s.y", "s.y")(0), variance, 1e-12);
  EXPECT_EQ(*state.value(y), 7.0);
}

TEST(State, ABlockThatHasAValueTakesAnotherInItsPlace) {
  State state = Abc(), moved = Abc();
  const BlockId a = state.layout().Find("s.a"), b = state.layout().Find("s.b");
  const Eigen::RowVector2d ja(1.0, -2.0);
  const Eigen::MatrixXd own = Eigen::MatrixXd::Constant(1, 1, 0.25);
  const double value = 7.0;
  moved.Remove(b);
  ASSERT_EQ(moved.Declare("s.b", "s", Named(Geometry::Vector(1))), b);
  for (State* one : {&state, &moved})
    one->Initialise(std::array{b}, &value, std::array{a}, ja, own);
  for (const char* x : {"s.a", "s.b", "s.c"}) {
    for (const char* y : {"s.a", "s.b", "s.c"}) EXPECT_EQ(Cross(state, x, y), Cross(moved, x, y));
  }
  EXPECT_EQ(*state.value(b), 7.0);
  EXPECT_EQ(state.layout()[b].tangent_offset, 2);
  state.Add(b, &value, own);
  EXPECT_EQ(Cross(state, "s.b", "s.b"), own);
  EXPECT_EQ(Cross(state, "s.a", "s.b").norm() + Cross(state, "s.b", "s.c").norm(), 0.0);
  EXPECT_EQ(state.layout()[b].tangent_offset, 2);
}

TEST(State, AReservedPlaceIsTakenByItsBlockAlone) {
  State state;
  const double value = 3.0;
  const BlockId first = state.Declare("s.first", "s", Named(Geometry::Vector(1)));
  const BlockId second = state.Declare("s.second", "s", Named(Geometry::Vector(1)));
  const BlockId third = state.Declare("s.third", "s", Named(Geometry::Vector(1)));
  state.Reserve(first);
  for (const BlockId id : {second, third}) {
    state.Add(id, &value, Eigen::MatrixXd::Constant(1, 1, 4.0));
  }
  EXPECT_FALSE(state.layout()[first].present);
  EXPECT_EQ(state.covariance().Dense(),
            Eigen::Vector3d(0.0, 4.0, 4.0).asDiagonal().toDenseMatrix());
  state.Remove(third);
  state.Add(first, &value, Eigen::MatrixXd::Constant(1, 1, 9.0));
  EXPECT_EQ(state.layout()[first].tangent_offset, 0);
  EXPECT_EQ(state.layout()[first].value_offset, 0);
  EXPECT_EQ(state.covariance().Dense(), Eigen::Vector2d(9.0, 4.0).asDiagonal().toDenseMatrix());
}

TEST(State, DropKeepsTheRestAndFillsTheGap) {
  State state = Abc();
  const Eigen::MatrixXd bc = Cross(state, "s.b", "s.c");
  state.Remove(state.layout().Find("s.a"));
  // Block c is the last block of the same size, so it was moved to the position of a.
  EXPECT_EQ(state.covariance().size(), 3);
  EXPECT_EQ(Cross(state, "s.b", "s.c"), bc);
  EXPECT_EQ(state.layout()[state.layout().Find("s.c")].tangent_offset, 0);
  EXPECT_EQ(state.value(state.layout().Find("s.c"))[1], 2.0);
}

TEST(State, DropMovesAtMostOneBlock) {
  State state;
  std::vector<BlockId> ids;
  for (int i = 0; i < 20; ++i) {
    const double value = i;
    ids.push_back(state.Declare("s.b" + std::to_string(i), "s", Named(Geometry::Vector(1))));
    state.Add(ids.back(), &value, Eigen::MatrixXd::Constant(1, 1, 1.0 + i));
  }
  state.Remove(ids[4]);
  int moved = 0;
  for (int i = 0; i < 20; ++i) {
    if (i == 4) continue;
    const Block& block = state.layout()[ids[static_cast<std::size_t>(i)]];
    EXPECT_EQ(*state.value(ids[static_cast<std::size_t>(i)]), i);
    EXPECT_EQ(state.covariance().Variance(block.tangent_offset), 1.0 + i);
    if (block.tangent_offset != i) ++moved;
  }
  EXPECT_EQ(moved, 1);
}

TEST(State, ASmallerBlockAtTheEndMovesIntoAGap) {
  State state;
  const double value[3] = {1, 2, 3};
  const BlockId large = state.Declare("s.large", "s", Named(Geometry::Vector(3)));
  const BlockId a = state.Declare("s.a", "s", Named(Geometry::Vector(1)));
  const BlockId b = state.Declare("s.b", "s", Named(Geometry::Vector(1)));
  state.Add(large, value, Eigen::Matrix3d::Identity());
  state.Add(a, value, Eigen::MatrixXd::Constant(1, 1, 4.0));
  state.Add(b, value, Eigen::MatrixXd::Constant(1, 1, 9.0));
  state.covariance().SetBlock(3, 4, Eigen::MatrixXd::Constant(1, 1, 5.0));
  state.Remove(large);
  EXPECT_EQ(state.covariance().size(), 2);
  EXPECT_EQ(Cross(state, "s.a", "s.a")(0), 4.0);
  EXPECT_EQ(Cross(state, "s.b", "s.b")(0), 9.0);
  EXPECT_EQ(Cross(state, "s.a", "s.b")(0), 5.0);
}

TEST(State, ADroppedBlockGivesItsIdAndNameBack) {
  State state = Abc();
  const std::size_t blocks = state.layout().blocks().size();
  const BlockId a = state.layout().Find("s.a");
  const Eigen::MatrixXd bc = Cross(state, "s.b", "s.c");
  state.Remove(a);
  EXPECT_EQ(state.layout().Find("s.a"), -1);
  EXPECT_FALSE(state.layout()[a].present);
  EXPECT_EQ(state.Declare("s.a", "s", Named(Geometry::Vector(4))), a);
  EXPECT_EQ(state.layout().blocks().size(), blocks);
  EXPECT_EQ(Cross(state, "s.b", "s.c"), bc);
}

TEST(State, BlocksInitialisedTogetherAreCorrelatedThroughTheirNoise) {
  State state = Abc();
  const BlockId c = state.layout().Find("s.c");
  const Eigen::MatrixXd cc = Cross(state, "s.c", "s.c");
  Eigen::MatrixXd j(3, 2), own(3, 3);
  j << 1, 2, 0, 1, -1, 1;
  own << 2, 0.5, 0.3, 0.5, 3, 0.7, 0.3, 0.7, 4;
  const BlockId d = state.Declare("s.d", "s", Named(Geometry::Vector(1)));
  const BlockId e = state.Declare("s.e", "s", Named(Geometry::Vector(2)));
  const double values[3] = {7, 8, 9};
  state.Initialise(std::array{d, e}, values, std::array{c}, j, own);
  const Eigen::MatrixXd expected = j * cc * j.transpose() + own;
  EXPECT_LT((Cross(state, "s.d", "s.d") - expected.topLeftCorner(1, 1)).norm(), 1e-12);
  EXPECT_LT((Cross(state, "s.d", "s.e") - expected.topRightCorner(1, 2)).norm(), 1e-12);
  EXPECT_LT((Cross(state, "s.e", "s.e") - expected.bottomRightCorner(2, 2)).norm(), 1e-12);
  EXPECT_LT((Cross(state, "s.e", "s.c") - j.bottomRows(2) * cc).norm(), 1e-12);
  EXPECT_EQ(state.value(e)[1], 9.0);
}

TEST(State, FixedBlocksHaveAValueAndNoCovariance) {
  State state;
  const BlockId id = state.Declare("s.f", "s", Named(Geometry::Vector(2)), BlockStatus::kConstant);
  const double value[2] = {1, 2};
  state.Add(id, value, Eigen::MatrixXd());
  EXPECT_EQ(state.covariance().size(), 0);
  EXPECT_EQ(state.value(id)[1], 2.0);
}

TEST(State, MovesOnTheManifold) {
  State state;
  const BlockId q = state.Declare("s.q", "s", Named(Geometry::UnitQuaternion()));
  const double identity[4] = {1, 0, 0, 0};
  state.Add(q, identity, Eigen::Matrix3d::Identity());
  // The quaternion rotates by half a turn about z, in two quarter turns.
  const double quarter = std::acos(0.0);
  Move(state, Eigen::Vector3d(0, 0, quarter));
  Move(state, Eigen::Vector3d(0, 0, quarter));
  EXPECT_NEAR(state.value(q)[0], 0.0, 1e-15);
  EXPECT_NEAR(state.value(q)[3], 1.0, 1e-15);
}

TEST(State, MoveToTransportsTheCovarianceOfADirection) {
  State state;
  const BlockId s = state.Declare("s.d", "s", Named(Geometry::UnitVector()));
  const double z[3] = {0.6, 0, 0.8};
  Eigen::Matrix2d p;
  p << 4, 1, 1, 2;
  state.Add(s, z, p);
  Move(state, Eigen::Vector2d(0.3, -0.4));
  Eigen::Matrix<double, 2, 2, Eigen::RowMajor> j;
  state.layout()[s].geometry().Transport(z, state.value(s), j.data());
  EXPECT_GT((j - Eigen::Matrix2d::Identity()).norm(), 1e-3);
  EXPECT_LT((state.covariance().Dense() - j * p * j.transpose()).norm(), 1e-14);
}

TEST(StateLayout, ABlockIsDeclaredLikeAnotherOfTheSameLayout) {
  StateLayout layout;
  layout.Declare("s.a", "s", Named(Geometry::UnitQuaternion()));
  for (int i = 0; i < 20; ++i) {  // declares enough blocks to cause a reallocation
    const Block& first = layout[0];
    const BlockId id = layout.Declare("s." + std::to_string(i), first.owner, first.space);
    EXPECT_EQ(layout[id].owner, "s");
    EXPECT_EQ(layout[id].geometry(), Geometry::UnitQuaternion());
  }
}

TEST(StateLayout, TwoBlocksOfOneNameAreAMisuse) {
  StateLayout layout;
  layout.Declare("s.a", "s", Named(Geometry::Vector(1)));
  EXPECT_THROW(layout.Declare("s.a", "s", Named(Geometry::Vector(1))), ContractViolation);
}

}  // namespace
}  // namespace alidade
