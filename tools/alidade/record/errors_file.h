// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/column_tables.h"

namespace alidade::internal {

/// Writer of `NAME/errors.csv`. The file exists if the source provides the truth of a block:
///
///   e      = x (-) x_true    of each tangent element, in the tangent space at the estimate
///   sigma  = sqrt(P_ii)      of the estimate; the uncertainty of the truth is not included
///
/// e is computed as -(x_true (-) x), which equals x (-) x_true for vectors, angles and rotations.
/// The error of a rotation is in the body frame, rad.
class ErrorsFile {
 public:
  /// `blocks` are all blocks of the problem. If no block has a truth, the file is not created.
  ErrorsFile(const OutputFolder& folder, const std::string& estimator,
             const std::vector<BlockLayout>& blocks, RunColumns& run_columns);

  /// Writes a row. A cell is empty if the value, the truth or the covariance is unknown. Error:
  /// kIo.
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
