// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/evaluate_models.h"

#include <algorithm>
#include <cmath>

namespace alidade::internal {

void RolesAt(const SensorBinding& sensor, const SensorPlace& place, const std::vector<double>& x,
             const std::vector<double>& known, std::vector<const double*>& roles) {
  roles.clear();
  for (std::size_t i = 0; i < place.values.size(); ++i) {
    const int at = place.values[i];
    const bool knows = i < sensor.roles.size() && sensor.roles[i].mode == RoleMode::kKnown;
    roles.push_back(at < 0 ? nullptr : (knows ? known : x).data() + at);
  }
}

Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place, const double* const* roles,
                   std::vector<double*>& columns, std::vector<double>& h,
                   std::vector<double>* jacobian) {
  const Geometry& geometry = model.measurement().geometry;
  h.assign(static_cast<std::size_t>(geometry.ambient), std::nan(""));
  if (jacobian == nullptr) return OutcomeOf(model.Predict(roles, h.data()));
  const int m = geometry.tangent;
  jacobian->assign(static_cast<std::size_t>(m) * static_cast<std::size_t>(place.width), 0.0);
  for (const JacobianPart& part : place.parts) {
    for (int i = 0; i < m; ++i) {
      std::fill_n(jacobian->data() + i * place.width + part.column, part.size, std::nan(""));
    }
  }
  columns.clear();
  for (const int column : place.columns) {
    columns.push_back(column < 0 ? nullptr : jacobian->data() + column);
  }
  return OutcomeOf(model.Linearise(roles, h.data(), columns.data(), place.strides.data()));
}

Outcome NoiseAt(const SensorModel& model, const Measurement& measurement,
                const double* const* roles, std::vector<double>& l, std::vector<double>& r) {
  if (!measurement.covariance.empty()) {
    r.assign(measurement.covariance.begin(), measurement.covariance.end());
    return Outcome::kAccepted;
  }
  const auto m = static_cast<std::size_t>(model.measurement().geometry.tangent);
  r.resize(m * m);
  l.assign(m * m, std::nan(""));
  const Outcome outcome = OutcomeOf(model.SqrtNoise(roles, measurement.values.data(), l.data()));
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (std::size_t k = 0; k < m; ++k) sum += l[i * m + k] * l[j * m + k];
      r[i * m + j] = r[j * m + i] = sum;
    }
  }
  return outcome;
}

Outcome InvertAt(const SensorBinding& sensor, const SensorPlace& place, const double* z,
                 const double* prior, std::vector<const double*>& roles, Inverse& inverse) {
  const SensorModel& model = sensor.model;
  const auto first = static_cast<std::size_t>(model.initialised_role());
  const auto count = static_cast<std::size_t>(model.initialised_count());
  const std::span<const Space> targets = std::span(model.roles()).subspan(first, count);
  int rows = 0, size = 0, columns = 0;
  for (const Space& target : targets) {
    rows += target.geometry.tangent;
    size += target.geometry.ambient;
  }
  const double unwritten = std::nan("");
  std::fill_n(roles.begin() + model.initialised_role(), count, nullptr);
  const auto counts = [&](std::size_t i) { return roles[i] != nullptr && place.columns[i] >= 0; };
  inverse.from.clear();
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (!counts(i)) continue;
    inverse.from.push_back(sensor.roles[i].block);
    columns += model.roles()[i].geometry.tangent;
  }
  inverse.by_role.assign(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns),
                         unwritten);
  inverse.of_role.assign(roles.size(), nullptr);
  double* next = inverse.by_role.data();
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (!counts(i)) continue;
    inverse.of_role[i] = next;
    next += rows * model.roles()[i].geometry.tangent;
  }
  inverse.y.assign(static_cast<std::size_t>(size), unwritten);
  inverse.by_z.setConstant(rows, model.measurement().geometry.tangent, unwritten);
  inverse.by_prior.setConstant(rows, model.prior_size(), unwritten);
  const Status status =
      model.Initialise(roles.data(), z, prior, inverse.y.data(), inverse.of_role.data(),
                       inverse.by_z.data(), inverse.by_prior.data());
  if (status != Status::kOk) return OutcomeOf(status);
  inverse.by_x.resize(rows, columns);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (inverse.of_role[i] == nullptr) continue;
    const int width = model.roles()[i].geometry.tangent;
    inverse.by_x.middleCols(column, width) =
        Eigen::Map<const RowMajor>(inverse.of_role[i], rows, width);
    column += width;
  }
  double* y = inverse.y.data();
  for (std::size_t i = 0; i < count; ++i) {
    targets[i].geometry.Normalise(y);
    roles[first + i] = y;
    y += targets[i].geometry.ambient;
  }
  const bool finite = AllFinite(inverse.y) && inverse.by_x.allFinite() &&
                      inverse.by_z.allFinite() && inverse.by_prior.allFinite();
  return finite ? Outcome::kAccepted : Outcome::kNotFinite;
}

const double* const* RolesAt(FilterState& f, const Row& row, const std::vector<double>& x) {
  RolesAt(*row.binding, *row.place, x, f.state.values(), f.buffers.roles);
  return f.buffers.roles.data();
}

Outcome PredictAt(FilterState& f, const Row& row, const std::vector<double>& x, double* h) {
  return OutcomeOf(row.model->Predict(RolesAt(f, row, x), h));
}

Outcome LineariseAt(FilterState& f, Row& row, const double* const* roles) {
  return EvaluateAt(*row.model, *row.place, roles, f.buffers.jacobians, row.report->h, &row.H);
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
      InvertAt(*row.binding, *row.place, row.measurement->values.data(),
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
