// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/csv_file.h"
#include "alidade/record/contents.h"

namespace alidade::internal {

/// Whether each tangent element is an angle or of a rotation or direction: in rad.
std::vector<bool> AreAngles(const Geometry& geometry);

/// `NAME/errors.csv`, of an estimator with a block whose truth the source names:
///
///   e      = x (-) x_true    of each tangent element, at the estimate: P's; unit of the element
///   sigma  = sqrt(P_ii)      of the estimate alone
///
/// At the estimate means - (x_true (-) x): the same for vectors, angles and rotations. A rotation
/// has its error in the body, rad.
class ErrorsFile {
 public:
  /// `truth_of` is MatchTruths of the problem's blocks.
  ErrorsFile(const OutputFolder& folder, const std::string& estimator, const Problem& problem,
             const std::vector<int>& truth_of);

  /// A row for each estimate; empty cells where value, truth or P is not known. Error: kIo.
  void Add(const SourceFrame& frame, const State& state);
  void Close();
  const std::vector<RecordedError>& elements() const { return elements_; }

 private:
  struct Tracked {
    BlockId id;
    std::size_t truth, first;  ///< index into SourceFrame::truth; the first of elements_
  };

  std::vector<Tracked> blocks_;
  std::vector<RecordedError> elements_;
  std::optional<CsvFile> file_;  ///< none: no block has a truth
};

}  // namespace alidade::internal
