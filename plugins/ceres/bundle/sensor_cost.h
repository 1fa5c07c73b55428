// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/cost_function.h>

#include <algorithm>

#include "cost_kind.h"
#include "plugins/ceres/difference.h"

namespace alidade::ceres_batch {

/// Residual of a measurement, computed with the sensor's h:
///
///   r = -W (z (-) h(roles)),   W = L^-1,   R = L L'
///
/// The sign does not affect the cost. With this sign the Jacobian is W H, and equals H if W = I.
/// The Jacobian with respect to a role is in the tangent of the role, and is padded to the ambient
/// columns: [J | 0], see GeometryManifold. `Sensor` is SensorModel or the type of a model. Evaluate
/// returns false if h is not defined, and does not allocate. The object is small, because the costs
/// of a large problem do not fit into the cache.
template <class Sensor>
class SensorCost final : public ceres::CostFunction {
  using Traits = detail::SensorTraits<Sensor>;

 public:
  /// `z` has ambient size. `kind` must outlive the cost. If `z` has more than three numbers, the
  /// array must outlive the cost too.
  SensorCost(const CostKind<Sensor>& kind, const double* z) : kind_(kind) {
    if (kind.measured().ambient <= kInlineSize) {
      std::copy_n(z, kind.measured().ambient, z_.inline_values);
    } else {
      z_.pointer = z;
    }
    set_num_residuals(kind.measured().tangent);
    *mutable_parameter_block_sizes() = kind.sizes;
  }

  ALIDADE_SCALAR_LOOPS bool Evaluate(const double* const* blocks, double* residuals,
                                     double** jacobians) const override {
    const double* const z = kind_.measured().ambient <= kInlineSize ? z_.inline_values : z_.pointer;
    __builtin_prefetch(z);  // z is read only after h has been computed
    const double* roles[Traits::kMaxRoles];
    double* j[Traits::kMaxRoles];
    Bind(blocks, jacobians, roles, j);
    double** const requested = jacobians == nullptr ? nullptr : j;
    if (kind_.measured().geometry != ALIDADE_VECTOR || !kind_.isotropic)
      return EvaluateGeneral(z, roles, requested, residuals, jacobians);
    if (Traits::Linearise(kind_.sensor, roles, residuals, requested, kind_.strides) != Status::kOk)
      return false;
    const int m = kind_.measured().tangent;
    const double scale = kind_.scale;
    for (int i = 0; i < m; ++i) residuals[i] = scale * (residuals[i] - z[i]);
    if (jacobians != nullptr && scale != 1.0) WhitenAll(jacobians, 1.0);
    return true;
  }

 private:
  /// Sets the pointers to the roles and to the Jacobians with respect to the roles. Sets those
  /// elements of the Jacobians to 0 that the model does not write.
  void Bind(const double* const* blocks, double** jacobians, const double** roles,
            double** j) const {
    for (int i = 0; i < kind_.role_count(); ++i) {
      const auto [block, offset] = kind_.places[i];
      roles[i] = block < 0 ? nullptr : blocks[block] + offset;
      const bool requested = jacobians != nullptr && block >= 0 && jacobians[block] != nullptr;
      j[i] = requested ? jacobians[block] + offset : nullptr;
    }
    if (jacobians == nullptr) return;
    for (const auto [block, index] : kind_.unwritten) {
      if (jacobians[block] != nullptr) jacobians[block][index] = 0.0;
    }
  }

  /// Evaluates the cost if z is not a vector, or if W is not a multiple of I. This function is not
  /// inlined, so that Evaluate() remains small.
  [[gnu::noinline]] bool EvaluateGeneral(const double* z, const double* const* roles,
                                         double* const* j, double* residuals,
                                         double** jacobians) const {
    bool is_evaluated = false;
    const bool is_curved = VisitGeometry(kind_.measured().geometry, [&]<class G>(G) {
      is_evaluated = EvaluateOnManifold<G>(z, roles, j, residuals, jacobians);
    });
    if (is_curved) return is_evaluated;
    if (Traits::Linearise(kind_.sensor, roles, residuals, j, kind_.strides) != Status::kOk)
      return false;
    for (int i = 0; i < kind_.measured().tangent; ++i) residuals[i] -= z[i];
    Whiten(residuals, 1, 1.0);
    WhitenAll(jacobians, 1.0);
    return true;
  }

  /// Evaluates the cost if z is on a manifold G.
  template <class G>
  bool EvaluateOnManifold(const double* z, const double* const* roles, double* const* j,
                          double* residuals, double** jacobians) const {
    constexpr int m = G::kTangent;
    double h[G::kAmbient], slope[m * m];
    if (Traits::Linearise(kind_.sensor, roles, h, j, kind_.strides) != Status::kOk) return false;
    Difference<G>(z, h, residuals, j == nullptr ? nullptr : slope);
    Whiten(residuals, 1, -1.0);
    for (std::size_t i = 0; jacobians != nullptr && i < kind_.sizes.size(); ++i) {
      for (int c = 0; jacobians[i] != nullptr && c < kind_.sizes[i]; ++c) {
        double column[m];
        for (int r = 0; r < m; ++r) column[r] = jacobians[i][r * kind_.sizes[i] + c];
        for (int r = 0; r < m; ++r) {
          double sum = 0.0;
          for (int k = 0; k < m; ++k) sum += slope[r * m + k] * column[k];
          jacobians[i][r * kind_.sizes[i] + c] = sum;
        }
      }
    }
    WhitenAll(jacobians, -1.0);
    return true;
  }

  [[gnu::noinline]] void WhitenAll(double** jacobians, double sign) const {
    if (jacobians == nullptr) return;
    const int* const sizes = kind_.sizes.data();
    for (std::size_t i = 0; i < kind_.sizes.size(); ++i) {
      if (jacobians[i] != nullptr) Whiten(jacobians[i], sizes[i], sign);
    }
  }
  /// Computes a <- sign W a in place, from the last row to the first, because W is lower
  /// triangular.
  void Whiten(double* a, int columns, double sign) const {
    const int m = kind_.measured().tangent;
    if (kind_.isotropic) {
      const double factor = sign * kind_.scale;
      if (factor == 1.0) return;
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
  static constexpr int kInlineSize = 3;
  union {
    double inline_values[kInlineSize];  ///< z with at most kInlineSize numbers
    const double* pointer;              ///< pointer to a longer z
  } z_;
};

}  // namespace alidade::ceres_batch
