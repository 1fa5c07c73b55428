// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "alidade/model/autodiff.h"

/// Filter whose models are combined at compile time, for embedded systems. It needs C++17 and
/// Eigen, but no plugins, configs, memory allocation or exceptions. Benchmarks also compare this
/// filter with the filters of a Problem.
namespace alidade {

/// Outcome of a measurement in StaticEkf::Update.
enum class StaticOutcome {
  kAccepted,
  kGated,
  kOutOfDomain,  ///< h is not defined at the prediction
  kInvalid,      ///< the measurement is beyond the limits of the sensor
  kNotFinite,    ///< S is not positive definite, or a result is not finite; x and P are unchanged
};

/// Extended Kalman filter for the blocks of all motion models `Motions`. The blocks are numbered in
/// the order of the models.
///
///   predict    x' = f(x, u, 0, dt),  P' = F P F' + G Q G'
///   update     S = H P H' + R,  K = P H' S^-1,  x' = x (+) K r,  P' = P - K S K'
///
///   symbol     shape                  meaning
///   x          sum of ambient sizes   state; P, n x n, is its covariance in the tangent space
///   r          m                      innovation z (-) h(x)
///   gate       1                      largest accepted r' S^-1 r; infinity: no gate
///
/// Each measurement is linearised at the state after the previous measurement, as in Ekf with
/// `fuse: per_measurement`. If a unit vector changes, P is rotated with the tangent basis, as in
/// Ekf. All sizes must be known at compile time: use Constant<1>, not Constant<>. The caller passes
/// the control inputs to every Predict. Discrete noise is constant from one accepted measurement or
/// call of Set to the next.
template <class... Motions>
class StaticEkf {
 public:
  using Spaces = decltype(std::tuple_cat(std::declval<typename Motions::Spaces>()...));
  static constexpr int kBlocks = static_cast<int>(std::tuple_size<Spaces>::value);
  static constexpr int kAmbient = detail::SpacesOf<Spaces>::kAmbient;
  static constexpr int kTangent = detail::SpacesOf<Spaces>::kTangent;
  static_assert(detail::SpacesOf<Spaces>::kStatic, "sizes must be known at compile time");
  template <int B>
  using Space = std::tuple_element_t<static_cast<std::size_t>(B), Spaces>;
  using Covariance = Eigen::Matrix<double, kTangent, kTangent>;

  explicit StaticEkf(Motions... motions) : motions_(std::move(motions)...) {}

  /// Sets block B to `value` (ambient) with the covariance `p` (tangent). The block is then
  /// uncorrelated with the other blocks.
  template <int B, class Matrix>
  void Set(const double* value, const Eigen::MatrixBase<Matrix>& p) {
    constexpr int o = TangentOffset(B), k = Space<B>::kTangent;
    std::copy_n(value, Space<B>::kAmbient, x_ + AmbientOffset(B));
    p_.template middleRows<k>(o).setZero();
    p_.template middleCols<k>(o).setZero();
    p_.template block<k, k>(o, o) = p;
    in_interval_ = false;
  }
  /// Sets a scalar block to `value` with the standard deviation `sigma`.
  template <int B>
  void Set(double value, double sigma) {
    static_assert(Space<B>::kTangent == 1 && Space<B>::kAmbient == 1, "block B must be scalar");
    Set<B>(&value, Eigen::Matrix<double, 1, 1>::Constant(sigma * sigma));
  }

  /// Returns the ambient values of block B.
  template <int B>
  const double* value() const {
    return x_ + AmbientOffset(B);
  }
  /// Returns P, n x n, in the order of the blocks.
  Covariance covariance() const { return p_.template selfadjointView<Eigen::Lower>(); }

  /// Predicts the state after dt_s seconds. `u` contains the control inputs of the models that have
  /// a control input, in the order of the models. Each input is a `const double*` to ambient
  /// values. Returns kOutOfDomain if a model is not defined at the state, and kError if x' or P' is
  /// not finite. In both cases x and P are unchanged.
  template <class... Inputs>
  ALIDADE_FLATTEN Status Predict(double dt_s, Inputs... u) {
    static_assert(sizeof...(Inputs) == InputsBefore(sizeof...(Motions)),
                  "Predict needs one control input for each model with a control input");
    const double* const inputs[] = {u..., nullptr};
    return PredictAll(dt_s, inputs, std::index_sequence_for<Motions...>{});
  }

