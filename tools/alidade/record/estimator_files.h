// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/csv_file.h"
#include "alidade/record/contents.h"
#include "alidade/record/errors_file.h"
#include "alidade/record/pose_file.h"

namespace alidade::internal {

/// The files of one estimator that grow frame by frame: `estimates.csv`, `innovations.csv`,
/// `gains.csv`, of blocks with truth `errors.csv`, of sensors of landmarks `reprojection.csv`, and
/// of blocks X.position and X.orientation `trajectory.tum`, with a covariance
/// `trajectory_covariance.tum`. They hold the blocks and sensors that the problem has from the
/// start.
class EstimatorFiles {
 public:
  /// `truth_columns` names the columns of truth.csv, by truth and element; `covariances` asks for
  /// `covariance.bin` too.
  EstimatorFiles(const OutputFolder& folder, const EstimatorSpec& spec,
                 const std::vector<StreamInfo>& truths,
                 const std::vector<std::vector<std::string>>& truth_columns, bool covariances);

  /// A frame older than the state has no row in estimates.csv: the state is not of its timestamp.
  /// Error: kIo.
  void Add(const SourceFrame& frame, const State& state, const UpdateReport& report);
  void Close();
  const RecordedEstimator& recorded() const { return recorded_; }

 private:
  struct BlockColumns {
    BlockId id;
    std::size_t ambient, tangent;
    std::size_t element;  ///< the first of it in recorded_.elements
    std::size_t sigma;    ///< likewise in recorded_.sigmas
    int truth;            ///< index into SourceFrame::truth, or -1
  };

  static RecordedEstimator Describe(const EstimatorSpec& spec);
  std::vector<std::string> EstimatesHeader(
      const Problem& problem, const std::vector<int>& truth_of,
      const std::vector<std::vector<std::string>>& truth_columns);
  std::vector<std::string> InnovationsHeader() const;
  std::vector<std::string> GainsHeader(const Problem& problem);
  /// The position that landmarks are seen from, among the elements.
  void FindPath(const Problem& problem);
  void OpenTrajectory(const OutputFolder& folder, const Problem& problem);
  void AddEstimate(const SourceFrame& frame, const State& state);
  void AddPose(Timestamp timestamp, const State& state);
  void AddInnovation(Timestamp timestamp, const MeasurementReport& report);
  void AddGain(Timestamp timestamp, const State& state, const MeasurementReport& report);

  RecordedEstimator recorded_;
  std::vector<BlockColumns> blocks_;
  std::size_t gain_columns_ = 0;
  std::vector<Timestamp> measured_;  ///< by sensor, when it did so last
  CsvFile estimates_, innovations_, gains_;
  ErrorsFile errors_;
  std::optional<CsvFile> reprojection_;
  std::optional<PosePlace> pose_;  ///< among the blocks
  std::optional<PoseFile> trajectory_, trajectory_covariance_;
  std::unique_ptr<OutputFile> covariances_;  ///< null: not asked for
};

}  // namespace alidade::internal
