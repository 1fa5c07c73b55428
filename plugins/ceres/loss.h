// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/loss_function.h>

#include <cmath>

#include "alidade/estimation/robust_loss.h"

namespace alidade::ceres_batch {

/// A RobustLoss as Ceres takes it, on s = d^2, with half of it in the cost:
///
///   rho_c(s) = 2 rho(d),   rho_c'(s) = w(d),   rho_c''(s) = w'(d) / 2 d
class Loss : public ceres::LossFunction {
 public:
  explicit Loss(const RobustLoss& loss) : loss_(loss) {}
  void Evaluate(double s, double rho[3]) const override {
    const double d = std::sqrt(s), w = Weight(loss_, d);
    rho[0] = 2.0 * Rho(loss_, d);
    rho[1] = w;
    rho[2] = 0.0;
    if (loss_.kind == LossKind::kHuber && w < 1.0) rho[2] = -0.5 * w / s;
    if (loss_.kind == LossKind::kCauchy) rho[2] = -w * w / (loss_.scale * loss_.scale);
  }

 private:
  RobustLoss loss_;
};

}  // namespace alidade::ceres_batch
