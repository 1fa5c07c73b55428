// SPDX-License-Identifier: Apache-2.0
//
// How a landmark enters the state, and what is told of it.
#include <algorithm>
#include <cmath>

#include "ekf_landmarks.h"
#include "landmark_forms.h"

namespace alidade {

/// What the inverse observation of a sensor makes of one measurement.
struct Ekf::Landmarks::Sight {
  std::vector<double> y;  ///< of all landmark roles, one after the other
  std::vector<BlockId> from;
  std::vector<Eigen::MatrixXd> jacobians;  ///< dy/d from
  Eigen::MatrixXd own;                     ///< of z and the prior
};

/// y, its Jacobians and J_z R J_z' + J_p sigma^2 J_p'. kAccepted, or why not.
Outcome Ekf::Landmarks::Invert(Row& row, Sight& sight) {
  const SensorBinding& sensor = ekf_.BindingOf(row);
  const SensorModel& model = sensor.model;
  const Family& family = FamilyOf(row);
  const auto first = static_cast<std::size_t>(family.first);
  int rows = 0, size = 0;
  for (const Space& role : family.roles) {
    rows += role.geometry.tangent;
    size += role.geometry.ambient;
  }
  std::vector<const double*> roles(sensor.roles.size(), nullptr);
  std::vector<RowMajor> jacobians(first);
  std::vector<double*> jx(roles.size(), nullptr);
  for (std::size_t i = 0; i < first; ++i) {
    const RoleBinding& role = sensor.roles[i];
    if (role.block < 0) continue;
    roles[i] = ekf_.state_.value(role.block);
    const Block& block = ekf_.state_.layout()[role.block];
    if (role.mode == RoleMode::kHold || !block.has_covariance()) continue;
    jacobians[i] = RowMajor::Constant(rows, block.geometry().tangent, std::nan(""));
    jx[i] = jacobians[i].data();
    sight.from.push_back(role.block);
  }
  const int m = model.measurement().geometry.tangent;
  RowMajor jz = RowMajor::Constant(rows, m, std::nan(""));
  RowMajor jp = RowMajor::Constant(rows, model.prior_size(), std::nan(""));
  sight.y.resize(static_cast<std::size_t>(size));
  const Status status = model.Initialise(roles.data(), row.measurement->values.data(), &prior_,
                                         sight.y.data(), jx.data(), jz.data(), jp.data());
  if (status == Status::kError) ekf_.NotePluginFailure(sensor);
  if (status != Status::kOk) {
    return status == Status::kError ? Outcome::kFailed : Outcome::kInvalid;
  }
  double* y = sight.y.data();
  for (std::size_t i = 0; i < family.roles.size(); ++i) {
    family.roles[i].geometry.Normalise(y);
    roles[first + i] = y;
    y += family.roles[i].geometry.ambient;
  }
  const Outcome outcome = ekf_.NoiseOf(row, roles.data());
  if (outcome != Outcome::kAccepted) return outcome;
  const Eigen::Map<const RowMajor> r(row.r.data(), m, m);
  sight.own = jz * r * jz.transpose();
  if (jp.cols() > 0) {
    const double sigma = options_.prior->sigma;
    sight.own += sigma * sigma * jp * jp.transpose();
  }
  for (std::size_t i = 0; i < first; ++i) {
    if (jx[i] != nullptr) sight.jacobians.emplace_back(jacobians[i]);
  }
  const auto finite = [](const Eigen::MatrixXd& j) { return j.allFinite(); };
  const bool good =
      AllFinite(sight.y) && finite(sight.own) && std::ranges::all_of(sight.jacobians, finite);
  return good ? Outcome::kAccepted : Outcome::kNotFinite;
}

/// Gives the landmark its blocks, correlated with those that the sight took. Of a shared role the
/// first landmark of the frame makes the block, and the others of the same sensor take it.
Outcome Ekf::Landmarks::Initialise(std::int64_t id, Row& row, Landmark& landmark) {
  Family& family = families_[static_cast<std::size_t>(row.sensor)];
  Sight sight;
  const Outcome outcome = Invert(row, sight);
  if (outcome != Outcome::kAccepted) return outcome;
  std::vector<BlockId> fresh;
  std::vector<double> values;
  std::vector<int> kept;  // rows of y
  const double* y = sight.y.data();
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
  for (const Eigen::MatrixXd& j : sight.jacobians) jacobians.emplace_back(j(kept, Eigen::all));
  ekf_.state_.Initialise(fresh, values.data(), sight.from, jacobians, sight.own(kept, kept));
  landmark.form = family.form;
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
    one.form = landmark.form;
    one.first = landmark.first;
    one.last = landmark.last;
    one.tried = landmark.tried;
    one.accepted = landmark.accepted;
    if (HasInverseDistance(landmark)) {
      one.inverse_distance = InverseDistance(landmark);
      one.sigma = InverseDistanceSigma(landmark);
    }
    if (!landmark.form) continue;
    const auto point = internal::PointOf(*landmark.form, ValuesOf(landmark).data());
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
