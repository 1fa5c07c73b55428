// SPDX-License-Identifier: Apache-2.0
#include "path_alignment.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "similarity.h"

namespace alidade::internal {

std::optional<Aligned> PathAlignment::Result() const {
  const auto n = static_cast<double>(count_);
  const Eigen::Vector3d mean = sum_ / n, onto_mean = onto_sum_ / n;
  const double variance = squares_ / n - mean.squaredNorm();
  const double onto_variance = onto_squares_ / n - onto_mean.squaredNorm();
  if (count_ < 3 || !(variance > 0.0)) return std::nullopt;
  const Eigen::Matrix3d c = products_ / n - onto_mean * mean.transpose();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(c, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::VectorXd d = svd.singularValues();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) d[2] = -d[2];
  const double trace = d.sum();
  if (!DeterminesScale(trace / variance, variance, onto_variance)) return std::nullopt;
  const double square = onto_variance - trace * trace / variance;
  return Aligned{std::sqrt(std::max(0.0, square)), trace / variance};
}

}  // namespace alidade::internal