  /// Updates with z, a measurement of `sensor`. The roles of the sensor are bound to the blocks
  /// `Roles`. z contains the ambient values, followed by the known numbers if the sensor uses any.
  template <int... Roles, class Model>
  ALIDADE_FLATTEN StaticOutcome Update(const Model& sensor, const double* z,
                                       double gate = std::numeric_limits<double>::infinity());

 private:
  using Indices = std::make_index_sequence<static_cast<std::size_t>(kBlocks)>;
  static constexpr int AmbientOffset(int block) { return OffsetOf<true>(block, Indices{}); }
  static constexpr int TangentOffset(int block) { return OffsetOf<false>(block, Indices{}); }
  template <bool kOfAmbient, std::size_t... I>
  static constexpr int OffsetOf(int block, std::index_sequence<I...>) {
    const int sizes[] = {(kOfAmbient ? Space<static_cast<int>(I)>::kAmbient
                                     : Space<static_cast<int>(I)>::kTangent)...};
    int offset = 0;
    for (int i = 0; i < block; ++i) offset += sizes[i];
    return offset;
  }
  /// Returns the index of the first block of motion model m.
  static constexpr int FirstBlock(std::size_t m) {
    const int counts[] = {detail::Blocks<Motions>::kCount...};
    int first = 0;
    for (std::size_t i = 0; i < m; ++i) first += counts[i];
    return first;
  }
  /// Returns the number of motion models before m that have a control input.
  static constexpr std::size_t InputsBefore(std::size_t m) {
    const bool has_input[] = {(Motions::Input::kAmbient > 0)...};
    std::size_t count = 0;
    for (std::size_t i = 0; i < m; ++i) count += has_input[i] ? 1 : 0;
    return count;
  }
  /// View of a matrix that a model has written. The order is row-major, except for a single column,
  /// for which Eigen requires column-major order.
  template <int R, int C>
  using RowMajorMap = Eigen::Map<
      const Eigen::Matrix<double, R, C, C == 1 && R != 1 ? Eigen::ColMajor : Eigen::RowMajor>>;

  /// Transition of N tangent elements: f = F and q = G Q G'.
  template <int N>
  struct Transition {
    Eigen::Matrix<double, N, N> f, q;
  };
  template <class Model>
  using TransitionOf = Transition<detail::Blocks<Model>::kTangent>;

  /// Discrete noise over an interval: l is Lq at the start of the interval, and m is M = Cov(x, w).
  template <class Model>
  struct DiscreteNoise {
    Eigen::Matrix<double, Model::kNoise, Model::kNoise> l;
    Eigen::Matrix<double, detail::Blocks<Model>::kTangent, Model::kNoise> m;
  };

  template <std::size_t... M>
  Status PredictAll(double dt_s, const double* const* inputs, std::index_sequence<M...>) {
    double next[kAmbient];
    std::tuple<TransitionOf<Motions>...> transitions;
    std::tuple<DiscreteNoise<Motions>...> noise;
    Status status = Status::kOk;
    const bool succeeded =
        (((status = StepModel<M>(dt_s, inputs[InputsBefore(M)], next, std::get<M>(transitions),
                                 std::get<M>(noise))) == Status::kOk) &&
         ...);
    if (!succeeded) return status;
    const auto step = [&] {
      std::copy_n(next, kAmbient, x_);
      const auto normalise = [&](auto index) {
        constexpr int b = decltype(index)::value;
        Space<b>::Normalise(x_ + AmbientOffset(b));
      };
      detail::ForEach(normalise, Indices{});
      (Propagate<TangentOffset(FirstBlock(M))>(std::get<M>(transitions)), ...);
    };
    if (!ApplyIfFinite(step)) return Status::kError;
    (StoreDiscreteNoise<M>(std::get<M>(noise)), ...);
    in_interval_ = true;
    return Status::kOk;
  }
  /// Applies a change of x and P. If a result is not finite, restores x and P and returns false.
  template <class Change>
  bool ApplyIfFinite(const Change& change);
  template <std::size_t M, class Noise>
  void StoreDiscreteNoise(const Noise& noise) {
    if (std::get<M>(motions_).noise_kind() == NoiseKind::kDiscrete) std::get<M>(noise_) = noise;
  }
  template <std::size_t M, int N, class Noise>
  Status StepModel(double dt_s, const double* u,
                   double* next,  // NOLINT(readability-non-const-parameter): y points to it
                   Transition<N>& transition, Noise& noise) const {
    using Model = std::tuple_element_t<M, std::tuple<Motions...>>;
    constexpr typename detail::Blocks<Model>::Indices indices{};
    constexpr int n_w = Model::kNoise;
    const Model& model = std::get<M>(motions_);
    const double* x[detail::Blocks<Model>::kCount];
    double* y[detail::Blocks<Model>::kCount];
    const auto place = [&](auto index) {
      constexpr int i = decltype(index)::value, o = AmbientOffset(FirstBlock(M) + i);
      x[i] = x_ + o;
      y[i] = next + o;
    };
    detail::ForEach(place, indices);
    double f[N * N], g[N * n_w + 1] = {}, l[n_w * n_w + 1] = {};
    const Status status = Step(model, x, u, nullptr, dt_s, y, {f, N}, {g, n_w});
    if (status != Status::kOk) return status;
    const bool is_discrete = model.noise_kind() == NoiseKind::kDiscrete;
    const bool is_continued = is_discrete && in_interval_;
    if (!is_continued) detail::CallSqrtQ(model, x, dt_s, {l, n_w}, indices);
    if (is_continued) {
      noise.l = std::get<M>(noise_).l;
    } else {
      noise.l = RowMajorMap<n_w, n_w>(l);
    }
    noise.m = RowMajorMap<N, n_w>(g).lazyProduct(noise.l);
    transition.f = RowMajorMap<N, N>(f);
    transition.q = noise.m.lazyProduct(noise.m.transpose());
    if (is_continued) {  // A = F M, N = G Lq: q += A N' + N A', M' = A + N
      const Eigen::Matrix<double, N, n_w> a = transition.f.lazyProduct(std::get<M>(noise_).m);
      const Eigen::Matrix<double, N, N> product = a.lazyProduct(noise.m.transpose());
      transition.q += product + product.transpose();
      noise.m += a;
    }
    return Status::kOk;
  }

