// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/model/autodiff.h"

/// Evaluates inverse measurement models and their Jacobians.
namespace alidade {
namespace detail {

/// Ambient and tangent size of y, which contains the roles that Initialise computes.
template <class Model>
struct InitialisedSizes {
  static constexpr int Sum(bool ambient) {
    int sum = 0, i = 0;
    const auto add = [&](int a, int t) {
      sum += IsInitialised<Model>(i++) ? (ambient ? a : t) : 0;
    };
    AddAll(add, static_cast<typename Model::Spaces*>(nullptr));
    return sum;
  }
  template <class Add, class... G>
  static constexpr void AddAll(const Add& add, std::tuple<G...>*) {
    (add(G::kAmbient, G::kTangent), ...);
  }
  static constexpr int kAmbient = Sum(true), kTangent = Sum(false);
};

/// Returns the index of the k-th role that Initialise does not compute.
template <class Model>
constexpr std::size_t OtherRole(std::size_t k) {
  std::size_t i = 0;
  for (;; ++i) {
    if (IsInitialised<Model>(static_cast<int>(i))) continue;
    if (k-- == 0) return i;
  }
}

template <class Model, class T, std::size_t... I>
bool CallInitialise(const Model& model, const T* const* x, const double* known, const T* z,
                    const T* prior, T* y, std::index_sequence<I...>) {
  constexpr std::index_sequence<OtherRole<Model>(I)...> other_roles{};
  const auto initialise = [&](auto... arguments) { return model.Initialise(arguments...); };
  if constexpr (Model::kPrior > 0) {
    return WithRoles<Model>(initialise, x, known, other_roles, z, prior, y);
  } else {
    static_cast<void>(prior);
    return WithRoles<Model>(initialise, x, known, other_roles, z, y);
  }
}

/// Reads the derivatives of y with respect to the variables [first, first + count), role by role.
template <class Model, class Jet>
void ReadInitialised(const Jet* y, int first, int count, MatrixRef j) {
  int offset = 0, row = 0;
  const auto read = [&](auto index) {
    constexpr int i = decltype(index)::value;
    using G = SpaceAt<i, Model>;
    if (!IsInitialised<Model>(i)) return;
    ReadTangent<G>(y + offset, first, count, j.Row(row));
    offset += G::kAmbient;
    row += G::kTangent;
  };
  ForEach(read, typename Blocks<Model>::Indices{});
}

}  // namespace detail

/// Evaluates the inverse measurement model: computes y from the other roles, z and the prior. y is
/// the value of the role Model::kInitialises. For a landmark, y contains the values of all landmark
/// roles, one after the other. Also computes the Jacobians jx[i] = d y / d role_i, jz = d y / d z
/// and jp = d y / d prior. Each Jacobian may be null. Returns kInvalid if the model needs a prior
/// and `prior` is null. `known` has the same meaning as in Evaluate.
template <class Model>
Status InitialiseRole(const Model& model, const double* const* roles, const double* z,
                      const double* prior, double* y, double* const* jx, const int* jx_strides,
                      MatrixRef jz, MatrixRef jp, const double* known = nullptr) {
  using Z = typename Model::Measurement;
  using Y = detail::InitialisedSizes<Model>;
  using Blocks = detail::Blocks<Model>;
  constexpr std::make_index_sequence<detail::OtherCount<Model>()> other_roles{};
  constexpr int kRoles = Blocks::kTangent - Y::kTangent;
  using Jet = alidade::Jet<double, kRoles + Z::kTangent + Model::kPrior>;
  if (Model::kPrior > 0 && prior == nullptr) return Status::kInvalid;
  Jet lifted[Blocks::kAmbient], dz[Z::kTangent], lifted_z[Z::kAmbient];
  Jet lifted_prior[Model::kPrior + 1], value[Y::kAmbient];
  const Jet* x[Blocks::kCount];
  detail::Lift<Model, detail::IsInitialised<Model>>(roles, lifted, x);
  for (int i = 0; i < Z::kTangent; ++i) dz[i] = Jet(0.0, kRoles + i);
  Z::Plus(z, dz, lifted_z);
  for (int i = 0; i < Model::kPrior; ++i) {
    lifted_prior[i] = Jet(prior[i], kRoles + Z::kTangent + i);
  }
  const Jet *const_z = lifted_z, *const_prior = lifted_prior;
  if (!detail::CallInitialise(model, x, known, const_z, const_prior, value, other_roles)) {
    return Status::kOutOfDomain;
  }
  for (int i = 0; i < Y::kAmbient; ++i) y[i] = value[i].a;
  int first = 0;
  const auto read = [&](auto index) {
    constexpr int i = decltype(index)::value;
    constexpr int n = detail::SpaceAt<i, Model>::kTangent;
    if (detail::IsInitialised<Model>(i)) return;
    if (jx != nullptr && jx[i] != nullptr) {
      detail::ReadInitialised<Model>(value, first, n, MatrixRef{jx[i], jx_strides[i]});
    }
    first += n;
  };
  detail::ForEach(read, typename Blocks::Indices{});
  if (jz) detail::ReadInitialised<Model>(value, kRoles, Z::kTangent, jz);
  if (jp) detail::ReadInitialised<Model>(value, kRoles + Z::kTangent, Model::kPrior, jp);
  return Status::kOk;
}

}  // namespace alidade
