// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <exception>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "alidade/estimation/models.h"
#include "alidade/model/autodiff_inverse.h"
#include "alidade/model/model_members.h"

/// Sensor and motion models that call model structs (alidade/model/model.h). The structs are
/// compiled into the program, so that a plugin is not needed.
namespace alidade {

/// Struct that is derived from Sensor (alidade/model/model.h).
template <class Model>
concept SensorStruct = requires {
  Model::kInitialises;
};
/// Struct that is derived from Motion (alidade/model/model.h).
template <class Model>
concept MotionStruct = requires {
  Model::kNoise;
};

namespace detail {

/// Returns the space of a quantity with this geometry. If the geometry is a product, `parts` are
/// the spaces of its factors.
Space SpaceOf(const Quantity& quantity, const Geometry& geometry,
              const std::vector<Space>& parts = {});

template <class G>
Geometry GeometryOf(int size) {
  return Geometry::Of<G>(size);
}

template <class Model>
Space MeasurementSpace() {
  using Z = typename Model::Measurement;
  std::vector<Space> parts;
  std::vector<Geometry> geometries;
  if constexpr (Z::kGeometry == ALIDADE_PRODUCT) {
    constexpr auto quantities = Model::kParts;
    static_assert(quantities.size() == Z::kParts, "kParts needs one Quantity for each part");
    Z::ForEachPart([&](auto part, int, int) {
      geometries.push_back(GeometryOf<decltype(part)>(decltype(part)::kAmbient));
      parts.push_back(SpaceOf(quantities[parts.size()], geometries.back()));
    });
    return SpaceOf(Model::kMeasurement, Geometry::Product(geometries), parts);
  } else {
    return SpaceOf(Model::kMeasurement, GeometryOf<Z>(Z::kAmbient));
  }
}

/// Converts the prior and dynamics of a role. Throws Error kPlugin if either is invalid.
OwnedRole OwnedRoleOf(const Owned& owned, const Space& role);

template <class Model>
SensorModel::Description DescribeSensor(const Model& model, std::string name) {
  static_assert(CheckSensorNames<Model>() && CheckSensorMembers<Model>());
  static_assert(std::tuple_size_v<decltype(Model::kRoles)> == Blocks<Model>::kCount,
                "kRoles needs one Quantity for each role");
  static_assert(AreNamed(Model::kRoles) && Model::kMeasurement.name != nullptr,
                "kMeasurement and each Quantity of kRoles need a name, as in Quantity{\"depth\"}");
  SensorModel::Description description;
  description.name = std::move(name);
  ForEach(
      [&](auto i) {
        using G = SpaceAt<i, Model>;
        description.roles.push_back(SpaceOf(Model::kRoles[i], GeometryOf<G>(G::kAmbient)));
        if constexpr (HasOwnedRole<Model>::value) {
          const Space& role = description.roles.back();
          if ((role.flags & ALIDADE_ROLE_OWNED) != 0) {
            description.owned[i] = OwnedRoleOf(model.OwnedRole(i), role);
          }
        }
      },
      typename Blocks<Model>::Indices{});
  description.measurement = MeasurementSpace<Model>();
  if constexpr (kHasKnown<Model>) {
    description.known =
        SpaceOf(Model::kKnown, GeometryOf<typename Model::Known>(Model::Known::kAmbient));
  }
  if constexpr (Model::kInitialises >= 0) {
    description.inverse.role = Model::kInitialises;
    description.inverse.prior_size = Model::kPrior;
    for (int i = 0; i < Blocks<Model>::kCount; ++i) {
      description.inverse.count += IsInitialised<Model>(i) ? 1 : 0;
    }
  }
  description.has_validity = HasValid<Model>::value;
  return description;
}

template <class Model>
MotionModel::Description DescribeMotion(const Model& model, std::string name) {
  static_assert(CheckMotionNames<Model>() && CheckMotionMembers<Model>());
  static_assert(std::tuple_size_v<decltype(Model::kBlocks)> == Blocks<Model>::kCount,
                "kBlocks needs one Quantity for each block");
  static_assert(AreNamed(Model::kBlocks),
                "each Quantity of kBlocks needs a name, as in Quantity{\"position\"}");
  MotionModel::Description description;
  description.name = std::move(name);
  ForEach(
      [&](auto i) {
        using G = SpaceAt<i, Model>;
        int size = G::kAmbient;
        if constexpr (HasSize<Model>::value) size = model.Size(i);
        description.blocks.push_back(SpaceOf(Model::kBlocks[i], GeometryOf<G>(size)));
      },
      typename Blocks<Model>::Indices{});
  if constexpr (Model::Input::kAmbient > 0) {
    description.input =
        SpaceOf(Model::kInput, GeometryOf<typename Model::Input>(Model::Input::kAmbient));
  }
  description.noise_size = NoiseSizeOf(model);
  description.discrete_noise = model.noise_kind() == NoiseKind::kDiscrete;
  if constexpr (HasStationary<Model>::value) description.stationary = model.Stationary();
  return description;
}

/// Runs `call`, which calls `model`. If `call` throws, records the text of the exception as the
/// error text of the model and returns kError.
template <class Call>
Status Guarded(const void* model, const Call& call) {
  try {
    return call();
  } catch (const std::exception& e) {
    return internal::RecordModelError(model, e.what());
  }
}

}  // namespace detail

/// Sensor model that calls a struct derived from Sensor.
template <class Model>
class DirectSensor final : public SensorModel {
 public:
  explicit DirectSensor(Model model, std::string name = "model")
      : SensorModel(detail::DescribeSensor(model, std::move(name))), model_(std::move(model)) {}
  const Model& model() const { return model_; }

