// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/evaluate_models.h"

#include <algorithm>
#include <cmath>

namespace alidade::internal {

const double* const* RolesAt(FilterState& f, const Row& row, const std::vector<double>& x) {
  const std::vector<RoleBinding>& bound = row.binding->roles;
  f.buffers.roles.clear();
  for (std::size_t i = 0; i < row.place->values.size(); ++i) {
    const int at = row.place->values[i];
    const bool known = i < bound.size() && bound[i].mode == RoleMode::kKnown;
    f.buffers.roles.push_back(at < 0 ? nullptr : (known ? f.state.values() : x).data() + at);
  }
  return f.buffers.roles.data();
}

Outcome PredictAt(FilterState& f, const Row& row, const std::vector<double>& x, double* h) {
  return OutcomeOf(row.model->Predict(RolesAt(f, row, x), h));
}

Outcome LineariseAt(FilterState& f, Row& row, const double* const* roles) {
  const SensorPlace& place = *row.place;
  const int m = row.report->dof;
  row.H.assign(static_cast<std::size_t>(m) * static_cast<std::size_t>(place.width), 0.0);
  for (const JacobianPart& part : place.parts) {
    for (int i = 0; i < m; ++i) {
      std::fill_n(row.H.data() + i * place.width + part.column, part.size, std::nan(""));
    }
  }
  f.buffers.jacobians.clear();
  for (const int column : place.columns) {
    f.buffers.jacobians.push_back(column < 0 ? nullptr : row.H.data() + column);
  }
  row.report->h.assign(static_cast<std::size_t>(row.model->measurement().geometry.ambient),
                       std::nan(""));
  return OutcomeOf(row.model->Linearise(roles, row.report->h.data(), f.buffers.jacobians.data(),
                                        place.strides.data()));
}

Outcome NoiseAt(Row& row, const double* const* roles) {
  const auto m = static_cast<std::size_t>(row.report->dof);
  const Measurement& measurement = *row.measurement;
  if (!measurement.covariance.empty()) {
    row.R.assign(measurement.covariance.begin(), measurement.covariance.end());
    return Outcome::kAccepted;
  }
  row.R.resize(m * m);
  row.L.assign(m * m, std::nan(""));
  const Outcome outcome =
      OutcomeOf(row.model->SqrtNoise(roles, measurement.values.data(), row.L.data()));
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (std::size_t k = 0; k < m; ++k) sum += row.L[i * m + k] * row.L[j * m + k];
      row.R[i * m + j] = row.R[j * m + i] = sum;
    }
  }
  return outcome;
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
  const Workspace::Use use(f.work);
  const SensorBinding& binding = *row.binding;
  const SensorModel& model = binding.model;
  const auto first = static_cast<std::size_t>(model.initialised_role());
  const auto count = static_cast<std::size_t>(model.initialised_count());
  const std::span<const Space> targets = std::span(model.roles()).subspan(first, count);
  const auto matrix = [&](Eigen::Index rows, Eigen::Index columns) {
    Eigen::Map<RowMajor> taken(f.work.Take(rows * columns).data(), rows, columns);
    taken.setConstant(std::nan(""));
    return taken;
  };
  int size = 0;
  inverse.rows = inverse.columns = 0;
  inverse.from.clear();
  for (const Space& target : targets) {
    inverse.rows += target.geometry.tangent;
    size += target.geometry.ambient;
  }
  std::vector<const double*>& roles = f.buffers.roles;
  std::vector<double*>& jx = f.buffers.jacobians;
  roles.assign(binding.roles.size(), nullptr);
  jx.assign(binding.roles.size(), nullptr);
  for (std::size_t i = 0; i < roles.size(); ++i) {
    const RoleBinding& role = binding.roles[i];
    if ((i >= first && i < first + count) || role.block < 0) continue;
    roles[i] = f.state.value(role.block);
    const Block& block = f.state.layout()[role.block];
    if (role.mode == RoleMode::kKnown || !block.has_covariance()) continue;
    jx[i] = matrix(inverse.rows, block.geometry().tangent).data();
    inverse.from.push_back(role.block);
    inverse.columns += block.geometry().tangent;
  }
  const int m = model.measurement().geometry.tangent;
  Eigen::Map<RowMajor> jz = matrix(inverse.rows, m), jp = matrix(inverse.rows, model.prior_size());
  inverse.y.resize(static_cast<std::size_t>(size));
  const Status status = model.Initialise(roles.data(), row.measurement->values.data(),
                                         prior == nullptr ? nullptr : &prior->inverse_distance,
                                         inverse.y.data(), jx.data(), jz.data(), jp.data());
  Outcome outcome = OutcomeOf(status);
  if (status == Status::kOk) {
    double* y = inverse.y.data();
    for (std::size_t i = 0; i < count; ++i) {
      targets[i].geometry.Normalise(y);
      roles[first + i] = y;
      y += targets[i].geometry.ambient;
    }
    outcome = NoiseAt(row, roles.data());
  }
  if (outcome == Outcome::kFailed) NotePluginFailure(f, binding);
  if (outcome != Outcome::kAccepted) {
    return outcome == Outcome::kFailed ? outcome : Outcome::kInvalid;
  }
  Eigen::Map<RowMajor> jz_r = matrix(inverse.rows, m);
  inverse.own.resize(static_cast<std::size_t>(inverse.rows * inverse.rows));
  Eigen::Map<RowMajor> own(inverse.own.data(), inverse.rows, inverse.rows);
  jz_r.noalias() = jz * Eigen::Map<const RowMajor>(row.R.data(), m, m);
  own.noalias() = jz_r * jz.transpose();
  if (prior != nullptr) own.noalias() += prior->sigma * prior->sigma * jp * jp.transpose();
  inverse.jacobian.resize(static_cast<std::size_t>(inverse.rows * inverse.columns));
  Eigen::Map<RowMajor> jacobian(inverse.jacobian.data(), inverse.rows, inverse.columns);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (jx[i] == nullptr) continue;
    const Eigen::Index width = model.roles()[i].geometry.tangent;
    jacobian.middleCols(column, width) = Eigen::Map<const RowMajor>(jx[i], inverse.rows, width);
    column += width;
  }
  const bool finite = AllFinite(inverse.y) && own.allFinite() && jacobian.allFinite();
  return finite ? Outcome::kAccepted : Outcome::kNotFinite;
}

}  // namespace alidade::internal
