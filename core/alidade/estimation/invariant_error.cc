// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/invariant_error.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/text.h"
#include "alidade/model/euclidean_group.h"
#include "alidade/state/element_names.h"

namespace alidade {
namespace {

using internal::RecordModelError;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using MatrixMap = Eigen::Map<RowMajor>;
using StridedMap = Eigen::Map<RowMajor, 0, Eigen::OuterStride<>>;

/// M(X) and its inverse.
struct Maps {
  RowMajor blocks_from_group, group_from_blocks;
};

/// Computes M(X). X = X^ Exp(xi) moves positions and velocities by R xi, and the rotation by xi.
/// The right error is Ad_X times the left error.
template <class Group>
Maps MapsOf(const double* x, ErrorSide side) {
  constexpr int n = Group::kTangent;
  RowMajor frames(n, n);
  Group::Rotations(x, frames.data());
  if constexpr (n > 3) {
    frames.template block<3, 3>(3, 3).setIdentity();  // both tangents are in the frame of the body
  }
  if (side == ErrorSide::kLeft) return {frames, frames.transpose()};
  std::array<double, Group::kAmbient> inverse;
  RowMajor adjoint(n, n), inverse_adjoint(n, n);
  Group::Inverse(x, inverse.data());
  Group::Adjoint(x, adjoint.data());
  Group::Adjoint(inverse.data(), inverse_adjoint.data());
  return {frames * inverse_adjoint, adjoint * frames.transpose()};
}

/// Group that the blocks of an InvariantError can form.
struct GroupInfo {
  std::vector<Geometry> blocks;
  const char* blocks_text;
  std::uint32_t left, right;  ///< geometries with the left and the right error
  Maps (*maps)(const double* x, ErrorSide side);
};

template <class Group>
GroupInfo InfoOfGroup(std::vector<Geometry> blocks, const char* text) {
  return {std::move(blocks), text, Group::kLeftNumber, Group::kRightNumber, MapsOf<Group>};
}

const std::vector<GroupInfo>& Groups() {
  static const std::vector<GroupInfo> groups{
      InfoOfGroup<Se2>({Geometry::Vector(2), Geometry::Angle()},
                       "a position in the plane and a heading"),
      InfoOfGroup<Se3>({Geometry::Vector(3), Geometry::UnitQuaternion()},
                       "a position and an orientation"),
      InfoOfGroup<Se23>({Geometry::Vector(3), Geometry::UnitQuaternion(), Geometry::Vector(3)},
                        "a position, an orientation and a velocity")};
  return groups;
}

/// Returns the group of the blocks, or null if their geometries are not those of a group.
const GroupInfo* FindGroup(const InvariantError& error, const Problem& problem) {
  std::vector<Geometry> geometries;
  for (const BlockId id : error.blocks) geometries.push_back(problem.layout[id].geometry());
  const auto found = std::ranges::find(Groups(), geometries, &GroupInfo::blocks);
  return found == Groups().end() ? nullptr : &*found;
}

/// Group element that replaces blocks of a problem.
class GroupBlock {
 public:
  GroupBlock(const InvariantError& error, const GroupInfo& info)
      : side_(error.side), info_(&info), ids_(error.blocks) {}

  Geometry geometry() const {
    return Geometry(side_ == ErrorSide::kLeft ? info_->left : info_->right);
  }
  /// Returns the index of a block of the problem in the group, or -1.
  int Find(BlockId id) const {
    const auto found = std::ranges::find(ids_, id);
    return found == ids_.end() ? -1 : static_cast<int>(found - ids_.begin());
  }
  const std::vector<BlockId>& ids() const { return ids_; }
  /// Returns the offset of a block in the values of the group.
  int ValueOffset(int index) const { return Offset(index, &Geometry::ambient); }
  /// Returns the first row of a block in M.
  int Row(int index) const { return Offset(index, &Geometry::tangent); }
  int Rows(int index) const { return info_->blocks[static_cast<std::size_t>(index)].tangent; }
  Maps MapsAt(const double* x) const { return info_->maps(x, side_); }

 private:
  int Offset(int index, int Geometry::*size) const {
    int offset = 0;
    for (int i = 0; i < index; ++i) offset += info_->blocks[static_cast<std::size_t>(i)].*size;
    return offset;
  }

