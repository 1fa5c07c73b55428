// SPDX-License-Identifier: Apache-2.0
//
// A step and an update of the filter as whole matrices, for the estimators that build on it.
#include "alidade/ekf.h"

namespace alidade {
namespace {

/// Rows of the covariance that one motion model moves, in its own order.
std::vector<int> RowsOf(const std::vector<std::pair<int, int>>& segments) {
  std::vector<int> rows;
  for (const auto& [offset, size] : segments) {
    for (int i = 0; i < size; ++i) rows.push_back(offset + i);
  }
  return rows;
}

}  // namespace

Eigen::MatrixXd Ekf::Transition() const {
  const Eigen::Index n = state_.covariance().size();
  Eigen::MatrixXd transition = Eigen::MatrixXd::Identity(n, n);
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const MotionPlan& plan = motions_[i];
    if (!plan.active || plan.segments.empty()) continue;
    const std::vector<int> at = RowsOf(plan.segments);
    const Eigen::Index k = system_.motions[i].model.tangent_size();
    const Eigen::Map<const RowMajor> f(plan.f.data(), k, k);
    if (plan.rows.empty()) {
      transition(at, at) = f;
    } else {
      transition(at, at) = f(plan.rows, plan.rows);
    }
  }
  return transition;
}

Eigen::MatrixXd Ekf::NoiseInput() const {
  Eigen::Index columns = 0;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (motions_[i].active) columns += system_.motions[i].model.noise_size();
  }
  Eigen::MatrixXd input = Eigen::MatrixXd::Zero(state_.covariance().size(), columns);
  columns = 0;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const MotionPlan& plan = motions_[i];
    if (!plan.active) continue;
    const MotionModel& model = system_.motions[i].model;
    const Eigen::Map<const RowMajor> gl(plan.gl.data(), model.tangent_size(), model.noise_size());
    const std::vector<int> at = RowsOf(plan.segments);
    for (std::size_t row = 0; row < at.size(); ++row) {
      const Eigen::Index own = plan.rows.empty() ? static_cast<Eigen::Index>(row) : plan.rows[row];
      input.row(at[row]).segment(columns, model.noise_size()) = gl.row(own);
    }
    columns += model.noise_size();
  }
  return input;
}

Ekf::Stacked Ekf::Stack(std::span<Row* const> rows) const {
  Eigen::Index m = 0;
  for (const Row* row : rows) m += BindingOf(*row).model.measurement().geometry.tangent;
  Stacked all{Eigen::MatrixXd::Zero(m, state_.covariance().size()), Eigen::MatrixXd::Zero(m, m),
              Eigen::VectorXd(m)};
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const JacobianRows own = JacobianOf(*row);
    const Eigen::Index k = own.rows;
    const Eigen::Map<const RowMajor> compact(own.data, k, own.stride);
    for (const JacobianPart& part : own.parts) {
      all.h.block(at, part.offset, k, part.size) += compact.middleCols(part.column, part.size);
    }
    all.noise.block(at, at, k, k) = Eigen::Map<const RowMajor>(row->r.data(), k, k);
    const MeasurementReport& entry = report_.measurements()[row->report];
    all.innovation.segment(at, k) = Eigen::Map<const Eigen::VectorXd>(entry.innovation.data(), k);
    at += k;
  }
  return all;
}

Eigen::MatrixXd Ekf::TransportTo(const std::vector<double>& values) const {
  const Eigen::Index n = state_.covariance().size();
  Eigen::MatrixXd transport = Eigen::MatrixXd::Identity(n, n);
  for (const Block& block : state_.layout().blocks()) {
    if (!block.has_covariance() || block.geometry().kind != GeometryKind::kUnitVector) continue;
    const Eigen::Index k = block.geometry().tangent;
    RowMajor j(k, k);
    block.geometry().Transport(state_.values().data() + block.value_offset,
                               values.data() + block.value_offset, j.data());
    transport.block(block.tangent_offset, block.tangent_offset, k, k) = j;
  }
  return transport;
}

void Ekf::RecordUpdate(std::span<Row* const> rows, const Eigen::MatrixXd& gain) {
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    MeasurementReport& entry = EntryOf(*row);
    RecordGain(entry, gain.data() + at * gain.rows());
    at += entry.dof;
  }
  const Row& last = *rows.back();
  last_used_.sensor = last.sensor;
  last_used_.stamp = last.measurement->stamp;
  last_used_.z.assign(last.measurement->values.begin(), last.measurement->values.end());
}

}  // namespace alidade
