// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/invariant_sensor.h"

#include <Eigen/Core>
#include <array>
#include <utility>

namespace alidade::internal {
namespace {

/// Sensor model with one role for the group element. Its other roles are those of the original
/// model that have a block.
class InvariantSensor final : public SensorModel {
 public:
  InvariantSensor(SharedSensor sensor, GroupBlock group, std::vector<RoleSource> sources,
                  std::vector<Space> roles, int element_role)
      : SensorModel(Describe(*sensor, sources, std::move(roles))),
        sensor_(std::move(sensor)),
        group_(std::move(group)),
        sources_(std::move(sources)),
        element_role_(static_cast<std::size_t>(element_role)) {}

 private:
  static Description Describe(const SensorModel& sensor, const std::vector<RoleSource>& sources,
                              std::vector<Space> roles) {
    Description description = sensor.description();
    description.owned.clear();
    description.roles = std::move(roles);
    if (description.inverse.role >= 0) {
      const RoleSource& source = sources[static_cast<std::size_t>(description.inverse.role)];
      description.inverse.role = source.role;
      if (source.member >= 0) description.inverse = {};
    }
    return description;
  }

  std::array<const double*, kMaxRoles> RolesOf(const double* const* roles) const {
    std::array<const double*, kMaxRoles> pointers{};
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const auto [role, member] = sources_[i];
      if (role < 0 || roles[role] == nullptr) continue;
      pointers[i] = roles[role] + (member < 0 ? 0 : group_.ValueOffset(member));
    }
    return pointers;
  }

  /// Jacobians of the original model. Those of blocks of the group are columns of the Jacobian of
  /// the group element.
  struct Jacobians {
    std::array<double*, kMaxRoles> pointers{};
    std::array<int, kMaxRoles> strides{};
  };
  using ElementMap =
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>, 0,
                 Eigen::OuterStride<>>;

  /// Returns the Jacobian of the group element, with `rows` rows.
  ElementMap OfElement(int rows, double* const* jacobians, const int* strides) const {
    const int n = group_.geometry().tangent;
    return {jacobians[element_role_], rows, n,
            Eigen::OuterStride<>(strides == nullptr ? n : strides[element_role_])};
  }
  Jacobians Destinations(int rows, double* const* jacobians, const int* strides) const {
    Jacobians destinations;
    if (jacobians[element_role_] != nullptr) OfElement(rows, jacobians, strides).setZero();
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const auto [role, member] = sources_[i];
      if (role < 0 || jacobians[role] == nullptr) continue;
      const int columns = roles()[static_cast<std::size_t>(role)].geometry.tangent;
      destinations.pointers[i] = jacobians[role] + (member < 0 ? 0 : group_.Row(member));
      destinations.strides[i] = strides == nullptr ? columns : strides[role];
    }
    return destinations;
  }
  /// Multiplies the Jacobian of the blocks of the group by M.
  void Chain(int rows, const double* const* roles, double* const* jacobians,
             const int* strides) const {
    if (jacobians[element_role_] == nullptr) return;
    const GroupMatrix map = group_.MapsAt(roles[element_role_]).blocks_from_group.transpose();
    ElementMap j = OfElement(rows, jacobians, strides);
    for (int i = 0; i < rows; ++i) {
      const GroupVector row = map * j.row(i).transpose();
      j.row(i) = row.transpose();
    }
  }

  Status DoEvaluate(const Observation& observation, const double* const* roles,
                    const Output& out) const override {
    const auto sensor_roles = RolesOf(roles);
    const int m = measurement().geometry.tangent;
    Output sensor_out = out;
    Jacobians inner;
    if (out.jacobians != nullptr) {
      inner = Destinations(m, out.jacobians, out.strides);
      sensor_out.jacobians = inner.pointers.data();
      sensor_out.strides = inner.strides.data();
    }
    const Status status = sensor_->Evaluate(observation, sensor_roles.data(), sensor_out);
    if (status == Status::kError) return RecordModelError(this, sensor_->error_text());
    if (status == Status::kOk && out.jacobians != nullptr) {
      Chain(m, roles, out.jacobians, out.strides);
    }
    return status;
  }
  Status DoValid(const Observation& observation) const override {
    const Status status = sensor_->Valid(observation);
    return status == Status::kError ? RecordModelError(this, sensor_->error_text()) : status;
  }
  Status DoInitialise(const double* const* roles, const Observation& observation,
                      const double* prior, const InverseOutput& out) const override {
    const auto sensor_roles = RolesOf(roles);
    const int rows =
        sensor_->roles()[static_cast<std::size_t>(sensor_->inverse().role)].geometry.tangent;
    InverseOutput sensor_out = out;
    Jacobians inner;
    if (out.jx != nullptr) {
      inner = Destinations(rows, out.jx, out.strides);
      sensor_out.jx = inner.pointers.data();
      sensor_out.strides = inner.strides.data();
    }
    const Status status = sensor_->Initialise(sensor_roles.data(), observation, prior, sensor_out);
    if (status == Status::kError) return RecordModelError(this, sensor_->error_text());
    if (status == Status::kOk && out.jx != nullptr) Chain(rows, roles, out.jx, out.strides);
    return status;
  }

  SharedSensor sensor_;
  GroupBlock group_;
  std::vector<RoleSource> sources_;
  std::size_t element_role_;
};

}  // namespace

SharedSensor MakeInvariantSensor(SharedSensor sensor, const GroupBlock& group,
                                 std::vector<RoleSource> sources, std::vector<Space> roles,
                                 int element_role) {
  return std::make_shared<InvariantSensor>(std::move(sensor), group, std::move(sources),
                                           std::move(roles), element_role);
}

}  // namespace alidade::internal
