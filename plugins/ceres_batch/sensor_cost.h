// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/cost_function.h>
#include <ceres/jet.h>

#include <algorithm>
#include <vector>

#include "alidade/autodiff.h"
#include "alidade/error.h"
#include "alidade/models.h"

namespace alidade::ceres_batch {

/// Where the value of a role stands: `offset` numbers into parameter block `block` of the cost.
struct RolePlace {
  int block = -1;  ///< -1: an optional role that is not bound
  int offset = 0;
};

namespace detail {

/// What is asked of a sensor: a model of alidade/model.h, which the compiler sees through.
template <class Sensor>
struct SensorTraits {
  using Z = typename Sensor::Measurement;
  using Roles = alidade::detail::Blocks<Sensor>;
  static constexpr int kMaxRoles = Roles::kCount;
  static constexpr int RoleCount(const Sensor&) { return kMaxRoles; }
  static constexpr int Rows(const Sensor&) { return Z::kTangent; }
  static constexpr GeometryKind Kind(const Sensor&) { return GeometryKind{Z::kGeometry}; }
  static std::vector<Geometry> Geometries(const Sensor&) {
    std::vector<Geometry> all;
    const auto add = [&](auto index) {
      using G = alidade::detail::SpaceAt<decltype(index)::value, Sensor>;
      all.push_back({GeometryKind{G::kGeometry}, G::kAmbient, G::kTangent});
    };
    alidade::detail::ForEach(add, typename Roles::Indices{});
    return all;
  }
  static Status Linearise(const Sensor& sensor, const double* const* roles, double* z,
                          double* const* jacobians, const int* strides) {
    return Evaluate(sensor, roles, z, jacobians, strides);
  }
};

/// And of one behind the boundary of plugins.
template <>
struct SensorTraits<SensorModel> {
  static constexpr int kMaxRoles = 64;  // as many as a model may have
  static int RoleCount(const SensorModel& sensor) {
    return static_cast<int>(sensor.roles().size());
  }
  static int Rows(const SensorModel& sensor) { return sensor.measurement().geometry.tangent; }
  static GeometryKind Kind(const SensorModel& sensor) { return sensor.measurement().geometry.kind; }
  static std::vector<Geometry> Geometries(const SensorModel& sensor) {
    std::vector<Geometry> all;
    for (const Space& role : sensor.roles()) all.push_back(role.geometry);
    return all;
  }
  static Status Linearise(const SensorModel& sensor, const double* const* roles, double* z,
                          double* const* jacobians, const int* strides) {
    return sensor.Linearise(roles, z, jacobians, strides);
  }
};

/// d = z (-) h and, where j is not null, dd/dh (row-major) in the tangent at h.
template <class G>
void Difference(const double* z, const double* h, double* d, double* j) {
  using Jet = ceres::Jet<double, G::kTangent>;
  Jet seed[G::kTangent], moved[G::kAmbient], difference[G::kTangent];
  for (int i = 0; i < G::kTangent; ++i) seed[i] = Jet(0.0, i);
  G::Plus(h, seed, moved);
  G::Minus(z, moved, difference);
  for (int i = 0; i < G::kTangent; ++i) {
    d[i] = difference[i].a;
    for (int k = 0; j != nullptr && k < G::kTangent; ++k)
      j[i * G::kTangent + k] = difference[i].v[k];
  }
}

}  // namespace detail

/// A sensor with the places of its roles in the parameter blocks of its costs: one for all costs of
/// a kind.
template <class Sensor>
struct CostKind {
  /// `blocks` are the ambient sizes of the parameter blocks. No two roles may share a place; the
  /// sensor must outlive this.
  CostKind(const Sensor& model, const std::vector<RolePlace>& roles, const std::vector<int>& blocks)
      : sensor(model), places(roles), sizes(blocks) {
    const std::vector<Geometry> geometries = detail::SensorTraits<Sensor>::Geometries(model);
    ALIDADE_EXPECTS(roles.size() == geometries.size());
    std::vector<int> written(blocks.size());
    for (std::size_t i = 0; i < roles.size(); ++i) {
      tangents.push_back(geometries[i].tangent);
      if (roles[i].block < 0) continue;
      const auto block = static_cast<std::size_t>(roles[i].block);
      ALIDADE_EXPECTS(block < blocks.size() && roles[i].offset >= 0 &&
                      roles[i].offset + geometries[i].ambient <= blocks[block]);
      written[block] += geometries[i].tangent;
    }
    for (std::size_t i = 0; i < blocks.size(); ++i) gaps.push_back(written[i] < blocks[i]);
  }

  const Sensor& sensor;
  std::vector<RolePlace> places;
  std::vector<int> tangents;  ///< of the roles
  std::vector<int> sizes;     ///< of the blocks
  std::vector<bool> gaps;     ///< columns of a block that no role writes
};

/// The factor of a measurement, made of the sensor's own h:
///
///   r = W (z (-) h(roles)),   W = L^-1,   R = L L'
///
/// Jacobians are in the tangent of each role, [J | 0] in its ambient columns: see GeometryManifold.
/// `Sensor` is a SensorModel or a model itself. Evaluate is false where h is not defined, and
/// allocates nothing.
template <class Sensor>
class SensorCost final : public ceres::CostFunction {
  using Traits = detail::SensorTraits<Sensor>;

