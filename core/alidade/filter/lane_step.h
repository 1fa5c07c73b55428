// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <tuple>
#include <utility>

#include "alidade/filter/pack.h"
#include "alidade/model/static_ekf.h"

/// The arithmetic of StaticEkf for one filter (S = double) or as many as a pack has lanes.
namespace alidade {

/// What one sensor has measured, once of each filter of an array of `count`.
template <class Model, int... Roles>
struct ArrayUpdate {
  using Sensor = Model;
  static constexpr int kBound[] = {Roles...};
  static constexpr std::size_t kRoles = sizeof...(Roles);

  const Model& sensor;  ///< its roles are filled by the blocks Roles
  const double* z;      ///< element e of filter i at z[e count + i]
  double gate = std::numeric_limits<double>::infinity();  ///< bound on r' S^-1 r
  const bool* present = nullptr;      ///< whether there is one, of each filter; null: always
  StaticOutcome* outcomes = nullptr;  ///< out, of each filter; null: not wanted
};

namespace internal {

inline bool Less(double a, double b) { return a < b; }
inline bool LessEqual(double a, double b) { return a <= b; }
inline bool Equal(double a, double b) { return a == b; }
inline bool Any(bool mask) { return mask; }
inline bool All(bool mask) { return mask; }

/// Whether a geometry has one coordinate for each direction of its tangent.
template <class G>
struct IsFlat : std::bool_constant<G::kAmbient == G::kTangent> {};
template <class Spaces>
struct AreFlat;
template <class... G>
struct AreFlat<std::tuple<G...>> : std::bool_constant<(IsFlat<G>::value && ...)> {};

struct PredictCall {
  template <class Model, class... A>
  auto operator()(const Model& model, A... a) const -> decltype(model.Predict(a...));
};
template <class T, std::size_t>
using In = const T*;

template <class Model, class T, class Indices>
struct PredictsWith;
template <class Model, class T, std::size_t... I>
struct PredictsWith<Model, T, std::index_sequence<I...>>
    : std::is_invocable<PredictCall, const Model&, In<T, I>..., T*> {};

/// As detail::CallSqrtNoise, of any scalar.
template <class Model, class S, std::size_t... I>
void NoiseOfLanes(const Model& model, const S* const* roles, const S* z, S* l,
                  std::index_sequence<I...>) {
  if constexpr (detail::HasNoiseOfMeasurement<Model, std::index_sequence<I...>>::value) {
    model.SqrtNoise(roles[I]..., z, l);
  } else {
    static_cast<void>(z);
    model.SqrtNoise(roles[I]..., l);
  }
}

/// x, P and noise that is held, of one filter or of a pack of them.
template <class S, class... Motions>
struct LaneState {
  using Composed = StaticEkf<Motions...>;
  static constexpr int kAmbient = Composed::kAmbient, kTangent = Composed::kTangent;
  static constexpr int kTriangle = kTangent * (kTangent + 1) / 2;
  static constexpr int kHeld =
      ((detail::Blocks<Motions>::kTangent * Motions::kNoise + Motions::kNoise * Motions::kNoise) +
       ... + 0);

  S x[kAmbient];
  S p[kTriangle];     ///< lower triangle by rows
  S held[kHeld + 1];  ///< of each motion model M = Cov(x, w) and Lq, while an interval goes on
  S in_interval;      ///< 1: P has been stepped since anything else changed it; else 0
};

/// Lq of a motion model whose noise does not depend on the state.
template <class Model>
struct RootQ {
  double l[Model::kNoise * Model::kNoise + 1] = {};

  RootQ(const Model& model, double dt_s) {
    if constexpr (detail::HasSimpleSqrtQ<Model>::value) model.SqrtQ(dt_s, {l, Model::kNoise});
  }
};

/// A step of a LaneState, and what became of it, lane by lane.
template <class S, class... Motions>
class LaneStep {
 public:
  using State = LaneState<S, Motions...>;
  using Flags = internal::Flags<S>;
  using Spaces = typename State::Composed::Spaces;
  static constexpr int kAmbient = State::kAmbient, kTangent = State::kTangent;
  static constexpr int kBlocks = State::Composed::kBlocks;
  template <int B>
  using Space = std::tuple_element_t<static_cast<std::size_t>(B), Spaces>;

