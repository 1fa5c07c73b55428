// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/evaluate_models.h"

#include <algorithm>
#include <array>

#include "alidade/base/all_finite.h"

namespace alidade::internal {
namespace {

bool AreFinite(const double* values, Eigen::Index size) {
  return AllFinite({values, static_cast<std::size_t>(size)});
}

/// The values of the model's blocks in x.
std::array<const double*, kMaxRoles> BlocksAt(const MotionPlace& place, const double* x) {
  std::array<const double*, kMaxRoles> blocks;
  std::ranges::transform(place.values, blocks.begin(), [&](int at) { return x + at; });
  return blocks;
}

}  // namespace

Outcome StepAt(const MotionBinding& motion, const MotionPlace& place, const double* x,
               const double* u, const double* w, double dt_s, double* next, double* f, double* g) {
  const MotionModel& model = motion.model;
  const Eigen::Index n = model.tangent_size();
  const Eigen::Index of_f = f == nullptr ? 0 : n * n,
                     of_g = g == nullptr ? 0 : n * model.noise_size();
  std::array<double*, kMaxRoles> to;
  for (std::size_t k = 0; k < place.values.size(); ++k) {
    to[k] = next + place.values[k];
    std::fill_n(to[k], model.blocks()[k].geometry.ambient, kNotWritten);
  }
  std::fill_n(f, of_f, kNotWritten);
  std::fill_n(g, of_g, kNotWritten);
  const Status status = model.Step(BlocksAt(place, x).data(), u, w, dt_s, to.data(), f, g);
  if (status != Status::kOk) return OutcomeOf(status);
  bool finite = AreFinite(f, of_f) && AreFinite(g, of_g);
  for (std::size_t k = 0; k < place.values.size(); ++k) {
    finite = finite && AreFinite(to[k], model.blocks()[k].geometry.ambient);
  }
  return finite ? Outcome::kAccepted : Outcome::kNotFinite;
}

Outcome SqrtQAt(const MotionBinding& motion, const MotionPlace& place, const double* x,
                const double* u, double dt_s, double* l) {
  const Eigen::Index size = Eigen::Index{motion.model.noise_size()} * motion.model.noise_size();
  std::fill_n(l, size, kNotWritten);
  const Status status = motion.model.SqrtQ(BlocksAt(place, x).data(), u, dt_s, l);
  if (status != Status::kOk) return OutcomeOf(status);
  return AreFinite(l, size) ? Outcome::kAccepted : Outcome::kNotFinite;
}

Trouble TroubleOf(const MotionBinding& motion, Outcome outcome) {
  if (outcome == Outcome::kAccepted) return {};
  const std::string who = "motion model of '" + motion.name + "' ";
  if (outcome == Outcome::kNotFinite) {
    return {"not_finite", who + "steps to a state that is not finite"};
  }
  const bool failed = outcome == Outcome::kFailed;
  return {failed ? "plugin_failed" : "diverged",
          who + "cannot step: " + (failed ? motion.model.error_text() : "out of its domain")};
}

void TakeStep(const MotionBinding& motion, const StateLayout& layout, const double* next,
              double* x) {
  for (const BlockId id : motion.blocks) {
    const Block& block = layout[id];
    if (block.status == BlockStatus::kConstant) continue;
    const Geometry& geometry = block.geometry();
    double* const value = x + block.value_offset;
    std::copy_n(next + block.value_offset, geometry.ambient, value);
    if (geometry.kind != GeometryKind::kVector) geometry.Normalise(value);
  }
}

void RolesAt(const SensorBinding& sensor, const SensorPlace& place, const std::vector<double>& x,
             const std::vector<double>& known, std::vector<const double*>& roles) {
  roles.clear();
  for (std::size_t i = 0; i < place.values.size(); ++i) {
    const int at = place.values[i];
    const bool knows = i < sensor.roles.size() && sensor.roles[i].mode == RoleMode::kKnown;
    roles.push_back(at < 0 ? nullptr : (knows ? known : x).data() + at);
  }
}

Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles,
                   std::vector<double*>& columns, std::vector<double>& h,
                   std::vector<double>* jacobian) {
  const double* const known = measurement.known.data();
  const Geometry& geometry = model.measurement().geometry;
  h.assign(static_cast<std::size_t>(geometry.ambient), kNotWritten);
  if (jacobian == nullptr) return OutcomeOf(model.Predict(roles, h.data(), known));
  const int m = geometry.tangent;
  jacobian->assign(static_cast<std::size_t>(m) * static_cast<std::size_t>(place.width), 0.0);
  for (const JacobianPart& part : place.parts) {
    for (int i = 0; i < m; ++i) {
      std::fill_n(jacobian->data() + i * place.width + part.column, part.size, kNotWritten);
    }
  }
  columns.clear();
  for (const int column : place.columns) {
    columns.push_back(column < 0 ? nullptr : jacobian->data() + column);
  }
  return OutcomeOf(model.Linearise(roles, h.data(), columns.data(), place.strides.data(), known));
}

