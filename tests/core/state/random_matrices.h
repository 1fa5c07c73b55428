// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/base/random.h"
#include "alidade/state/covariance.h"

namespace alidade {

inline Eigen::MatrixXd RandomMatrix(Eigen::Index rows, Eigen::Index columns, Random& random) {
  Eigen::MatrixXd m(rows, columns);
  for (double& element : m.reshaped()) element = random.Normal();
  return m;
}

/// Returns a full random covariance. `parts` contains the sizes of its blocks.
inline Covariance RandomCovariance(const std::vector<int>& parts, Random& random) {
  Covariance p;
  for (const int rows : parts) p.Add(rows);
  const Eigen::MatrixXd a = RandomMatrix(p.size(), p.size(), random);
  p.SetBlock(0, 0, a * a.transpose());
  return p;
}

}  // namespace alidade