  /// Returns a reference to P(i, j). Only the lower triangle of P is stored.
  double& P(int i, int j) { return i >= j ? p_(i, j) : p_(j, i); }
  /// Propagates P for the rows a = [O, O + N): P_aa <- F P_aa F' + Q, P_ai <- F P_ai for all other
  /// rows i.
  template <int O, int N>
  void Propagate(const Transition<N>& t);
  template <int M>
  StaticOutcome Correct(const Eigen::Matrix<double, kTangent, M>& pht,
                        const Eigen::Matrix<double, M, M>& s, const Eigen::Matrix<double, M, 1>& r,
                        double gate);
  /// Computes x <- x (+) dx, and rotates P with the tangent spaces of unit vectors.
  void ApplyCorrection(const double* dx) {
    const auto apply = [&](auto index) {
      constexpr int b = decltype(index)::value, n = Space<b>::kTangent;
      double corrected[Space<b>::kAmbient];
      Space<b>::Plus(value<b>(), dx + TangentOffset(b), corrected);
      Space<b>::Normalise(corrected);
      if constexpr (kHasTransport<Space<b>>) {
        double j[n * n];
        Space<b>::Transport(value<b>(), corrected, j);
        const Transition<n> transport{RowMajorMap<n, n>(j), Eigen::Matrix<double, n, n>::Zero()};
        Propagate<TangentOffset(b)>(transport);
      }
      std::copy_n(corrected, Space<b>::kAmbient, x_ + AmbientOffset(b));
    };
    detail::ForEach(apply, Indices{});
  }

  std::tuple<Motions...> motions_;
  double x_[kAmbient] = {};
  Covariance p_ = Covariance::Zero();
  std::tuple<DiscreteNoise<Motions>...> noise_;  ///< noise of the current interval
  bool in_interval_ = false;                     ///< true if the last change of P was a prediction
};

// Unrolls a loop of constant length at any level of optimisation. Disabled if sanitizers are
// active, for the same reason as ALIDADE_FLATTEN.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ALIDADE_UNROLL
#else
#define ALIDADE_UNROLL _Pragma("GCC unroll 16")
#endif

template <class... Motions>
template <class Change>
bool StaticEkf<Motions...>::ApplyIfFinite(const Change& change) {
  double x[kAmbient];
  std::copy_n(x_, kAmbient, x);
  const Covariance p = p_;
  change();
  double sum = 0.0;  // 0 times a number that is not finite is NaN
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
  static_assert(sizeof...(Roles) == RoleBlocks::kCount, "Update needs one block for each role");
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
      double sum = -0.0;  // -0.0 + x is x, also if x is -0.0 or 0.0
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
    ApplyCorrection(dx.data());
  };
  if (!ApplyIfFinite(correct)) return StaticOutcome::kNotFinite;
  in_interval_ = false;
  return StaticOutcome::kAccepted;
}

#undef ALIDADE_UNROLL

}  // namespace alidade