  /// Of a block in x and in the rows of P; all blocks are flat.
  static constexpr int Offset(int block) { return OffsetOf(block, Indices{}); }
  /// Where P(i, j) is, of which the lower triangle is kept.
  static constexpr int At(int i, int j) { return i >= j ? i * (i + 1) / 2 + j : At(j, i); }

  LaneStep(State& state, const std::tuple<Motions...>& motions) : s_(state), motions_(motions) {}

  /// false where a model is not defined: for every lane, unless they differ. `roots` are those of
  /// dt_s.
  bool Predict(double dt_s, const std::tuple<RootQ<Motions>...>* roots) {
    return PredictAll(dt_s, roots, std::index_sequence_for<Motions...>{});
  }

  /// What became of a measurement; of a pack, of the lanes that are active.
  struct Result {
    StaticOutcome outcome;  ///< of those that are not accepted
    Flags accepted;
  };
  template <class Model, int... Roles>
  Result Update(const ArrayUpdate<Model, Roles...>& update, const S* z, const Flags& active);

  /// Whether all is finite: x, P, and of a pack every S, which besides was positive. Of a pack no
  /// too where their sum is not.
  bool IsFinite() const {
    S sum = doubt_, other(0.0);
    if constexpr (std::is_same_v<S, double>) {  // 0 times what is not finite is not a number
      for (const double one : s_.x) sum += 0.0 * one;
      for (const double one : s_.p) sum += 0.0 * one;
    } else {
      For<kAmbient>([&](auto i) { sum += s_.x[i]; });
      For<State::kTriangle>([&](auto i) { (i % 2 == 0 ? other : sum) += s_.p[i]; });
    }
    return All(Mask(And(sound_, Equal(S(0.0 * (sum + other)), S(0.0)))));
  }

 private:
  using Indices = std::make_index_sequence<static_cast<std::size_t>(kBlocks)>;
  template <std::size_t... I>
  static constexpr int OffsetOf(int block, std::index_sequence<I...>) {
    const int sizes[] = {Space<static_cast<int>(I)>::kTangent...};
    int offset = 0;
    for (int i = 0; i < block; ++i) offset += sizes[i];
    return offset;
  }
  /// Before motion model m.
  static constexpr int FirstBlock(std::size_t m) {
    const int counts[] = {detail::Blocks<Motions>::kCount...};
    int first = 0;
    for (std::size_t i = 0; i < m; ++i) first += counts[i];
    return first;
  }
  static constexpr int FirstHeld(std::size_t m) {
    const int counts[] = {(detail::Blocks<Motions>::kTangent * Motions::kNoise +
                           Motions::kNoise * Motions::kNoise)...};
    int first = 0;
    for (std::size_t i = 0; i < m; ++i) first += counts[i];
    return first;
  }

  /// Part of a step of n elements: F, and G Q G'; M and Lq where noise is held.
  template <int N, int kNoise>
  struct Transition {
    S next[N];
    Partial<S> f[N][N];
    S q[N * (N + 1) / 2];
    S m[N * kNoise + 1], l[kNoise * kNoise + 1];
  };
  template <class Model>
  using TransitionOf = Transition<detail::Blocks<Model>::kTangent, Model::kNoise>;

