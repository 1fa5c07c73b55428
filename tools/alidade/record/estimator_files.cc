// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/estimator_files.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "alidade/experiment/frame_innovation.h"
#include "alidade/experiment/reference_metrics.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/state/element_names.h"

namespace alidade::internal {
namespace {

std::string InParentheses(const std::string& unit) {
  return unit.find_first_of("/ ^") == unit.npos ? unit : '(' + unit + ')';
}

/// Of an element of that unit for one of a measurement; "" where it has none. A sensor of several
/// elements without a unit may have one for each.
std::string UnitOfGain(const std::string& unit, const RecordedSensor& sensor) {
  if (unit == sensor.unit) return "";
  if (sensor.unit.empty()) return sensor.tangent == 1 ? unit : "";
  return (unit.empty() ? "1" : InParentheses(unit)) + '/' + InParentheses(sensor.unit);
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
    sensor.has_landmark = sensor.has_several = binding.model->has_landmark();
    recorded.width = std::max(recorded.width, space.geometry.ambient);
  }
  return recorded;
}

EstimatorFiles::EstimatorFiles(const OutputFolder& folder, const EstimatorSpec& spec,
                               const std::vector<StreamInfo>& truths,
                               const std::vector<std::vector<std::string>>& truth_columns,
                               bool covariances)
    : recorded_(Describe(spec)),
      estimates_(
          folder, spec.name + "/estimates.csv",
          EstimatesHeader(spec.problem, MatchTruths(spec.problem.layout, truths), truth_columns)),
      innovations_(folder, spec.name + "/innovations.csv", InnovationsHeader()),
      gains_(folder, spec.name + "/gains.csv", GainsHeader(spec.problem)),
      errors_(folder, spec.name, spec.problem, MatchTruths(spec.problem.layout, truths)) {
  measured_.assign(spec.problem.sensors.size(), kNoTimestamp);
  FindPath(spec.problem);
  OpenTrajectory(folder, spec.problem);
  if (covariances) covariances_ = folder.Create(spec.name + "/covariance.bin");
  if (std::ranges::any_of(spec.problem.sensors, HasReprojection)) {
    reprojection_.emplace(folder, spec.name + "/reprojection.csv",
                          std::vector<std::string>{"t_s", "sensor", "landmarks", "rms"});
  }
}

void EstimatorFiles::OpenTrajectory(const OutputFolder& folder, const Problem& problem) {
  pose_ = FindPose(BlocksOf(problem));
  if (!pose_) return;
  trajectory_.emplace(folder, recorded_.name + "/trajectory.tum", *pose_);
  const auto constant = [&](std::size_t id) {
    return problem.layout.blocks()[id].status == BlockStatus::kConstant;
  };
  if (constant(pose_->position) || constant(pose_->orientation)) return;
  trajectory_covariance_.emplace(folder, recorded_.name + "/trajectory_covariance.tum", *pose_,
                                 true);
}

void EstimatorFiles::FindPath(const Problem& problem) {
  for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
    recorded_.sensors[s].has_reprojection = HasReprojection(problem.sensors[s]);
  }
  const BlockId path = PositionBlockOf(problem);
  for (const BlockColumns& columns : blocks_) {
    if (columns.id == path) recorded_.path = static_cast<int>(columns.element);
  }
}

std::vector<std::string> EstimatorFiles::EstimatesHeader(
    const Problem& problem, const std::vector<int>& truth_of,
    const std::vector<std::vector<std::string>>& truth_columns) {
  std::vector<std::string> header = {"t_s"};
  for (BlockId id = 0; id < static_cast<int>(problem.layout.blocks().size()); ++id) {
    const Block& block = problem.layout[id];
    const std::vector<std::string> names = AmbientNames(block.name, block.space);
    const std::vector<std::string> tangents = TangentNames(block.name, block.space);
    const int truth = truth_of[static_cast<std::size_t>(id)];
    blocks_.push_back({id, names.size(), tangents.size(), recorded_.elements.size(),
                       recorded_.sigmas.size(), truth});
    const std::vector<bool> angles = AreAngles(block.geometry());
    for (std::size_t i = 0; i < tangents.size(); ++i) {
      recorded_.sigmas.push_back({tangents[i], angles[i] ? "rad" : UnitOf(problem, id)});
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      recorded_.elements.push_back({names[i], UnitOf(problem, id), names == tangents,
                                    truth >= 0 ? truth_columns[truth][i] : ""});
    }
    header.insert(header.end(), names.begin(), names.end());
    for (const std::string& name : tangents) header.push_back("sigma:" + name);
  }
  return header;
}

