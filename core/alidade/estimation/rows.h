// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "alidade/estimation/filter_state.h"
#include "alidade/state/kernels.h"
#include "alidade/state/workspace.h"

/// Measurements on their way into an update: what a frame has of them, what their sensor models say
/// at some x, and how they lie below one another.
namespace alidade::internal {

/// One measurement on its way into an update: m = dof, n = size of P.
struct Row {
  const Measurement* measurement = nullptr;
  MeasurementReport* report = nullptr;
  int sensor = -1;
  const SensorBinding* binding = nullptr;
  const SensorModel* model = nullptr;  ///< the sensor's, or that of its landmark's representation
  const SensorPlace* place = nullptr;  ///< the sensor's, or `own`; set by Bind
  SensorPlace own;                     ///< with the blocks of the landmark that it measures
  std::vector<double> numbers;  ///< z, h, the innovation, S, R and L; the report points to them
  double *z = nullptr, *h = nullptr, *innovation = nullptr, *s = nullptr;  ///< s: m x m, row-major
  std::span<double> R;                                                     ///< R, m x m, row-major
  double* root = nullptr;                                                  ///< L of R = L L'
  std::vector<double> H;                       ///< H, m rows of the place's width
  std::vector<double> gain;                    ///< as in the report
  std::array<double*, kMaxRoles> jacobians{};  ///< in H, by role
  Roles roles{};                               ///< as RolesAt last had them
  const double* roles_of = nullptr;            ///< the values of the filter, if roles are those
  double weight = 1.0;                         ///< w of the robust loss; R is divided by it
  MeasurementRows linearised;  ///< H, innovation, R and S; its column, if it passes the gate

  /// Gives it another place.
  void Bind(const SensorPlace& to);
  /// Whether it measures a landmark in the state.
  bool on_landmark() const { return place == &own; }
};

/// The rows of a frame, in memory that is kept from one to the next: there lie the numbers of their
/// reports.
class Rows {
 public:
  /// One row for each measurement and sensor bound to its stream, in the order of the sensors, with
  /// its entry in the report: kAccepted as long as nothing speaks against it. Unless `refused` is
  /// kAccepted all have that outcome, and no model is asked.
  void Collect(const Frame& frame, const Binding& binding, UpdateReport& report,
               Outcome refused = Outcome::kAccepted);
  /// The same of one measurement and one sensor, whatever their streams. kAccepted.
  Row& CollectOne(const Measurement& measurement, int sensor, const Binding& binding,
                  UpdateReport& report);
  std::span<Row> all() { return std::span(rows_).first(static_cast<std::size_t>(count_)); }

 private:
  Row& Add(const Measurement& measurement, const SensorPlace& place);
  void Report(const Row& row, Outcome outcome, UpdateReport& report);
  void PointToReports(UpdateReport& report);
  Outcome Check(const Row& row);
  Outcome CheckRest(const Row& row);
  bool IsCovariance(const std::vector<double>& covariance, int size);

  std::vector<Row> rows_;  ///< the first count_ are in use
  std::ptrdiff_t count_ = 0;
  // Memory.
  Scratch<Eigen::LDLT<Eigen::MatrixXd>> ldlt_;
  Scratch<Eigen::MatrixXd> root_;
};

// A sensor model at any values x of the whole state: that of a filter, an iterate, a sigma point, a
// point of a batch. m: tangent size of the measurement.

/// The values that fill the roles of a sensor at x; of roles that it knows those of `known_roles`.
/// Null: the role has no place.
void RolesAt(const SensorPlace& place, const double* x, const double* known_roles, Roles& roles);

/// Destinations of an evaluation, row-major; null: not wanted.
struct EvaluationOutput {
  double* h = nullptr;         ///< ambient
  double* jacobian = nullptr;  ///< H, m rows of the place's width; h has to be wanted too
  double* l = nullptr;         ///< of R = L L', m x m
};
/// A sensor model at the roles.
Outcome EvaluateAt(const SensorModel& model, const SensorPlace& place,
                   const Measurement& measurement, const double* const* roles,
                   const EvaluationOutput& to);

/// R = L L', m x m, row-major.
inline void Square(const double* l, int m, double* r) {
  if (m == 1) {
    r[0] = l[0] * l[0];
    return;
  }
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (int k = 0; k < m; ++k) sum += l[i * m + k] * l[j * m + k];
      r[i * m + j] = r[j * m + i] = sum;
    }
  }
}

/// R at the roles, or as the measurement itself says, m x m, row-major. `l` is memory, m x m.
Outcome NoiseAt(const SensorModel& model, const SensorPlace& place, const Measurement& measurement,
                const double* const* roles, double* l, double* r);

// The same of a row.

