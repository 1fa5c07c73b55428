// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/autodiff.h"

/// The motion-model side of autodiff.h.
namespace alidade {
namespace detail {

/// step(next). Static blocks go through a buffer, so that a step that fails or throws leaves
/// `next` untouched; models with dynamic blocks see to that themselves.
template <class Model, class F>
bool Buffered(double* const* next, const F& step) {
  using Blocks = detail::Blocks<Model>;
  if constexpr (Blocks::kStatic) {
    constexpr typename Blocks::Indices indices{};
    double value[Blocks::kAmbient];
    double* result[Blocks::kCount];
    int offset = 0;
    const auto place = [&](auto index) {
      constexpr int i = decltype(index)::value;
      result[i] = value + offset;
      offset += SpaceAt<i, Model>::kAmbient;
    };
    ForEach(place, indices);
    if (!step(result)) return false;
    const auto copy = [&](auto index) {
      constexpr int i = decltype(index)::value;
      std::copy_n(result[i], SpaceAt<i, Model>::kAmbient, next[i]);
    };
    ForEach(copy, indices);
    return true;
  } else {
    return step(next);
  }
}

/// Analytic F and G, buffered as `next` is.
template <class Model, std::size_t... I>
void AnalyticStep(const Model& model, const double* const* x, const double* w, double dt_s,
                  MatrixRef f, MatrixRef g, std::index_sequence<I...>) {
  if constexpr (Blocks<Model>::kStatic && Model::kNoise != kDynamic) {
    constexpr int n = Blocks<Model>::kTangent, n_w = Model::kNoise;
    double f_buffer[n * n] = {}, g_buffer[n * n_w + 1] = {};
    const MatrixRef f_new{f_buffer, n}, g_new{g_buffer, n_w};
    model.StepJacobian(x[I]..., w, dt_s, f_new, g_new);
    Copy(f_new, n, n, f);
    Copy(g_new, n, NoiseSizeOf(model), g);  // a model may use less noise than it has room for
  } else {
    const int n = TangentSizeOf(model);
    Zero(f, n, n);
    Zero(g, n, NoiseSizeOf(model));
    model.StepJacobian(x[I]..., w, dt_s, f, g);
  }
}

/// x', F and G by dual numbers.
template <class Model>
Status StepJets(const Model& model, const double* const* x, const double* u, const double* w,
                double dt_s, double* const* next, MatrixRef f, MatrixRef g) {
  using All = Blocks<Model>;
  constexpr typename All::Indices indices{};
  using Jet = ceres::Jet<double, All::kTangent + Model::kNoise>;
  Jet lifted[All::kAmbient], value[All::kAmbient];
  Jet lifted_w[Model::kNoise + 1], lifted_u[Model::Input::kAmbient + 1];
  const Jet* block[All::kCount];
  Jet* result[All::kCount];
  Lift<Model>(x, lifted, block);
  for (int i = 0; i < All::kCount; ++i) result[i] = value + (block[i] - lifted);
  for (int i = 0; i < Model::kNoise; ++i) lifted_w[i] = Jet(w[i], All::kTangent + i);
  for (int i = 0; i < Model::Input::kAmbient; ++i) lifted_u[i] = Jet(u[i]);
  const Jet *const_w = lifted_w, *const_u = lifted_u;
  if (!CallStep(model, block, const_u, const_w, dt_s, result, indices)) {
    return Status::kOutOfDomain;
  }
  int row = 0;
  const auto read = [&](auto index) {
    constexpr int i = decltype(index)::value;
    using B = SpaceAt<i, Model>;
    for (int k = 0; k < B::kAmbient; ++k) next[i][k] = result[i][k].a;
    ReadTangent<B>(result[i], 0, All::kTangent, f.Row(row));
    ReadTangent<B>(result[i], All::kTangent, Model::kNoise, g.Row(row));
    row += B::kTangent;
  };
  ForEach(read, indices);
  return Status::kOk;
}

/// B by dual numbers.
template <class Model>
Status InputJets(const Model& model, const double* const* x, const double* u, const double* w,
                 double dt_s, MatrixRef b) {
  using All = Blocks<Model>;
  using U = typename Model::Input;
  static_assert(All::kStatic && Model::kNoise != kDynamic,
                "a model of dynamic size has no control input");
  constexpr typename All::Indices indices{};
  using Jet = ceres::Jet<double, U::kTangent>;
  Jet lifted[All::kAmbient], value[All::kAmbient], lifted_w[Model::kNoise + 1];
  Jet lifted_u[U::kAmbient];
  const Jet* block[All::kCount];
  Jet* result[All::kCount];
  int offset = 0;
  const auto lift = [&](auto index) {
    constexpr int i = decltype(index)::value;
    block[i] = lifted + offset;
    result[i] = value + offset;
    for (int k = 0; k < SpaceAt<i, Model>::kAmbient; ++k) lifted[offset++] = Jet(x[i][k]);
  };
  ForEach(lift, indices);
  for (int i = 0; i < Model::kNoise; ++i) lifted_w[i] = Jet(w[i]);
  LiftOne<U>(u, 0, lifted_u);
  const Jet *const_w = lifted_w, *const_u = lifted_u;
  if (!CallStep(model, block, const_u, const_w, dt_s, result, indices)) {
    return Status::kOutOfDomain;
  }
  int row = 0;
  const auto read = [&](auto index) {
    constexpr int i = decltype(index)::value;
    using B = SpaceAt<i, Model>;
    ReadTangent<B>(result[i], 0, U::kTangent, b.Row(row));
    row += B::kTangent;
  };
  ForEach(read, indices);
  return Status::kOk;
}

/// Calls f(w) with zeros of the size of the model's noise.
template <class Model, class F>
Status WithZeroNoise(const Model& model, const F& f) {
  if constexpr (Model::kNoise == kDynamic) {
    const std::vector<double> zero(static_cast<std::size_t>(NoiseSizeOf(model)) + 1);
    return f(zero.data());
  } else {
    static_cast<void>(model);
    const double zero[Model::kNoise + 1] = {};
    return f(zero);
  }
}

/// Step for a `w` that is given.
template <class Model>
Status StepWithNoise(const Model& model, const double* const* x, const double* u, const double* w,
                     double dt_s, double* const* next, MatrixRef f, MatrixRef g) {
  constexpr typename Blocks<Model>::Indices indices{};
  if (!f && !g) {
    const auto step = [&](double* const* to) {
      return CallStep(model, x, u, w, dt_s, to, indices);
    };
    return Buffered<Model>(next, step) ? Status::kOk : Status::kOutOfDomain;
  }
  if constexpr (HasStepJacobian<Model, typename Blocks<Model>::Indices>::value) {
    const auto step = [&](double* const* to) {
      if (!CallStep(model, x, u, w, dt_s, to, indices)) return false;
      AnalyticStep(model, x, w, dt_s, f, g, indices);
      return true;
    };
    return Buffered<Model>(next, step) ? Status::kOk : Status::kOutOfDomain;
  } else {
    return StepJets(model, x, u, w, dt_s, next, f, g);
  }
}

}  // namespace detail

/// x' = f(x, u, w, dt), F = d x' / d x (n x n), G = d x' / d w (n x n_w); w may be null (zero), F
/// and G may be empty.
template <class Model>
Status Step(const Model& model, const double* const* x, const double* u, const double* w,
            double dt_s, double* const* next, MatrixRef f, MatrixRef g) {
  static_assert(detail::CheckMotionMembers<Model>());
  const int n = detail::TangentSizeOf(model), n_w = detail::NoiseSizeOf(model);
  std::vector<double> unwanted;  // where one of the two is asked for: rare
  if (static_cast<bool>(f) != static_cast<bool>(g) && n_w > 0) {
    unwanted.resize(static_cast<std::size_t>(n) * std::max(n, n_w));
    (f ? g : f) = MatrixRef{unwanted.data(), f ? n_w : n};
  }
  const auto step = [&](const double* noise) {
    return detail::StepWithNoise(model, x, u, noise, dt_s, next, f, n_w > 0 ? g : MatrixRef{});
  };
  return w != nullptr ? step(w) : detail::WithZeroNoise(model, step);
}

/// The same with B = d x' / d u (n x n_u), of a model with a control input.
template <class Model>
Status Step(const Model& model, const double* const* x, const double* u, const double* w,
            double dt_s, double* const* next, MatrixRef f, MatrixRef g, MatrixRef b) {
  constexpr int n_u = Model::Input::kTangent;
  const int n = detail::TangentSizeOf(model);
  std::vector<double> by_input(static_cast<std::size_t>(n) * n_u);
  const MatrixRef fresh{by_input.data(), n_u};
  const auto differentiate = [&](const double* noise) {
    return detail::InputJets(model, x, u, noise, dt_s, fresh);
  };
  const Status status =
      w != nullptr ? differentiate(w) : detail::WithZeroNoise(model, differentiate);
  if (status != Status::kOk) return status;
  const Status stepped = Step(model, x, u, w, dt_s, next, f, g);
  if (stepped == Status::kOk) detail::Copy(fresh, n, n_u, b);
  return stepped;
}

}  // namespace alidade
