// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "alidade/filter/update_report.h"
#include "alidade/host/source.h"
#include "alidade/state/state.h"

namespace alidade::ceres_batch {

/// One step of one motion model, whose inputs are those from `column` on.
struct Step {
  std::size_t motion;
  double dt_s;
  int column;
  int columns;            ///< inputs before it: of which the state depends on some
  bool begins;            ///< it has inputs of its own, else those that the step before held
  std::vector<double> u;  ///< control input; empty: the model takes none
  RowMajor l;             ///< frozen
};

/// A measurement, as one sensor takes it.
struct Factor {
  int sensor = -1;
  bool xyz = false;  ///< a known landmark: the sensor's model of one that is xyz
  Measurement measurement;
  Outcome outcome = Outcome::kAccepted;
  int row = -1;       ///< of r; -1: not in use, or of a landmark
  int landmark = -1;  ///< index of the one that it sees
  Eigen::MatrixXd l;  ///< frozen
};

/// A factor whose measurement gives a block its first value.
struct FirstValue {
  std::size_t factor;
  BlockId block;
  int column;
};

/// A frame of a CondensedRun: how it is reached, and what was measured.
struct Epoch {
  std::vector<Step> steps;  ///< that lead to it
  std::vector<Factor> factors;
  std::vector<FirstValue> first_values;  ///< after the steps
  UpdateReport report;                   ///< as far as it does not depend on the solution
  bool ends = false;                     ///< no noise goes on being held after it
  int column = 0;  ///< the first of its inputs; of the first epoch 0: the prior's too
};

/// What a frame is at some inputs e: x_k, and S_k where it was asked for (columns of later inputs
/// are zero). About a given trajectory x is that one's, and the linearised state is
/// x (+) (offset + S e).
struct Point {
  std::vector<double> x;
  Eigen::MatrixXd s;
  Eigen::VectorXd offset;
};
using TakePoint = std::function<void(std::size_t frame, const Point&)>;

}  // namespace alidade::ceres_batch
