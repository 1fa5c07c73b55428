// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

#include "alidade/model/geometry.h"
#include "alidade/model/params.h"

/// What the author of a model writes: a struct on one of the two bases below, templated on the
/// scalar, pure. It needs this header and Eigen, C++17, and works without the plugin machinery.
namespace alidade {

/// A named quantity: a role, a measurement, a control input.
struct Quantity {
  const char* name;
  const char* unit = "";
  const char* doc = "";
  const char* elements = "";  ///< "x,y,z"; "" where there is one element
  unsigned flags = 0;         ///< ALIDADE_ROLE_*
};

/// Row-major view of a Jacobian or covariance factor. Empty where the caller wants none.
struct MatrixRef {
  double* data = nullptr;
  int stride = 0;
  double& operator()(int row, int column) const {
    return data[std::ptrdiff_t{row} * stride + column];
  }
  /// The view from `row` on.
  MatrixRef Row(int row) const { return {data + std::ptrdiff_t{row} * stride, stride}; }
  explicit operator bool() const { return data != nullptr; }
};

/// Process noise over a time that is stepped in parts. An interval lies between two updates; both
/// kinds are white from one interval to the next.
enum class NoiseKind {
  kContinuous,  ///< each step has a w of its own: Q of the whole is F_2 Q_1 F_2' + Q_2
  kDiscrete,    ///< one w is held over the interval: G Lq of the whole is (F_2 G_1 + G_2) Lq
};

/// Base of a sensor z = h(roles) + n, n ~ N(0, L L'). The model has
///
///   static constexpr std::array kRoles{Quantity{...}, ...};      one for each role geometry
///   static constexpr Quantity kMeasurement{...};
///   explicit Model(Params&);
///   template <class T> bool Predict(const T* role..., T* z) const;      false: out of domain
///   template <class T> void SqrtNoise(const T* role..., [const T* z,] T* L) const;
///                                                                       L row-major, zeroed
///
/// and may have
///
///   bool Valid(const double* z) const;
///   static constexpr int kInitialises;                                  the role y below
///   template <class T> bool Initialise(const T* other..., const T* z[, prior], T* y) const;
///   static constexpr int kPrior;         numbers of the prior, beyond z; default 0
///   void Jacobian(const double* role..., MatrixRef J_z_role...) const;  analytic, zeroed
///
/// Roles with the flag ALIDADE_ROLE_LANDMARK stand side by side and are filled by the landmark that
/// a measurement names. Where kInitialises is the first of them, y holds them all, one after the
/// other. An optional member of another signature is a compile error (model_members.h).
template <class MeasurementGeometry, class... RoleGeometries>
struct Sensor {
  using Measurement = MeasurementGeometry;
  using Spaces = std::tuple<RoleGeometries...>;
  static constexpr int kPrior = 0;
  static constexpr int kInitialises = -1;
};

/// Base of a motion model x' = f(x, u, w, dt), w ~ N(0, Lq Lq') of size NoiseSize. The model has
///
///   static constexpr std::array kBlocks{Quantity{...}, ...};     one for each block geometry
///   explicit Model(Params&);
///   template <class T> void Step(const T* block..., [const T* u,] const T* w, double dt_s,
///                                T* next...) const;
///   void SqrtQ([const double* block...,] double dt_s, MatrixRef Lq) const;       zeroed
///
/// Step may return bool, false meaning out of domain. The model may have
///
///   using Input = Vec<2>; static constexpr Quantity kInput{...};        a control input u
///   void StepJacobian(const double* block..., const double* w, double dt_s, MatrixRef F,
///                     MatrixRef G) const;      analytic, zeroed; only without control input
///   bool Stationary() const;                   x' = x and no noise: estimators skip the step
///   NoiseKind noise_kind() const;              default kContinuous; `alidade check` compares
///
/// Lq of discrete noise is taken at the start of its interval and does not depend on dt_s.
///
/// A block with the flag ALIDADE_ROLE_OWNED, a bias or an extrinsic, is constant at the neutral
/// element of its geometry, unless the config gives it an initial value.
///
/// Blocks of size kDynamic need StepJacobian, `int Size(int block) const` and
/// `int NoiseSize() const`. Their Step, StepJacobian and SqrtQ write to the caller's buffers: they
/// must not throw, and a Step that returns false must not have written.
template <int NoiseSize, class... BlockGeometries>
struct Motion {
  using Spaces = std::tuple<BlockGeometries...>;
  using Input = Vec<0>;
  static constexpr Quantity kInput{""};
  static constexpr int kNoise = NoiseSize;
  NoiseKind noise_kind() const { return NoiseKind::kContinuous; }
};

namespace detail {

template <class Spaces>
struct SpacesOf;
template <class... G>
struct SpacesOf<std::tuple<G...>> {
  static constexpr int kCount = sizeof...(G);
  static constexpr bool kStatic = ((G::kTangent != kDynamic) && ... && true);
  static constexpr int kAmbient = kStatic ? (G::kAmbient + ... + 0) : 0;
  static constexpr int kTangent = kStatic ? (G::kTangent + ... + 0) : 0;
  using Indices = std::make_index_sequence<sizeof...(G)>;
};

template <class Model>
using Blocks = SpacesOf<typename Model::Spaces>;

template <int I, class Model>
using SpaceAt = std::tuple_element_t<static_cast<std::size_t>(I), typename Model::Spaces>;

/// Whether role i is one of those that Initialise computes.
template <class Model>
constexpr bool IsInitialised(int i) {
  constexpr int first = Model::kInitialises;
  if (first < 0 || i < first) return false;
  for (int k = first + 1; k <= i; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if ((Model::kRoles[at - 1].flags & Model::kRoles[at].flags & ALIDADE_ROLE_LANDMARK) == 0)
      return false;
  }
  return true;
}

/// f(integral_constant<int, I>) for every I.
template <class F, std::size_t... I>
void ForEach(const F& f, std::index_sequence<I...>) {
  (f(std::integral_constant<int, static_cast<int>(I)>{}), ...);
}

/// `const T*` for every index.
template <class T, std::size_t>
using Pointer = const T*;
template <std::size_t>
using Matrix = MatrixRef;

template <class Model, class Indices, class = void>
struct HasJacobian : std::false_type {};
template <class Model, std::size_t... I>
struct HasJacobian<Model, std::index_sequence<I...>,
                   std::void_t<decltype(std::declval<const Model&>().Jacobian(
                       std::declval<Pointer<double, I>>()..., std::declval<Matrix<I>>()...))>>
    : std::true_type {};

template <class Model, class Indices, class = void>
struct HasNoiseOfMeasurement : std::false_type {};
template <class Model, std::size_t... I>
struct HasNoiseOfMeasurement<Model, std::index_sequence<I...>,
                             std::void_t<decltype(std::declval<const Model&>().SqrtNoise(
                                 std::declval<Pointer<double, I>>()...,
                                 std::declval<const double*>(), std::declval<double*>()))>>
    : std::true_type {};

template <class Model, class = void>
struct HasSimpleSqrtQ : std::false_type {};
template <class Model>
struct HasSimpleSqrtQ<Model, std::void_t<decltype(std::declval<const Model&>().SqrtQ(
                                 1.0, std::declval<MatrixRef>()))>> : std::true_type {};

/// Calls f(block pointers..., [input,] rest...) of a motion model.
template <class Model, class T, class F, std::size_t... I, class... Rest>
auto WithBlocks(const F& f, const T* const* x, const T* u, std::index_sequence<I...>,
                Rest... rest) {
  if constexpr (Model::Input::kAmbient > 0) {
    return f(x[I]..., u, rest...);
  } else {
    static_cast<void>(u);
    return f(x[I]..., rest...);
  }
}

template <class Model, class T, std::size_t... I>
bool CallStep(const Model& model, const T* const* x, const T* u, const T* w, double dt_s,
              T* const* next, std::index_sequence<I...> indices) {
  const auto step = [&](auto... arguments) { return model.Step(arguments..., next[I]...); };
  if constexpr (std::is_void_v<decltype(WithBlocks<Model>(step, x, u, indices, w, dt_s))>) {
    WithBlocks<Model>(step, x, u, indices, w, dt_s);
    return true;
  } else {
    return WithBlocks<Model>(step, x, u, indices, w, dt_s);
  }
}

/// L with R = L L' of a sensor, row-major and zeroed before.
template <class Model, std::size_t... I>
void CallSqrtNoise(const Model& model, const double* const* x, const double* z, double* l,
                   std::index_sequence<I...>) {
  if constexpr (HasNoiseOfMeasurement<Model, std::index_sequence<I...>>::value) {
    model.SqrtNoise(x[I]..., z, l);
  } else {
    static_cast<void>(z);
    model.SqrtNoise(x[I]..., l);
  }
}

/// Lq of a motion model, zeroed before.
template <class Model, std::size_t... I>
void CallSqrtQ(const Model& model, const double* const* x, double dt_s, MatrixRef l,
               std::index_sequence<I...>) {
  if constexpr (HasSimpleSqrtQ<Model>::value) {
    static_cast<void>(x);
    model.SqrtQ(dt_s, l);
  } else {
    model.SqrtQ(x[I]..., dt_s, l);
  }
}

template <class Model, class Indices, class = void>
struct HasStepJacobian : std::false_type {};
template <class Model, std::size_t... I>
struct HasStepJacobian<Model, std::index_sequence<I...>,
                       std::void_t<decltype(std::declval<const Model&>().StepJacobian(
                           std::declval<Pointer<double, I>>()..., std::declval<const double*>(),
                           1.0, std::declval<MatrixRef>(), std::declval<MatrixRef>()))>>
    : std::true_type {};

template <class Model, class = void>
struct HasSize : std::false_type {};
template <class Model>
struct HasSize<Model, std::void_t<decltype(std::declval<const Model&>().Size(0))>>
    : std::true_type {};

template <class Model>
int NoiseSizeOf(const Model& model) {
  if constexpr (HasSize<Model>::value) {
    return model.NoiseSize();
  } else {
    static_cast<void>(model);
    return Model::kNoise;
  }
}

template <class Model>
int TangentSizeOf(const Model& model) {
  if constexpr (HasSize<Model>::value) {
    int size = 0;
    for (int i = 0; i < Blocks<Model>::kCount; ++i) size += model.Size(i);
    return size;
  } else {
    static_cast<void>(model);
    return Blocks<Model>::kTangent;
  }
}

}  // namespace detail
}  // namespace alidade
