// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/record/column_tables.h"

namespace alidade::internal {

/// Writer of `NAME/errors.csv`. The file exists if the source provides the truth of a block. It
/// contains these numbers for each tangent element, and the NEES for each owner:
///
///   e      = x (-) x_true    error, in the tangent space at the estimate
///   sigma  = sqrt(P_ii)      standard deviation of the estimate, without that of the truth
///   nees   = e' C^-1 e / n   of the n elements of all blocks of the owner, see JointNees
///
/// e is computed as -(x_true (-) x), which equals x (-) x_true for vectors, angles and rotations.
/// The error of a rotation is expressed in the body frame, in rad.
class ErrorsFile {
 public:
  /// `blocks` contains all blocks of the problem. If no block has a truth, the file is not created.
  ErrorsFile(const OutputFolder& folder, const std::string& estimator,
             const std::vector<BlockLayout>& blocks, RunColumns& run_columns);

  /// Writes a row. A cell is empty if the value, the truth or the covariance is unknown. Error:
  /// kIo.
  void Add(const SourceFrame& frame, const State& state);
  /// Closes the file. Error: kIo.
  void Close();

 private:
  void AddOwner(const BlockLayout& block);

  std::vector<BlockLayout> blocks_;  ///< blocks that have a truth
  std::vector<OwnerLayout> owners_;
  std::optional<CsvFile> file_;  ///< empty if no block has a truth
};

}  // namespace alidade::internal
