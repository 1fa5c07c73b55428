// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "alidade/model/geometry.h"
#include "alidade/model/params.h"

/// Bases of models. A model is a struct that derives from Sensor or Motion. Its functions are
/// templates of the scalar and have no side effects. It needs this header and C++17 only, and works
/// without the plugin machinery.
namespace alidade {

/// A named quantity: a role, a measurement or a control input.
struct Quantity {
  const char* name;
  const char* unit = "";
  const char* doc = "";
  const char* elements = "";  ///< names such as "x,y,z"; "" for a single element
  unsigned flags = 0;         ///< ALIDADE_ROLE_*
};

/// Row-major view of a Jacobian or covariance factor. Empty if the caller does not request it.
struct MatrixRef {
  double* data = nullptr;
  int stride = 0;
  double& operator()(int row, int column) const {
    return data[std::ptrdiff_t{row} * stride + column];
  }
  /// Returns the view that starts at `row`.
  MatrixRef Row(int row) const { return {data + std::ptrdiff_t{row} * stride, stride}; }
  explicit operator bool() const { return data != nullptr; }
};

/// Prior and dynamics of a role with the flag ALIDADE_ROLE_OWNED. A config may override them.
/// `mean` has a number for each ambient element, the others for each element of the tangent.
struct Owned {
  std::uint32_t dynamics = ALIDADE_STAYS;
  std::vector<double> mean, sigma;
  std::vector<double> density;   ///< driving white noise, unit / sqrt(s)
  double time_constant_s = 0.0;  ///< of a Gauss-Markov process

