// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/loss_function.h>

#include <cmath>

#include "alidade/estimation/robust_loss.h"

namespace alidade::ceres_batch {

/// RobustLoss as a loss function rho_c of Ceres, with s = d^2. Ceres adds rho_c / 2 to the cost:
///
///   rho_c(s) = 2 rho(d),   rho_c'(s) = w(d),   rho_c''(s) = w'(d) / (2 d)
class Loss : public ceres::LossFunction {
 public:
  explicit Loss(const RobustLoss& loss) : loss_(loss) {}
  void Evaluate(double s, double rho[3]) const override {
    const double d = std::sqrt(s);
    rho[0] = 2.0 * Rho(loss_, d);
    rho[1] = Weight(loss_, d);
    rho[2] = FunctionsOf(loss_.kind).curvature(d, loss_.scale);
  }

 private:
  RobustLoss loss_;
};

}  // namespace alidade::ceres_batch
