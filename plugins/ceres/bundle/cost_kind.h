// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <type_traits>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/estimation/models.h"
#include "alidade/model/autodiff.h"

namespace alidade::ceres_batch {

/// Place of the value of a role in the parameter blocks: the value starts at element `offset` of
/// parameter block `block`.
struct RolePlace {
  int block = -1;  ///< -1 if the role is optional and not bound
  int offset = 0;
};

/// Element of the row-major Jacobian with respect to a parameter block.
struct JacobianElement {
  int block, index;
};

namespace detail {

/// Geometry of a measurement. A measurement never has a product of several geometries.
struct Measured {
  std::uint32_t geometry;  ///< number of the geometry in the C table
  int ambient, tangent;
};

/// Static properties of a sensor whose type is known to the compiler (alidade/model/model.h).
template <class Sensor>
struct SensorTraits {
  using Z = typename Sensor::Measurement;
  using Roles = alidade::detail::Blocks<Sensor>;
  static constexpr int kMaxRoles = Roles::kCount;
  static constexpr detail::Measured Measured(const Sensor&) {
    return {Z::kGeometry, Z::kAmbient, Z::kTangent};
  }
  static std::vector<Geometry> Geometries(const Sensor&) {
    std::vector<Geometry> geometries;
    const auto add = [&](auto index) {
      using G = alidade::detail::SpaceAt<decltype(index)::value, Sensor>;
      geometries.push_back(Geometry::Of<G>());
    };
    alidade::detail::ForEach(add, typename Roles::Indices{});
    return geometries;
  }
  ALIDADE_FLATTEN ALIDADE_SCALAR_LOOPS static Status Linearise(const Sensor& sensor,
                                                               const double* const* roles,
                                                               double* z, double* const* jacobians,
                                                               const int* strides) {
    return Evaluate(sensor, roles, z, jacobians, strides);
  }
};

/// Properties of a sensor behind the plugin ABI.
template <>
struct SensorTraits<SensorModel> {
  static constexpr int kMaxRoles = 64;  // maximum number of roles of a model
  static detail::Measured Measured(const SensorModel& sensor) {
    const Geometry& z = sensor.measurement().geometry;
    return {z.row().number, z.ambient, z.tangent};
  }
  static std::vector<Geometry> Geometries(const SensorModel& sensor) {
    std::vector<Geometry> geometries;
    for (const Space& role : sensor.roles()) geometries.push_back(role.geometry);
    return geometries;
  }
  static Status Linearise(const SensorModel& sensor, const double* const* roles, double* z,
                          double* const* jacobians, const int* strides) {
    return sensor.Linearise(roles, z, jacobians, strides);
  }
};

}  // namespace detail

/// Common data of all costs of a kind: the sensor, the places of its roles in the parameter blocks,
/// and the noise, given as W = L^-1 with R = L L'.
template <class Sensor>
struct CostKind {
  using Traits = detail::SensorTraits<Sensor>;

  /// `blocks` are the ambient sizes of the parameter blocks. `whiten` is W: lower triangular,
  /// row-major, with the tangent size of z. The places of two roles must not overlap. `model` must
  /// outlive this object.
  CostKind(const Sensor& model, const std::vector<RolePlace>& roles, const std::vector<int>& blocks,
           const std::vector<double>& whiten)
      : sensor(model), sizes(blocks), w(whiten) {
    const std::vector<Geometry> geometries = Traits::Geometries(model);
    const auto m = static_cast<std::size_t>(measured().tangent);
    ALIDADE_EXPECTS(roles.size() == geometries.size() && w.size() == m * m);
    std::vector<std::vector<bool>> bound, written;  // flag of each element of each block
    for (const int size : blocks) bound.emplace_back(static_cast<std::size_t>(size), false);
    written = bound;
    role_count_ = static_cast<int>(roles.size());
    for (std::size_t i = 0; i < roles.size(); ++i) {
      places[i] = roles[i];
      if (roles[i].block < 0) continue;
      const auto block = static_cast<std::size_t>(roles[i].block);
      ALIDADE_EXPECTS(block < blocks.size() && roles[i].offset >= 0 &&
                      roles[i].offset + geometries[i].ambient <= blocks[block]);
      strides[i] = blocks[block];
      for (int k = 0; k < geometries[i].ambient; ++k) {
        const std::size_t index =
            static_cast<std::size_t>(roles[i].offset) + static_cast<std::size_t>(k);
        ALIDADE_EXPECTS(!bound[block][index]);
        bound[block][index] = true;
        written[block][index] = k < geometries[i].tangent;
      }
    }
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      for (int k = 0; k < static_cast<int>(m) * blocks[i]; ++k) {
        if (!written[i][static_cast<std::size_t>(k % blocks[i])])
          unwritten.push_back({static_cast<int>(i), k});
      }
    }
    scale = w[0];
    for (std::size_t i = 0; i < w.size(); ++i)
      isotropic = isotropic && w[i] == (i % (m + 1) == 0 ? scale : 0.0);
  }

  int role_count() const { return kStatic ? Traits::kMaxRoles : role_count_; }
  /// Returns the geometry of z.
  detail::Measured measured() const { return kStatic ? Traits::Measured(sensor) : measured_; }

  const Sensor& sensor;
  double scale = 1.0;
  bool isotropic = true;                   ///< true if W = scale I
  RolePlace places[Traits::kMaxRoles];     ///< place of each role
  int strides[Traits::kMaxRoles] = {};     ///< row lengths of the Jacobians of the roles
  std::vector<int> sizes;                  ///< ambient sizes of the blocks
  std::vector<double> w;                   ///< W, row-major
  std::vector<JacobianElement> unwritten;  ///< Jacobian elements that the model does not write

 private:
  /// True if the compiler knows the type of the sensor. role_count() and measured() are then
  /// constants.
  static constexpr bool kStatic = !std::is_same_v<Sensor, SensorModel>;
  int role_count_ = 0;
  detail::Measured measured_ = Traits::Measured(sensor);
};

}  // namespace alidade::ceres_batch
