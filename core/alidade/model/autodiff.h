// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "alidade/model/jet.h"
#include "alidade/model/model_members.h"
#include "alidade/model/status.h"

/// Evaluation of models and their Jacobians in the tangent space. If a model defines analytic
/// Jacobians, these functions call them. Otherwise, they compute the Jacobians by forward-mode
/// automatic differentiation through (+) and (-). Plugins, StaticEkf, the costs of the batch and
/// tests share this code. Matrices are row-major with a row stride. Outputs are unchanged unless
/// the result is kOk.

/// Disables the vectorisation of loops in a function that copies the outputs of a model. The model
/// writes its outputs as single numbers. A vector load of several outputs would stall until these
/// stores have completed.
#if defined(__GNUC__) && !defined(__clang__)
#define ALIDADE_SCALAR_LOOPS __attribute__((optimize("no-tree-loop-vectorize")))
#else
#define ALIDADE_SCALAR_LOOPS
#endif

/// Inlines all callees into a function, including the arithmetic of the model. Disabled if
/// sanitizers are active, because compilation would then need minutes and gigabytes of memory.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ALIDADE_FLATTEN
#else
#define ALIDADE_FLATTEN __attribute__((flatten))
#endif

namespace alidade {
namespace detail {

/// Returns false: no block is skipped.
constexpr bool SkipNone(int) { return false; }

/// Computes x (+) d at d = 0 in dual numbers. The elements of d are the variables `seed`, `seed` +
/// 1, ...
template <class G, class Jet>
void LiftBlock(const double* x, int seed, Jet* lifted) {
  if constexpr (G::kGeometry == ALIDADE_VECTOR) {
    for (int k = 0; k < G::kTangent; ++k) lifted[k] = Jet(x[k], seed + k);
  } else if constexpr (G::kGeometry == ALIDADE_UNIT_QUATERNION) {
    // To first order, x Exp(d) = x (1, d/2).
    const double w = 0.5 * x[0], i = 0.5 * x[1], j = 0.5 * x[2], k = 0.5 * x[3];
    const double slope[4][3] = {{-i, -j, -k}, {w, -k, j}, {k, w, -i}, {-j, i, w}};
    for (int r = 0; r < 4; ++r) {
      lifted[r] = Jet(x[r]);
      for (int c = 0; c < 3; ++c) lifted[r].v[seed + c] = slope[r][c];
    }
  } else {
    Jet d[G::kTangent];
    for (int k = 0; k < G::kTangent; ++k) d[k] = Jet(0.0, seed + k);
    G::Plus(x, d, lifted);
  }
}

/// Computes x (+) 0 of all blocks in dual numbers. Each block has its own variables, which are
/// numbered in the order of the blocks. A block for which kSkip returns true has no dual numbers
/// and no variables; its pointer is null.
template <class Model, bool (*kSkip)(int) = SkipNone, class Jet>
void Lift(const double* const* x, Jet* lifted, const Jet** pointers) {
  int seed = 0, offset = 0;
  const auto lift = [&](auto index) {
    constexpr int i = decltype(index)::value;
    using G = SpaceAt<i, Model>;
    pointers[i] = nullptr;
    if (!kSkip(i) && x[i] != nullptr) {
      LiftBlock<G>(x[i], seed, lifted + offset);
      pointers[i] = lifted + offset;
    }
    if (!kSkip(i)) seed += G::kTangent;
    offset += G::kAmbient;
  };
  ForEach(lift, typename Blocks<Model>::Indices{});
}

/// Reads the derivatives of a value with respect to the variables [first, first + count), in the
/// tangent space of G at the value.
template <class G, class Jet>
void ReadTangent(const Jet* value, int first, int count, MatrixRef j) {
  if constexpr (G::kGeometry == ALIDADE_VECTOR) {
    for (int r = 0; r < G::kTangent; ++r) {
      for (int c = 0; c < count; ++c) j(r, c) = value[r].v[first + c];
    }
    return;
  }
  double base[G::kAmbient];
  for (int i = 0; i < G::kAmbient; ++i) base[i] = value[i].a;
  Jet d[G::kTangent];
  G::Minus(value, base, d);
  for (int r = 0; r < G::kTangent; ++r) {
    for (int c = 0; c < count; ++c) j(r, c) = d[r].v[first + c];
  }
}

inline void Zero(MatrixRef m, int rows, int columns) {
  for (int r = 0; r < rows && columns > 0; ++r) std::fill_n(&m(r, 0), columns, 0.0);
}

inline void Copy(MatrixRef source, int rows, int columns, MatrixRef destination) {
  for (int r = 0; r < rows && columns > 0; ++r)
    std::copy_n(&source(r, 0), columns, &destination(r, 0));
}

template <int kColumns, std::size_t... I>
void CopyUnrolled(MatrixRef source, MatrixRef destination, std::index_sequence<I...>) {
  ((destination(I / kColumns, I % kColumns) = source(I / kColumns, I % kColumns)), ...);
}

/// Copies a matrix whose size is known at compile time. A small matrix is copied number by number,
/// so that it can remain in registers. A load of two numbers cannot be forwarded from two separate
/// stores: the load would wait until both stores have left the store buffer.
template <int kRows, int kColumns>
void CopyFixed(MatrixRef source, MatrixRef destination) {
  if constexpr (kRows * kColumns <= 64) {
    CopyUnrolled<kColumns>(source, destination, std::make_index_sequence<kRows * kColumns>());
  } else {
    Copy(source, kRows, kColumns, destination);
  }
}

template <class Model, class T, std::size_t... I>
bool CallPredict(const Model& model, const T* const* x, const double* known, T* z,
                 std::index_sequence<I...> indices) {
  const auto predict = [&](auto... arguments) { return model.Predict(arguments...); };
  return WithRoles<Model>(predict, x, known, indices, z);
}

/// Computes the analytic Jacobians in a buffer and then copies them. `jacobians` is therefore
/// unchanged if Model::Jacobian throws.
template <class Model, std::size_t... I>
void AnalyticJacobians(const Model& model, const double* const* x, const double* known,
                       double* const* jacobians, const int* strides,
                       std::index_sequence<I...> indices) {
  constexpr int m = Model::Measurement::kTangent;
  double buffer[m * Blocks<Model>::kTangent] = {};
  MatrixRef j[sizeof...(I)];
  int used = 0;
  const auto bind = [&](auto index) {
    constexpr int i = decltype(index)::value;
    constexpr int n = SpaceAt<i, Model>::kTangent;
    j[i] = {buffer + used, n};
    used += m * n;
  };
  ForEach(bind, indices);
  const auto differentiate = [&](auto... arguments) { model.Jacobian(arguments...); };
  WithRoles<Model>(differentiate, x, known, indices, j[I]...);
  const auto copy = [&](auto index) {
    constexpr int i = decltype(index)::value;
    constexpr int n = SpaceAt<i, Model>::kTangent;
    if (jacobians[i] == nullptr) return;
    CopyFixed<m, n>(j[i], {jacobians[i], strides[i]});
  };
  ForEach(copy, indices);
}

}  // namespace detail

/// Computes z = h(roles). Unless `jacobians` is null, also computes jacobians[i] = d z / d role_i,
/// except for null entries and unbound roles. `known` contains the known numbers of the
/// measurement; only models with kKnown use them.
template <class Model>
Status Evaluate(const Model& model, const double* const* roles, double* z, double* const* jacobians,
                const int* strides, const double* known = nullptr) {
  static_assert(detail::CheckSensorMembers<Model>());
  using Z = typename Model::Measurement;
  using Blocks = detail::Blocks<Model>;
  constexpr typename Blocks::Indices indices{};
  constexpr bool kAnalytic = detail::HasJacobian<Model, typename Blocks::Indices>::value;
  if (kAnalytic || jacobians == nullptr) {
    double value[Z::kAmbient];
    if (!detail::CallPredict(model, roles, known, value, indices)) return Status::kOutOfDomain;
    if constexpr (kAnalytic) {
      if (jacobians != nullptr)
        detail::AnalyticJacobians(model, roles, known, jacobians, strides, indices);
    }
    std::copy_n(value, Z::kAmbient, z);
    return Status::kOk;
  }
  if constexpr (!kAnalytic) {
    using Jet = alidade::Jet<double, Blocks::kTangent>;
    Jet lifted[Blocks::kAmbient], value[Z::kAmbient];
    const Jet* x[Blocks::kCount];
    detail::Lift<Model>(roles, lifted, x);
    if (!detail::CallPredict(model, x, known, value, indices)) return Status::kOutOfDomain;
    for (int i = 0; i < Z::kAmbient; ++i) z[i] = value[i].a;
    int first = 0;
    const auto read = [&](auto index) {
      constexpr int i = decltype(index)::value;
      constexpr int n = detail::SpaceAt<i, Model>::kTangent;
      if (jacobians[i] != nullptr) {
        detail::ReadTangent<Z>(value, first, n, MatrixRef{jacobians[i], strides[i]});
      }
      first += n;
    };
    detail::ForEach(read, indices);
  }
  return Status::kOk;
}

// Evaluation of motion models.

namespace detail {

/// Calls step(next) and returns its result. If all blocks have a static size, the step writes to a
/// buffer, so that `next` is unchanged if the step fails or throws. The step of a model with
/// dynamic blocks writes directly to `next`, and must not change `next` if it fails.
template <class Model, class F>
bool CallBuffered(double* const* next, const F& step) {
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

/// Computes F and G by StepJacobian of the model. If all sizes are static, the matrices are first
/// computed in buffers, so that `f` and `g` are unchanged if StepJacobian throws.
template <class Model, std::size_t... I>
void AnalyticStep(const Model& model, const double* const* x, const double* w, double dt_s,
                  MatrixRef f, MatrixRef g, std::index_sequence<I...>) {
  if constexpr (Blocks<Model>::kStatic && Model::kNoise != kDynamic) {
    constexpr int n = Blocks<Model>::kTangent, n_w = Model::kNoise;
    double f_buffer[n * n] = {}, g_buffer[n * n_w + 1] = {};
    const MatrixRef f_new{f_buffer, n}, g_new{g_buffer, n_w};
    model.StepJacobian(x[I]..., w, dt_s, f_new, g_new);
    Copy(f_new, n, n, f);
    Copy(g_new, n, NoiseSizeOf(model), g);  // NoiseSizeOf(model) may be less than kNoise
  } else {
    const int n = TangentSizeOf(model);
    Zero(f, n, n);
    Zero(g, n, NoiseSizeOf(model));
    model.StepJacobian(x[I]..., w, dt_s, f, g);
  }
}

/// Computes x', F and G with dual numbers.
template <class Model>
Status StepJets(const Model& model, const double* const* x, const double* u, const double* w,
                double dt_s, double* const* next, MatrixRef f, MatrixRef g) {
  using BlocksOfModel = Blocks<Model>;
  constexpr typename BlocksOfModel::Indices indices{};
  using Jet = alidade::Jet<double, BlocksOfModel::kTangent + Model::kNoise>;
  Jet lifted[BlocksOfModel::kAmbient], value[BlocksOfModel::kAmbient];
  Jet lifted_w[Model::kNoise + 1], lifted_u[Model::Input::kAmbient + 1];
  const Jet* block[BlocksOfModel::kCount];
  Jet* result[BlocksOfModel::kCount];
  Lift<Model>(x, lifted, block);
  for (int i = 0; i < BlocksOfModel::kCount; ++i) result[i] = value + (block[i] - lifted);
  for (int i = 0; i < Model::kNoise; ++i) lifted_w[i] = Jet(w[i], BlocksOfModel::kTangent + i);
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
    ReadTangent<B>(result[i], 0, BlocksOfModel::kTangent, f.Row(row));
    ReadTangent<B>(result[i], BlocksOfModel::kTangent, Model::kNoise, g.Row(row));
    row += B::kTangent;
  };
  ForEach(read, indices);
  return Status::kOk;
}

/// Computes B = d x' / d u with dual numbers.
template <class Model>
Status InputJets(const Model& model, const double* const* x, const double* u, const double* w,
                 double dt_s, MatrixRef b) {
  using BlocksOfModel = Blocks<Model>;
  using U = typename Model::Input;
  static_assert(BlocksOfModel::kStatic && Model::kNoise != kDynamic,
                "a model of dynamic size has no control input");
  constexpr typename BlocksOfModel::Indices indices{};
  using Jet = alidade::Jet<double, U::kTangent>;
  Jet lifted[BlocksOfModel::kAmbient], value[BlocksOfModel::kAmbient], lifted_w[Model::kNoise + 1];
  Jet lifted_u[U::kAmbient];
  const Jet* block[BlocksOfModel::kCount];
  Jet* result[BlocksOfModel::kCount];
  int offset = 0;
  const auto lift = [&](auto index) {
    constexpr int i = decltype(index)::value;
    block[i] = lifted + offset;
    result[i] = value + offset;
    for (int k = 0; k < SpaceAt<i, Model>::kAmbient; ++k) lifted[offset++] = Jet(x[i][k]);
  };
  ForEach(lift, indices);
  for (int i = 0; i < Model::kNoise; ++i) lifted_w[i] = Jet(w[i]);
  LiftBlock<U>(u, 0, lifted_u);
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

/// Calls f(w) with w = 0. The size of w is the size of the model's noise.
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

/// Computes a step. `w` must not be null.
template <class Model>
Status StepWithNoise(const Model& model, const double* const* x, const double* u, const double* w,
                     double dt_s, double* const* next, MatrixRef f, MatrixRef g) {
  constexpr typename Blocks<Model>::Indices indices{};
  if (!f && !g) {
    const auto step = [&](double* const* destination) {
      return CallStep(model, x, u, w, dt_s, destination, indices);
    };
    return CallBuffered<Model>(next, step) ? Status::kOk : Status::kOutOfDomain;
  }
  if constexpr (HasStepJacobian<Model, typename Blocks<Model>::Indices>::value) {
    const auto step = [&](double* const* destination) {
      if (!CallStep(model, x, u, w, dt_s, destination, indices)) return false;
      AnalyticStep(model, x, w, dt_s, f, g, indices);
      return true;
    };
    return CallBuffered<Model>(next, step) ? Status::kOk : Status::kOutOfDomain;
  } else {
    return StepJets(model, x, u, w, dt_s, next, f, g);
  }
}

}  // namespace detail

/// Computes x' = f(x, u, w, dt), F = d x' / d x (n x n) and G = d x' / d w (n x n_w). A null w
/// means w = 0. F and G may be empty.
template <class Model>
Status Step(const Model& model, const double* const* x, const double* u, const double* w,
            double dt_s, double* const* next, MatrixRef f, MatrixRef g) {
  static_assert(detail::CheckMotionMembers<Model>());
  const int n = detail::TangentSizeOf(model), n_w = detail::NoiseSizeOf(model);
  std::vector<double> unused;  // receives the Jacobian that the caller does not request
  if (static_cast<bool>(f) != static_cast<bool>(g) && n_w > 0) {
    unused.resize(static_cast<std::size_t>(n) * std::max(n, n_w));
    (f ? g : f) = MatrixRef{unused.data(), f ? n_w : n};
  }
  const auto step = [&](const double* noise) {
    return detail::StepWithNoise(model, x, u, noise, dt_s, next, f, n_w > 0 ? g : MatrixRef{});
  };
  return w != nullptr ? step(w) : detail::WithZeroNoise(model, step);
}

/// Computes x', F and G like the function above, and also B = d x' / d u (n x n_u). The model must
/// have a control input.
template <class Model>
Status Step(const Model& model, const double* const* x, const double* u, const double* w,
            double dt_s, double* const* next, MatrixRef f, MatrixRef g, MatrixRef b) {
  constexpr int n_u = Model::Input::kTangent;
  const int n = detail::TangentSizeOf(model);
  std::vector<double> buffer(static_cast<std::size_t>(n) * n_u);
  const MatrixRef new_b{buffer.data(), n_u};
  const auto differentiate = [&](const double* noise) {
    return detail::InputJets(model, x, u, noise, dt_s, new_b);
  };
  const Status status =
      w != nullptr ? differentiate(w) : detail::WithZeroNoise(model, differentiate);
  if (status != Status::kOk) return status;
  const Status step_status = Step(model, x, u, w, dt_s, next, f, g);
  if (step_status == Status::kOk) detail::Copy(new_b, n, n_u, b);
  return step_status;
}

}  // namespace alidade