  ErrorSide side_;
  const GroupInfo* info_;
  std::vector<BlockId> ids_;
};

/// Motion model whose first block is the group element. The other blocks follow in the order of the
/// original model.
class InvariantMotion final : public MotionModel {
 public:
  /// `members` contains the index of each block of `model` in the group, or -1.
  InvariantMotion(SharedMotion model, GroupBlock group, std::vector<int> members,
                  const Space& element)
      : MotionModel(Describe(*model, members, element)),
        model_(std::move(model)),
        group_(std::move(group)),
        members_(std::move(members)) {
    std::vector<int> remaining;
    order_.resize(static_cast<std::size_t>(group_.geometry().tangent));
    int row = 0;
    for (std::size_t i = 0; i < members_.size(); ++i) {
      for (int k = 0; k < model_->blocks()[i].geometry.tangent; ++k, ++row) {
        if (members_[i] < 0) {
          remaining.push_back(row);
        } else {
          order_[static_cast<std::size_t>(group_.Row(members_[i])) + static_cast<std::size_t>(k)] =
              row;
        }
      }
    }
    order_.insert(order_.end(), remaining.begin(), remaining.end());
  }

 private:
  static Description Describe(const MotionModel& model, const std::vector<int>& members,
                              const Space& element) {
    Description description = model.description();
    description.blocks = {element};
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (members[i] < 0) description.blocks.push_back(model.blocks()[i]);
    }
    return description;
  }

  /// Returns the pointers to the blocks of the original model.
  template <class Pointer>
  std::array<Pointer, kMaxRoles> BlocksOf(Pointer const* blocks) const {
    std::array<Pointer, kMaxRoles> pointers{};
    int next = 1;
    for (std::size_t i = 0; i < members_.size(); ++i) {
      pointers[i] = members_[i] < 0 ? blocks[next++] : blocks[0] + group_.ValueOffset(members_[i]);
    }
    return pointers;
  }

  Status DoStep(const double* const* blocks, const double* input, const double* w, double dt_s,
                const Output& out) const override {
    const auto model_blocks = BlocksOf(blocks);
    Output model_out = out;
    std::array<double*, kMaxRoles> next{};
    if (out.next != nullptr) {
      next = BlocksOf(out.next);
      model_out.next = next.data();
    }
    const Status status = model_->Step(model_blocks.data(), input, w, dt_s, model_out);
    if (status == Status::kError) return RecordModelError(this, model_->error_text());
    if (status != Status::kOk || out.g == nullptr) return status;
    const RowMajor after = group_.MapsAt(out.next[0]).group_from_blocks;
    MatrixMap g(out.g, tangent_size(), noise_size());
    g = g(order_, Eigen::all).eval();
    g.topRows(after.rows()) = (after * g.topRows(after.rows())).eval();
    if (out.f == nullptr) return status;
    const RowMajor before = group_.MapsAt(blocks[0]).blocks_from_group;
    MatrixMap f(out.f, tangent_size(), tangent_size());
    f = f(order_, order_).eval();
    f.topRows(after.rows()) = (after * f.topRows(after.rows())).eval();
    f.leftCols(before.cols()) = (f.leftCols(before.cols()) * before).eval();
    return status;
  }

  SharedMotion model_;
  GroupBlock group_;
  std::vector<int> members_;
  /// By tangent element of this model: its row in the Jacobians of the original model.
  std::vector<int> order_;
};

/// Role of a sensor model in an InvariantSensor.
struct RoleSource {
  int role;         ///< role of the InvariantSensor; -1: the role has no block
  int member = -1;  ///< index of the block in the group; -1: the block is not in the group
};

/// Sensor model with one role for the group element. Its other roles are those of the original
/// model that have a block.
class InvariantSensor final : public SensorModel {
 public:
  InvariantSensor(SharedSensor sensor, GroupBlock group, std::vector<RoleSource> sources,
                  std::vector<Space> roles, int element_role)
      : SensorModel(Describe(*sensor, sources, std::move(roles))),
        sensor_(std::move(sensor)),
        group_(std::move(group)),
        sources_(std::move(sources)),
        element_role_(static_cast<std::size_t>(element_role)) {}

 private:
  static Description Describe(const SensorModel& sensor, const std::vector<RoleSource>& sources,
                              std::vector<Space> roles) {
    Description description = sensor.description();
    description.owned.clear();
    description.roles = std::move(roles);
    if (description.inverse.role >= 0) {
      const RoleSource& source = sources[static_cast<std::size_t>(description.inverse.role)];
      description.inverse.role = source.role;
      if (source.member >= 0) description.inverse = {};
    }
    return description;
  }

  std::array<const double*, kMaxRoles> RolesOf(const double* const* roles) const {
    std::array<const double*, kMaxRoles> pointers{};
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const auto [role, member] = sources_[i];
      if (role < 0 || roles[role] == nullptr) continue;
      pointers[i] = roles[role] + (member < 0 ? 0 : group_.ValueOffset(member));
    }
    return pointers;
  }

