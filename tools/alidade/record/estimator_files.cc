// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/estimator_files.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <utility>

#include "alidade/experiment/frame_innovation.h"
#include "alidade/experiment/reference_metrics.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/state/element_names.h"

namespace alidade::internal {
namespace {

std::string InParentheses(const std::string& unit) {
  return unit.find_first_of("/ ^") == unit.npos ? unit : '(' + unit + ')';
}

/// Returns the unit of the gain from a measurement of `sensor` to a block element with the unit
/// `unit`. Returns "" if the gain has no unit or an unknown unit. The unit is unknown if the
/// measured elements have no common unit.
std::string UnitOfGain(const std::string& unit, const RecordedSensor& sensor) {
  if (unit == sensor.unit) return "";
  if (sensor.unit.empty()) return sensor.tangent == 1 ? unit : "";
  return (unit.empty() ? "1" : InParentheses(unit)) + '/' + InParentheses(sensor.unit);
}

/// Returns the ambient size of the largest measurement.
std::size_t WidestMeasurement(const Problem& problem) {
  int width = 0;
  for (const SensorBinding& binding : problem.sensors) {
    width = std::max(width, binding.model->measurement().geometry.ambient);
  }
  return static_cast<std::size_t>(width);
}

}  // namespace

RecordedEstimator EstimatorFiles::Describe(const EstimatorSpec& spec) {
  RecordedEstimator recorded;
  recorded.name = spec.name;
  recorded.blocks = SeriesBlocksOf(spec.problem);
  for (const SensorBinding& binding : spec.problem.sensors) {
    const Space& space = binding.model->measurement();
    RecordedSensor& sensor = recorded.sensors.emplace_back();
    sensor.name = binding.name;
    sensor.stream = binding.stream;
    sensor.unit = space.unit;
    sensor.tangent = space.geometry.tangent;
    sensor.series = InnovationSeries(binding);
    sensor.has_reprojection = HasReprojection(binding);
  }
  return recorded;
}

EstimatorFiles::EstimatorFiles(const OutputFolder& folder, const EstimatorSpec& spec,
                               const TruthLayout& truth, bool covariances, RunColumns& run_columns)
    : recorded_(Describe(spec)),
      blocks_(BlockLayoutsOf(spec.problem, truth.truths)),
      width_(WidestMeasurement(spec.problem)),
      history_(blocks_) {
  OpenEstimates(folder, run_columns);
  const auto create = [&](const char* file, std::vector<Column> columns) {
    return CreateCsv(folder, spec.name + file, std::move(columns), run_columns);
  };
  std::vector<Column> columns;
  AppendColumns(kInnovationColumns, {width_}, columns);
  innovations_ = create("/innovations.csv", std::exchange(columns, {}));
  gain_layout_ = AddGains(spec.problem);
  AppendColumns(kGainColumns, gain_layout_, columns);
  gains_ = create("/gains.csv", std::exchange(columns, {}));
  if (std::ranges::any_of(recorded_.sensors, &RecordedSensor::has_reprojection)) {
    AppendColumns(kReprojectionColumns, NoLayout{}, columns);
    reprojection_ = create("/reprojection.csv", std::move(columns));
  }
  OpenTrajectory(folder, spec.problem);
  if (covariances) covariances_ = folder.Create(spec.name + "/covariance.bin");
}

void EstimatorFiles::OpenEstimates(const OutputFolder& folder, RunColumns& run_columns) {
  std::vector<Column> columns = {kTimeColumn};
  for (const BlockLayout& block : blocks_) AppendColumns(kEstimateColumns, block, columns);
  estimates_ =
      CreateCsv(folder, recorded_.name + "/estimates.csv", std::move(columns), run_columns);
  errors_.emplace(folder, recorded_.name, blocks_, run_columns);
  final_covariance_.emplace(blocks_);
}

void EstimatorFiles::OpenTrajectory(const OutputFolder& folder, const Problem& problem) {
  pose_ = FindPose(BlocksOf(problem));
  if (!pose_) return;
  trajectory_.emplace(folder, recorded_.name + "/trajectory.tum", *pose_);
  const auto is_constant = [&](std::size_t id) {
    return problem.layout.blocks()[id].status == BlockStatus::kConstant;
  };
  if (is_constant(pose_->position) || is_constant(pose_->orientation)) return;
  trajectory_covariance_.emplace(folder, recorded_.name + "/trajectory_covariance.tum", *pose_,
                                 true);
}

GainLayout EstimatorFiles::AddGains(const Problem& problem) {
  GainLayout layout;
  // Name of a gain -> column. Gains with the same name share a column.
  std::map<std::string, std::size_t> columns;
  for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
    const Space& space = problem.sensors[s].model->measurement();
    if (problem.sensors[s].model->has_landmark()) continue;
    for (const BlockLayout& block : blocks_) {
      if (problem.layout[block.id].status == BlockStatus::kConstant) continue;
      for (const Column& element : TangentColumns(block, "")) {
        const std::string unit = UnitOfGain(element.unit, recorded_.sensors[s]);
        for (const std::string& measured : TangentNames(space.name, space)) {
          const std::string name = element.name + "<-" + measured;
          const auto [column, is_new] = columns.try_emplace(name, columns.size());
          if (is_new) layout.elements.push_back({name, unit, "", block.name});
          recorded_.sensors[s].gain_columns.push_back(column->second);
        }
      }
    }
  }
  return layout;
}

