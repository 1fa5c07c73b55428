// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <optional>
#include <span>
#include <vector>

#include "alidade/base/workspace.h"
#include "alidade/filter/binding.h"
#include "alidade/filter/estimator.h"

namespace alidade::internal {

struct FilterState;  // in alidade/filter/filter_state.h

/// One measurement on its way into an update: m = dof, n = size of P.
struct Row {
  const Measurement* measurement = nullptr;
  MeasurementReport* report = nullptr;
  int sensor = -1;
  const SensorBinding* binding = nullptr;
  const SensorModel* model = nullptr;  ///< the sensor's, or that of its landmark's representation
  const SensorPlace* place = nullptr;  ///< the sensor's, or `own`
  SensorPlace own;                     ///< with the blocks of the landmark that it measures
  std::vector<double> H;               ///< H, m rows of the place's width
  std::vector<double> R;               ///< R, m x m, row-major
  std::vector<const double*> roles;    ///< what fills its roles, as RolesAt last had it
  double weight = 1.0;                 ///< w of the robust loss; R is divided by it
  struct {
    std::vector<double*> columns;
    std::vector<double> l;  ///< factor of R
  } memory;

  /// Whether it measures a landmark in the state.
  bool on_landmark() const { return place == &own; }
  JacobianRows jacobian() const {
    return {H.data(), report->dof, place->width, place->parts, place->whole};
  }
};

/// The rows of a frame, in memory that is kept from one to the next.
class Rows {
 public:
  /// One row for each measurement and sensor bound to its stream, in the order of the sensors, with
  /// its entry in the report: kAccepted as long as nothing speaks against it. With `refused` all
  /// have that outcome, and no model is asked.
  void Collect(const Frame& frame, const Binding& binding, UpdateReport& report,
               std::optional<Outcome> refused = {});
  /// The same of one measurement and one sensor, whatever their streams. kAccepted.
  Row& CollectOne(const Measurement& measurement, int sensor, const Binding& binding,
                  UpdateReport& report);
  std::span<Row> all() { return {rows_.data(), count_}; }

 private:
  Row& Add(const Measurement& measurement, int sensor, const Binding& binding,
           UpdateReport& report);
  Outcome Check(const Row& row);

  std::vector<Row> rows_;  ///< the first count_ are in use
  std::size_t count_ = 0;
  // Memory.
  Scratch<Eigen::LDLT<Eigen::MatrixXd>> ldlt_;
  Scratch<Eigen::MatrixXd> root_;
};

/// m, of all rows of an update.
Eigen::Index CountOf(std::span<Row* const> rows);

/// Whether the gain is reported: of a landmark it is not, whose blocks come and go.
inline bool GainIsRecorded(const Row& row) { return !row.model->has_landmark(); }
/// Puts the gain of all rows of an update into their reports: n x m by columns, its rows as they
/// lie in P.
void RecordGain(const FilterState& f, std::span<Row* const> rows, const double* gain);

}  // namespace alidade::internal
