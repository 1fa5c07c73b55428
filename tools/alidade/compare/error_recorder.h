// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "alidade/compare/over_seeds.h"
#include "alidade/experiment/cramer_rao.h"
#include "alidade/experiment/run.h"

namespace alidade::internal {

/// Follows the errors of one estimator of a run, and of one that knows the past alone the bound
/// that no such estimator is below: CramerRaoBound. Of a long run every n-th timestamp is kept, n a
/// power of two, so that memory does not grow with it.
class ErrorRecorder {
 public:
  static constexpr std::size_t kMost = 2048;  ///< timestamps

  ErrorRecorder(const EstimatorSpec& spec, const Experiment& experiment);
  void Add(const SourceFrame& frame, const State& state);
  ErrorSeries Take();

 private:
  /// A block with truth; its error at the timestamp at hand.
  struct Tracked {
    BlockId id;
    std::size_t truth, owner;
    double truth_variance;
    Eigen::VectorXd error = {};
    bool known = false;
    double bound = 0.0;           ///< tr P of it
    double sum_by_bound = 0.0;    ///< of |e|^2 / tr P over the timestamps that have both
    std::int64_t with_bound = 0;  ///< these
  };

  /// False: there is no bound, and will be none.
  bool AddBound(const SourceFrame& frame);
  /// Appends the timestamp at hand to the series.
  void Keep(Timestamp timestamp, const State& state);
  /// Leaves out every other row.
  void Thin();

  ErrorSeries series_;
  std::vector<Tracked> tracked_;
  std::optional<CramerRaoBound> bound_;
  std::size_t count_ = 0, stride_ = 1;
};

}  // namespace alidade::internal
