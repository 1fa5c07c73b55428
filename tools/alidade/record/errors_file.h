// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/column_tables.h"

namespace alidade::internal {

/// `NAME/errors.csv`, for an estimator with a block whose truth the source names:
///
///   e      = x (-) x_true    of each tangent element, in the tangent at the estimate, as P
///   sigma  = sqrt(P_ii)      of the estimate alone
///
/// e is -(x_true (-) x): the same for vectors, angles and rotations. The error of a rotation is in
/// the body frame, rad.
class ErrorsFile {
 public:
  /// `blocks` are those of the problem.
  ErrorsFile(const OutputFolder& folder, const std::string& estimator,
             const std::vector<BlockLayout>& blocks, RunColumns& run_columns);

  /// Writes a row. Cells are empty while value, truth or P is unknown. Error: kIo.
  void Add(const SourceFrame& frame, const State& state);
  void Close();
  const std::vector<RecordedError>& elements() const { return elements_; }

 private:
  void Record(const BlockRow& row);

  std::vector<BlockLayout> blocks_;  ///< those with truth
  std::vector<RecordedError> elements_;
  std::optional<CsvFile> file_;  ///< none if no block has a truth
};

}  // namespace alidade::internal
