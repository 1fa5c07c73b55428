// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

#include "alidade/model/jet.h"
#include "alidade/model/model.h"

/// Compile-time checks of the members of a model, with readable error messages. The checks reject a
/// model without a required member. They also reject an optional member with a wrong signature,
/// which would otherwise be ignored silently. Optional members of a final struct are not checked.
namespace alidade {
namespace detail {

struct Nothing {};

/// DeclaresNAME<Model>::value is true if the model has any member called NAME. The check derives a
/// struct from the model and from another struct that has a member NAME. If the model also has a
/// member NAME, then NAME is ambiguous in the derived struct.
#define ALIDADE_DECLARES(NAME)                                                         \
  struct With##NAME {                                                                  \
    int NAME;                                                                          \
  };                                                                                   \
  template <class Model>                                                               \
  struct TwiceWith##NAME : std::conditional_t<std::is_final_v<Model>, Nothing, Model>, \
                           With##NAME {};                                              \
  template <class Model, class = void>                                                 \
  struct Declares##NAME : std::true_type {};                                           \
  template <class Model>                                                               \
  struct Declares##NAME<Model, std::void_t<decltype(&TwiceWith##NAME<Model>::NAME)>>   \
      : std::false_type {};
ALIDADE_DECLARES(Jacobian)
ALIDADE_DECLARES(Valid)
ALIDADE_DECLARES(Initialise)
ALIDADE_DECLARES(StepJacobian)
ALIDADE_DECLARES(Stationary)
ALIDADE_DECLARES(OwnedRole)
#undef ALIDADE_DECLARES

struct PredictCall {
  template <class Model, class... A>
  auto operator()(const Model& model, A... a) const
      -> std::enable_if_t<std::is_convertible_v<decltype(model.Predict(a...)), bool>>;
};
template <class Model, class Indices, class T = double>
struct HasPredict : AcceptsRolesOf<T, PredictCall, Model, Indices, T*> {};

/// Dual number with which the checks instantiate the functions of a model.
using AnyJet = Jet<double, 1>;

template <class Model, class = void>
struct HasRoles : std::false_type {};
template <class Model>
struct HasRoles<Model, std::void_t<decltype(Model::kRoles)>> : std::true_type {};
template <class Model, class = void>
struct HasMeasurement : std::false_type {};
template <class Model>
struct HasMeasurement<Model, std::void_t<decltype(Model::kMeasurement)>> : std::true_type {};
template <class Model, class = void>
struct HasBlocks : std::false_type {};
template <class Model>
struct HasBlocks<Model, std::void_t<decltype(Model::kBlocks)>> : std::true_type {};

template <class Model, class Indices>
struct HasSqrtNoise {
  static constexpr bool value = AcceptsRoles<SqrtNoiseCall, Model, Indices, double*>::value ||
                                HasNoiseOfMeasurement<Model, Indices>::value;
};

struct StepCall {
  template <class Model, class... A>
  auto operator()(const Model& model, A... a) const -> decltype(model.Step(a...));
};
template <class T, std::size_t>
using Next = T*;
template <class Model, class Indices, class T = double>
struct HasStep;
template <class Model, class T, std::size_t... I>
struct HasStep<Model, std::index_sequence<I...>, T> {
  static constexpr bool value = Model::Input::kAmbient > 0
                                    ? std::is_invocable_v<StepCall, const Model&, Pointer<T, I>...,
                                                          const T*, const T*, double, Next<T, I>...>
                                    : std::is_invocable_v<StepCall, const Model&, Pointer<T, I>...,
                                                          const T*, double, Next<T, I>...>;
};

struct SqrtQCall {
  template <class Model, class... A>
  auto operator()(const Model& model, A... a) const -> decltype(model.SqrtQ(a...));
};
template <class Model, class Indices>
struct HasSqrtQ;
template <class Model, std::size_t... I>
struct HasSqrtQ<Model, std::index_sequence<I...>> {
  static constexpr bool value =
      HasSimpleSqrtQ<Model>::value ||
      std::is_invocable_v<SqrtQCall, const Model&, Pointer<double, I>..., double, MatrixRef>;
};

struct ValidCall {
  template <class Model, class... A>
  auto operator()(const Model& model, A... a) const
      -> std::enable_if_t<std::is_convertible_v<decltype(model.Valid(a...)), bool>>;
};
template <class Model>
struct HasValid : AcceptsRoles<ValidCall, Model, std::index_sequence<>, const double*> {};

/// Calls Valid of a model that has this member.
template <class Model>
bool CallValid(const Model& model, const double* known, const double* z) {
  const auto valid = [&](auto... arguments) -> bool { return model.Valid(arguments...); };
  const double* const* const no_roles = nullptr;
  return WithRoles<Model>(valid, no_roles, known, std::index_sequence<>{}, z);
}

template <class Model, class = void>
struct HasStationary : std::false_type {};
template <class Model>
struct HasStationary<Model, std::enable_if_t<std::is_convertible_v<
                                decltype(std::declval<const Model&>().Stationary()), bool>>>
    : std::true_type {};

template <class Model, class = void>
struct HasOwnedRole : std::false_type {};
template <class Model>
struct HasOwnedRole<Model, std::enable_if_t<std::is_convertible_v<
                               decltype(std::declval<const Model&>().OwnedRole(0)), Owned>>>
    : std::true_type {};

/// Returns the number of roles that Initialise does not compute.
template <class Model>
constexpr std::size_t OtherCount() {
  std::size_t count = 0;
  for (int i = 0; i < Blocks<Model>::kCount; ++i) count += IsInitialised<Model>(i) ? 0u : 1u;
  return count;
}

struct InitialiseCall {
  template <class Model, class... A>
  auto operator()(const Model& model, A... a) const
      -> std::enable_if_t<std::is_convertible_v<decltype(model.Initialise(a...)), bool>>;
};
template <class Model, class OtherRoles>
struct CanInitialise {
  static constexpr bool value =
      Model::kPrior > 0
          ? AcceptsRoles<InitialiseCall, Model, OtherRoles, const double*, const double*,
                         double*>::value
          : AcceptsRoles<InitialiseCall, Model, OtherRoles, const double*, double*>::value;
};

/// Returns true if each quantity has a name.
template <class Quantities>
constexpr bool AreNamed(const Quantities& quantities) {
  for (const Quantity& quantity : quantities) {
    if (quantity.name == nullptr) return false;
  }
  return true;
}

/// Compile-time check: rejects a sensor without the names that a Problem or a plugin needs.
/// StaticEkf does not need these names. Returns true.
template <class Model>
constexpr bool CheckSensorNames() {
  static_assert(HasRoles<Model>::value,
                "a sensor needs static constexpr std::array kRoles{alidade::Quantity{\"name\", "
                "\"unit\", \"meaning\"}, ...}, one for each role: see docs/add_a_sensor.md");
  static_assert(
      HasMeasurement<Model>::value,
      "a sensor needs static constexpr alidade::Quantity kMeasurement{\"name\", \"unit\", "
      "\"meaning\"}: see docs/add_a_sensor.md");
  return true;
}
template <class Model>
constexpr bool CheckMotionNames() {
  static_assert(HasBlocks<Model>::value,
                "a motion model needs static constexpr std::array kBlocks{alidade::Quantity{"
                "\"name\", \"unit\", \"meaning\"}, ...}, one for each block: see "
                "docs/add_a_motion_model.md");
  return true;
}

/// Compile-time check: rejects a sensor if a function is missing or has a wrong signature. Returns
/// true.
template <class Model>
constexpr bool CheckSensorMembers() {
  using Indices = typename Blocks<Model>::Indices;
  using OtherRoles = std::make_index_sequence<OtherCount<Model>()>;
  static_assert(HasPredict<Model, Indices>::value,
                "a sensor needs template <class T> bool Predict(const T* role..., [const double* "
                "known,] T* z) const, with one pointer for each role: see docs/add_a_sensor.md");
  static_assert(HasJacobian<Model, Indices>::value || !HasPredict<Model, Indices>::value ||
                    HasPredict<Model, Indices, AnyJet>::value,
                "Predict has to be a template <class T> on the scalar type, for automatic "
                "differentiation, unless the sensor defines Jacobian: see docs/add_a_sensor.md");
  static_assert(HasSqrtNoise<Model, Indices>::value,
                "a sensor needs template <class T> void SqrtNoise(const T* role..., [const double* "
                "known,] [const T* z,] T* L) const: see docs/add_a_sensor.md");
  static_assert(!DeclaresJacobian<Model>::value || HasJacobian<Model, Indices>::value,
                "Jacobian exists but cannot be called as Jacobian(const double* role..., "
                "[const double* known,] MatrixRef J_z_role...) const: see docs/add_a_sensor.md");
  static_assert(!DeclaresValid<Model>::value || HasValid<Model>::value,
                "Valid exists but cannot be called as bool Valid([const double* known,] const "
                "double* z) const: see docs/add_a_sensor.md");
  static_assert(!DeclaresOwnedRole<Model>::value || HasOwnedRole<Model>::value,
                "OwnedRole exists but cannot be called as Owned OwnedRole(int role) const: see "
                "docs/add_a_sensor.md");
  static_assert(
      !DeclaresInitialise<Model>::value || Model::kInitialises >= 0,
      "Initialise exists, but the model does not define kInitialises, the index of the role "
      "that Initialise computes: see docs/add_a_sensor.md");
  static_assert(Model::kInitialises < 0 || CanInitialise<Model, OtherRoles>::value,
                "kInitialises exists, but Initialise cannot be called as bool Initialise(const T* "
                "other_role..., [const double* known,] const T* z, [const T* prior,] T* y) const: "
                "see docs/add_a_sensor.md");
  return true;
}

template <class Model>
constexpr bool StepOrderFits() {
  if constexpr (std::is_same_v<decltype(Model::kStepOrder), const int>) {
    return Model::kStepOrder >= 0 && Model::kStepOrder <= 8;
  } else {
    return false;
  }
}

/// Compile-time check: rejects a motion model if a function is missing or has a wrong signature.
/// Returns true.
template <class Model>
constexpr bool CheckMotionMembers() {
  using Indices = typename Blocks<Model>::Indices;
  static_assert(HasStep<Model, Indices>::value,
                "a motion model needs template <class T> void Step(const T* block..., [const T* "
                "u,] const T* w, double dt_s, T* next...) const, with one pointer for each block: "
                "see alidade/model/model.h");
  static_assert(
      HasStepJacobian<Model, Indices>::value || !HasStep<Model, Indices>::value ||
          HasStep<Model, Indices, AnyJet>::value,
      "Step has to be a template <class T> on the scalar type, for automatic differentiation, "
      "unless the model defines StepJacobian: see docs/add_a_motion_model.md");
  static_assert(std::is_same_v<decltype(std::declval<const Model&>().noise_kind()), NoiseKind>,
                "noise_kind has to be declared as NoiseKind noise_kind() const: see "
                "docs/add_a_motion_model.md");
  static_assert(HasSqrtQ<Model, Indices>::value,
                "a motion model needs void SqrtQ([const double* block...,] double dt_s, MatrixRef "
                "Lq) const: see alidade/model/model.h");
  static_assert(!DeclaresStepJacobian<Model>::value || HasStepJacobian<Model, Indices>::value,
                "StepJacobian exists but cannot be called as StepJacobian(const double* block..., "
                "const double* w, double dt_s, MatrixRef F, MatrixRef G) const: see "
                "alidade/model/model.h");
  static_assert(
      !HasStepJacobian<Model, Indices>::value || Model::Input::kAmbient == 0,
      "StepJacobian is not supported for a model with a control input, whose Jacobians are "
      "computed by automatic differentiation");
  static_assert(!DeclaresStationary<Model>::value || HasStationary<Model>::value,
                "Stationary exists but cannot be called as bool Stationary() const: see "
                "alidade/model/model.h");
  static_assert(StepOrderFits<Model>(),
                "kStepOrder has to be a static constexpr int from 0 to 8, the order in dt of the "
                "error of a step (2 for Euler's method): see docs/add_a_motion_model.md");
  static_assert(
      Blocks<Model>::kStatic || HasSize<Model>::value,
      "a block of size kDynamic needs int Size(int block) const: see alidade/model/model.h");
  return true;
}

}  // namespace detail
}  // namespace alidade