Outcome NoiseAt(const SensorModel& model, const Measurement& measurement,
                const double* const* roles, std::vector<double>& l, std::vector<double>& r) {
  if (!measurement.covariance.empty()) {
    r.assign(measurement.covariance.begin(), measurement.covariance.end());
    return Outcome::kAccepted;
  }
  const auto m = static_cast<std::size_t>(model.measurement().geometry.tangent);
  r.resize(m * m);
  l.assign(m * m, kNotWritten);
  const Outcome outcome = OutcomeOf(
      model.SqrtNoise(roles, measurement.values.data(), l.data(), measurement.known.data()));
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (std::size_t k = 0; k < m; ++k) sum += l[i * m + k] * l[j * m + k];
      r[i * m + j] = r[j * m + i] = sum;
    }
  }
  return outcome;
}

const double* const* RolesAt(Row& row, const std::vector<double>& x,
                             const std::vector<double>& known) {
  RolesAt(*row.binding, *row.place, x, known, row.roles);
  return row.roles.data();
}

Outcome PredictAt(Row& row, const std::vector<double>& x, const std::vector<double>& known,
                  double* h) {
  std::fill_n(h, row.model->measurement().geometry.ambient, kNotWritten);
  return OutcomeOf(row.model->Predict(RolesAt(row, x, known), h, row.measurement->known.data()));
}

Outcome LineariseAt(Row& row, const double* const* roles) {
  return EvaluateAt(*row.model, *row.place, *row.measurement, roles, row.memory.columns,
                    row.report->h, &row.H);
}

Outcome NoiseAt(Row& row, const double* const* roles) {
  return NoiseAt(*row.model, *row.measurement, roles, row.memory.l, row.R);
}

void TakeInnovation(Row& row) {
  MeasurementReport& entry = *row.report;
  entry.innovation.resize(static_cast<std::size_t>(entry.dof));
  row.model->measurement().geometry.Minus(entry.z.data(), entry.h.data(), entry.innovation.data());
}

void ChainJacobian(Row& row, int column, int size, const double* j, Workspace& work) {
  const Workspace::Use use(work);
  const int m = row.report->dof;
  auto own = Eigen::Map<RowMajor>(row.H.data(), m, row.place->width).middleCols(column, size);
  Workspace::Matrix chained = work.Take(m, size);
  chained.noalias() = own * Eigen::Map<const RowMajor>(j, size, size);
  own = chained;
}

Outcome InvertAt(const SensorBinding& sensor, const SensorPlace& place,
                 const Measurement& measurement, const double* prior,
                 std::vector<const double*>& roles, Inverse& inverse) {
  const SensorModel& model = sensor.model;
  const auto first = static_cast<std::size_t>(model.inverse().role);
  const auto count = static_cast<std::size_t>(model.inverse().count);
  const std::span<const Space> targets = std::span(model.roles()).subspan(first, count);
  int rows = 0, size = 0, columns = 0, most = 0;
  for (const Space& target : targets) {
    rows += target.geometry.tangent;
    size += target.geometry.ambient;
  }
  for (const Space& role : model.roles()) most += role.geometry.tangent;
  std::fill_n(roles.begin() + model.inverse().role, count, nullptr);
  inverse.from.clear();
  inverse.by_role.assign(static_cast<std::size_t>(rows) * static_cast<std::size_t>(most),
                         kNotWritten);
  inverse.of_role.assign(roles.size(), nullptr);
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (roles[i] == nullptr || place.columns[i] < 0) continue;
    inverse.from.push_back(sensor.roles[i].block);
    inverse.of_role[i] = inverse.by_role.data() + rows * columns;
    columns += model.roles()[i].geometry.tangent;
  }
  inverse.y.assign(static_cast<std::size_t>(size), kNotWritten);
  inverse.by_z.setConstant(rows, model.measurement().geometry.tangent, kNotWritten);
  inverse.by_prior.setConstant(rows, model.inverse().prior_size, kNotWritten);
  const Status status = model.Initialise(
      roles.data(), measurement.values.data(), prior, inverse.y.data(), inverse.of_role.data(),
      inverse.by_z.data(), inverse.by_prior.data(), measurement.known.data());
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

}  // namespace alidade::internal