  template <std::size_t... M>
  bool PredictAll(double dt_s, const std::tuple<RootQ<Motions>...>* roots,
                  std::index_sequence<M...>) {
    std::tuple<TransitionOf<Motions>...> transitions;
    const bool all = (StepOne<M>(dt_s, roots, std::get<M>(transitions)) && ...);
    if (!all) return false;
    (Take<M>(std::get<M>(transitions)), ...);
    s_.in_interval = S(1.0);
    return true;
  }
  template <std::size_t M, class Model, std::size_t... I>
  void NoiseOf(const Model& model, double dt_s, const std::tuple<RootQ<Motions>...>* roots, S* l,
               std::index_sequence<I...> indices);
  template <std::size_t M, int N, int kNoise>
  bool StepOne(double dt_s, const std::tuple<RootQ<Motions>...>* roots, Transition<N, kNoise>& t);
  template <std::size_t M, int N, int kNoise>
  void Hold(const S& goes_on, Transition<N, kNoise>& t);
  template <std::size_t M, int N, int kNoise>
  void Take(const Transition<N, kNoise>& t);
  Result CorrectScalar(const S (&pht)[kTangent][1], const S& s, const S& innovation, double gate,
                       const Flags& active);
  template <int kRows>
  Result Correct(const S (&pht)[kTangent][kRows], S (&s)[kRows][kRows], S (&r)[kRows], double gate,
                 const Flags& active);
  Result FinishCorrection(const Flags& accepted);

