// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/invariant_error.h"

#include <Eigen/Core>
#include <algorithm>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/text.h"
#include "alidade/estimation/invariant_motion.h"
#include "alidade/estimation/invariant_sensor.h"
#include "alidade/state/element_names.h"

namespace alidade {
namespace {

using internal::FindGroup;
using internal::GroupBlock;
using internal::GroupInfo;
using internal::GroupMatrix;
using internal::Groups;
using internal::RoleSource;

/// Returns the space of the group element.
Space ElementOf(const GroupBlock& group, const Problem& problem) {
  Space space;
  space.geometry = group.geometry();
  space.name = space.geometry.name();
  space.unit = problem.layout[group.ids().front()].space.unit;
  space.elements = internal::ElementsOf("", space.geometry);
  return space;
}

/// Replaces the roles of a sensor that are bound to blocks of the group. `new_ids` contains the id
/// of each block of the original problem in the new problem.
void ReplaceRoles(const GroupBlock& group, const Space& element,
                  const std::vector<BlockId>& new_ids, SensorBinding& sensor) {
  const auto member_of = [&](const RoleBinding& role) {
    return role.block < 0 ? -1 : group.Find(role.block);
  };
  const bool has_member = std::ranges::any_of(
      sensor.roles, [&](const RoleBinding& role) { return member_of(role) >= 0; });
  std::vector<RoleSource> sources;
  std::vector<Space> roles;
  std::vector<RoleBinding> bindings;
  int element_role = -1;
  for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
    RoleBinding& binding = sensor.roles[i];
    const int member = member_of(binding), role = static_cast<int>(roles.size());
    if (binding.block >= 0) binding.block = new_ids[static_cast<std::size_t>(binding.block)];
    if (binding.block < 0 || (member >= 0 && element_role >= 0)) {
      sources.push_back({binding.block < 0 ? -1 : element_role, member});
      continue;
    }
    if (member >= 0) element_role = role;
    sources.push_back({role, member});
    bindings.push_back(binding);
    roles.push_back(member < 0 ? sensor.model->roles()[i] : element);
    roles.back().flags = 0;
  }
  if (!has_member) return;
  sensor.roles = std::move(bindings);
  sensor.model = internal::MakeInvariantSensor(sensor.model, group, std::move(sources),
                                               std::move(roles), element_role);
}

/// Returns the initial estimate of the group element.
Prior PriorOf(const GroupBlock& group, const Problem& problem) {
  Prior prior;
  const int n = group.geometry().tangent;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t i = 0; i < group.ids().size(); ++i) {
    const Prior& block = *std::ranges::find(problem.priors, group.ids()[i], &Prior::block);
    prior.mean.insert(prior.mean.end(), block.mean.begin(), block.mean.end());
    const int row = group.Row(static_cast<int>(i)), rows = group.Rows(static_cast<int>(i));
    covariance.block(row, row, rows, rows) = block.covariance;
  }
  const GroupMatrix map = group.MapsAt(prior.mean.data()).group_from_blocks;
  prior.covariance = map * covariance * map.transpose();
  return prior;
}

GroupBlock GroupOf(const InvariantError& error, const Problem& problem) {
  const std::string defect = FindDefect(error, problem);
  if (!defect.empty()) throw Error(ExitCode::kBadConfig, "invariant error: " + defect);
  return {error, *FindGroup(error, problem)};
}

/// Returns, for each block of `problem`, its id in the InvariantProblem. Blocks of the group have
/// the id of the group element, which is the last block.
std::vector<BlockId> NewIds(const GroupBlock& group, const Problem& problem) {
  const auto count = std::ssize(problem.layout.blocks());
  const auto element = static_cast<BlockId>(count - std::ssize(group.ids()));
  std::vector<BlockId> ids;
  BlockId next = 0;
  for (BlockId id = 0; id < count; ++id) ids.push_back(group.Find(id) < 0 ? next++ : element);
  return ids;
}

/// Estimator that estimates a group element, and converts its results to blocks.
class InvariantEstimator final : public Estimator {
 public:
  InvariantEstimator(GroupBlock group, const Problem& problem, std::unique_ptr<Estimator> estimator)
      : group_(std::move(group)),
        ids_(NewIds(group_, problem)),
        layout_(problem.layout),
        estimator_(std::move(estimator)) {
    ConvertState(estimator_->state(), state_);
  }

