// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <cmath>

#include "alidade/model/static_ekf.h"

/// The arithmetic of StaticEkf. Loops over states and rows are of constant length, and P is its
/// lower triangle.
namespace alidade {

// Loops of constant length, unrolled at any level of optimisation; not under sanitizers, for the
// reason of ALIDADE_FLATTEN.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ALIDADE_UNROLL
#else
#define ALIDADE_UNROLL _Pragma("GCC unroll 16")
#endif

template <class... Motions>
template <class Change>
bool StaticEkf<Motions...>::Try(const Change& change) {
  double x[kAmbient];
  std::copy_n(x_, kAmbient, x);
  const Covariance p = p_;
  change();
  double sum = 0.0;  // 0 times what is not finite is not a number
  ALIDADE_UNROLL for (int i = 0; i < kAmbient; ++i) sum += 0.0 * x_[i];
  ALIDADE_UNROLL for (int i = 0; i < kTangent; ++i) {
    ALIDADE_UNROLL for (int j = 0; j <= i; ++j) sum += 0.0 * p_(i, j);
  }
  if (sum == 0.0) return true;
  std::copy_n(x, kAmbient, x_);
  p_ = p;
  return false;
}

template <class... Motions>
template <int O, int N>
void StaticEkf<Motions...>::Propagate(const Transition<N>& t) {
  double fp[N][kTangent];
  ALIDADE_UNROLL for (int r = 0; r < N; ++r) {
    ALIDADE_UNROLL for (int c = 0; c < kTangent; ++c) {
      fp[r][c] = t.f(r, 0) * P(O, c);
      ALIDADE_UNROLL for (int k = 1; k < N; ++k) fp[r][c] += t.f(r, k) * P(O + k, c);
    }
  }
  ALIDADE_UNROLL for (int r = 0; r < N; ++r) {
    ALIDADE_UNROLL for (int c = 0; c < kTangent; ++c) {
      if (c < O || c >= O + N) P(O + r, c) = fp[r][c];
    }
    ALIDADE_UNROLL for (int c = 0; c <= r; ++c) {
      double sum = t.q(r, c);
      ALIDADE_UNROLL for (int k = 0; k < N; ++k) sum += fp[r][O + k] * t.f(c, k);
      P(O + r, O + c) = sum;
    }
  }
}

template <class... Motions>
template <int... Roles, class Model>
StaticOutcome StaticEkf<Motions...>::Update(const Model& sensor, const double* z, double gate) {
  using Z = typename Model::Measurement;
  using RoleBlocks = detail::Blocks<Model>;
  constexpr typename RoleBlocks::Indices indices{};
  constexpr int m = Z::kTangent, bound[] = {Roles...};
  static_assert(sizeof...(Roles) == RoleBlocks::kCount, "one block for each role");
  if constexpr (detail::HasValid<Model>::value) {
    if (!detail::CallValid(sensor, z + Model::Measurement::kAmbient, z))
      return StaticOutcome::kInvalid;
  }
  const double* const roles[] = {value<Roles>()...};
  double h[Z::kAmbient], l[m * m] = {}, j[m * RoleBlocks::kTangent];
  double* jacobians[RoleBlocks::kCount];
  int strides[RoleBlocks::kCount], used = 0;
  const auto place = [&](auto index) {
    constexpr int i = decltype(index)::value;
    strides[i] = detail::SpaceAt<i, Model>::kTangent;
    jacobians[i] = j + used;
    used += m * strides[i];
  };
  detail::ForEach(place, indices);
  const double* const known = z + Model::Measurement::kAmbient;
  if (Evaluate(sensor, roles, h, jacobians, strides, known) != Status::kOk) {
    return StaticOutcome::kOutOfDomain;
  }
  detail::CallSqrtNoise(sensor, roles, known, z, l, indices);
  Eigen::Matrix<double, m, 1> r;
  Z::Minus(z, h, r.data());
  Eigen::Matrix<double, kTangent, m> pht;
  ALIDADE_UNROLL for (int i = 0; i < kTangent; ++i) {
    ALIDADE_UNROLL for (int c = 0; c < m; ++c) {
      double sum = -0.0;  // adds nothing, not even a sign
      const auto add = [&](auto index) {
        constexpr int role = decltype(index)::value, o = TangentOffset(bound[role]);
        constexpr int n = detail::SpaceAt<role, Model>::kTangent;
        ALIDADE_UNROLL for (int k = 0; k < n; ++k) sum += P(i, o + k) * jacobians[role][c * n + k];
      };
      detail::ForEach(add, indices);
      pht(i, c) = sum;
    }
  }
  Eigen::Matrix<double, m, m> s =
      RowMajorMap<m, m>(l).lazyProduct(RowMajorMap<m, m>(l).transpose());
  const auto add = [&](auto index) {
    constexpr int role = decltype(index)::value, n = detail::SpaceAt<role, Model>::kTangent;
    s += RowMajorMap<m, n>(jacobians[role])
             .lazyProduct(pht.template middleRows<n>(TangentOffset(bound[role])));
  };
  detail::ForEach(add, indices);
  return Correct<m>(pht, s, r, gate);
}

template <class... Motions>
template <int M>
StaticOutcome StaticEkf<Motions...>::Correct(const Eigen::Matrix<double, kTangent, M>& pht,
                                             const Eigen::Matrix<double, M, M>& s,
                                             const Eigen::Matrix<double, M, 1>& r, double gate) {
  Eigen::Matrix<double, kTangent, M> k;  // K = P H' S^-1
  if constexpr (M == 1) {
    if (!(s(0) > 0.0 && s(0) <= std::numeric_limits<double>::max())) {
      return StaticOutcome::kNotFinite;
    }
    const double inverse = 1.0 / s(0), nis = r(0) * r(0) * inverse;
    k = pht * inverse;
    if (!std::isfinite(nis)) return StaticOutcome::kNotFinite;
    if (!(nis <= gate)) return StaticOutcome::kGated;
  } else {
    const Eigen::LLT<Eigen::Matrix<double, M, M>> llt(s);
    if (!s.allFinite() || llt.info() != Eigen::Success) return StaticOutcome::kNotFinite;
    const double nis = llt.matrixL().solve(r).squaredNorm();
    if (!std::isfinite(nis)) return StaticOutcome::kNotFinite;
    if (!(nis <= gate)) return StaticOutcome::kGated;
    k = llt.solve(pht.transpose()).transpose();
  }
  const Eigen::Matrix<double, kTangent, 1> dx = k.lazyProduct(r);
  const auto correct = [&] {
    ALIDADE_UNROLL for (int i = 0; i < kTangent; ++i) {
      ALIDADE_UNROLL for (int j = 0; j <= i; ++j) {
        double sum = k(i, 0) * pht(j, 0);
        ALIDADE_UNROLL for (int c = 1; c < M; ++c) sum += k(i, c) * pht(j, c);
        p_(i, j) -= sum;
      }
    }
    Move(dx.data());
  };
  if (!Try(correct)) return StaticOutcome::kNotFinite;
  in_interval_ = false;
  return StaticOutcome::kAccepted;
}

#undef ALIDADE_UNROLL

}  // namespace alidade
