// SPDX-License-Identifier: Apache-2.0
//
// How a landmark is initialised, and what is told of it.
#include <algorithm>
#include <cmath>

#include "alidade/filter/ekf_landmarks.h"
#include "alidade/system/landmark_forms.h"

namespace alidade {

/// Gives the landmark its blocks, correlated with those that the observation took. Of a shared role
/// the first landmark of the frame makes the block, and the others of the same sensor take it.
Outcome Ekf::Landmarks::Initialise(std::int64_t id, Row& row, Landmark& landmark) {
  Family& family = families_[static_cast<std::size_t>(row.sensor)];
  Inverse inverse;
  const Outcome outcome = ekf_.Invert(row, options_.prior ? &prior_ : nullptr, inverse);
  if (outcome != Outcome::kAccepted) return outcome;
  std::vector<BlockId> fresh;
  std::vector<double> values;
  std::vector<int> kept;  // rows of y
  const double* y = inverse.y.data();
  int at = 0;
  for (std::size_t i = 0; i < family.roles.size(); ++i) {
    const Space& role = family.roles[i];
    const auto shared = family.shared.find(i);
    if (shared != family.shared.end()) {
      landmark.blocks.push_back(shared->second);
    } else {
      fresh.push_back(Declare(id, role, BlockStatus::kEstimated));
      landmark.blocks.push_back(fresh.back());
      values.insert(values.end(), y, y + role.geometry.ambient);
      for (int k = 0; k < role.geometry.tangent; ++k) kept.push_back(at + k);
      if (role.shared()) family.shared[i] = fresh.back();
    }
    if (role.shared()) ++map_.users[landmark.blocks.back()];
    y += role.geometry.ambient;
    at += role.geometry.tangent;
  }
  std::vector<Eigen::MatrixXd> jacobians;
  for (const Eigen::MatrixXd& j : inverse.jacobians) jacobians.emplace_back(j(kept, Eigen::all));
  ekf_.state_.Initialise(fresh, values.data(), inverse.from, jacobians, inverse.own(kept, kept));
  landmark.representation = family.representation;
  moved_ = true;
  return Outcome::kInitialised;
}

std::vector<LandmarkEstimate> Ekf::Landmarks::Estimates() const {
  std::vector<LandmarkEstimate> estimates;
  for (const auto& [id, landmark] : map_.landmarks) {
    if (!landmark.in_state()) continue;
    LandmarkEstimate& one = estimates.emplace_back();
    one.id = id;
    one.generation = landmark.generation;
    one.representation = landmark.representation;
    one.first = landmark.first;
    one.last = landmark.last;
    one.tried = landmark.tried;
    one.accepted = landmark.accepted;
    if (HasInverseDistance(landmark)) {
      one.inverse_distance = InverseDistance(landmark);
      one.sigma = InverseDistanceSigma(landmark);
    }
    if (!landmark.representation) continue;
    const auto point = internal::PointOf(*landmark.representation, ValuesOf(landmark).data());
    if (!point) continue;
    one.position = point->position;
    one.covariance = CovarianceOf(landmark, point->jacobian);
  }
  return estimates;
}

/// J P J' of the blocks of a landmark.
Eigen::Matrix3d Ekf::Landmarks::CovarianceOf(
    const Landmark& landmark, const Eigen::Matrix<double, 3, Eigen::Dynamic>& jacobian) const {
  std::vector<JacobianBlock> parts;
  Eigen::Index column = 0;
  for (const BlockId id : landmark.blocks) {
    const Block& block = ekf_.state_.layout()[id];
    const int size = block.geometry().tangent;
    if (block.has_covariance()) {
      parts.push_back({block.tangent_offset, jacobian.middleCols(column, size)});
    }
    column += size;
  }
  return Times(parts, 3, ekf_.state_.covariance().TimesTransposed(parts, 3));
}

}  // namespace alidade