  void Start(Timestamp timestamp) override {
    estimator_->Start(timestamp);
    ConvertState(estimator_->state(), state_);
  }
  const UpdateReport& Process(const Frame& frame) override {
    const UpdateReport& report = estimator_->Process(frame);
    if (offline()) return report;
    Convert(estimator_->state(), report);
    return report_;
  }
  bool offline() const override { return estimator_->offline(); }
  void Smooth(const Emit& emit) override {
    estimator_->Smooth([&](std::size_t index, const State& state, const UpdateReport& report) {
      Convert(state, report);
      emit(index, state_, report_);
    });
  }
  void StopWhen(const std::function<bool()>& stop) override { estimator_->StopWhen(stop); }
  std::unique_ptr<Estimator> Clone() const override {
    std::unique_ptr<Estimator> copy = estimator_->Clone();
    if (copy == nullptr) return nullptr;
    return std::make_unique<InvariantEstimator>(*this, std::move(copy));
  }
  const State& state() const override { return state_; }
  Timestamp timestamp() const override { return estimator_->timestamp(); }
  bool diverged() const override { return estimator_->diverged(); }
  bool failed() const override { return estimator_->failed(); }

  /// Copies the results of `other`, whose estimator has the copy `copy`.
  InvariantEstimator(const InvariantEstimator& other, std::unique_ptr<Estimator> copy)
      : group_(other.group_),
        ids_(other.ids_),
        layout_(other.layout_),
        estimator_(std::move(copy)),
        state_(other.state_),
        report_(other.report_) {}

 private:
  void Convert(const State& inner, const UpdateReport& report) {
    const Eigen::MatrixXd map = ConvertState(inner, state_);
    report_ = report;
    for (MeasurementReport& entry : report_.measurements()) {
      if (entry.gain.empty()) continue;
      const Eigen::Map<const Eigen::MatrixXd> gain(entry.gain.data(), map.cols(),
                                                   std::ssize(entry.gain) / map.cols());
      const Eigen::MatrixXd converted = map * gain;
      entry.gain = report_.Copy({converted.data(), static_cast<std::size_t>(converted.size())});
    }
  }

  /// Computes the state of the blocks. Returns de/dd of their errors e with respect to the errors d
  /// of `inner`. Rows and columns belong to the blocks with a covariance, in the order of the
  /// layouts.
  Eigen::MatrixXd ConvertState(const State& inner, State& outer) const {
    outer = State(layout_);
    std::vector<int> columns, first_column;  // rows of P; by block: its first column
    for (const Block& block : inner.layout().blocks()) {
      first_column.push_back(static_cast<int>(columns.size()));
      for (int i = 0; block.has_covariance() && i < block.geometry().tangent; ++i) {
        columns.push_back(block.tangent_offset + i);
      }
    }
    const double* const element = inner.value(ids_[static_cast<std::size_t>(group_.ids()[0])]);
    const GroupMatrix group_map = group_.MapsAt(element).blocks_from_group;
    Eigen::MatrixXd map = Eigen::MatrixXd::Zero(std::ssize(columns), std::ssize(columns));
    int row = 0;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      const auto id = static_cast<BlockId>(i);
      const Block& source = inner.layout()[ids_[i]];
      if (!source.present) continue;
      const int member = group_.Find(id), rows = layout_[id].geometry().tangent;
      outer.Add(id, member < 0 ? inner.value(ids_[i]) : element + group_.ValueOffset(member),
                Eigen::MatrixXd::Zero(rows, rows));
      if (!source.has_covariance()) continue;
      const int column = first_column[static_cast<std::size_t>(ids_[i])];
      if (member < 0) {
        map.block(row, column, rows, rows).setIdentity();
      } else {
        map.block(row, column, rows, group_map.cols()) =
            group_map.middleRows(group_.Row(member), rows);
      }
      row += rows;
    }
    const Eigen::MatrixXd p = inner.covariance().Dense()(columns, columns);
    outer.covariance().SetBlock(0, 0, map * p * map.transpose());
    return map;
  }

  GroupBlock group_;
  std::vector<BlockId> ids_;  ///< by block of the problem: block of estimator_
  StateLayout layout_;        ///< layout of the problem, without values
  std::unique_ptr<Estimator> estimator_;
  State state_;
  UpdateReport report_;
};

}  // namespace