 public:
  /// `z` is ambient; W is lower triangular, row-major, of the size of the tangent of z. All must
  /// outlive the cost; costs may share all but z.
  SensorCost(const CostKind<Sensor>& kind, const double* z, const double* w)
      : kind_(kind), z_(z), w_(w) {
    const int m = Traits::Rows(kind.sensor);
    set_num_residuals(m);
    for (const int size : kind.sizes) mutable_parameter_block_sizes()->push_back(size);
    for (int i = 0; i < m; ++i) {
      for (int k = 0; k < i; ++k) diagonal_ = diagonal_ && w[i * m + k] == 0.0;
    }
  }

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const int count = Traits::RoleCount(kind_.sensor);
    const double* roles[Traits::kMaxRoles];
    double* j[Traits::kMaxRoles];
    int strides[Traits::kMaxRoles];
    if (jacobians != nullptr) ClearGaps(jacobians);
    for (int i = 0; i < count; ++i) {
      const auto [block, offset] = kind_.places[static_cast<std::size_t>(i)];
      roles[i] = block < 0 ? nullptr : blocks[block] + offset;
      const bool wanted = jacobians != nullptr && block >= 0 && jacobians[block] != nullptr;
      j[i] = wanted ? jacobians[block] + offset : nullptr;
      strides[i] = wanted ? kind_.sizes[static_cast<std::size_t>(block)] : 0;
    }
    double** const wanted = jacobians == nullptr ? nullptr : j;
    const GeometryKind geometry = Traits::Kind(kind_.sensor);
    if (geometry == GeometryKind::kUnitQuaternion)
      return Curved<UnitQuaternion>(roles, residuals, wanted, strides);
    if (geometry == GeometryKind::kUnitVector)
      return Curved<UnitVector>(roles, residuals, wanted, strides);
    if (Traits::Linearise(kind_.sensor, roles, residuals, wanted, strides) != Status::kOk)
      return false;
    const int m = Traits::Rows(kind_.sensor);
    for (int i = 0; i < m; ++i) residuals[i] = z_[i] - residuals[i];
    if (geometry == GeometryKind::kAngle) residuals[0] = Angle::Wrap(residuals[0]);
    Whiten(residuals, 1, 1, 1.0);
    if (wanted != nullptr) WhitenAll(j, strides, -1.0);
    return true;
  }

 private:
  /// Where z is on a manifold G of 2 or 3 dimensions.
  template <class G>
  bool Curved(const double* const* roles, double* residuals, double* const* j,
              const int* strides) const {
    double h[G::kAmbient], slope[G::kTangent * G::kTangent];
    if (Traits::Linearise(kind_.sensor, roles, h, j, strides) != Status::kOk) return false;
    detail::Difference<G>(z_, h, residuals, j == nullptr ? nullptr : slope);
    Whiten(residuals, 1, 1, 1.0);
    if (j == nullptr) return true;
    for (int i = 0; i < Traits::RoleCount(kind_.sensor); ++i) {
      for (int c = 0; j[i] != nullptr && c < kind_.tangents[static_cast<std::size_t>(i)]; ++c) {
        double before[G::kTangent];
        for (int r = 0; r < G::kTangent; ++r) before[r] = j[i][r * strides[i] + c];
        for (int r = 0; r < G::kTangent; ++r) {
          double sum = 0.0;
          for (int k = 0; k < G::kTangent; ++k) sum += slope[r * G::kTangent + k] * before[k];
          j[i][r * strides[i] + c] = sum;
        }
      }
    }
    WhitenAll(j, strides, 1.0);
    return true;
  }

  void WhitenAll(double* const* j, const int* strides, double sign) const {
    for (int i = 0; i < Traits::RoleCount(kind_.sensor); ++i) {
      if (j[i] != nullptr)
        Whiten(j[i], kind_.tangents[static_cast<std::size_t>(i)], strides[i], sign);
    }
  }
  /// a <- sign W a, in place: from the last row up, as W is lower triangular.
  void Whiten(double* a, int columns, int stride, double sign) const {
    const int m = Traits::Rows(kind_.sensor);
    for (int r = m - 1; r >= 0; --r) {
      double* const row = a + r * stride;
      const double* const w = w_ + r * m;
      for (int c = 0; c < columns; ++c) row[c] *= sign * w[r];
      for (int k = 0; !diagonal_ && k < r; ++k) {
        for (int c = 0; c < columns; ++c) row[c] += sign * w[k] * a[k * stride + c];
      }
    }
  }
  /// Zeros where no role writes.
  void ClearGaps(double** jacobians) const {
    const int m = Traits::Rows(kind_.sensor);
    for (std::size_t i = 0; i < kind_.sizes.size(); ++i) {
      if (kind_.gaps[i] && jacobians[i] != nullptr)
        std::fill_n(jacobians[i], m * kind_.sizes[i], 0.0);
    }
  }

  const CostKind<Sensor>& kind_;
  const double* z_;
  const double* w_;
  bool diagonal_ = true;
};

}  // namespace alidade::ceres_batch
