// SPDX-License-Identifier: Apache-2.0
#include "alidade/state/kernels.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/state/random_matrices.h"

namespace alidade::internal {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kKernelRounding = 1e-11;

/// An update of n states and the dense matrices of this update. `rows` contains the number of rows
/// of each measurement.
struct KernelProblem {
  KernelProblem(int n, const std::vector<int>& rows, Random& random)
      : size(n), stride(PaddedSize(n)), capacity(2) {
    const MatrixXd a = RandomMatrix(n, n, random);
    p = a * a.transpose() + MatrixXd::Identity(n, n);
    for (const int m : rows) capacity += m;
    const int m = capacity - 2;
    H = MatrixXd::Zero(m, n);
    R = MatrixXd::Zero(m, m);
    r = RandomMatrix(m, 1, random);
    int at = 0;
    for (const int k : rows) {
      One& one = ones.emplace_back();
      for (int c = 0; c < std::min(n, 5); ++c) one.columns.push_back((7 * at + 3 * c) % n);
      one.columns.push_back(one.columns.front());  // two roles have the same block
      one.h = RandomMatrix(k, std::ssize(one.columns), random);
      const MatrixXd l = RandomMatrix(k, k, random);
      R.block(at, at, k, k) = l * l.transpose() + MatrixXd::Identity(k, k);
      one.noise = R.block(at, at, k, k);
      for (std::size_t c = 0; c < one.columns.size(); ++c) {
        H.col(one.columns[c]).segment(at, k) += one.h.col(static_cast<Eigen::Index>(c));
      }
      at += k;
    }
  }

  /// Prepares the memory of the update for `kernels`.
  Update Begin(const Kernels& kernels) {
    const auto number = [](int count) { return static_cast<std::size_t>(count); };
    const int rows = PaddedSize(capacity);
    memory.assign(number(stride * (stride + 2 * capacity + 2) + rows * (capacity + 2)), 0.0);
    double* next = memory.data();
    const auto take = [&](int count) { return std::exchange(next, next + count); };
    update = {};
    update.p = {take(stride * stride), size, stride};
    for (int j = 0; j < size; ++j) {
      for (int i = j; i < size; ++i) update.p(i, j) = p(i, j);
      for (int i = 0; i < j; ++i)
        update.p.data[j * stride + i] = 7.0;  // The upper triangle is not used.
    }
    update.capacity = capacity;
    update.panel_rows = kernels.panel_rows;
    update.w = take(stride * capacity);
    update.gain = take(stride * capacity);
    update.s = take(rows * capacity);
    update.inverse_d = take(rows);
    update.y = take(rows);
    update.dx = take(stride);
    update.variance_decrease = take(stride);
    measurements.clear();
    int at = 0;
    for (One& one : ones) {
      const int k = static_cast<int>(one.h.rows());
      one.s.resize(k, k);
      measurements.push_back(
          {{one.h.data(), k, one.columns}, r.data() + at, one.noise.data(), one.s.data(), at});
      at += k;
    }
    all.clear();
    for (const MeasurementRows& one : measurements) all.push_back(&one);
    update.measurements = all;
    update.m = at;
    return update;
  }
  MatrixXd Covariance() const {
    MatrixXd whole(size, size);
    for (int i = 0; i < size; ++i) {
      for (int j = 0; j < size; ++j) whole(i, j) = update.p(i, j);
    }
    return whole;
  }