std::string FindDefect(const InvariantError& error, const Problem& problem) {
  std::vector<BlockId> sorted = error.blocks;
  std::ranges::sort(sorted);
  if (std::ranges::adjacent_find(sorted) != sorted.end()) return "a block is listed twice";
  if (FindGroup(error, problem) == nullptr) {
    std::vector<std::string> geometries, groups;
    for (const BlockId id : error.blocks) {
      geometries.push_back(ToString(problem.layout[id].geometry()));
    }
    for (const GroupInfo& group : Groups()) groups.emplace_back(group.blocks_text);
    return "blocks with the geometries " + internal::Join(geometries) +
           " do not form a group; the blocks must be, in this order, " +
           internal::Join(groups, "; or ");
  }
  if (problem.landmarks) return "the state has landmarks, which the group would have to contain";
  const auto is_moved_by = [&](const MotionBinding& motion) {
    return std::ranges::all_of(
        error.blocks, [&](BlockId id) { return std::ranges::count(motion.blocks, id) == 1; });
  };
  if (std::ranges::none_of(problem.motions, is_moved_by)) {
    return "the blocks do not belong to one motion model";
  }
  for (const BlockId id : error.blocks) {
    const std::string block = "block '" + problem.layout[id].name + '\'';
    if (problem.layout[id].status != BlockStatus::kEstimated) {
      return block + " is constant or a consider state";
    }
    const auto prior = std::ranges::find(problem.priors, id, &Prior::block);
    if (prior == problem.priors.end() || !prior->sensor.empty()) {
      return block + " starts from a measurement";
    }
    for (const SensorBinding& sensor : problem.sensors) {
      for (const RoleBinding& role : sensor.roles) {
        if (role.block != id) continue;
        if (role.mode != RoleMode::kEstimate) {
          return "sensor '" + sensor.name + "' does not estimate " + block;
        }
        if (role.jacobian_at != JacobianAt::kPrediction) {
          return "sensor '" + sensor.name + "' evaluates the Jacobian of " + block +
                 " at the measurement";
        }
      }
    }
  }
  return {};
}

Problem internal::InvariantProblem(const InvariantError& error, const Problem& problem) {
  const GroupBlock group = GroupOf(error, problem);
  const Space element = ElementOf(group, problem);
  const std::vector<BlockId> new_ids = NewIds(group, problem);
  Problem result = problem;
  result.layout = {};
  for (BlockId id = 0; id < std::ssize(new_ids); ++id) {
    const Block& block = problem.layout[id];
    if (group.Find(id) < 0)
      result.layout.Declare(block.name, block.owner, block.space, block.status);
  }
  std::vector<std::string> names;  // messages report the original blocks
  for (const BlockId id : error.blocks) names.push_back(problem.layout[id].name);
  const BlockId element_id =
      result.layout.Declare(Join(names), problem.layout[error.blocks.front()].owner, element);
  for (MotionBinding& motion : result.motions) {
    std::vector<int> members;
    std::vector<BlockId> blocks;
    for (const BlockId id : motion.blocks) {
      members.push_back(group.Find(id));
      if (members.back() < 0) blocks.push_back(new_ids[static_cast<std::size_t>(id)]);
    }
    if (blocks.size() < members.size()) {
      blocks.insert(blocks.begin(), element_id);
      motion.model = MakeInvariantMotion(motion.model, group, std::move(members), element);
    }
    motion.blocks = std::move(blocks);
  }
  for (SensorBinding& sensor : result.sensors) ReplaceRoles(group, element, new_ids, sensor);
  result.priors.clear();
  for (Prior prior : problem.priors) {
    if (group.Find(prior.block) >= 0) continue;
    prior.block = new_ids[static_cast<std::size_t>(prior.block)];
    result.priors.push_back(std::move(prior));
  }
  result.priors.push_back(PriorOf(group, problem));
  result.priors.back().block = element_id;
  return result;
}

std::unique_ptr<Estimator> MakeInvariant(
    const InvariantError& error, const Problem& problem,
    const std::function<std::unique_ptr<Estimator>(const Problem&)>& make) {
  return std::make_unique<InvariantEstimator>(GroupOf(error, problem), problem,
                                              make(internal::InvariantProblem(error, problem)));
}

}  // namespace alidade
