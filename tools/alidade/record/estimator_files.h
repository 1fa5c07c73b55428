// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/csv_file.h"
#include "alidade/record/column_tables.h"
#include "alidade/record/contents.h"
#include "alidade/record/errors_file.h"
#include "alidade/record/pose_file.h"

namespace alidade::internal {

/// Writer of the files of one estimator that grow frame by frame: `estimates.csv`,
/// `innovations.csv` and `gains.csv`; `errors.csv` if a block has truth; `reprojection.csv` if a
/// sensor observes landmarks; `trajectory.tum`, and `trajectory_covariance.tum` if both have a
/// covariance, if there are blocks X.position and X.orientation. The files have the blocks and
/// sensors of the initial problem.
class EstimatorFiles {
 public:
  /// `truth` has the columns of truth.csv. Writes `covariance.bin`, too, if `covariances`.
  EstimatorFiles(const OutputFolder& folder, const EstimatorSpec& spec, const TruthLayout& truth,
                 bool covariances, RunColumns& run_columns);

  /// Writes the rows of a frame. A frame older than the state does not get a row in estimates.csv,
  /// because the state has a later timestamp. Error: kIo.
  void Add(const SourceFrame& frame, const State& state, const UpdateReport& report);
  void Close();
  const RecordedEstimator& recorded() const { return recorded_; }

 private:
  struct RecordedBlock {
    BlockLayout layout;
    std::size_t element;  ///< its first index in recorded_.elements
    std::size_t sigma;    ///< its first index in recorded_.sigmas
  };

  static RecordedEstimator Describe(const EstimatorSpec& spec);
  void AddBlocks(const Problem& problem, const TruthLayout& truth);
  /// Finds the elements of the position that sees landmarks.
  void FindPath(const Problem& problem);
  void OpenEstimates(const OutputFolder& folder, RunColumns& run_columns);
  GainLayout AddGains(const Problem& problem);
  void OpenTrajectory(const OutputFolder& folder, const Problem& problem);
  void RecordEstimate(const SourceFrame& frame, const State& state);
  void AddEstimate(const SourceFrame& frame, const State& state);
  void AddPose(Timestamp timestamp, const State& state);
  void AddInnovation(Timestamp timestamp, const MeasurementReport& report);
  void AddGain(Timestamp timestamp, const State& state, const MeasurementReport& report);

  RecordedEstimator recorded_;
  std::vector<RecordedBlock> blocks_;
  GainLayout gain_layout_;
  std::vector<Timestamp> last_measured_;  ///< by sensor
  std::optional<CsvFile> estimates_, innovations_, gains_, reprojection_;
  std::optional<ErrorsFile> errors_;
  std::optional<PosePlace> pose_;  ///< its indices among the blocks
  std::optional<PoseFile> trajectory_, trajectory_covariance_;
  std::unique_ptr<OutputFile> covariances_;  ///< null if it is not written
};

}  // namespace alidade::internal
