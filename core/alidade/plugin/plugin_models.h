// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/estimation/models.h"
#include "alidade/plugin/model_instance.h"

/// Models behind the plugin ABI, as estimators see models.
namespace alidade {

/// A sensor by the calls of plugin_abi.h. An exception of a call is an error of the model.
class PluginSensor final : public SensorModel {
 public:
  /// ContractViolation if the instance is no sensor.
  explicit PluginSensor(std::shared_ptr<const ModelInstance> instance);
  const ModelInstance& instance() const { return *instance_; }

 private:
  Status DoEvaluate(const Observation& seen, const double* const* roles,
                    const Output& out) const override;
  Status DoValid(const Observation& seen) const override;
  Status DoInitialise(const double* const* roles, const Observation& seen, const double* prior,
                      const InverseOutput& out) const override;
  AlidadeObservation Show(const Observation& seen) const;

  std::shared_ptr<const ModelInstance> instance_;
  const AlidadeSensor* calls_;
  const void* self_;
  AlidadeObservation unseen_;  ///< to be copied, which is faster than filling one with zeros
};

/// A motion model by the calls of plugin_abi.h. An exception of a call is an error of the model.
class PluginMotion final : public MotionModel {
 public:
  /// ContractViolation if the instance is no motion model.
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