std::vector<std::string> EstimatorFiles::InnovationsHeader() const {
  std::vector<std::string> header = {"t_s",     "stream", "sensor", "landmark",
                                     "outcome", "dof",    "nis"};
  for (const char* what : {"z", "h", "s", "r"}) {
    for (int i = 0; i < recorded_.width; ++i) header.push_back(what + std::to_string(i));
  }
  return header;
}

std::vector<std::string> EstimatorFiles::GainsHeader(const Problem& problem) {
  std::vector<std::string> header = {"t_s", "sensor"};
  std::map<std::string, std::size_t> known;  // sensors that measure alike share columns
  for (std::size_t s = 0; s < problem.sensors.size(); ++s) {
    const Space& space = problem.sensors[s].model->measurement();
    if (problem.sensors[s].model->has_landmark()) continue;
    for (const BlockColumns& columns : blocks_) {
      const Block& block = problem.layout[columns.id];
      if (block.status == BlockStatus::kConstant) continue;
      for (std::size_t i = 0; i < columns.tangent; ++i) {
        const RecordedSigma& element = recorded_.sigmas[columns.sigma + i];
        for (const std::string& measured : TangentNames(space.name, space)) {
          const std::string name = element.name + "<-" + measured;
          const auto [cell, is_new] = known.try_emplace(name, known.size());
          if (is_new) header.push_back(name);
          recorded_.sensors[s].gains.push_back(
              {name, UnitOfGain(element.unit, recorded_.sensors[s]), cell->second});
        }
      }
    }
  }
  gain_columns_ = header.size() - 2;
  return header;
}

void EstimatorFiles::Add(const SourceFrame& frame, const State& state, const UpdateReport& report) {
  if (!report.stale) {
    AddEstimate(frame, state);
    errors_.Add(frame, state);
    if (pose_) AddPose(frame.timestamp, state);
  }
  for (const MeasurementReport& one : report.measurements()) {
    if (one.sensor < 0 || one.sensor >= static_cast<int>(recorded_.sensors.size())) continue;
    AddInnovation(frame.timestamp, one);
    if (!one.gain.empty()) AddGain(frame.timestamp, state, one);
  }
  for (std::size_t s = 0; s < recorded_.sensors.size(); ++s) {
    if (!recorded_.sensors[s].has_reprojection) continue;
    const FrameInnovation innovation = FrameInnovationOf(report, static_cast<int>(s));
    if (innovation.measurements == 0) continue;
    reprojection_->Time(frame.timestamp).Text(recorded_.sensors[s].name);
    reprojection_->Integer(innovation.measurements).Number(innovation.rms).EndRow();
  }
}

void EstimatorFiles::AddEstimate(const SourceFrame& frame, const State& state) {
  estimates_.Time(frame.timestamp);
  for (const BlockColumns& columns : blocks_) {
    const Block& block = state.layout()[columns.id];
    if (!block.present) {
      estimates_.Empty(columns.ambient + columns.tangent);
      continue;
    }
    estimates_.Numbers(state.value(columns.id), columns.ambient, columns.ambient);
    const auto truth = static_cast<std::size_t>(columns.truth);
    const bool known = truth < frame.truth.size() && !frame.truth[truth].empty();
    for (std::size_t i = 0; i < columns.ambient; ++i) {
      RecordedElement& element = recorded_.elements[columns.element + i];
      element.has_value = true;
      element.varies = element.varies || block.status != BlockStatus::kConstant;
      element.has_truth = element.has_truth || known;
    }
    if (!block.has_covariance()) {
      estimates_.Empty(columns.tangent);
      continue;
    }
    for (std::size_t i = 0; i < columns.tangent; ++i) {
      const double variance =
          state.covariance().Variance(block.tangent_offset + static_cast<int>(i));
      estimates_.Number(std::sqrt(variance));
      if (!(variance > 0.0)) continue;
      recorded_.sigmas[columns.sigma + i].is_random = true;
      RecordedElement& element = recorded_.elements[columns.element + i];
      if (element.has_sigma) element.is_random = true;
    }
  }
  estimates_.EndRow();
  if (!covariances_) return;
  static_assert(std::endian::native == std::endian::little);
  std::vector<double> cells;
  AppendCovariance(state, blocks_.size(), cells);
  covariances_->Write({reinterpret_cast<const char*>(cells.data()), 8 * cells.size()});
}

