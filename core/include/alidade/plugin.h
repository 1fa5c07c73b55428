// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <exception>
#include <memory>

#include "alidade/autodiff.h"
#include "alidade/fingerprint.h"

/// Puts models behind the sealed boundary of plugin_abi.h. In the .cc of a plugin:
///
///   ALIDADE_PLUGIN(ALIDADE_SENSOR(Model, "name", "doc", "citation"), ...)
namespace alidade {
namespace detail {

inline AlidadeSpace Describe(const Quantity& q, std::uint32_t geometry, int ambient, int tangent) {
  AlidadeSpace space{};
  space.struct_size = sizeof(AlidadeSpace);
  space.geometry = geometry;
  space.ambient = ambient;
  space.tangent = tangent;
  space.flags = q.flags;
  space.name = q.name;
  space.unit = q.unit;
  space.elements = q.elements;
  space.doc = q.doc;
  return space;
}

/// A model with its description, as the instance's `self`.
template <class Model>
struct Holder {
  explicit Holder(Params& p) : Holder(Model(p)) {}
  explicit Holder(Model m) : model(std::move(m)) { description.struct_size = sizeof(description); }
  Holder(const Holder&) = delete;
  Holder& operator=(const Holder&) = delete;

  template <class Quantities>
  void DescribeRoles(const Quantities& quantities) {
    static_assert(std::tuple_size<Quantities>::value == Blocks<Model>::kCount,
                  "one Quantity for each role or block");
    const auto describe = [&](auto index) {
      constexpr int i = decltype(index)::value;
      using G = SpaceAt<i, Model>;
      if constexpr (HasSize<Model>::value) {
        roles[i] = Describe(quantities[i], G::kGeometry, model.Size(i), model.Size(i));
      } else {
        roles[i] = Describe(quantities[i], G::kGeometry, G::kAmbient, G::kTangent);
      }
    };
    ForEach(describe, typename Blocks<Model>::Indices{});
    description.role_count = Blocks<Model>::kCount;
    description.role_stride = sizeof(AlidadeSpace);
    description.roles = roles;
  }

  Model model;
  AlidadeDescription description{};
  AlidadeSpace roles[Blocks<Model>::kCount];
  AlidadeSpace space;  ///< the measurement, or the control input
  mutable char error[256] = "";
};

/// Runs f on the holder behind `self`; an exception becomes ALIDADE_ERROR and its text.
template <class Model, class F>
std::int32_t Guarded(const void* self, const F& f) noexcept {
  const auto* holder = static_cast<const Holder<Model>*>(self);
#if defined(__cpp_exceptions)
  try {
    return f(holder->model);
  } catch (const std::exception& e) {
    std::snprintf(holder->error, sizeof(holder->error), "%s", e.what());
  } catch (...) {
    std::snprintf(holder->error, sizeof(holder->error), "an exception of unknown type");
  }
  return ALIDADE_ERROR;
#else
  return f(holder->model);
#endif
}

/// Hidden, as is MotionCalls: were its table exported, two plugins with a struct of one name would
/// share the table of the first (STB_GNU_UNIQUE), whatever dlopen is told.
template <class Model>
struct __attribute__((visibility("hidden"))) SensorCalls {
  static constexpr bool kInitialises = Model::kInitialises >= 0;

