// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/estimation/models.h"
#include "alidade/plugin/model_instance.h"

/// Adapters from the plugin ABI to the model interfaces that estimators use.
namespace alidade {

/// Sensor model that calls the functions of a plugin (plugin_abi.h). An exception in a call counts
/// as an error of the model.
class PluginSensor final : public SensorModel {
 public:
  /// Error: ContractViolation if the instance is not a sensor.
  explicit PluginSensor(std::shared_ptr<const ModelInstance> instance);
  const ModelInstance& instance() const { return *instance_; }

 private:
  Status DoEvaluate(const Observation& observation, const double* const* roles,
                    const Output& out) const override;
  Status DoValid(const Observation& observation) const override;
  Status DoInitialise(const double* const* roles, const Observation& observation,
                      const double* prior, const InverseOutput& out) const override;
  AlidadeObservation ToAbi(const Observation& observation) const;

  std::shared_ptr<const ModelInstance> instance_;
  const AlidadeSensor* calls_;
  const void* self_;
  /// Initial value that ToAbi() copies for each call. Copying is faster than zeroing.
  AlidadeObservation empty_observation_;
};

/// Motion model that calls the functions of a plugin (plugin_abi.h). An exception in a call counts
/// as an error of the model.
class PluginMotion final : public MotionModel {
 public:
  /// Error: ContractViolation if the instance is not a motion model.
  explicit PluginMotion(std::shared_ptr<const ModelInstance> instance);
  const ModelInstance& instance() const { return *instance_; }

 private:
  Status DoStep(const double* const* blocks, const double* input, const double* w, double dt_s,
                const Output& out) const override;

  std::shared_ptr<const ModelInstance> instance_;
  const AlidadeMotion* calls_;
  const void* self_;
};

}  // namespace alidade
