// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/ekf_small.h"

namespace alidade {

/// Works out how models and state fit together; again whenever blocks come, go or move.
void Ekf::Bind() {
  const StateLayout& layout = state_.layout();
  waiting_ = considering_ = false;
  order_.clear();
  bool in_order = true;
  // What comes after the blocks of the system are landmarks.
  for (const Block& block : std::span(layout.blocks()).first(system_.layout.blocks().size())) {
    waiting_ = waiting_ || !block.present;
    considering_ = considering_ || (block.present && block.status == BlockStatus::kConsider);
    if (!block.has_covariance()) continue;
    in_order = in_order && block.tangent_offset == std::ssize(order_);
    for (int i = 0; i < block.geometry().tangent; ++i) order_.push_back(block.tangent_offset + i);
  }
  if (in_order && std::ssize(order_) == state_.covariance().size()) order_.clear();
  KeepFirstEstimates();
  const bool small = state_.covariance().small();
  plans_.assign(system_.sensors.size(), {});
  for (std::size_t s = 0; s < plans_.size(); ++s) {
    const SensorBinding& sensor = system_.sensors[s];
    SensorPlan& plan = plans_[s];
    bool apart = true;  // no two roles have the same block
    for (const RoleBinding& role : sensor.roles) {
      const bool present = role.block >= 0 && layout[role.block].present;
      plan.roles.push_back(present ? state_.value(role.block) : nullptr);
      plan.linearised_at.push_back(plan.roles.back());
      plan.columns.push_back(-1);
      plan.ready = plan.ready && (role.block < 0 || present);
      if (present && role.jacobian_at == JacobianAt::kMeasurement) {
        plan.implied.resize(static_cast<std::size_t>(layout[role.block].geometry().ambient));
        plan.linearised_at.back() = plan.implied.data();
      } else if (present && !first_.empty() && !FirstEstimate(role.block).empty()) {
        plan.linearised_at.back() = FirstEstimate(role.block).data();
      }
      if (!present || role.mode == RoleMode::kKnown || !layout[role.block].has_covariance())
        continue;
      const Block& block = layout[role.block];
      for (const JacobianPart& other : plan.parts) apart &= other.offset != block.tangent_offset;
      plan.columns.back() = plan.width;
      plan.parts.push_back({block.tangent_offset, block.geometry().tangent, plan.width});
      plan.consider.push_back(role.mode == RoleMode::kConsider);
      plan.width += block.geometry().tangent;
    }
    plan.whole = small && apart && !sensor.model.has_landmark();
    if (plan.whole) {
      plan.width = state_.covariance().size();
      std::size_t part = 0;
      for (int& column : plan.columns) {
        if (column < 0) continue;
        column = plan.parts[part].column = plan.parts[part].offset;
        ++part;
      }
    }
    plan.linearised_elsewhere = plan.linearised_at != plan.roles;
    plan.strides.assign(sensor.roles.size(), plan.width);
  }
  for (Row& row : rows_) row.zeroed = nullptr;
  BindMotions();
  interval_steps_ = 0;
  small_ = steps_ == Steps::kOwn ? Small::For(*this) : nullptr;
}

/// Under `first_estimate`: the values of stationary blocks that have none noted yet.
void Ekf::KeepFirstEstimates() {
  if (options_.jacobian != JacobianPolicy::kFirstEstimate) return;
  first_.resize(system_.layout.blocks().size());
  for (const MotionBinding& motion : system_.motions) {
    if (!motion.model.stationary()) continue;
    for (const BlockId id : motion.blocks) {
      const Block& block = state_.layout()[id];
      if (!block.has_covariance() || !FirstEstimate(id).empty()) continue;
      FirstEstimate(id).assign(state_.value(id), state_.value(id) + block.geometry().ambient);
    }
  }
}

void Ekf::BindMotions() {
  next_.resize(state_.values().size());
  motions_.assign(system_.motions.size(), {});
  holds_ = false;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const MotionBinding& motion = system_.motions[i];
    MotionPlan& plan = motions_[i];
    plan.active = !motion.model.stationary();
    plan.holds = motion.model.discrete_noise() && motion.model.noise_size() > 0;
    bool whole = true;  // every block has a covariance
    int row = 0;
    for (const BlockId id : motion.blocks) {
      const Block& block = state_.layout()[id];
      plan.active = plan.active && block.present;
      if (!plan.active) break;
      const int size = block.geometry().tangent;
      plan.x.push_back(state_.value(id));
      plan.next.push_back(next_.data() + block.value_offset);
      for (int k = 0; k < size && block.has_covariance(); ++k) plan.rows.push_back(row + k);
      for (int k = 0; k < size; ++k) {
        plan.at.push_back(block.has_covariance() ? block.tangent_offset + k : -1);
      }
      row += size;
      if (!block.has_covariance()) {
        whole = false;
      } else if (!plan.segments.empty() &&
                 plan.segments.back().first + plan.segments.back().second == block.tangent_offset) {
        plan.segments.back().second += size;
      } else {
        plan.segments.emplace_back(block.tangent_offset, size);
      }
    }
    holds_ = holds_ || (plan.active && plan.holds);
    if (whole) plan.rows.clear();
    const auto n = static_cast<std::size_t>(motion.model.tangent_size());
    const auto n_w = static_cast<std::size_t>(motion.model.noise_size());
    plan.f.resize(n * n);
    plan.g.resize(n * n_w);
    plan.gl.resize(n * n_w);
    if (plan.holds) plan.m.resize(n * n_w);
    plan.l.resize(n_w * n_w);
    plan.q.resize(n * n);
  }
}

}  // namespace alidade