  struct One {
    RowMajor h, noise, s;
    std::vector<int> columns;
  };
  int size, stride, capacity;
  MatrixXd p, H, R, r;
  std::vector<One> ones;
  std::vector<MeasurementRows> measurements;
  std::vector<const MeasurementRows*> all;
  std::vector<double> memory;
  Update update;
};

double RelativeDifference(const MatrixXd& a, const MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / (1.0 + b.cwiseAbs().maxCoeff());
}

/// Calls test(kernels, n) for all kernels that this processor supports. The sizes n are below, at
/// and above the panel size of the kernels.
template <class Test>
void ForAllKernels(const Test& test) {
  for (int n = 1; n <= 8; ++n) {
    const Kernels& kernels = KernelsFor({nullptr, n, 8});
    ASSERT_EQ(kernels.panel_rows, n);
    SCOPED_TRACE("unrolled, n = " + std::to_string(n));
    test(kernels, n);
  }
  for (const InstructionSet set : AllInstructionSets()) {
    const Kernels& kernels = KernelsOf(set);
    ASSERT_STREQ(kernels.name, ToString(set));
    for (const int n : {1, 2, 7, 8, 9, 15, 16, 17, 31, 100, 203}) {
      SCOPED_TRACE(std::string(kernels.name) + ", n = " + std::to_string(n));
      test(kernels, n);
    }
  }
}

TEST(Kernels, AnUpdateIsThatOfTheTextbook) {
  Random random(1);
  const std::vector<std::vector<int>> updates = {{1},
                                                 {2},
                                                 {1, 1},
                                                 {3},
                                                 {2, 1, 3},
                                                 {1, 6, 2},
                                                 std::vector<int>(20, 2),
                                                 std::vector<int>(90, 3)};
  ForAllKernels([&](const Kernels& kernels, int n) {
    for (const std::vector<int>& rows : updates) {
      KernelProblem problem(n, rows, random);
      const Update update = problem.Begin(kernels);
      const MatrixXd &p = problem.p, &h = problem.H;
      const MatrixXd s = h * p * h.transpose() + problem.R;
      int at = 0;
      for (const MeasurementRows& one : problem.measurements) {
        const int m = one.h.rows;
        const double nis = Kernels::For(kernels.nis, m)(update, one);
        const MatrixXd own = s.block(at, at, m, m);
        const VectorXd r = problem.r.middleRows(at, m);
        EXPECT_NEAR(nis, r.dot(own.llt().solve(r)), kKernelRounding * (1.0 + nis));
        EXPECT_LE(
            RelativeDifference(
                problem.ones[static_cast<std::size_t>(&one - problem.measurements.data())].s, own),
            kKernelRounding);
        at += m;
      }
      EXPECT_EQ(Kernels::For(kernels.solve, at)(update), Solution::kOk);
      const MatrixXd gain = s.llt().solve(h * p).transpose(), dx = gain * problem.r;
      const MatrixXd lost = (gain * s * gain.transpose()).diagonal();
      for (int i = 0; i < n; ++i) {
        EXPECT_NEAR(update.dx[i], dx(i), kKernelRounding * (1.0 + dx.norm()));
        EXPECT_NEAR(update.variance_decrease[i], lost(i), kKernelRounding * (1.0 + lost.norm()));
        for (int j = 0; j < at; ++j) {
          EXPECT_NEAR(update.At(update.gain, i, j), gain(i, j),
                      kKernelRounding * (1.0 + gain.norm()));
        }
      }
      Kernels::For(kernels.downdate, at)(update);
      EXPECT_LE(RelativeDifference(problem.Covariance(), p - gain * s * gain.transpose()),
                kKernelRounding);
      for (int i = n; i < problem.stride; ++i) {
        for (int j = 0; j < i && kernels.panel_rows != n; ++j) EXPECT_EQ(update.p(i, j), 0.0);
      }
    }
  });
}

TEST(Kernels, AStepIsThatOfTheTextbook) {
  Random random(2);
  ForAllKernels([&](const Kernels& kernels, int n) {
    for (const int k : {1, 2, 3, 6}) {
      if (k > n) continue;
      KernelProblem problem(n, {1}, random);
      Update update = problem.Begin(kernels);
      std::vector<int> rows;
      for (int i = 0; i < k; ++i)
        rows.push_back((n - 1 + i * (n - 1)) % n);  // The rows are not in ascending order.
      for (const int width : {0, 1, 3}) {
        const RowMajor f = RandomMatrix(k, k, random), l = RandomMatrix(k, width, random),
                       cross = 0.1 * RandomMatrix(k, k, random);
        MatrixXd whole = MatrixXd::Identity(n, n), noise = MatrixXd::Zero(n, n);
        whole(rows, rows) = f;
        noise(rows, rows) = l * l.transpose();
        if (width == 1) noise(rows, rows) += cross + cross.transpose();
        std::vector<double> memory(Transition::MemoryOf(n, k, width));
        const MatrixXd before = problem.Covariance();
        EXPECT_TRUE(kernels.propagate(
            update.p,
            {rows, f.data(), l.data(), width, width == 1 ? cross.data() : nullptr, memory.data()}));
        EXPECT_LE(
            RelativeDifference(problem.Covariance(), whole * before * whole.transpose() + noise),
            kKernelRounding);
      }
    }
  });
}

TEST(Kernels, AStepToWhatIsNotFiniteChangesNothing) {
  Random random(3);
  ForAllKernels([&](const Kernels& kernels, int n) {
    KernelProblem problem(n, {1}, random);
    Update update = problem.Begin(kernels);
    const MatrixXd before = problem.Covariance();
    const int rows[] = {n - 1};
    const double f = 1e200;
    std::vector<double> memory(Transition::MemoryOf(n, 1, 0));
    EXPECT_FALSE(kernels.propagate(update.p, {rows, &f, nullptr, 0, nullptr, memory.data()}));
    EXPECT_TRUE(problem.Covariance() == before);
  });
}

TEST(Kernels, WhatIsNotPositiveDefiniteOrNotFiniteIsFound) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Random random(5);
  ForAllKernels([&](const Kernels& kernels, int n) {
    for (const int m : {1, 2, 3}) {
      for (const double variance : {-1e6, kInfinity, std::nan("")}) {
        KernelProblem problem(n, {m}, random);
        problem.ones[0].noise(m - 1, m - 1) = variance;
        const Update update = problem.Begin(kernels);
        EXPECT_TRUE(std::isnan(Kernels::For(kernels.nis, m)(update, problem.measurements[0])));
        EXPECT_EQ(Kernels::For(kernels.solve, m)(update), Solution::kNotPositiveDefinite);
      }
      KernelProblem problem(n, {m}, random);
      const Update update = problem.Begin(kernels);
      Kernels::For(kernels.nis, m)(update, problem.measurements[0]);
      problem.r(0) = kInfinity;
      EXPECT_EQ(Kernels::For(kernels.solve, m)(update), Solution::kNotFinite);
    }
  });
}

TEST(Kernels, AVarianceThatCancelsIsFound) {
  Random random(6);
  ForAllKernels([&](const Kernels& kernels, int n) {
    KernelProblem problem(n, {1}, random);
    problem.ones[0].columns.assign(1, n - 1);
    problem.ones[0].h = RowMajor::Ones(1, 1);
    problem.ones[0].noise(0, 0) = 1e-12 * problem.p(n - 1, n - 1);
    const Update update = problem.Begin(kernels);
    Kernels::For(kernels.nis, 1)(update, problem.measurements[0]);
    EXPECT_EQ(Kernels::For(kernels.solve, 1)(update), Solution::kCancellation);
  });
}

}  // namespace
}  // namespace alidade::internal