void EstimatorFiles::AddPose(Timestamp timestamp, const State& state) {
  const auto position = static_cast<BlockId>(pose_->position);
  const auto orientation = static_cast<BlockId>(pose_->orientation);
  const Block& at = state.layout()[position];
  const Block& turned = state.layout()[orientation];
  if (!at.present || !turned.present) return;
  trajectory_->Add(timestamp, state.value(position), state.value(orientation));
  if (!trajectory_covariance_ || !at.has_covariance() || !turned.has_covariance()) return;
  const auto covariance = [&](const Block& block) {
    const int size = block.geometry().tangent;
    return state.covariance().Block(block.tangent_offset, size, block.tangent_offset, size);
  };
  trajectory_covariance_->Add(timestamp, state.value(position), state.value(orientation),
                              covariance(at), covariance(turned));
}

void EstimatorFiles::AddInnovation(Timestamp timestamp, const MeasurementReport& report) {
  RecordedSensor& sensor = recorded_.sensors[static_cast<std::size_t>(report.sensor)];
  const auto width = static_cast<std::size_t>(recorded_.width);
  innovations_.Time(timestamp).Text(sensor.stream).Text(sensor.name).Landmark(report.landmark);
  innovations_.Text(ToString(report.outcome)).Integer(report.dof);
  const bool reached = !report.s.empty();
  if (reached) {
    innovations_.Number(report.nis);
  } else {
    innovations_.Empty();
  }
  std::vector<double> sigma;
  const auto m = static_cast<std::size_t>(report.dof);
  for (std::size_t i = 0; i < m && reached; ++i) sigma.push_back(std::sqrt(report.s[i * m + i]));
  innovations_.Numbers(report.z.data(), report.z.size(), width)
      .Numbers(report.h.data(), report.h.size(), width)
      .Numbers(sigma.data(), sigma.size(), width)
      .Numbers(report.innovation.data(), report.innovation.size(), width)
      .EndRow();
  sensor.has_innovations = sensor.has_innovations || (reached && !report.innovation.empty());
  Timestamp& before = measured_[static_cast<std::size_t>(report.sensor)];
  sensor.has_several = sensor.has_several || before == timestamp;
  before = timestamp;
}

void EstimatorFiles::AddGain(Timestamp timestamp, const State& state,
                             const MeasurementReport& report) {
  RecordedSensor& sensor = recorded_.sensors[static_cast<std::size_t>(report.sensor)];
  std::vector<const double*> cells(gain_columns_, nullptr);
  const std::size_t rows = report.gain.size() / static_cast<std::size_t>(sensor.tangent);
  std::size_t next = 0;  // of sensor.gains, which lists blocks, elements, measured elements
  std::size_t row = 0;   // of K
  for (const BlockColumns& columns : blocks_) {
    if (state.layout()[columns.id].status == BlockStatus::kConstant) continue;
    const bool present = state.layout()[columns.id].present;
    for (std::size_t i = 0; i < columns.tangent; ++i) {
      for (int j = 0; j < sensor.tangent && next < sensor.gains.size(); ++j, ++next) {
        if (!present) continue;
        const double& k = report.gain[row + rows * static_cast<std::size_t>(j)];
        RecordedGain& gain = sensor.gains[next];
        cells[gain.cell] = &k;
        gain.used = gain.used || k != 0.0;
      }
      row += present ? 1 : 0;
    }
  }
  gains_.Time(timestamp).Text(sensor.name);
  for (const double* cell : cells) {
    if (cell != nullptr) {
      gains_.Number(*cell);
    } else {
      gains_.Empty();
    }
  }
  gains_.EndRow();
}

void EstimatorFiles::Close() {
  estimates_.Close();
  innovations_.Close();
  gains_.Close();
  errors_.Close();
  recorded_.errors = errors_.elements();
  if (trajectory_) trajectory_->Close();
  if (trajectory_covariance_) trajectory_covariance_->Close();
  if (covariances_) covariances_->Close();
  if (reprojection_) {
    reprojection_->Close();
    recorded_.reprojection_rows = reprojection_->rows();
  }
  recorded_.estimate_rows = estimates_.rows();
  recorded_.innovation_rows = innovations_.rows();
  recorded_.gain_rows = gains_.rows();
}

}  // namespace alidade::internal
