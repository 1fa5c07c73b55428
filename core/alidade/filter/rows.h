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
  std::vector<double> PHt;             ///< P H', n x m by columns, where the method has an H
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

/// Of a landmark it is not: its blocks come and go.
inline bool GainIsRecorded(const Row& row) { return !row.model->has_landmark(); }

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
  Outcome OutcomeOf(const Row& row);
  void Link(UpdateReport& report);

  std::vector<Row> rows_;  ///< the first count_ are in use
  std::size_t count_ = 0;
  // Memory.
  Scratch<Eigen::LDLT<Eigen::MatrixXd>> ldlt_;
  Scratch<Eigen::MatrixXd> root_;
};

/// Which measurements may correct the state, each by itself: those with r' S^-1 r at most the
/// quantile of chi-square that has the gate's probability. Also the weight of a robust loss, which
/// depends on the same distance.
class Gate {
 public:
  /// Of S, less noise than this vanishes compared with H P H'.
  static constexpr double kVanishing = 1e-13;

  /// `probability` >= 1: all that is finite passes.
  Gate(const System& system, double probability);

  /// NIS and w of a row with r, R and S, and whether it passes: kAccepted, or why not. What lies so
  /// far out that its R / w is not finite does not.
  Outcome Pass(FilterState& f, Row& row);
  /// R <- R / w in R and in S.
  static void Weigh(Row& row);

  double threshold(std::size_t sensor) const { return thresholds_[sensor]; }
  /// Whether it was said that the noise of a sensor vanishes compared with H P H'.
  bool warned(std::size_t sensor) const { return warned_[sensor]; }

 private:
  void CheckConditioning(FilterState& f, const Row& row);

  std::vector<double> thresholds_;  ///< on r' S^-1 r, by sensor
  std::vector<bool> warned_;        ///< by sensor
  Scratch<std::vector<double>> memory_;
};

}  // namespace alidade::internal
