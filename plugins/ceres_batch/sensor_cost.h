// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/cost_function.h>
#include <ceres/jet.h>

#include <algorithm>
#include <type_traits>
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
  __attribute__((flatten)) ALIDADE_SCALAR_LOOPS static Status Linearise(const Sensor& sensor,
                                                                        const double* const* roles,
                                                                        double* z,
                                                                        double* const* jacobians,
                                                                        const int* strides) {
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
// NOLINTNEXTLINE(readability-non-const-parameter): written to below
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

/// What costs of a kind share: the sensor, the places of its roles in the parameter blocks, and the
/// noise, by W = L^-1, R = L L'.
template <class Sensor>
struct CostKind {
  /// `blocks` are the ambient sizes of the parameter blocks. `whiten` = W is lower triangular,
  /// row-major, of the size of the tangent of z. No two roles may share a place; the sensor must
  /// outlive this.
  CostKind(const Sensor& model, const std::vector<RolePlace>& roles, const std::vector<int>& blocks,
           const std::vector<double>& whiten)
      : sensor(model), places(roles), sizes(blocks), w(whiten) {
    const std::vector<Geometry> geometries = detail::SensorTraits<Sensor>::Geometries(model);
    const auto m = static_cast<std::size_t>(detail::SensorTraits<Sensor>::Rows(model));
    ALIDADE_EXPECTS(roles.size() == geometries.size() && w.size() == m * m);
    std::vector<std::vector<bool>> taken, written;  // elements of each block
    for (const int size : blocks) taken.emplace_back(static_cast<std::size_t>(size), false);
    written = taken;
    for (std::size_t i = 0; i < roles.size(); ++i) {
      if (roles[i].block < 0) continue;
      const auto block = static_cast<std::size_t>(roles[i].block);
      ALIDADE_EXPECTS(block < blocks.size() && roles[i].offset >= 0 &&
                      roles[i].offset + geometries[i].ambient <= blocks[block]);
      for (int k = 0; k < geometries[i].ambient; ++k) {
        const std::size_t at =
            static_cast<std::size_t>(roles[i].offset) + static_cast<std::size_t>(k);
        ALIDADE_EXPECTS(!taken[block][at]);
        taken[block][at] = true;
        written[block][at] = k < geometries[i].tangent;
      }
    }
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      for (int c = 0; c < blocks[i]; ++c) {
        if (!written[i][static_cast<std::size_t>(c)]) gaps.push_back({static_cast<int>(i), c});
      }
    }
    for (std::size_t i = 0; i < w.size(); ++i)
      isotropic = isotropic && w[i] == (i % (m + 1) == 0 ? w[0] : 0.0);
  }

  int role_count() const { return kStatic ? Traits::RoleCount(sensor) : role_count_; }
  int rows() const { return kStatic ? Traits::Rows(sensor) : rows_; }
  GeometryKind geometry() const { return kStatic ? Traits::Kind(sensor) : geometry_; }

  const Sensor& sensor;
  std::vector<RolePlace> places;
  std::vector<int> sizes;       ///< of the blocks
  std::vector<RolePlace> gaps;  ///< columns that no role writes
  std::vector<double> w;
  bool isotropic = true;  ///< W is a multiple of the identity

 private:
  using Traits = detail::SensorTraits<Sensor>;
  /// Of a model that the compiler sees through they are constants.
  static constexpr bool kStatic = !std::is_same_v<Sensor, SensorModel>;
  int role_count_ = Traits::RoleCount(sensor), rows_ = Traits::Rows(sensor);
  GeometryKind geometry_ = Traits::Kind(sensor);
};

/// The factor of a measurement, made of the sensor's own h:
///
///   r = W (z (-) h(roles)),   W = L^-1,   R = L L'
///
/// Jacobians are in the tangent of each role, [J | 0] in its ambient columns: see GeometryManifold.
/// `Sensor` is a SensorModel or a model itself. Evaluate is false where h is not defined, and
/// allocates nothing. In a large problem each cost is far memory: it is as small as may be.
template <class Sensor>
class SensorCost final : public ceres::CostFunction {
  using Traits = detail::SensorTraits<Sensor>;

