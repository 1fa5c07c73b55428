// SPDX-License-Identifier: Apache-2.0
//
// A step and an update of the filter as whole matrices, for the estimators that build on it.
#include <algorithm>

#include "alidade/filter/ekf.h"

namespace alidade {

int Ekf::NoiseSize() const {
  int size = 0;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (motions_[i].active) size += system_.motions[i].model.noise_size();
  }
  return size;
}

Workspace::Matrix Ekf::Transition() {
  const Eigen::Index n = state_.covariance().size();
  Workspace::Matrix transition = work_.Take(n, n);
  transition.setIdentity();
  for (const MotionPlan& plan : motions_) {
    if (!plan.active) continue;
    const double* f = plan.f.data();
    for (const int row : plan.at) {
      for (const int column : plan.at) {
        if (row >= 0 && column >= 0) transition(row, column) = *f;
        ++f;
      }
    }
  }
  return transition;
}

/// A matrix of the plans (n x n_w each) in the rows of the covariance, next to one another; with
/// `held_only` the columns of continuous noise are zero.
Workspace::Matrix Ekf::Spread(std::vector<double> MotionPlan::*matrix, bool held_only) {
  Workspace::Matrix input = work_.Take(state_.covariance().size(), NoiseSize());
  input.setZero();
  Eigen::Index columns = 0;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const MotionPlan& plan = motions_[i];
    if (!plan.active) continue;
    const MotionModel& model = system_.motions[i].model;
    const Eigen::Index width = model.noise_size();
    for (std::size_t row = 0; row < plan.at.size() && (plan.holds || !held_only); ++row) {
      if (plan.at[row] < 0) continue;
      const Eigen::Map<const RowMajor> from((plan.*matrix).data(), model.tangent_size(), width);
      input.row(plan.at[row]).segment(columns, width) = from.row(static_cast<Eigen::Index>(row));
    }
    columns += width;
  }
  return input;
}

Workspace::Matrix Ekf::NoiseInput() { return Spread(&MotionPlan::gl, false); }
Workspace::Matrix Ekf::HeldInput() { return Spread(&MotionPlan::gl, true); }
Workspace::Matrix Ekf::HeldNoise() { return Spread(&MotionPlan::m, true); }

Ekf::Stacked Ekf::Stack(std::span<Row* const> rows) {
  Eigen::Index m = 0;
  for (const Row* row : rows) m += BindingOf(*row).model.measurement().geometry.tangent;
  Stacked all{work_.Take(m, state_.covariance().size()), work_.Take(m, m), work_.Take(m)};
  all.h.setZero();
  all.noise.setZero();
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

void Ekf::SetCovariance(const Workspace::Matrix& p) {
  Covariance& covariance = state_.covariance();
  for (Eigen::Index c = 0; c < p.cols(); ++c) {
    std::copy_n(&p(c, c), p.rows() - c, covariance.data() + c * covariance.stride() + c);
  }
}

Workspace::Matrix Ekf::TransportTo(const std::vector<double>& values) {
  const Eigen::Index n = state_.covariance().size();
  Workspace::Matrix transport = work_.Take(n, n);
  transport.setIdentity();
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

}  // namespace alidade
