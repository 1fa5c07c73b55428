// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/record/column_tables.h"

namespace alidade::internal {

/// Writer of `NAME/final_covariance.csv`: the covariance P of the last estimate whose P is finite.
/// The file contains the tangent elements whose variance is above zero.
class CovarianceFile {
 public:
  /// `blocks` are the blocks of the initial problem.
  explicit CovarianceFile(const std::vector<BlockLayout>& blocks);

  /// Retains the covariance of `state` until the next call.
  void Set(const State& state);
  /// Writes the file if a covariance is known. Errors: kCannotCreate, kIo.
  void Write(const OutputFolder& folder, const std::string& estimator, RunColumns& run_columns);

 private:
  std::size_t blocks_;
  std::vector<std::string> names_;           ///< names of all tangent elements
  std::vector<double> lower_, last_finite_;  ///< lower triangles of P, row by row
};

}  // namespace alidade::internal