 public:
  /// `z`, ambient, and the kind must outlive the cost.
  SensorCost(const CostKind<Sensor>& kind, const double* z) : kind_(kind), z_(z) {
    set_num_residuals(Traits::Rows(kind.sensor));
    for (const int size : kind.sizes) mutable_parameter_block_sizes()->push_back(size);
  }

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    __builtin_prefetch(z_);  // it is far away, and not needed until h is there
    const double* roles[Traits::kMaxRoles];
    double* j[Traits::kMaxRoles];
    int strides[Traits::kMaxRoles];
    Bind(blocks, jacobians, roles, j, strides);
    double** const wanted = jacobians == nullptr ? nullptr : j;
    const GeometryKind geometry = kind_.geometry();
    if (geometry == GeometryKind::kUnitQuaternion)
      return Curved<UnitQuaternion>(roles, wanted, strides, residuals, jacobians);
    if (geometry == GeometryKind::kUnitVector)
      return Curved<UnitVector>(roles, wanted, strides, residuals, jacobians);
    if (Traits::Linearise(kind_.sensor, roles, residuals, wanted, strides) != Status::kOk)
      return false;
    const int m = kind_.rows();
    for (int i = 0; i < m; ++i) residuals[i] = z_[i] - residuals[i];
    if (geometry == GeometryKind::kAngle) residuals[0] = Angle::Wrap(residuals[0]);
    Whiten(residuals, 1, 1.0);
    WhitenAll(jacobians, -1.0);
    return true;
  }

 private:
  /// Where the roles are, and where the Jacobian by each goes.
  void Bind(const double* const* blocks, double** jacobians, const double** roles, double** j,
            int* strides) const {
    const RolePlace* const places = kind_.places.data();
    const int* const sizes = kind_.sizes.data();
    for (int i = 0; i < kind_.role_count(); ++i) {
      const auto [block, offset] = places[i];
      roles[i] = block < 0 ? nullptr : blocks[block] + offset;
      if (jacobians == nullptr) continue;
      const bool wanted = block >= 0 && jacobians[block] != nullptr;
      j[i] = wanted ? jacobians[block] + offset : nullptr;
      strides[i] = wanted ? sizes[block] : 0;
    }
    if (jacobians == nullptr) return;
    for (const auto [block, column] : kind_.gaps) {
      for (int r = 0; jacobians[block] != nullptr && r < kind_.rows(); ++r)
        jacobians[block][r * sizes[block] + column] = 0.0;
    }
  }

  /// Where z is on a manifold G, of 2 or 3 dimensions.
  template <class G>
  bool Curved(const double* const* roles, double* const* j, const int* strides, double* residuals,
              double** jacobians) const {
    constexpr int m = G::kTangent;
    double h[G::kAmbient], slope[m * m];
    if (Traits::Linearise(kind_.sensor, roles, h, j, strides) != Status::kOk) return false;
    detail::Difference<G>(z_, h, residuals, j == nullptr ? nullptr : slope);
    Whiten(residuals, 1, 1.0);
    for (std::size_t i = 0; jacobians != nullptr && i < kind_.sizes.size(); ++i) {
      for (int c = 0; jacobians[i] != nullptr && c < kind_.sizes[i]; ++c) {
        double before[m];
        for (int r = 0; r < m; ++r) before[r] = jacobians[i][r * kind_.sizes[i] + c];
        for (int r = 0; r < m; ++r) {
          double sum = 0.0;
          for (int k = 0; k < m; ++k) sum += slope[r * m + k] * before[k];
          jacobians[i][r * kind_.sizes[i] + c] = sum;
        }
      }
    }
    WhitenAll(jacobians, 1.0);
    return true;
  }

  void WhitenAll(double** jacobians, double sign) const {
    if (jacobians == nullptr) return;
    const int* const sizes = kind_.sizes.data();
    for (std::size_t i = 0; i < kind_.sizes.size(); ++i) {
      if (jacobians[i] != nullptr) Whiten(jacobians[i], sizes[i], sign);
    }
  }
  /// a <- sign W a, in place: from the last row up, as W is lower triangular.
  /// Not inlined: the loops of a function that is are the other one's.
  __attribute__((noinline)) ALIDADE_SCALAR_LOOPS void Whiten(double* a, int columns,
                                                             double sign) const {
    const int m = kind_.rows();
    if (kind_.isotropic) {
      const double factor = sign * kind_.w[0];
      for (int i = 0; i < m * columns; ++i) a[i] *= factor;
      return;
    }
    for (int r = m - 1; r >= 0; --r) {
      double* const row = a + r * columns;
      const double* const w = kind_.w.data() + r * m;
      for (int c = 0; c < columns; ++c) {
        double sum = w[r] * row[c];
        for (int k = 0; k < r; ++k) sum += w[k] * a[k * columns + c];
        row[c] = sign * sum;
      }
    }
  }

  const CostKind<Sensor>& kind_;
  const double* z_;
};

}  // namespace alidade::ceres_batch