/// What fills its roles at x; roles that the sensor knows have their value in f. Until the next
/// call.
inline const double* const* RolesAt(const FilterState& f, Row& row, const std::vector<double>& x) {
  const double* const values = f.state.values().data();
  if (x.data() == values && row.roles_of == values) return row.roles.data();
  RolesAt(*row.place, x.data(), values, row.roles);
  row.roles_of = x.data() == values ? values : nullptr;
  return row.roles.data();
}
/// h at x, ambient, in `h`.
Outcome PredictAt(const FilterState& f, Row& row, const std::vector<double>& x, double* h);
/// h at the roles, in the report; H and R, in the row.
[[gnu::always_inline]] inline Outcome LineariseAt(Row& row, const double* const* roles) {
  const SensorPlace& place = *row.place;
  const Measurement& measurement = *row.measurement;
  const bool has_noise = !measurement.covariance.empty();
  row.report->h = {row.h, static_cast<std::size_t>(place.ambient)};
  const Status status = row.model->Evaluate(
      {measurement.values.data(), measurement.known.data()}, roles,
      {row.h, row.jacobians.data(), place.strides.data(), has_noise ? nullptr : row.root});
  if (has_noise) {
    std::ranges::copy(measurement.covariance, row.R.begin());
  } else {
    Square(row.root, place.dof, row.R.data());
  }
  return OutcomeOf(status);
}
/// R at the roles, or as the measurement itself says, in the row.
Outcome NoiseAt(Row& row, const double* const* roles);
/// z (-) h of the h in the report, in the report.
inline void ComputeInnovation(Row& row) {
  row.report->innovation = {row.innovation, static_cast<std::size_t>(row.place->dof)};
  row.model->measurement().geometry.Minus(row.z, row.h, row.innovation);
}
/// r' S^-1 r of the S and the innovation in the report; not a number unless S is positive definite.
double ComputeNis(const Row& row, Workspace& work);
/// H <- H J in the columns of one role, J size x size, row-major.
void ChainJacobian(Row& row, int column, int size, const double* j, Workspace& work);

/// r' S^-1 r by S = L D L', m x m, row-major; not a number unless S is positive definite.
double SquaredMahalanobis(const double* s, const double* r, int m, Workspace& work);

/// Tells why h of a row could not be had; outside its domain, by which the filter counts as
/// diverged, once until the sensor is accepted again.
void NoteRefusal(FilterState& f, const Row& row, Outcome outcome);
void NotePluginFailure(FilterState& f, const Row& row);

// The rows of an update below one another: m rows in all, n = size of P.

/// m, of all rows of an update.
int TotalDof(std::span<Row* const> rows);

/// Whether the gain is reported: of a landmark it is not, whose blocks come and go.
inline bool GainIsRecorded(const Row& row) { return !row.place->has_landmark; }
/// Gives the reports of the rows their columns of K: copy(rows of P, column, count, to).
template <class Copy>
void RecordGainBy(const FilterState& f, std::span<Row* const> rows, const Copy& copy) {
  const std::vector<int>& kept = f.blocks.gain_rows;
  int column = 0;
  for (Row* const row : rows) {
    const int m = row->place->dof;
    if (GainIsRecorded(*row)) {
      const std::size_t count = kept.size() * static_cast<std::size_t>(m);
      if (row->gain.size() < count) row->gain.resize(count);
      row->report->gain = {row->gain.data(), count};
      copy(kept, column, m, row->gain.data());
    }
    column += m;
  }
}
/// The same of K as a matrix.
void RecordGain(const FilterState& f, std::span<Row* const> rows, const ConstMatrix& gain);

struct Stacked {
  Workspace::Matrix h, noise;    ///< H (m x n), R (m x m)
  Workspace::Vector innovation;  ///< m
};

/// The rows as they are, in f.work.
Stacked Stack(FilterState& f, std::span<Row* const> rows);
/// H, R and the innovation of all rows, in f.work.
Workspace::Matrix JacobianOf(FilterState& f, std::span<Row* const> rows);
Workspace::Matrix NoiseOf(FilterState& f, std::span<Row* const> rows);
Workspace::Vector InnovationOf(FilterState& f, std::span<Row* const> rows);
/// Calls zero(offset, size, at, k) for each part of the gain that consider blocks and roles keep at
/// 0: rows [offset, offset + size) of P, columns [at, at + k) of the update.
template <class Zero>
void ForEachConsidered(const FilterState& f, std::span<Row* const> rows, const Zero& zero) {
  for (std::size_t i = 0; f.blocks.considering && i < f.binding->system.layout.blocks().size();
       ++i) {
    const Block& block = f.state.layout()[static_cast<BlockId>(i)];
    if (!block.present || block.status != BlockStatus::kConsider) continue;
    zero(block.tangent_offset, block.geometry().tangent, 0, TotalDof(rows));
  }
  int at = 0;
  for (const Row* row : rows) {
    const SensorPlace& place = *row->place;
    for (std::size_t i = 0; place.considers && i < place.parts.size(); ++i) {
      if (place.consider[i]) zero(place.parts[i].offset, place.parts[i].size, at, row->report->dof);
    }
    at += row->report->dof;
  }
}

}  // namespace alidade::internal
