// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/csv_file.h"
#include "alidade/record/column_tables.h"
#include "alidade/record/covariance_file.h"
#include "alidade/record/errors_file.h"
#include "alidade/record/estimate_history.h"
#include "alidade/record/pose_file.h"
#include "alidade/record/recorded_run.h"

namespace alidade::internal {

/// Writer of the files of one estimator to which each frame adds data. The files contain the blocks
/// and the sensors of the initial problem:
///
///   estimates.csv, innovations.csv, gains.csv
///   final_covariance.csv         if a block has a covariance
///   errors.csv                   if a block has a truth
///   reprojection.csv             if a sensor observes landmarks
///   trajectory.tum               if there are blocks X.position and X.orientation
///   trajectory_covariance.tum    if these blocks also have a covariance
///   covariance.bin               if requested
class EstimatorFiles {
 public:
  /// `truth` contains the columns of truth.csv. If `covariances` is true, covariance.bin is also
  /// written.
  EstimatorFiles(const OutputFolder& folder, const EstimatorSpec& spec, const TruthLayout& truth,
                 bool covariances, RunColumns& run_columns);

  /// Writes the rows of a frame. If the frame is older than the state, the estimate and its error
  /// are not written, because they belong to a later timestamp. Error: kIo.
  void Add(const SourceFrame& frame, const State& state, const UpdateReport& report);
  /// Closes all files, writes final_covariance.csv and completes recorded(). Errors: kIo,
  /// kCannotCreate.
  void Close(const OutputFolder& folder, RunColumns& run_columns);
  const RecordedEstimator& recorded() const { return recorded_; }
  /// Returns the description of the files of an estimator, without the number of rows.
  static RecordedEstimator Describe(const EstimatorSpec& spec);
  const EstimateHistory& history() const { return history_; }

 private:
  void OpenEstimates(const OutputFolder& folder, RunColumns& run_columns);
  GainLayout AddGains(const Problem& problem);
  void OpenTrajectory(const OutputFolder& folder, const Problem& problem);
  void AddEstimate(const SourceFrame& frame, const State& state);
  void AddPose(Timestamp timestamp, const State& state);
  void AddInnovation(Timestamp timestamp, const MeasurementReport& report);
  void AddGain(Timestamp timestamp, const State& state, const MeasurementReport& report);

  RecordedEstimator recorded_;
  std::vector<BlockLayout> blocks_;
  std::size_t width_;  ///< number of columns of each of z, h, s and r
  GainLayout gain_layout_;
  EstimateHistory history_;
  std::optional<CsvFile> estimates_, innovations_, gains_, reprojection_;
  std::optional<ErrorsFile> errors_;
  std::optional<PosePlace> pose_;  ///< indices of the blocks of the pose
  std::optional<PoseFile> trajectory_, trajectory_covariance_;
  std::optional<CovarianceFile> final_covariance_;
  std::unique_ptr<OutputFile> covariances_;  ///< covariance.bin; null if not requested
};

}  // namespace alidade::internal
