// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/column_tables.h"

namespace alidade::internal {

/// Writer of `NAME/errors.csv`, which exists if the source names the truth of a block:
///
///   e      = x (-) x_true    each tangent element, in the tangent space at the estimate, like P
///   sigma  = sqrt(P_ii)      of the estimate only, without the uncertainty of the truth
///
/// e is computed as -(x_true (-) x), which is equal for vectors, angles and rotations. The error of
/// a rotation is in the body frame, rad.
class ErrorsFile {
 public:
  /// `blocks` are all blocks of the problem. Creates no file if no block has a truth.
  ErrorsFile(const OutputFolder& folder, const std::string& estimator,
             const std::vector<BlockLayout>& blocks, RunColumns& run_columns);

  /// Writes a row. A cell is empty if its value, truth or covariance is unknown. Error: kIo.
  void Add(const SourceFrame& frame, const State& state);
  /// Closes the file. Error: kIo.
  void Close();
  const std::vector<RecordedError>& elements() const { return elements_; }

 private:
  void Record(const BlockRow& row);

  std::vector<BlockLayout> blocks_;  ///< only the blocks with truth
  std::vector<RecordedError> elements_;
  std::optional<CsvFile> file_;  ///< empty if no block has a truth
};

}  // namespace alidade::internal
