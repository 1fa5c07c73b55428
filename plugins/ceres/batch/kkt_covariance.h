// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "kkt_system.h"

namespace alidade::ceres_batch {

/// The covariances of states and landmarks of a KktSystem that Solve has left at damping 0: blocks
/// of its inverse, which are made once. It has to stay as it is while they are asked for.
class KktSystem::Covariances {
 public:
  explicit Covariances(KktSystem& system);

  /// By what share, about, rounding may change the variances of what sensors read: they lose what a
  /// variance has more than the information of all frames, which it cancels in, eps P_ii |H_ii|.
  double Inexactness() const;
  /// P of a frame.
  Eigen::MatrixXd OfFrame(std::size_t frame) const;
  /// `map`, the landmarks that a filter has at the end: place and covariance.
  void PutMap(std::vector<LandmarkEstimate>& map) const;

 private:
  Eigen::MatrixXd Found(int i, int j) const;
  Eigen::MatrixXd JointOf(const std::vector<int>& variables) const;
  Eigen::MatrixXd JointOf(std::size_t k) const;
  Eigen::MatrixXd OfLandmark(std::size_t landmark) const;

  const KktSystem& s_;
  std::vector<Eigen::MatrixXd> inverse_;
  std::unordered_map<std::uint64_t, std::size_t> found_;  ///< in inverse_, by KeyOf
};

}  // namespace alidade::ceres_batch