void EstimatorFiles::Add(const SourceFrame& frame, const State& state, const UpdateReport& report) {
  if (!report.stale) {
    AddEstimate(frame, state);
    errors_->Add(frame, state);
    history_.Add(frame, state);
    if (pose_) AddPose(frame.timestamp, state);
  }
  for (const MeasurementReport& measurement : report.measurements()) {
    const int sensor = measurement.sensor;
    if (sensor < 0 || sensor >= static_cast<int>(recorded_.sensors.size())) continue;
    AddInnovation(frame.timestamp, measurement);
    if (!measurement.gain.empty()) AddGain(frame.timestamp, state, measurement);
  }
  for (std::size_t s = 0; s < recorded_.sensors.size(); ++s) {
    if (!recorded_.sensors[s].has_reprojection) continue;
    const FrameInnovation innovation = FrameInnovationOf(report, static_cast<int>(s));
    if (innovation.measurements == 0) continue;
    WriteCells(kReprojectionColumns, NoLayout{},
               {frame.timestamp, recorded_.sensors[s].name, innovation}, *reprojection_);
    reprojection_->EndRow();
  }
}

void EstimatorFiles::AddEstimate(const SourceFrame& frame, const State& state) {
  estimates_->Time(frame.timestamp);
  for (const BlockLayout& block : blocks_) {
    WriteCells(kEstimateColumns, block, {frame, state}, *estimates_);
  }
  estimates_->EndRow();
  final_covariance_->Set(state);
  if (!covariances_) return;
  static_assert(std::endian::native == std::endian::little);
  std::vector<double> cells;
  AppendCovariance(state, blocks_.size(), cells);
  covariances_->Write({reinterpret_cast<const char*>(cells.data()), 8 * cells.size()});
}

void EstimatorFiles::AddPose(Timestamp timestamp, const State& state) {
  const auto position = static_cast<BlockId>(pose_->position);
  const auto orientation = static_cast<BlockId>(pose_->orientation);
  const Block& position_block = state.layout()[position];
  const Block& orientation_block = state.layout()[orientation];
  if (!position_block.present || !orientation_block.present) return;
  trajectory_->Add(timestamp, state.value(position), state.value(orientation));
  if (!trajectory_covariance_ || !position_block.has_covariance() ||
      !orientation_block.has_covariance()) {
    return;
  }
  const auto covariance = [&](const Block& block) {
    const int size = block.geometry().tangent;
    return state.covariance().Block(block.tangent_offset, size, block.tangent_offset, size);
  };
  trajectory_covariance_->Add(timestamp, state.value(position), state.value(orientation),
                              covariance(position_block), covariance(orientation_block));
}

void EstimatorFiles::AddInnovation(Timestamp timestamp, const MeasurementReport& report) {
  const RecordedSensor& sensor = recorded_.sensors[static_cast<std::size_t>(report.sensor)];
  WriteCells(kInnovationColumns, {width_}, {timestamp, sensor, report}, *innovations_);
  innovations_->EndRow();
}

void EstimatorFiles::AddGain(Timestamp timestamp, const State& state,
                             const MeasurementReport& report) {
  const RecordedSensor& sensor = recorded_.sensors[static_cast<std::size_t>(report.sensor)];
  std::vector<const double*> cells(gain_layout_.elements.size(), nullptr);
  const std::size_t rows = report.gain.size() / static_cast<std::size_t>(sensor.tangent);
  std::size_t next = 0;  // index into sensor.gain_columns
  std::size_t row = 0;   // row of K
  for (const BlockLayout& layout : blocks_) {
    const Block& block = state.layout()[layout.id];
    if (block.status == BlockStatus::kConstant) continue;
    for (std::size_t i = 0; i < layout.tangent(); ++i) {
      for (int j = 0; j < sensor.tangent && next < sensor.gain_columns.size(); ++j, ++next) {
        if (!block.present) continue;
        cells[sensor.gain_columns[next]] = &report.gain[row + rows * static_cast<std::size_t>(j)];
      }
      row += block.present ? 1 : 0;
    }
  }
  WriteCells(kGainColumns, gain_layout_, {timestamp, sensor.name, cells}, *gains_);
  gains_->EndRow();
}

void EstimatorFiles::Close(const OutputFolder& folder, RunColumns& run_columns) {
  final_covariance_->Write(folder, recorded_.name, run_columns);
  estimates_->Close();
  innovations_->Close();
  gains_->Close();
  errors_->Close();
  if (trajectory_) trajectory_->Close();
  if (trajectory_covariance_) trajectory_covariance_->Close();
  if (covariances_) covariances_->Close();
  if (reprojection_) reprojection_->Close();
  recorded_.rows = estimates_->rows();
}

}  // namespace alidade::internal