  static std::int32_t Eval(const void* self, const double* const* roles, double* z,
                           double* const* jacobians, const std::int32_t* strides) noexcept {
    return Guarded<Model>(self, [&](const Model& model) {
      return static_cast<std::int32_t>(Evaluate(model, roles, z, jacobians, strides));
    });
  }
  template <std::size_t... I>
  static void CallNoise(const Model& model, const double* const* x, const double* z, double* l,
                        std::index_sequence<I...>) {
    if constexpr (HasNoiseOfMeasurement<Model, std::index_sequence<I...>>::value) {
      model.SqrtNoise(x[I]..., z, l);
    } else {
      static_cast<void>(z);
      model.SqrtNoise(x[I]..., l);
    }
  }
  static std::int32_t SqrtNoise(const void* self, const double* const* roles, const double* z,
                                double* l, std::int32_t stride) noexcept {
    return Guarded<Model>(self, [&](const Model& model) {
      constexpr int m = Model::Measurement::kTangent;
      double dense[m * m] = {};
      CallNoise(model, roles, z, dense, typename Blocks<Model>::Indices{});
      for (int i = 0; i < m; ++i) std::copy_n(dense + i * m, m, l + i * stride);
      return std::int32_t{ALIDADE_OK};
    });
  }
  static std::int32_t Valid(const void* self, const double* z) noexcept {
    return Guarded<Model>(self, [&](const Model& model) {
      if constexpr (HasValid<Model>::value) {
        return std::int32_t{model.Valid(z) ? ALIDADE_OK : ALIDADE_INVALID};
      } else {
        static_cast<void>(model);
        return std::int32_t{ALIDADE_OK};
      }
    });
  }
  static std::int32_t Initialise(const void* self, const double* const* roles, const double* z,
                                 const double* prior, double* y, double* const* jx,
                                 const std::int32_t* jx_strides, double* jz, std::int32_t jz_stride,
                                 double* jp, std::int32_t jp_stride) noexcept {
    return Guarded<Model>(self, [&](const Model& model) {
      if constexpr (kInitialises) {
        return static_cast<std::int32_t>(InitialiseRole(model, roles, z, prior, y, jx, jx_strides,
                                                        {jz, jz_stride}, {jp, jp_stride}));
      } else {
        return std::int32_t{ALIDADE_ERROR};
      }
    });
  }
  static constexpr AlidadeSensor kCalls{sizeof(AlidadeSensor),
                                        0,
                                        Eval,
                                        SqrtNoise,
                                        HasValid<Model>::value ? Valid : nullptr,
                                        kInitialises ? Initialise : nullptr,
                                        nullptr,
                                        {}};
};

template <class Model>
struct __attribute__((visibility("hidden"))) MotionCalls {
  static std::int32_t Step(const void* self, const double* const* blocks, const double* input,
                           const double* w, double dt_s, double* const* next, double* f,
                           std::int32_t f_stride, double* g, std::int32_t g_stride) noexcept {
    return Guarded<Model>(self, [&](const Model& model) {
      return static_cast<std::int32_t>(
          alidade::Step(model, blocks, input, w, dt_s, next, {f, f_stride}, {g, g_stride}));
    });
  }
  template <std::size_t... I>
  static void CallSqrtQ(const Model& model, const double* const* x, double dt_s, MatrixRef l,
                        std::index_sequence<I...>) {
    if constexpr (HasSimpleSqrtQ<Model>::value) {
      static_cast<void>(x);
      model.SqrtQ(dt_s, l);
    } else {
      model.SqrtQ(x[I]..., dt_s, l);
    }
  }
  static std::int32_t SqrtQ(const void* self, const double* const* blocks, double dt_s, double* l,
                            std::int32_t stride) noexcept {
    return Guarded<Model>(self, [&](const Model& model) {
      const int n = NoiseSizeOf(model);
      Zero({l, stride}, n, n);
      CallSqrtQ(model, blocks, dt_s, {l, stride}, typename Blocks<Model>::Indices{});
      return std::int32_t{ALIDADE_OK};
    });
  }
  static constexpr AlidadeMotion kCalls{sizeof(AlidadeMotion), 0, Step, SqrtQ, {}};
};

/// Hands `holder` over as `instance`.
template <class Model>
void Publish(std::unique_ptr<Holder<Model>> holder, std::uint32_t kind, AlidadeInstance* instance) {
  instance->kind = kind;
  instance->destroy = [](void* self) { delete static_cast<Holder<Model>*>(self); };
  instance->error_text = [](const void* self) -> const char* {
    return static_cast<const Holder<Model>*>(self)->error;
  };
  instance->description = &holder->description;
  instance->self = holder.release();
}

template <class Model>
void PublishSensor(std::unique_ptr<Holder<Model>> holder, AlidadeInstance* instance) {
  using Z = typename Model::Measurement;
  constexpr auto roles = Model::kRoles;  // copies, lest they too be shared
  constexpr Quantity measurement = Model::kMeasurement;
  holder->DescribeRoles(roles);
  holder->space = Describe(measurement, Z::kGeometry, Z::kAmbient, Z::kTangent);
  holder->description.output = &holder->space;
  holder->description.initialise_role = Model::kInitialises;
  holder->description.capabilities =
      (Model::kInitialises >= 0 ? unsigned{ALIDADE_CAN_INITIALISE} : 0u) |
      (HasValid<Model>::value ? unsigned{ALIDADE_HAS_VALIDITY} : 0u) |
      (HasJacobian<Model, typename Blocks<Model>::Indices>::value ? unsigned{ALIDADE_CLOSED_FORM}
                                                                  : 0u);
  instance->sensor = &SensorCalls<Model>::kCalls;
  Publish(std::move(holder), ALIDADE_KIND_SENSOR, instance);
}

template <class Model>
void PublishMotion(std::unique_ptr<Holder<Model>> holder, AlidadeInstance* instance) {
  using U = typename Model::Input;
  constexpr auto blocks = Model::kBlocks;
  holder->DescribeRoles(blocks);
  if (U::kAmbient > 0) {
    constexpr Quantity input = Model::kInput;
    holder->space = Describe(input, U::kGeometry, U::kAmbient, U::kTangent);
    holder->description.input = &holder->space;
  }
  holder->description.noise_count = NoiseSizeOf(holder->model);
  holder->description.initialise_role = -1;
  instance->motion = &MotionCalls<Model>::kCalls;
  Publish(std::move(holder), ALIDADE_KIND_MOTION, instance);
}

/// Runs f(params) for an entry's `create`; an exception is noted with the host.
template <class F>
std::int32_t GuardedCreate(const AlidadeHost* host, const F& f) noexcept {
  Params params(host);
#if defined(__cpp_exceptions)
  try {
    f(params);
    return ALIDADE_OK;
  } catch (const std::exception& e) {
    params.Fail("", e.what());
  } catch (...) {
    params.Fail("", "an exception of unknown type");
  }
  return ALIDADE_ERROR;
#else
  f(params);
  return ALIDADE_OK;
#endif
}

using Maker = void (*)(Params&, AlidadeInstance*);

template <Maker kMake>
constexpr AlidadeEntry Entry(std::uint32_t kind, const char* name, const char* doc,
                             const char* citation) {
  AlidadeEntry entry{};
  entry.struct_size = sizeof(AlidadeEntry);
  entry.kind = kind;
  entry.family = "";
  entry.name = name;
  entry.doc = doc;
  entry.citation = citation;
  entry.thread_flags = ALIDADE_THREAD_INSTANCES | ALIDADE_THREAD_CALLS;
  entry.create = [](const AlidadeHost* host, AlidadeInstance* instance) -> std::int32_t {
    return GuardedCreate(host, [&](Params& params) { kMake(params, instance); });
  };
  return entry;
}

}  // namespace detail

/// Makes a model from its parameters and hands it over as `instance`.
template <class Model>
void EmplaceSensor(Params& params, AlidadeInstance* instance) {
  detail::PublishSensor(std::make_unique<detail::Holder<Model>>(params), instance);
}
template <class Model>
void EmplaceMotion(Params& params, AlidadeInstance* instance) {
  detail::PublishMotion(std::make_unique<detail::Holder<Model>>(params), instance);
}

}  // namespace alidade

