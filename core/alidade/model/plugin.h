// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <memory>
#include <utility>

#include "alidade/model/build_tag.h"
#include "alidade/model/plugin_thunks.h"

/// Exports models through the plugin ABI (plugin_abi.h). The .cc file of a plugin contains
///
///   ALIDADE_PLUGIN(ALIDADE_SENSOR(Model, "name", "doc", "citation"), ...)
namespace alidade {
namespace detail {

/// Stores `holder` in `instance`, which then owns it.
template <class Model>
void Publish(std::unique_ptr<Holder<Model>> holder, std::uint32_t kind, AlidadeInstance* instance) {
  instance->kind = kind;
  instance->destroy = [](void* self) { delete static_cast<Holder<Model>*>(self); };
  instance->error_text = [](const void*) -> const char* { return LastError::Text(); };
  instance->description = &holder->description;
  instance->self = holder.release();
}

template <class Model>
void PublishSensor(std::unique_ptr<Holder<Model>> holder, AlidadeInstance* instance) {
  static_assert(CheckSensorNames<Model>());
  constexpr auto roles = Model::kRoles;  // local copy, so that plugins do not share the symbol
  holder->DescribeRoles(roles);
  holder->DescribeMeasurement();
  holder->DescribeKnown();
  holder->DescribeOwned();
  holder->description.initialise_role = Model::kInitialises;
  holder->description.prior_count = Model::kPrior;
  holder->description.capabilities =
      (Model::kInitialises >= 0 ? unsigned{ALIDADE_CAN_INITIALISE} : 0u) |
      (HasValid<Model>::value ? unsigned{ALIDADE_HAS_VALIDITY} : 0u) |
      (HasJacobian<Model, typename Blocks<Model>::Indices>::value
           ? unsigned{ALIDADE_ANALYTIC_JACOBIAN}
           : 0u);
  instance->sensor = &SensorCalls<Model>::kCalls;
  Publish(std::move(holder), ALIDADE_KIND_SENSOR, instance);
}

template <class Model>
void PublishMotion(std::unique_ptr<Holder<Model>> holder, AlidadeInstance* instance) {
  static_assert(CheckMotionNames<Model>() && CheckMotionMembers<Model>());
  using U = typename Model::Input;
  constexpr auto blocks = Model::kBlocks;
  holder->DescribeRoles(blocks);
  if (U::kAmbient > 0) {
    constexpr Quantity input = Model::kInput;
    holder->space = Describe(input, U::kGeometry, U::kAmbient, U::kTangent);
    holder->description.inputs = &holder->space;
    holder->description.input_count = 1;
    holder->description.input_stride = sizeof(AlidadeSpace);
  }
  holder->description.noise_count = NoiseSizeOf(holder->model);
  if constexpr (HasStepJacobian<Model, typename Blocks<Model>::Indices>::value) {
    holder->description.capabilities |= ALIDADE_ANALYTIC_JACOBIAN;
  }
  if constexpr (HasStationary<Model>::value) {
    if (holder->model.Stationary()) holder->description.capabilities |= ALIDADE_STATIONARY;
  }
  holder->description.capabilities |= static_cast<unsigned>(Model::kStepOrder)
                                      << ALIDADE_STEP_ORDER_SHIFT;
  const NoiseKind kind = holder->model.noise_kind();
  if (kind == NoiseKind::kDiscrete) holder->description.capabilities |= ALIDADE_DISCRETE_NOISE;
  holder->description.initialise_role = -1;
  instance->motion = &MotionCalls<Model>::kCalls;
  Publish(std::move(holder), ALIDADE_KIND_MOTION, instance);
}

/// Implements `create` of an entry. Runs f(params) and reports an exception to the host.
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
  entry.version = "";
  entry.thread_flags = ALIDADE_THREAD_INSTANCES | ALIDADE_THREAD_CALLS;
  entry.create = [](const AlidadeHost* host, AlidadeInstance* instance) -> std::int32_t {
    return GuardedCreate(host, [&](Params& params) { kMake(params, instance); });
  };
  return entry;
}

}  // namespace detail

/// Stores a sensor model in `instance`.
template <class Model>
void EmplaceSensor(const Model& model, AlidadeInstance* instance) {
  detail::PublishSensor(std::make_unique<detail::Holder<Model>>(model), instance);
}
/// Creates a model from its parameters and stores it in `instance`.
template <class Model>
void EmplaceSensor(Params& params, AlidadeInstance* instance) {
  detail::PublishSensor(std::make_unique<detail::Holder<Model>>(params), instance);
}
template <class Model>
void EmplaceMotion(Params& params, AlidadeInstance* instance) {
  detail::PublishMotion(std::make_unique<detail::Holder<Model>>(params), instance);
}

}  // namespace alidade

/// Each of these macros defines one model of a plugin. Use the _BY macros if a parameter selects
/// the struct of the model. Their argument `make` is a function `void (alidade::Params&,
/// AlidadeInstance*)` that reads this parameter and calls EmplaceSensor or EmplaceMotion for the
/// selected struct.
#define ALIDADE_SENSOR(Model, name, doc, citation) \
  ALIDADE_SENSOR_BY(alidade::EmplaceSensor<Model>, name, doc, citation)
#define ALIDADE_MOTION(Model, name, doc, citation) \
  ALIDADE_MOTION_BY(alidade::EmplaceMotion<Model>, name, doc, citation)
#define ALIDADE_SENSOR_BY(make, name, doc, citation) \
  (alidade::detail::Entry<make>(ALIDADE_KIND_SENSOR, name, doc, citation))
#define ALIDADE_MOTION_BY(make, name, doc, citation) \
  (alidade::detail::Entry<make>(ALIDADE_KIND_MOTION, name, doc, citation))

/// Exports the given models, which must be constant expressions, as the table of the plugin. Use
/// this macro once in each plugin.
#define ALIDADE_PLUGIN(...)                                                                        \
  ALIDADE_BUILD_TAG(ALIDADE_PLUGIN_C_ABI, "")                                                      \
  static constexpr AlidadeEntry alidade_entries[] = {__VA_ARGS__};                                 \
  ALIDADE_ENTRY_NAMES(alidade_entries)                                                             \
  extern "C" __attribute__((visibility("default"))) const AlidadeTable* alidade_plugin(void) {     \
    static const AlidadeTable table = alidade::detail::Table(alidade_entries, &alidade_build_tag); \
    return &table;                                                                                 \
  }