  /// Jacobians of the original model, with `rows` rows. Those of blocks outside the group are
  /// written to the destinations of the caller.
  struct Jacobians {
    std::array<double*, kMaxRoles> pointers{};
    std::array<int, kMaxRoles> strides{};
    std::vector<RowMajor> of_group;  ///< by role: empty unless the block is in the group
  };
  Jacobians Destinations(int rows, double* const* jacobians, const int* strides) const {
    Jacobians destinations;
    destinations.of_group.resize(sources_.size());
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const auto [role, member] = sources_[i];
      if (role < 0 || jacobians[role] == nullptr) continue;
      const int columns = sensor_->roles()[i].geometry.tangent;
      destinations.pointers[i] = jacobians[role];
      destinations.strides[i] = strides == nullptr ? columns : strides[role];
      if (member < 0) continue;
      destinations.of_group[i] = RowMajor::Zero(rows, columns);
      destinations.pointers[i] = destinations.of_group[i].data();
      destinations.strides[i] = columns;
    }
    return destinations;
  }
  /// Computes the Jacobian of the group element, the sum of H M over its blocks.
  void Chain(const Jacobians& inner, int rows, const double* const* roles, double* const* jacobians,
             const int* strides) const {
    double* const data = jacobians[element_role_];
    if (data == nullptr) return;
    const RowMajor map = group_.MapsAt(roles[element_role_]).blocks_from_group;
    const Eigen::Index n = map.cols();
    StridedMap j(data, rows, n,
                 Eigen::OuterStride<>(strides == nullptr ? n : strides[element_role_]));
    j.setZero();
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const int member = sources_[i].member;
      if (member < 0) continue;
      j += inner.of_group[i] * map.middleRows(group_.Row(member), group_.Rows(member));
    }
  }

  Status DoEvaluate(const Observation& observation, const double* const* roles,
                    const Output& out) const override {
    const auto sensor_roles = RolesOf(roles);
    const int m = measurement().geometry.tangent;
    Output sensor_out = out;
    Jacobians inner;
    if (out.jacobians != nullptr) {
      inner = Destinations(m, out.jacobians, out.strides);
      sensor_out.jacobians = inner.pointers.data();
      sensor_out.strides = inner.strides.data();
    }
    const Status status = sensor_->Evaluate(observation, sensor_roles.data(), sensor_out);
    if (status == Status::kError) return RecordModelError(this, sensor_->error_text());
    if (status == Status::kOk && out.jacobians != nullptr) {
      Chain(inner, m, roles, out.jacobians, out.strides);
    }
    return status;
  }
  Status DoValid(const Observation& observation) const override {
    const Status status = sensor_->Valid(observation);
    return status == Status::kError ? RecordModelError(this, sensor_->error_text()) : status;
  }
  Status DoInitialise(const double* const* roles, const Observation& observation,
                      const double* prior, const InverseOutput& out) const override {
    const auto sensor_roles = RolesOf(roles);
    const int rows =
        sensor_->roles()[static_cast<std::size_t>(sensor_->inverse().role)].geometry.tangent;
    InverseOutput sensor_out = out;
    Jacobians inner;
    if (out.jx != nullptr) {
      inner = Destinations(rows, out.jx, out.strides);
      sensor_out.jx = inner.pointers.data();
      sensor_out.strides = inner.strides.data();
    }
    const Status status = sensor_->Initialise(sensor_roles.data(), observation, prior, sensor_out);
    if (status == Status::kError) return RecordModelError(this, sensor_->error_text());
    if (status == Status::kOk && out.jx != nullptr) Chain(inner, rows, roles, out.jx, out.strides);
    return status;
  }

  SharedSensor sensor_;
  GroupBlock group_;
  std::vector<RoleSource> sources_;
  std::size_t element_role_;
};

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
  sensor.model = std::make_shared<InvariantSensor>(sensor.model, group, std::move(sources),
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
  const RowMajor map = group.MapsAt(prior.mean.data()).group_from_blocks;
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
    const RowMajor group_map = group_.MapsAt(element).blocks_from_group;
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
  const std::string& owner = problem.layout[error.blocks.front()].owner;
  const BlockId element_id = result.layout.Declare(owner + '.' + element.name, owner, element);
  for (MotionBinding& motion : result.motions) {
    std::vector<int> members;
    std::vector<BlockId> blocks;
    for (const BlockId id : motion.blocks) {
      members.push_back(group.Find(id));
      if (members.back() < 0) blocks.push_back(new_ids[static_cast<std::size_t>(id)]);
    }
    if (blocks.size() < members.size()) {
      blocks.insert(blocks.begin(), element_id);
      motion.model = std::make_shared<InvariantMotion>(motion.model, group, members, element);
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