  State& s_;
  // Of a pack: where doubt_ is not finite or sound_ false it has to be done lane by lane. What is
  // infinite or no number shows in a sum, an S below zero does not.
  S doubt_{0.0};
  Flags sound_ = AllFlags<S>();
  const std::tuple<Motions...>& motions_;
};

template <class S, class... Motions>
template <std::size_t M, class Model, std::size_t... I>
void LaneStep<S, Motions...>::NoiseOf(const Model& model, double dt_s,
                                      const std::tuple<RootQ<Motions>...>* roots, S* l,
                                      std::index_sequence<I...> indices) {
  constexpr int n_w = Model::kNoise, first = FirstBlock(M);
  if constexpr (detail::HasSimpleSqrtQ<Model>::value) {
    For<n_w * n_w>([&](auto i) { l[i] = S(std::get<M>(*roots).l[i]); });
  } else if constexpr (std::is_same_v<S, double>) {
    const double* const x[] = {s_.x + Offset(first + static_cast<int>(I))...};
    For<n_w * n_w>([&](auto i) { l[i] = 0.0; });
    detail::CallSqrtQ(model, x, dt_s, {l, n_w}, indices);
  } else {  // lane by lane
    for (int lane = 0; lane < S::kCount; ++lane) {
      double one[n_w * n_w + 1] = {}, own[kAmbient];
      For<kAmbient>([&](auto i) { own[i] = s_.x[i].lane(lane); });
      const double* const x[] = {own + Offset(first + static_cast<int>(I))...};
      detail::CallSqrtQ(model, x, dt_s, {one, n_w}, indices);
      For<n_w * n_w>([&](auto i) { l[i].SetLane(lane, one[i]); });
    }
  }
}

template <class S, class... Motions>
template <std::size_t M, int N, int kNoise>
bool LaneStep<S, Motions...>::StepOne(double dt_s, const std::tuple<RootQ<Motions>...>* roots,
                                      Transition<N, kNoise>& t) {
  using Model = std::tuple_element_t<M, std::tuple<Motions...>>;
  using D = Dual<S, N + kNoise>;
  using All = detail::Blocks<Model>;
  constexpr typename All::Indices indices{};
  constexpr int o = Offset(FirstBlock(M));
  const Model& model = std::get<M>(motions_);
  D lifted[N], next[N], noise[kNoise + 1];
  const D* x[All::kCount];
  D* y[All::kCount];
  For<N>([&](auto i) { lifted[i] = D(s_.x[o + i], i); });
  For<kNoise>([&](auto i) { noise[i] = D(S(0.0), std::integral_constant<int, N + i>{}); });
  For<All::kCount>([&](auto i) {
    x[i] = lifted + (Offset(FirstBlock(M) + i) - o);
    y[i] = next + (Offset(FirstBlock(M) + i) - o);
  });
  const D* const no_input = nullptr;
  if (!detail::CallStep(model, x, no_input, static_cast<const D*>(noise), dt_s, y, indices)) {
    return false;
  }
  For<All::kCount>([&](auto index) {
    constexpr int b = FirstBlock(M) + index, first = Offset(b) - o;
    For<Space<b>::kTangent>([&](auto i) {
      const S& value = next[first + i].a;
      t.next[first + i] = Space<b>::kGeometry == ALIDADE_ANGLE ? S(Angle::Wrap(value)) : value;
    });
  });
  For<N>([&](auto r) { For<N>([&](auto c) { t.f[r][c] = next[r].d[c]; }); });
  // M = G Lq, Q = M M'
  NoiseOf<M>(model, dt_s, roots, t.l, indices);
  const S goes_on = model.noise_kind() == NoiseKind::kDiscrete ? s_.in_interval : S(0.0);
  const bool any = Any(Less(S(0.0), goes_on));
  if (any) {
    constexpr int l = FirstHeld(M) + N * kNoise;
    For<kNoise * kNoise>(
        [&](auto i) { t.l[i] = Select(Less(S(0.0), goes_on), s_.held[l + i], t.l[i]); });
  }
  For<N>([&](auto r) {
    For<kNoise>([&](auto c) {
      Partial<S> sum = Partial<S>::Zero();
      For<kNoise>([&](auto k) { sum = sum + t.l[k * kNoise + c] * next[r].d[N + k]; });
      t.m[r * kNoise + c] = sum.value;
    });
  });
  For<N>([&](auto r) {
    For<r + 1>([&](auto c) {
      S sum(0.0);
      For<kNoise>([&](auto k) { sum += t.m[r * kNoise + k] * t.m[c * kNoise + k]; });
      t.q[At(r, c)] = sum;
    });
  });
  if (any) Hold<M>(goes_on, t);
  return true;
}

/// Of the noise held since before, A = F M_0: Q += A M' + M A', M += A.
template <class S, class... Motions>
template <std::size_t M, int N, int kNoise>
void LaneStep<S, Motions...>::Hold(const S& goes_on, Transition<N, kNoise>& t) {
  constexpr int first = FirstHeld(M);
  S a[N * kNoise + 1];
  For<N>([&](auto r) {
    For<kNoise>([&](auto c) {
      Partial<S> sum = Partial<S>::Zero();
      For<N>([&](auto k) { sum = sum + s_.held[first + k * kNoise + c] * t.f[r][k]; });
      a[r * kNoise + c] = Select(Less(S(0.0), goes_on), sum.value, S(0.0));
    });
  });
  For<N>([&](auto r) {
    For<r + 1>([&](auto c) {
      For<kNoise>([&](auto k) {
        t.q[At(r, c)] += a[r * kNoise + k] * t.m[c * kNoise + k];
        t.q[At(r, c)] += t.m[r * kNoise + k] * a[c * kNoise + k];
      });
    });
  });
  For<N * kNoise>([&](auto i) { t.m[i] += a[i]; });
}

/// P_aa <- F P_aa F' + Q, P_ai <- F P_ai.
template <class S, class... Motions>
template <std::size_t M, int N, int kNoise>
void LaneStep<S, Motions...>::Take(const Transition<N, kNoise>& t) {
  constexpr int o = Offset(FirstBlock(M));
  For<N>([&](auto i) { s_.x[o + i] = t.next[i]; });
  Partial<S> fp[N][kTangent];
  For<N>([&](auto r) {
    For<kTangent>([&](auto c) {
      Partial<S> sum = Partial<S>::Zero();
      For<N>([&](auto k) { sum = sum + s_.p[At(o + k, c)] * t.f[r][k]; });
      fp[r][c] = sum;
    });
  });
  For<N>([&](auto r) {
    For<kTangent>([&](auto c) {
      if constexpr (c < o || c >= o + N) s_.p[At(o + r, c)] = fp[r][c].value;
    });
    For<r + 1>([&](auto c) {
      Partial<S> sum = {t.q[At(r, c)], kNoise > 0};
      For<N>([&](auto k) { sum = sum + fp[r][o + k].value * t.f[c][k]; });
      s_.p[At(o + r, o + c)] = sum.value;
    });
  });
  if (std::get<M>(motions_).noise_kind() == NoiseKind::kDiscrete) {
    constexpr int first = FirstHeld(M);
    For<N * kNoise>([&](auto i) { s_.held[first + i] = t.m[i]; });
    For<kNoise * kNoise>([&](auto i) { s_.held[first + N * kNoise + i] = t.l[i]; });
  }
}

template <class S, class... Motions>
template <class Model, int... Roles>
typename LaneStep<S, Motions...>::Result LaneStep<S, Motions...>::Update(
    const ArrayUpdate<Model, Roles...>& update, const S* z, const Flags& active) {
  using Z = typename Model::Measurement;
  using All = detail::Blocks<Model>;
  constexpr typename All::Indices indices{};
  constexpr int n = All::kTangent, m = Z::kTangent;
  const Model& sensor = update.sensor;
  // Element k of the roles, side by side, is element kElements[k] of the state.
  constexpr auto elements = [] {
    constexpr int bound[] = {Roles...}, sizes[] = {Space<Roles>::kTangent...};
    std::array<int, n> result{};
    int used = 0;
    for (int i = 0; i < All::kCount; ++i) {
      for (int k = 0; k < sizes[i]; ++k) result[used++] = Offset(bound[i]) + k;
    }
    return result;
  }();
  using D = Dual<S, n>;
  D lifted[n], value[m];
  const D* x[All::kCount];
  S own[n];
  const S* roles[All::kCount];
  For<n>([&](auto k) { own[k] = s_.x[elements[k]]; });
  For<n>([&](auto k) { lifted[k] = D(own[k], k); });
  int used = 0;
  For<All::kCount>([&](auto i) {
    x[i] = lifted + used;
    roles[i] = own + used;
    used += detail::SpaceAt<i, Model>::kTangent;
  });
  if (!detail::CallPredict(sensor, x, nullptr, value, indices)) {
    return {StaticOutcome::kOutOfDomain, And(active, Less(S(0.0), S(0.0)))};
  }
  S l[m * m], h[m], r[m], pht[kTangent][m], s[m][m];
  For<m * m>([&](auto i) { l[i] = S(0.0); });
  NoiseOfLanes(sensor, roles, z, l, indices);
  For<m>([&](auto i) { h[i] = value[i].a; });
  Z::Minus(z, static_cast<const S*>(h), r);
  For<kTangent>([&](auto i) {
    For<m>([&](auto c) {
      Partial<S> sum = Partial<S>::Zero();
      For<n>([&](auto k) { sum = sum + s_.p[At(i, elements[k])] * value[c].d[k]; });
      pht[i][c] = sum.value;
    });
  });
  For<m>([&](auto i) {
    For<i + 1>([&](auto j) {
      Partial<S> sum = Partial<S>::Zero();
      For<n>([&](auto k) { sum = sum + pht[elements[k]][j] * value[i].d[k]; });
      s[i][j] = sum.value;
      For<m>([&](auto k) { s[i][j] += l[i * m + k] * l[j * m + k]; });
    });
  });
  if constexpr (m == 1) {
    return CorrectScalar(pht, s[0][0], r[0], update.gate, active);
  } else {
    return Correct<m>(pht, s, r, update.gate, active);
  }
}

/// Of one number: K = P H' / S, x += K r, P -= K H P, where NIS = r^2 / S is within the gate. The
/// quotient is what takes time: only K waits for it.
template <class S, class... Motions>
typename LaneStep<S, Motions...>::Result LaneStep<S, Motions...>::CorrectScalar(
    const S (&pht)[kTangent][1], const S& s, const S& innovation, double gate,
    const Flags& active) {
  const S zero(0.0);
  const S r = Select(Mask(active), innovation, zero), squared = r * r, inverse = 1.0 / s;
  const S doubt = s + squared * inverse;  // neither S nor NIS may be beyond what is finite
  const auto within = LessEqual(squared, gate * s);
  if constexpr (std::is_same_v<S, double>) {
    if (!(s > 0.0) || !std::isfinite(doubt)) return {StaticOutcome::kNotFinite, false};
    if (!within) return {StaticOutcome::kGated, false};
  } else {
    doubt_ += doubt;
    sound_ = And(sound_, Less(zero, s));
  }
  const Flags accepted = And(active, within);
  S kept[kTangent];  // of the other lanes the gain is zero
  For<kTangent>([&](auto i) { kept[i] = Select(Mask(accepted), pht[i][0], zero); });
  For<kTangent>([&](auto i) {
    const S k = kept[i] * inverse;
    s_.x[i] += k * r;
    For<i + 1>([&](auto j) { s_.p[At(i, j)] -= k * pht[j][0]; });
  });
  return FinishCorrection(accepted);
}

/// S = L L', y = L^-1 r, W = L^-1 H P: NIS = y'y, x += W'y, P -= W'W.
template <class S, class... Motions>
template <int kRows>
typename LaneStep<S, Motions...>::Result LaneStep<S, Motions...>::Correct(
    const S (&pht)[kTangent][kRows], S (&s)[kRows][kRows], S (&r)[kRows], double gate,
    const Flags& active) {
  using std::sqrt;
  const S zero(0.0);
  S inverse[kRows];  // of the diagonal of L: no number where S is not positive definite
  S nis(0.0), sum(0.0);
  For<kRows>([&](auto i) {
    r[i] = Select(Mask(active), r[i], zero);
    sum += s[i][i];
    For<i>([&](auto j) {
      For<j>([&](auto k) { s[i][j] -= s[i][k] * s[j][k]; });
      s[i][j] *= inverse[j];
      s[i][i] -= s[i][j] * s[i][j];
      r[i] -= s[i][j] * r[j];
    });
    inverse[i] = 1.0 / sqrt(s[i][i]);
    r[i] *= inverse[i];
    nis += r[i] * r[i];
  });
  sum += inverse[kRows - 1];
  const auto within = LessEqual(nis, S(gate));
  if constexpr (std::is_same_v<S, double>) {
    if (!std::isfinite(nis) || !std::isfinite(sum)) return {StaticOutcome::kNotFinite, false};
    if (!within) return {StaticOutcome::kGated, false};
  } else {
    doubt_ += sum + nis;
  }
  const Flags accepted = And(active, within);
  // Of the other lanes gain and innovation are zero.
  For<kRows>([&](auto i) {
    r[i] = Select(Mask(accepted), r[i], zero);
    inverse[i] = Select(Mask(accepted), inverse[i], zero);
  });
  S w[kTangent][kRows];
  For<kTangent>([&](auto i) {
    For<kRows>([&](auto c) {
      w[i][c] = pht[i][c];
      For<c>([&](auto k) { w[i][c] -= s[c][k] * w[i][k]; });
      w[i][c] *= inverse[c];
      s_.x[i] += w[i][c] * r[c];
    });
    For<i + 1>([&](auto j) { For<kRows>([&](auto c) { s_.p[At(i, j)] -= w[i][c] * w[j][c]; }); });
  });
  return FinishCorrection(accepted);
}

/// What follows a correction of the lanes that are `accepted`.
template <class S, class... Motions>
typename LaneStep<S, Motions...>::Result LaneStep<S, Motions...>::FinishCorrection(
    const Flags& accepted) {
  For<kBlocks>([&](auto b) {
    constexpr int o = Offset(b);
    if constexpr (Space<b>::kGeometry == ALIDADE_ANGLE) s_.x[o] = Angle::Wrap(s_.x[o]);
  });
  s_.in_interval = Select(Mask(accepted), S(0.0), s_.in_interval);
  return {StaticOutcome::kGated, accepted};
}

}  // namespace internal
}  // namespace alidade
