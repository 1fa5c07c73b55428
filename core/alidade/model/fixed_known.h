// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <type_traits>
#include <utility>

#include "alidade/model/plugin.h"

namespace alidade {

/// Sensor whose known numbers are the same for each measurement, and a parameter of the model. The
/// base `Model` declares known numbers, which accompany each measurement, and
///
///   static constexpr const char* kFixedKey;              key of the parameter
template <class Model, bool kHasValid = detail::HasValid<Model>::value>
struct FixedKnown;

template <class Model>
struct FixedKnown<Model, false> : Model {
  static constexpr int kSize = Model::Known::kAmbient;
  static constexpr std::size_t kArguments = std::tuple_size<typename Model::Spaces>::value + 1;
  using Known = Vec<0>;
  static constexpr Quantity kKnown{""};

  std::array<double, kSize> fixed;

  FixedKnown(const Model& model, const std::array<double, kSize>& value)
      : Model(model), fixed(value) {}
  explicit FixedKnown(Params& params) : FixedKnown(Model(params), ReadFixed(params)) {}

  /// Reads the parameter. Without it, the elements of the result are infinite.
  static std::array<double, kSize> ReadFixed(Params& params) {
    std::array<double, kSize> none;
    none.fill(std::numeric_limits<double>::infinity());
    return params.Vector<kSize>(Model::kFixedKey, Model::kKnown.unit,
                                "known to the model; default: a part of each measurement", Range{},
                                none);
  }

  /// Calls the function of Model with the fixed numbers.
  template <class... A, std::enable_if_t<sizeof...(A) == kArguments, int> = 0>
  bool Predict(A... roles_and_z) const {
    return Insert([this](auto... a) { return this->Model::Predict(a...); },
                  std::make_tuple(roles_and_z...), std::make_index_sequence<kArguments - 1>());
  }
  /// Calls the function of Model with the fixed numbers.
  template <class... A, std::enable_if_t<sizeof...(A) == kArguments, int> = 0>
  void SqrtNoise(A... roles_and_l) const {
    Insert([this](auto... a) { this->Model::SqrtNoise(a...); }, std::make_tuple(roles_and_l...),
           std::make_index_sequence<kArguments - 1>());
  }

 private:
  template <class F, class Arguments, std::size_t... I>
  auto Insert(const F& f, const Arguments& arguments, std::index_sequence<I...>) const {
    return f(std::get<I>(arguments)..., fixed.data(), std::get<sizeof...(I)>(arguments));
  }
};

template <class Model>
struct FixedKnown<Model, true> : FixedKnown<Model, false> {
  using FixedKnown<Model, false>::FixedKnown;

  /// Calls the function of Model with the fixed numbers.
  bool Valid(const double* z) const { return Model::Valid(this->fixed.data(), z); }
};

/// Creates FixedKnown<Model> if the config contains the key of the fixed numbers, otherwise Model.
template <class Model>
void EmplaceKnown(Params& params, AlidadeInstance* instance) {
  if (std::isfinite(FixedKnown<Model>::ReadFixed(params)[0])) {
    EmplaceSensor<FixedKnown<Model>>(params, instance);
  } else {
    EmplaceSensor<Model>(params, instance);
  }
}

}  // namespace alidade
