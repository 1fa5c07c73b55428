// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/plugin_models.h"

#include <utility>

#include "alidade/base/error.h"
#include "alidade/plugin/abi_read.h"

namespace alidade {
namespace {

/// Returns the status of `call`, which calls the function `name` of the instance. A result code
/// that the ABI does not define counts as an error of `model`.
template <class Call>
Status StatusOf(const void* model, const ModelInstance& instance, const char* name,
                const Call& call) {
  try {
    const std::int32_t code = call();
    if (code >= ALIDADE_OK && code < ALIDADE_ERROR) return static_cast<Status>(code);
    return internal::RecordModelError(model, instance.error_text());
  } catch (...) {
    const std::string exception_text = internal::CatchExceptionText([] { throw; });
    return internal::RecordModelError(model, std::string(name) + " of model '" + instance.name() +
                                                 "' of plugin " + instance.plugin() +
                                                 " threw: " + exception_text);
  }
}

SensorModel::Description DescriptionOf(const ModelInstance& instance) {
  ALIDADE_EXPECTS(instance.c().kind == ALIDADE_KIND_SENSOR);
  SensorModel::Description description;
  description.name = instance.name();
  description.origin = instance.plugin();
  description.roles = instance.spaces();
  description.measurement = instance.space();
  description.known = instance.known();
  description.owned = instance.owned();
  description.has_validity = instance.c().sensor->valid != nullptr;
  description.sqrt_noise = instance.noise_root();
  if ((instance.capabilities() & ALIDADE_CAN_INITIALISE) != 0) {
    const AlidadeDescription& c = *instance.c().description;
    const auto is_landmark = [&](int i) {
      return i < std::ssize(description.roles) &&
             description.roles[static_cast<std::size_t>(i)].landmark();
    };
    InverseModel& inverse = description.inverse;
    inverse.role = c.initialise_role;
    inverse.prior_size = c.prior_count;
    inverse.count = 1;
    while (is_landmark(inverse.role) && is_landmark(inverse.role + inverse.count)) ++inverse.count;
  }
  return description;
}

MotionModel::Description MotionDescriptionOf(const ModelInstance& instance) {
  ALIDADE_EXPECTS(instance.c().kind == ALIDADE_KIND_MOTION);
  MotionModel::Description description;
  description.name = instance.name();
  description.origin = instance.plugin();
  description.blocks = instance.spaces();
  description.input = instance.space();
  description.noise_size = instance.c().description->noise_count;
  description.stationary = (instance.capabilities() & ALIDADE_STATIONARY) != 0;
  description.discrete_noise = (instance.capabilities() & ALIDADE_DISCRETE_NOISE) != 0;
  description.sqrt_noise = instance.noise_root();
  return description;
}

}  // namespace

PluginSensor::PluginSensor(std::shared_ptr<const ModelInstance> instance)
    : SensorModel(DescriptionOf(*instance)),
      instance_(std::move(instance)),
      calls_(instance_->c().sensor),
      self_(instance_->c().self),
      empty_observation_(internal::MakeObservation(nullptr, nullptr)) {}

inline AlidadeObservation PluginSensor::ToAbi(const Observation& observation) const {
  AlidadeObservation abi_observation = empty_observation_;
  abi_observation.z = observation.z;
  abi_observation.known = observation.known;
  return abi_observation;
}

Status PluginSensor::DoEvaluate(const Observation& observation, const double* const* roles,
                                const Output& out) const {
  const AlidadeObservation abi_observation = ToAbi(observation);
  Status status = Status::kOk;
  if (out.h != nullptr) {
    status = StatusOf(this, *instance_, "Predict", [&] {
      return calls_->eval(self_, &abi_observation, roles, out.h, out.jacobians, out.strides);
    });
  }
  if (status != Status::kOk || out.sqrt_noise == nullptr) return status;
  return StatusOf(this, *instance_, "SqrtNoise", [&] {
    return calls_->sqrt_noise(self_, &abi_observation, roles, out.sqrt_noise,
                              measurement().geometry.tangent);
  });
}

Status PluginSensor::DoValid(const Observation& observation) const {
  const AlidadeObservation abi_observation = ToAbi(observation);
  return StatusOf(this, *instance_, "Valid",
                  [&] { return calls_->valid(self_, &abi_observation); });
}

Status PluginSensor::DoInitialise(const double* const* roles, const Observation& observation,
                                  const double* prior, const InverseOutput& out) const {
  const AlidadeObservation abi_observation = ToAbi(observation);
  return StatusOf(this, *instance_, "Initialise", [&] {
    return calls_->initialise(self_, &abi_observation, roles, prior, out.y, out.jx, out.strides,
                              out.jz, measurement().geometry.tangent, out.jp, inverse().prior_size);
  });
}

PluginMotion::PluginMotion(std::shared_ptr<const ModelInstance> instance)
    : MotionModel(MotionDescriptionOf(*instance)),
      instance_(std::move(instance)),
      calls_(instance_->c().motion),
      self_(instance_->c().self) {}

Status PluginMotion::DoStep(const double* const* blocks, const double* input, const double* w,
                            double dt_s, const Output& out) const {
  Status status = Status::kOk;
  if (out.next != nullptr) {
    status = StatusOf(this, *instance_, "Step", [&] {
      return calls_->step(self_, blocks, &input, w, dt_s, out.next, out.f, tangent_size(), out.g,
                          noise_size(), nullptr, 0);
    });
  }
  if (status != Status::kOk || out.sqrt_q == nullptr) return status;
  return StatusOf(this, *instance_, "SqrtQ", [&] {
    return calls_->sqrt_q(self_, blocks, &input, dt_s, out.sqrt_q, noise_size());
  });
}

}  // namespace alidade
