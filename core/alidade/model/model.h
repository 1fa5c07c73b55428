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

/// Base classes of models. A model is a struct that derives from Sensor or Motion. Its functions
/// have no side effects. Each function that is differentiated is a template on the scalar type. A
/// model needs only this header and C++17, and can be used without a plugin.
namespace alidade {

/// Name and unit of a quantity: a role, a measurement or a control input.
struct Quantity {
  const char* name;
  const char* unit = "";
  const char* doc = "";
  const char* elements = "";  ///< names of the elements, such as "x,y,z"; "" for one element
  unsigned flags = 0;         ///< ALIDADE_ROLE_*
};

/// Row-major view of a Jacobian or covariance factor. The view is empty if the caller does not
/// request the matrix.
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

/// Prior and dynamics of a role with the flag ALIDADE_ROLE_OWNED. A config may override both.
/// `mean` has one number for each ambient element. `sigma` and `density` have one number for each
/// tangent element.
struct Owned {
  std::uint32_t dynamics = ALIDADE_STAYS;
  std::vector<double> mean, sigma;
  std::vector<double> density;   ///< root of the spectral density of the driving noise
  double time_constant_s = 0.0;  ///< time constant of a Gauss-Markov process

  /// Returns the prior of a constant.
  static Owned Constant(std::vector<double> mean, std::vector<double> sigma) {
    return {ALIDADE_STAYS, std::move(mean), std::move(sigma), {}, 0.0};
  }
  /// Returns a random walk. `walk` is the standard deviation of the change in one second.
  static Owned RandomWalk(std::vector<double> mean, std::vector<double> sigma,
                          std::vector<double> walk) {
    return {ALIDADE_RANDOM_WALK, std::move(mean), std::move(sigma), std::move(walk), 0.0};
  }
  /// Returns a stationary Gauss-Markov process. `sigma` is the standard deviation at all times.
  static Owned GaussMarkov(std::vector<double> mean, std::vector<double> sigma,
                           double time_constant_s) {
    std::vector<double> density = sigma;
    for (double& value : density) value *= std::sqrt(2.0 / time_constant_s);
    return {ALIDADE_GAUSS_MARKOV, std::move(mean), std::move(sigma), std::move(density),
            time_constant_s};
  }
};

/// Kind of process noise. The kind matters if the interval between two updates is predicted in
/// several steps. With both kinds, the noise of one interval is independent of the noise of other
/// intervals.
enum class NoiseKind {
  /// Each step has independent noise w. For an interval of two steps, Q = F_2 Q_1 F_2' + Q_2.
  kContinuous,
  /// w is constant over the interval. For an interval of two steps, G Lq = (F_2 G_1 + G_2) Lq.
  kDiscrete,
};

/// Base of a sensor z = h(roles) + n, n ~ N(0, L L'). The model must define
///
///   static constexpr std::array kRoles{Quantity{...}, ...};      one for each role
///   static constexpr Quantity kMeasurement{...};
///   static constexpr std::array kParts{Quantity{...}, ...};      one for each part of a Product
///   explicit Model(Params&);
///   template <class T> bool Predict(const T* role..., T* z) const;      false: out of domain
///   template <class T> void SqrtNoise(const T* role..., [const T* z,] T* L) const;
///                                                                       L: row-major, initially 0
///
/// and may also define
///
///   using Known = Vec<3>; static constexpr Quantity kKnown{...};    known numbers of each
///                                       measurement, which are not estimated, such as the
///                                       position of a satellite. Every function has the argument
///                                       `const double* known` after the roles:
///                                       Predict(role..., known, z), Valid(known, z)
///   bool Valid(const double* z) const;
///   static constexpr int kInitialises;                         index of the initialised role, y
///   template <class T> bool Initialise(const T* other..., const T* z[, prior], T* y) const;
///   static constexpr int kPrior;         number of elements of the prior; default: 0
///   void Jacobian(const double* role..., MatrixRef J_z_role...) const;  analytic; initially 0
///
/// A role with the flag ALIDADE_ROLE_OWNED is a model parameter state of the sensor, such as a bias
/// or a lever arm, unless the config binds the role to a block. Such a state is constant at the
/// neutral element of its geometry, unless the model defines the prior and dynamics by
///
///   Owned OwnedRole(int role) const;
///
/// Roles with the flag ALIDADE_ROLE_LANDMARK must be adjacent. They are bound to the landmark that
/// the measurement identifies. If kInitialises is the first of these roles, y contains the values
/// of all landmark roles, one after the other. An optional member with a wrong signature is a
/// compile error (model_members.h).
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

/// Base of a motion model x' = f(x, u, w, dt), w ~ N(0, Lq Lq'). w has NoiseSize elements. The
/// model must define
///
///   static constexpr std::array kBlocks{Quantity{...}, ...};     one for each block
///   explicit Model(Params&);
///   template <class T> void Step(const T* block..., [const T* u,] const T* w, double dt_s,
///                                T* next...) const;
///   void SqrtQ([const double* block...,] double dt_s, MatrixRef Lq) const;       Lq: initially 0
///
/// Step may return bool; false means out of domain. The model may also define
///
///   using Input = Vec<2>; static constexpr Quantity kInput{...};        a control input u
///   void StepJacobian(const double* block..., const double* w, double dt_s, MatrixRef F,
///                     MatrixRef G) const;      analytic; F and G are initially 0; only for models
///                                              without control input
///   bool Stationary() const;                   true: x' = x and no noise; estimators skip the
///                                              step
///   NoiseKind noise_kind() const;              default: kContinuous; `alidade check` tests it
///   static constexpr int kStepOrder = N;       1 to 8: steps are additive in dt up to an error of
///                                              order dt^N (Euler's method: 2). Default: 0, exact
///
/// Lq of discrete noise is evaluated at the start of an interval and must not depend on dt_s.
///
/// A block with the flag ALIDADE_ROLE_OWNED, such as a bias or an extrinsic parameter, is constant
/// at the neutral element of its geometry, unless the config defines an initial value.
///
/// A model with blocks of size kDynamic needs StepJacobian and also the two functions
/// `int Size(int block) const` and `int NoiseSize() const`. Its Step, StepJacobian and SqrtQ write
/// directly to the buffers of the caller and must not throw. If Step returns false, it must not
/// have changed the buffers.
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

/// Returns true if Initialise computes the role i.
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

/// Calls f(integral_constant<int, I>{}) for every I.
template <class F, std::size_t... I>
void ForEach(const F& f, std::index_sequence<I...>) {
  (f(std::integral_constant<int, static_cast<int>(I)>{}), ...);
}

/// Aliases that map every index of a pack to the same type: `const T*`, or MatrixRef.
template <class T, std::size_t>
using Pointer = const T*;
template <std::size_t>
using Matrix = MatrixRef;

template <class Model>
inline constexpr bool kHasKnown = Model::Known::kAmbient > 0;

/// Calls f(role pointers..., [known,] arguments...) with the roles of a sensor.
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

/// `value` is true if Call can be called with the arguments (model, one `const T*` for each index,
/// [known,] arguments...).
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

/// Calls f(block pointers..., [input,] arguments...) with the blocks of a motion model.
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

/// Computes L of R = L L' of a sensor, row-major. All elements of L must be 0 before the call.
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

/// Computes Lq of a motion model. All elements of Lq must be 0 before the call.
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
