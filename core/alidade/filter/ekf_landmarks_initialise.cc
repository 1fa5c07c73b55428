// SPDX-License-Identifier: Apache-2.0
//
// How landmarks are initialised in the state.
#include <algorithm>

#include "alidade/filter/ekf_landmarks.h"
#include "alidade/system/landmark_representation.h"

namespace alidade {

/// Initialises landmarks of this frame that wait, as long as too few are measured.
void Ekf::Landmarks::InitialiseNew() {
  const std::vector<const Row*> used = MeasuredOnce();
  auto measured = std::ssize(used);
  for (Family& family : families_) family.shared.clear();
  if (options_.prior) prior_ = *options_.prior;
  bool asked_map = prior_.adapt_after == 0;
  for (Row& row : ekf_.rows()) {
    if (measured >= options_.max_per_frame) return;
    Outcome& outcome = ekf_.EntryOf(row).outcome;
    const SensorModel& model = ekf_.BindingOf(row).model;
    if (!Has(row.sensor) || outcome != Outcome::kNotReady ||
        !ekf_.plans_[static_cast<std::size_t>(row.sensor)].ready ||
        model.initialised_role() != FamilyOf(row).first) {
      continue;
    }
    const auto found = map_.landmarks.find(row.measurement->landmark);
    if (found == map_.landmarks.end() || found->second.in_state() ||
        found->second.observations < options_.min_observations) {
      continue;
    }
    if (!asked_map) prior_.inverse_distance = PriorInverseDistance(used);
    asked_map = true;
    outcome = Initialise(found->first, row, found->second);
    if (outcome != Outcome::kInitialised) continue;
    ++counts().initialised;
    ++measured;
  }
}

/// A row that was used of each landmark in the state, by id.
std::vector<const Ekf::Row*> Ekf::Landmarks::MeasuredOnce() const {
  std::vector<const Row*> used;
  for (const Row& row : ekf_.rows()) {
    if (row.plan == nullptr || !Used(ekf_.EntryOf(row))) continue;
    const auto found = map_.landmarks.find(row.measurement->landmark);
    if (found != map_.landmarks.end() && found->second.in_state()) used.push_back(&row);
  }
  const auto id = [](const Row* row) { return row->measurement->landmark; };
  std::ranges::stable_sort(used, {}, id);
  const auto same = [&](const Row* a, const Row* b) { return id(a) == id(b); };
  used.erase(std::unique(used.begin(), used.end(), same), used.end());
  return used;
}

/// The median of the converged inverse distances among landmarks that were measured, where there
/// are enough; else the prior's.
double Ekf::Landmarks::PriorInverseDistance(std::span<const Row* const> measured) const {
  std::vector<double> converged;
  for (const Row* const row : measured) {
    const double* const camera = CameraOf(FamilyOf(*row));
    const Landmark& landmark = map_.landmarks.at(row->measurement->landmark);
    constexpr double kConverged = 0.1;  // of the index of linearity, where nothing is converted
    const double limit =
        options_.max_linearity_index > 0.0 ? options_.max_linearity_index : kConverged;
    if (camera == nullptr || !landmark.representation) continue;
    const std::vector<const double*> values = ValuesOf(landmark);
    if (HasInverseDistance(landmark) &&
        !(internal::LinearityOf(*landmark.representation, values.data(),
                                InverseDistanceSigma(landmark), camera) < limit)) {
      continue;
    }
    const auto point = internal::PointOf(*landmark.representation, values.data());
    const Eigen::Map<const Eigen::Vector3d> r(camera);
    if (point) converged.push_back(1.0 / (point->position - r).norm());
  }
  if (converged.empty() || std::ssize(converged) < options_.prior->adapt_after) {
    return options_.prior->inverse_distance;
  }
  const auto middle = converged.begin() + std::ssize(converged) / 2;
  std::ranges::nth_element(converged, middle);
  return *middle;
}

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

}  // namespace alidade