  /// Returns a prior without dynamics.
  static Owned Constant(std::vector<double> mean, std::vector<double> sigma) {
    return {ALIDADE_STAYS, std::move(mean), std::move(sigma), {}, 0.0};
  }
  /// Returns a random walk; `walk` is the standard deviation of its change in one second.
  static Owned RandomWalk(std::vector<double> mean, std::vector<double> sigma,
                          std::vector<double> walk) {
    return {ALIDADE_RANDOM_WALK, std::move(mean), std::move(sigma), std::move(walk), 0.0};
  }
  /// Returns a stationary Gauss-Markov process: `sigma` is its standard deviation at all times.
  static Owned GaussMarkov(std::vector<double> mean, std::vector<double> sigma,
                           double time_constant_s) {
    std::vector<double> density = sigma;
    for (double& value : density) value *= std::sqrt(2.0 / time_constant_s);
    return {ALIDADE_GAUSS_MARKOV, std::move(mean), std::move(sigma), std::move(density),
            time_constant_s};
  }
};

/// Process noise over an interval that is predicted in several steps. An interval lies between two
/// updates. Both kinds are white from one interval to the next.
enum class NoiseKind {
  kContinuous,  ///< w is drawn for each step: the interval has Q = F_2 Q_1 F_2' + Q_2
  kDiscrete,    ///< w is constant over the interval, which has G Lq = (F_2 G_1 + G_2) Lq
};

/// Base of a sensor z = h(roles) + n, n ~ N(0, L L'). The model has
///
///   static constexpr std::array kRoles{Quantity{...}, ...};      one for each role geometry
///   static constexpr Quantity kMeasurement{...};
///   static constexpr std::array kParts{Quantity{...}, ...};      one for each part of a Product
///   explicit Model(Params&);
///   template <class T> bool Predict(const T* role..., T* z) const;      false: out of domain
///   template <class T> void SqrtNoise(const T* role..., [const T* z,] T* L) const;
///                                                                       L row-major, zeroed
///
/// and may have
///
///   using Known = Vec<3>; static constexpr Quantity kKnown{...};    numbers that come with each
///                                       measurement and are not estimated, such as a satellite's
///                                       position. Every function accepts `const double* known`
///                                       after the roles: Predict(role..., known, z),
///                                       Valid(known, z)
///   bool Valid(const double* z) const;
///   static constexpr int kInitialises;                         index of the role y below
///   template <class T> bool Initialise(const T* other..., const T* z[, prior], T* y) const;
///   static constexpr int kPrior;         count of the prior's numbers; default 0
///   void Jacobian(const double* role..., MatrixRef J_z_role...) const;  analytic, zeroed
///
/// A role with the flag ALIDADE_ROLE_OWNED is a state of the sensor, such as a bias or a lever arm,
/// unless the config binds it to a block. It is constant at the neutral element of its geometry,
/// unless the model defines its prior and dynamics by
///
///   Owned OwnedRole(int role) const;
///
/// Roles with the flag ALIDADE_ROLE_LANDMARK are adjacent. They are bound to the landmark that a
/// measurement names. If kInitialises is the first of them, y contains all of them, one after the
/// other. An optional member with another signature is a compile error (model_members.h).
template <class MeasurementGeometry, class... RoleGeometries>
struct Sensor {
  static_assert(((RoleGeometries::kGeometry != ALIDADE_PRODUCT) && ... && true),
                "a role cannot be a Product; expected a separate role for each part");
  using Measurement = MeasurementGeometry;
  using Spaces = std::tuple<RoleGeometries...>;
  using Known = Vec<0>;
  static constexpr Quantity kKnown{""};
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
/// Step may return bool; false means out of domain. The model may have
///
///   using Input = Vec<2>; static constexpr Quantity kInput{...};        a control input u
///   void StepJacobian(const double* block..., const double* w, double dt_s, MatrixRef F,
///                     MatrixRef G) const;      analytic, zeroed; only without control input
///   bool Stationary() const;                   x' = x without noise: estimators skip the step
///   NoiseKind noise_kind() const;              default kContinuous; `alidade check` compares
///   static constexpr int kStepOrder = N;       1 to 8: additive in dt up to an error of order
///                                              dt^N (Euler's method: 2); default 0: additive
///
/// Lq of discrete noise is evaluated at the start of its interval and does not depend on dt_s.
///
/// A block with the flag ALIDADE_ROLE_OWNED, such as a bias or an extrinsic, is constant at the
/// neutral element of its geometry, unless the config defines an initial value.
///
/// Blocks of size kDynamic need StepJacobian, `int Size(int block) const` and
/// `int NoiseSize() const`. Their Step, StepJacobian and SqrtQ write to the caller's buffers and
/// must not throw. A Step that returns false must leave the buffers untouched.
template <int NoiseSize, class... BlockGeometries>
struct Motion {
  using Spaces = std::tuple<BlockGeometries...>;
  using Input = Vec<0>;
  static constexpr Quantity kInput{""};
  static constexpr int kNoise = NoiseSize;
  static constexpr int kStepOrder = 0;
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

/// Returns true if Initialise computes role i.
template <class Model>
constexpr bool IsInitialised(int i) {
  constexpr int first = Model::kInitialises;
  if (first < 0 || i < first) return false;
  for (int k = first + 1; k <= i; ++k) {
    const auto role = static_cast<std::size_t>(k);
    if ((Model::kRoles[role - 1].flags & Model::kRoles[role].flags & ALIDADE_ROLE_LANDMARK) == 0)
      return false;
  }
  return true;
}

/// Calls f(integral_constant<int, I>) for every I.
template <class F, std::size_t... I>
void ForEach(const F& f, std::index_sequence<I...>) {
  (f(std::integral_constant<int, static_cast<int>(I)>{}), ...);
}

/// `const T*` for every index.
template <class T, std::size_t>
using Pointer = const T*;
template <std::size_t>
using Matrix = MatrixRef;

template <class Model>
inline constexpr bool kHasKnown = Model::Known::kAmbient > 0;

/// Calls f(role pointers..., [known,] arguments...) of a sensor.
template <class Model, class F, class T, std::size_t... I, class... Arguments>
decltype(auto) WithRoles(const F& f, const T* const* x, const double* known,
                         std::index_sequence<I...>, Arguments... arguments) {
  static_cast<void>(x);
  if constexpr (kHasKnown<Model>) {
    return f(x[I]..., known, arguments...);
  } else {
    static_cast<void>(known);
    return f(x[I]..., arguments...);
  }
}

/// `value` is true if Call accepts (model, const T* for each of Indices..., [known,]
/// arguments...).
template <class T, class Call, class Model, class Indices, class... Arguments>
struct AcceptsRolesOf;
template <class T, class Call, class Model, std::size_t... I, class... Arguments>
struct AcceptsRolesOf<T, Call, Model, std::index_sequence<I...>, Arguments...> {
  static constexpr bool value =
      kHasKnown<Model>
          ? std::is_invocable_v<Call, const Model&, Pointer<T, I>..., const double*, Arguments...>
          : std::is_invocable_v<Call, const Model&, Pointer<T, I>..., Arguments...>;
};
template <class Call, class Model, class Indices, class... Arguments>
struct AcceptsRoles : AcceptsRolesOf<double, Call, Model, Indices, Arguments...> {};

struct JacobianCall {
  template <class Model, class... A>
  auto operator()(const Model& model, A... a) const -> decltype(model.Jacobian(a...));
};
template <class Model, class Indices>
struct HasJacobian;
template <class Model, std::size_t... I>
struct HasJacobian<Model, std::index_sequence<I...>>
    : AcceptsRoles<JacobianCall, Model, std::index_sequence<I...>, Matrix<I>...> {};

struct SqrtNoiseCall {
  template <class Model, class... A>
  auto operator()(const Model& model, A... a) const -> decltype(model.SqrtNoise(a...));
};
template <class Model, class Indices>
struct HasNoiseOfMeasurement : AcceptsRoles<SqrtNoiseCall, Model, Indices, const double*, double*> {
};

template <class Model, class = void>
struct HasSimpleSqrtQ : std::false_type {};
template <class Model>
struct HasSimpleSqrtQ<Model, std::void_t<decltype(std::declval<const Model&>().SqrtQ(
                                 1.0, std::declval<MatrixRef>()))>> : std::true_type {};

/// Calls f(block pointers..., [input,] arguments...) of a motion model.
template <class Model, class T, class F, std::size_t... I, class... Arguments>
auto WithBlocks(const F& f, const T* const* x, const T* u, std::index_sequence<I...>,
                Arguments... arguments) {
  if constexpr (Model::Input::kAmbient > 0) {
    return f(x[I]..., u, arguments...);
  } else {
    static_cast<void>(u);
    return f(x[I]..., arguments...);
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

/// Computes L with R = L L' of a sensor, row-major. The caller zeroes L.
template <class Model, std::size_t... I>
void CallSqrtNoise(const Model& model, const double* const* x, const double* known, const double* z,
                   double* l, std::index_sequence<I...> indices) {
  const auto noise = [&](auto... arguments) { model.SqrtNoise(arguments...); };
  if constexpr (HasNoiseOfMeasurement<Model, std::index_sequence<I...>>::value) {
    WithRoles<Model>(noise, x, known, indices, z, l);
  } else {
    static_cast<void>(z);
    WithRoles<Model>(noise, x, known, indices, l);
  }
}

/// Computes Lq of a motion model. The caller zeroes Lq.
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