 private:
  using Indices = typename detail::Blocks<Model>::Indices;

  ALIDADE_FLATTEN Status DoEvaluate(const Observation& observation, const double* const* roles,
                                    const Output& out) const override {
    return detail::Guarded(this, [&] {
      Status status = Status::kOk;
      if (out.h != nullptr) {
        status =
            alidade::Evaluate(model_, roles, out.h, out.jacobians, out.strides, observation.known);
      }
      if (status == Status::kOk && out.sqrt_noise != nullptr) {
        constexpr int m = Model::Measurement::kTangent;
        std::fill_n(out.sqrt_noise, m * m, 0.0);
        detail::CallSqrtNoise(model_, roles, observation.known, observation.z, out.sqrt_noise,
                              Indices{});
      }
      return status;
    });
  }
  Status DoValid(const Observation& observation) const override {
    if constexpr (detail::HasValid<Model>::value) {
      return detail::Guarded(this, [&] {
        return detail::CallValid(model_, observation.known, observation.z) ? Status::kOk
                                                                           : Status::kInvalid;
      });
    } else {
      return Status::kOk;
    }
  }
  Status DoInitialise(const double* const* roles, const Observation& observation,
                      const double* prior, const InverseOutput& out) const override {
    if constexpr (Model::kInitialises >= 0) {
      return detail::Guarded(this, [&] {
        return InitialiseRole(model_, roles, observation.z, prior, out.y, out.jx, out.strides,
                              MatrixRef{out.jz, Model::Measurement::kTangent},
                              MatrixRef{out.jp, Model::kPrior}, observation.known);
      });
    } else {
      return Status::kError;
    }
  }

  Model model_;
};

/// Motion model that calls a struct derived from Motion.
template <class Model>
class DirectMotion final : public MotionModel {
 public:
  explicit DirectMotion(Model model, std::string name = "model")
      : MotionModel(detail::DescribeMotion(model, std::move(name))), model_(std::move(model)) {}
  const Model& model() const { return model_; }

 private:
  ALIDADE_FLATTEN Status DoStep(const double* const* blocks, const double* input, const double* w,
                                double dt_s, const Output& out) const override {
    return detail::Guarded(this, [&] {
      Status status = Status::kOk;
      if (out.next != nullptr) {
        // NaN reveals elements that a model with blocks of dynamic size does not write.
        if constexpr (!detail::Blocks<Model>::kStatic) {
          for (std::size_t k = 0; k < this->blocks().size(); ++k) {
            std::fill_n(out.next[k], this->blocks()[k].geometry.ambient,
                        std::numeric_limits<double>::quiet_NaN());
          }
        }
        status = alidade::Step(model_, blocks, input, w, dt_s, out.next,
                               MatrixRef{out.f, tangent_size()}, MatrixRef{out.g, noise_size()});
      }
      if (status == Status::kOk && out.sqrt_q != nullptr) {
        std::fill_n(out.sqrt_q, noise_size() * noise_size(), 0.0);
        detail::CallSqrtQ(model_, blocks, dt_s, MatrixRef{out.sqrt_q, noise_size()},
                          typename detail::Blocks<Model>::Indices{});
      }
      return status;
    });
  }

  Model model_;
};

/// Returns a sensor model that calls `model`. Messages refer to the model by `name`.
template <class Model>
SharedSensor MakeSensor(Model model, std::string name = "model") {
  return std::make_shared<DirectSensor<Model>>(std::move(model), std::move(name));
}
/// Returns a motion model that calls `model`. Messages refer to the model by `name`.
template <class Model>
SharedMotion MakeMotion(Model model, std::string name = "model") {
  return std::make_shared<DirectMotion<Model>>(std::move(model), std::move(name));
}

}  // namespace alidade
