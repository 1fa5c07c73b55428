// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/stacked.h"

namespace alidade::internal {

Stacked Stack(FilterState& f, std::span<Row* const> rows) {
  const Eigen::Index m = CountOf(rows);
  Stacked all{f.work.Take(m, f.size()), f.work.Take(m, m), f.work.Take(m)};
  all.h.setZero();
  all.noise.setZero();
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const JacobianRows own = row->jacobian();
    const Eigen::Index k = own.rows;
    const Eigen::Map<const RowMajor> compact(own.data, k, own.stride);
    for (const JacobianPart& part : own.parts) {
      all.h.block(at, part.offset, k, part.size) += compact.middleCols(part.column, part.size);
    }
    all.noise.block(at, at, k, k) = Eigen::Map<const RowMajor>(row->R.data(), k, k);
    all.innovation.segment(at, k) =
        Eigen::Map<const Eigen::VectorXd>(row->report->innovation.data(), k);
    at += k;
  }
  return all;
}

Workspace::Matrix ProjectionOf(FilterState& f, std::span<Row* const> rows) {
  const Eigen::Index n = f.size();
  Workspace::Matrix pht = f.work.Take(n, CountOf(rows));
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = row->report->dof;
    pht.middleCols(at, k) = Eigen::Map<const Eigen::MatrixXd>(row->PHt.data(), n, k);
    at += k;
  }
  return pht;
}

void AddProjected(std::span<Row* const> rows, const Workspace::Matrix& pht, Workspace::Matrix& s) {
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const JacobianRows h = row->jacobian();
    const Eigen::Map<const RowMajor> compact(h.data, h.rows, h.stride);
    for (const JacobianPart& part : h.parts) {
      s.middleRows(at, h.rows).noalias() +=
          compact.middleCols(part.column, part.size) * pht.middleRows(part.offset, part.size);
    }
    at += h.rows;
  }
}

Workspace::Matrix TransportTo(FilterState& f, const std::vector<double>& values) {
  Workspace::Matrix transport = f.work.Take(f.size(), f.size());
  transport.setIdentity();
  for (const Block& block : f.state.layout().blocks()) {
    if (!block.has_covariance() || block.geometry().kind != GeometryKind::kUnitVector) continue;
    Eigen::Matrix<double, 2, 2, Eigen::RowMajor> j;
    block.geometry().Transport(f.state.values().data() + block.value_offset,
                               values.data() + block.value_offset, j.data());
    transport.block<2, 2>(block.tangent_offset, block.tangent_offset) = j;
  }
  return transport;
}

}  // namespace alidade::internal
