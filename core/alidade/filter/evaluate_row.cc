// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/evaluate_row.h"

#include <algorithm>
#include <cmath>

namespace alidade::internal {

const double* const* RolesAt(FilterState& f, const Row& row, const std::vector<double>& x) {
  RolesAt(*row.binding, *row.place, x, f.state.values(), f.buffers.roles);
  return f.buffers.roles.data();
}

Outcome NoiseAt(Row& row, const double* const* roles) {
  return NoiseAt(*row.model, *row.measurement, roles, row.L, row.R);
}

Outcome PredictAt(FilterState& f, const Row& row, const std::vector<double>& x, double* h) {
  std::fill_n(h, row.model->measurement().geometry.ambient, std::nan(""));
  return OutcomeOf(row.model->Predict(RolesAt(f, row, x), h, row.measurement->known.data()));
}

Outcome LineariseAt(FilterState& f, Row& row, const double* const* roles) {
  return EvaluateAt(*row.model, *row.place, *row.measurement, roles, f.buffers.jacobians,
                    row.report->h, &row.H);
}

void TakeInnovation(Row& row) {
  MeasurementReport& entry = *row.report;
  entry.innovation.resize(static_cast<std::size_t>(entry.dof));
  row.model->measurement().geometry.Minus(entry.z.data(), entry.h.data(), entry.innovation.data());
}

void ChainJacobian(FilterState& f, Row& row, int column, int size, const double* j) {
  const Workspace::Use use(f.work);
  const int m = row.report->dof;
  auto own = Eigen::Map<RowMajor>(row.H.data(), m, row.place->width).middleCols(column, size);
  Workspace::Matrix chained = f.work.Take(m, size);
  chained.noalias() = own * Eigen::Map<const RowMajor>(j, size, size);
  own = chained;
}

Outcome Invert(FilterState& f, Row& row, const LandmarkOptions::Prior* prior, Inverse& inverse) {
  RolesAt(f, row, f.state.values());
  Outcome outcome =
      InvertAt(*row.binding, *row.place, *row.measurement,
               prior == nullptr ? nullptr : &prior->inverse_distance, f.buffers.roles, inverse);
  if (outcome == Outcome::kAccepted) outcome = NoiseAt(row, f.buffers.roles.data());
  if (outcome == Outcome::kFailed) NotePluginFailure(f, *row.binding);
  if (outcome != Outcome::kAccepted) {
    return outcome == Outcome::kOutOfDomain ? Outcome::kInvalid : outcome;
  }
  const int m = row.report->dof;
  const Eigen::Map<const RowMajor> r(row.R.data(), m, m);
  const RowMajor& jp = inverse.by_prior;
  inverse.by_z_r.noalias() = inverse.by_z * r;
  inverse.own.noalias() = inverse.by_z_r * inverse.by_z.transpose();
  if (prior != nullptr) {
    inverse.own.noalias() += prior->sigma * prior->sigma * jp * jp.transpose();
  }
  return inverse.own.allFinite() ? Outcome::kAccepted : Outcome::kNotFinite;
}

}  // namespace alidade::internal
