// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/stacked.h"

#include <algorithm>

#include "alidade/state/projection.h"
#include "alidade/state/tiles.h"
#include "alidade/state/vector_kernels.h"

namespace alidade::internal {

namespace {

/// Calls take(row, at) for each row, `at` of the update's m where it begins.
template <class Take>
void ForEachPlace(std::span<Row* const> rows, const Take& take) {
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    take(*row, at);
    at += row->report->dof;
  }
}

}  // namespace

Stacked Stack(FilterState& f, std::span<Row* const> rows) {
  return {JacobianOf(f, rows), NoiseOf(f, rows), InnovationOf(f, rows)};
}

Workspace::Matrix JacobianOf(FilterState& f, std::span<Row* const> rows) {
  Workspace::Matrix h = f.work.Take(CountOf(rows), f.size());
  h.setZero();
  ForEachPlace(rows, [&](const Row& row, Eigen::Index at) {
    const JacobianRows own = row.jacobian();
    const Eigen::Map<const RowMajor> compact(own.data, own.rows, own.stride);
    for (const JacobianPart& part : own.parts) {
      h.block(at, part.offset, own.rows, part.size) += compact.middleCols(part.column, part.size);
    }
  });
  return h;
}

Workspace::Matrix NoiseOf(FilterState& f, std::span<Row* const> rows) {
  Workspace::Matrix noise = f.work.Take(CountOf(rows), CountOf(rows));
  noise.setZero();
  ForEachPlace(rows, [&](const Row& row, Eigen::Index at) {
    const Eigen::Index k = row.report->dof;
    noise.block(at, at, k, k) = Eigen::Map<const RowMajor>(row.R.data(), k, k);
  });
  return noise;
}

Workspace::Vector InnovationOf(FilterState& f, std::span<Row* const> rows) {
  Workspace::Vector innovation = f.work.Take(CountOf(rows));
  ForEachPlace(rows, [&](const Row& row, Eigen::Index at) {
    std::ranges::copy(row.report->innovation, innovation.data() + at);
  });
  return innovation;
}

Panels ProjectionOf(FilterState& f, std::span<Row* const> rows) {
  const Panels pht = TakePanels(f.work, f.size(), CountOf(rows));
  f.jacobians.clear();
  for (const Row* const row : rows) f.jacobians.push_back(row->jacobian());
  Project(f.state.covariance(), f.jacobians, pht);
  return pht;
}

void AddProjected(const FilterState& f, const Panels& pht, Workspace::Matrix& s) {
  BestVectorKernels().add_projected(pht.rows, f.jacobians, pht.data, s.data(), s.outerStride());
}

Workspace::Matrix OutsideOf(FilterState& f, std::span<Row* const> rows) {
  const OutsideCorrelation& correlation = std::as_const(f.state).covariance().outside();
  Workspace::Matrix outside = f.work.Take(correlation.columns(), CountOf(rows));
  if (correlation.columns() == 0) return outside;
  ForEachPlace(rows, [&](const Row& row, Eigen::Index at) {
    correlation.Project(row.jacobian(), outside.data() + at * outside.rows());
  });
  return outside;
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
