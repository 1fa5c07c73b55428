// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/problem_index.h"

#include "alidade/base/error.h"

namespace alidade::internal {
namespace {

/// Appends a role with the offsets of its block. Known roles have no columns in H.
void AddRole(SensorPlace& place, const Block& block, bool is_known, bool is_consider) {
  place.values.push_back(block.value_offset);
  place.is_known.push_back(is_known ? 1 : 0);
  place.columns.push_back(-1);
  if (is_known || block.tangent_offset < 0) return;
  const int size = block.geometry().tangent;
  place.columns.back() = place.width;
  place.parts.push_back({block.tangent_offset, size, place.width});
  place.is_consider.push_back(is_consider);
  place.has_consider |= is_consider;
  for (int k = 0; k < size; ++k) place.rows.push_back(block.tangent_offset + k);
  place.width += size;
}

SensorPlace PlaceOf(const SensorBinding& sensor, const State& initial) {
  SensorPlace place;
  place.binding = &sensor;
  place.ambient = sensor.model->measurement().geometry.ambient;
  place.known_size = sensor.model->known_size();
  place.dof = sensor.model->measurement().geometry.tangent;
  place.has_landmark = sensor.model->has_landmark();
  for (const RoleBinding& role : sensor.roles) {
    place.linearises_at_measurement |=
        role.block >= 0 && role.jacobian_at == JacobianAt::kMeasurement;
    const Block block = role.block < 0 ? Block{} : initial.layout()[role.block];
    AddRole(place, block, role.mode == RoleMode::kKnown, role.mode == RoleMode::kConsider);
  }
  place.strides.assign(sensor.roles.size(), place.width);
  return place;
}

/// Appends the range of a block with this geometry and this offset in x. If the block and the
/// previous range are adjacent vectors, extends the previous range.
void AddRange(std::vector<MotionPlace::ValueRange>& ranges, const Geometry& geometry, int offset) {
  const bool is_curved = !geometry.is_vector();
  const bool is_adjacent = !ranges.empty() && !is_curved && ranges.back().geometry == nullptr &&
                           ranges.back().offset + ranges.back().size == offset;
  if (is_adjacent) {
    ranges.back().size += geometry.ambient;
  } else {
    ranges.push_back({offset, geometry.ambient, is_curved ? &geometry : nullptr});
  }
}

MotionPlace PlaceOf(const MotionBinding& motion, const StateLayout& layout) {
  MotionPlace place;
  place.holds = motion.model->discrete_noise() && motion.model->noise_size() > 0;
  for (std::size_t i = 0; i < motion.blocks.size(); ++i) {
    const Block& block = layout[motion.blocks[i]];
    const Geometry& geometry = motion.model->blocks()[i].geometry;
    const int size = geometry.tangent, offset = block.tangent_offset;
    place.values.push_back(block.value_offset);
    AddRange(place.block_ranges, geometry, block.value_offset);
    if (block.status != BlockStatus::kConstant) {
      AddRange(place.non_constant_ranges, geometry, block.value_offset);
    }
    for (int k = 0; k < size; ++k) {
      place.at.push_back(offset < 0 ? -1 : offset + k);
      if (offset < 0) continue;
      place.rows.push_back(offset + k);
      place.present.push_back(static_cast<int>(place.at.size()) - 1);
    }
  }
  return place;
}

}  // namespace

void SensorPlace::PutLandmark(std::size_t first, const StateLayout& layout,
                              const std::vector<BlockId>& blocks) {
  values.resize(first);
  is_known.resize(first);
  columns.resize(first);
  for (const BlockId id : blocks) AddRole(*this, layout[id], false, false);
  strides.assign(values.size(), width);
}

ProblemIndex::ProblemIndex(Problem indexed_problem, const std::vector<StreamInfo>& source_streams)
    : problem(std::move(indexed_problem)),
      streams(source_streams),
      initial(problem.InitialState(true)),
      stream_of_sensor(problem.sensors.size(), -1) {
  for (const SensorBinding& sensor : problem.sensors) {
    sensor_places.push_back(PlaceOf(sensor, initial));
    sensor_places.back().sensor = static_cast<int>(sensor_places.size()) - 1;
    has_consider |= sensor_places.back().has_consider;
  }
  for (const MotionBinding& motion : problem.motions) {
    motion_places.push_back(PlaceOf(motion, initial.layout()));
  }
  for (std::size_t i = 0; i < problem.sensors.size(); ++i) {
    for (std::size_t s = 0; s < streams.size(); ++s) {
      if (streams[s].name != problem.sensors[i].stream) continue;
      ALIDADE_EXPECTS(streams[s].size == problem.sensors[i].model->measurement().geometry.ambient);
      ALIDADE_EXPECTS(streams[s].known == problem.sensors[i].model->known_size());
      stream_of_sensor[i] = static_cast<int>(s);
    }
  }
}

}  // namespace alidade::internal