/// One model of a plugin. The _BY forms take a function `void (alidade::Params&, AlidadeInstance*)`
/// that reads a parameter to choose which struct to emplace.
#define ALIDADE_SENSOR(Model, name, doc, citation) \
  ALIDADE_SENSOR_BY(alidade::EmplaceSensor<Model>, name, doc, citation)
#define ALIDADE_MOTION(Model, name, doc, citation) \
  ALIDADE_MOTION_BY(alidade::EmplaceMotion<Model>, name, doc, citation)
#define ALIDADE_SENSOR_BY(make, name, doc, citation) \
  (alidade::detail::Entry<make>(ALIDADE_KIND_SENSOR, name, doc, citation))
#define ALIDADE_MOTION_BY(make, name, doc, citation) \
  (alidade::detail::Entry<make>(ALIDADE_KIND_MOTION, name, doc, citation))

/// Exports the models as this plugin's table. Once for each plugin.
#define ALIDADE_PLUGIN(...)                                                                    \
  ALIDADE_FINGERPRINT(ALIDADE_TIER_SEALED, "")                                                 \
  extern "C" __attribute__((visibility("default"))) const AlidadeTable* alidade_plugin(void) { \
    static const AlidadeEntry entries[] = {__VA_ARGS__};                                       \
    static const AlidadeTable table = alidade::detail::Table(entries, &alidade_fingerprint);   \
    return &table;                                                                             \
  }
