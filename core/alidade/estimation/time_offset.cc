// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/time_offset.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "alidade/base/all_finite.h"
#include "alidade/base/text.h"

namespace alidade::internal {
namespace {

/// Motion model that changes blocks of a sensor. Its blocks fill `count` roles of the OffsetSensor,
/// from the role `first` on.
struct Mover {
  SharedMotion model;
  int first, count;
  std::vector<bool> is_constant;  ///< by block of the motion model
};

/// Sensor model that evaluates another sensor model at the time t + delta.
class OffsetSensor final : public SensorModel {
 public:
  OffsetSensor(SharedSensor sensor, std::vector<Mover> movers, std::vector<int> role_map,
               std::vector<Space> roles, int offset_role)
      : SensorModel(Describe(*sensor, movers, role_map, std::move(roles))),
        sensor_(std::move(sensor)),
        movers_(std::move(movers)),
        role_map_(std::move(role_map)),
        offset_(offset_role) {
    for (const Mover& mover : movers_) {
      for (const Space& block : mover.model->blocks()) {
        ambient_ += static_cast<std::size_t>(block.geometry.ambient);
      }
      const auto n = static_cast<std::size_t>(mover.model->tangent_size());
      tangent_ += n;
      square_ += n * n;
      noise_ = std::max(noise_, n * static_cast<std::size_t>(mover.model->noise_size()));
    }
  }

 private:
  /// Scratch memory of one call. Later calls in the same thread reuse the memory.
  struct Memory {
    std::vector<double> next, f, g, rate;  ///< x(t + delta), F, G, df/ddelta of all movers
    std::vector<double> shifted, jacobian;
    std::vector<const double*> roles;
    std::vector<double*> jacobians;
    std::vector<int> strides;
  };
  static Memory& MemoryOfThread() {
    static thread_local Memory memory;
    return memory;
  }

  static bool IsMoved(const std::vector<Mover>& movers, int role) {
    return std::ranges::any_of(movers, [&](const Mover& mover) {
      return role >= mover.first && role < mover.first + mover.count;
    });
  }
  bool IsMoved(int role) const { return IsMoved(movers_, role); }

  static Description Describe(const SensorModel& sensor, const std::vector<Mover>& movers,
                              const std::vector<int>& role_map, std::vector<Space> roles) {
    Description description = sensor.description();
    description.owned.clear();
    description.roles = std::move(roles);
    for (Space& role : description.roles) role.flags &= ALIDADE_ROLE_LANDMARK | ALIDADE_ROLE_SHARED;
    int& inverse = description.inverse.role;
    if (inverse >= 0) inverse = role_map[static_cast<std::size_t>(inverse)];
    if (IsMoved(movers, inverse)) description.inverse = {};
    return description;
  }

  /// Computes x' of one mover after dt_s, as the concatenated values of its blocks. Also computes F
  /// if `f` is not null.
  static Status Move(const Mover& mover, const double* const* x, double dt_s, double* next,
                     Memory& memory, double* f) {
    std::array<double*, kMaxRoles> destinations;
    double* destination = next;
    for (std::size_t b = 0; b < mover.model->blocks().size(); ++b) {
      destinations[b] = destination;
      destination += mover.model->blocks()[b].geometry.ambient;
    }
    const int n = mover.model->tangent_size();
    const Status status =
        mover.model->Step(x, nullptr, nullptr, dt_s,
                          {destinations.data(), f, f == nullptr ? nullptr : memory.g.data()});
    int row = 0;
    for (std::size_t b = 0; status == Status::kOk && b < mover.model->blocks().size(); ++b) {
      const Geometry& geometry = mover.model->blocks()[b].geometry;
      geometry.Normalise(destinations[b]);
      if (mover.is_constant[b]) std::copy_n(x[b], geometry.ambient, destinations[b]);
      for (int r = row; r < row + geometry.tangent && mover.is_constant[b] && f != nullptr; ++r) {
        std::fill_n(f + r * n, n, 0.0);
        f[r * n + r] = 1.0;
      }
      row += geometry.tangent;
    }
    return status;
  }

  /// Computes df/ddelta of one mover, in the tangent space at x' = next.
  static Status Differentiate(const Mover& mover, const double* const* x, double dt_s,
                              const double* next, Memory& memory, double* rate) {
    constexpr double kStep = 1e-3;
    const std::array<std::pair<double, double>, 4> points{
        {{-2.0, 1.0 / 12.0}, {-1.0, -2.0 / 3.0}, {1.0, 2.0 / 3.0}, {2.0, -1.0 / 12.0}}};
    std::fill_n(rate, mover.model->tangent_size(), 0.0);
    std::vector<double>& shifted = memory.shifted;
    for (const auto& [steps, weight] : points) {
      const Status status = Move(mover, x, dt_s + steps * kStep, shifted.data(), memory, nullptr);
      if (status != Status::kOk) return status;
      int a = 0, t = 0;
      for (const Space& block : mover.model->blocks()) {
        std::array<double, 64> d;
        double* const difference = block.geometry.tangent <= 64 ? d.data() : memory.jacobian.data();
        block.geometry.Minus(shifted.data() + a, next + a, difference);
        for (int i = 0; i < block.geometry.tangent; ++i) {
          rate[t + i] += weight / kStep * difference[i];
        }
        a += block.geometry.ambient;
        t += block.geometry.tangent;
      }
    }
    return Status::kOk;
  }

  /// Computes the values of the sensor's roles at t + delta. The pointers memory.roles then point
  /// to these values. If `derivatives` is true, also computes F and df/ddelta.
  Status Shift(const double* const* roles, bool derivatives, Memory& memory) const {
    memory.next.resize(ambient_);
    memory.shifted.resize(ambient_);
    memory.rate.resize(tangent_);
    memory.f.resize(square_);
    memory.g.resize(noise_);
    memory.jacobian.resize(std::max(memory.jacobian.size(), tangent_));
    const double dt_s = roles[offset_][0];
    memory.roles.assign(role_map_.size(), nullptr);
    for (std::size_t i = 0; i < role_map_.size(); ++i) {
      if (role_map_[i] >= 0) memory.roles[i] = roles[role_map_[i]];
    }
    double *next = memory.next.data(), *f = memory.f.data(), *rate = memory.rate.data();
    for (const Mover& mover : movers_) {
      const double* const* const x = roles + mover.first;
      Status status = Move(mover, x, dt_s, next, memory, derivatives ? f : nullptr);
      if (status == Status::kOk && derivatives) {
        status = Differentiate(mover, x, dt_s, next, memory, rate);
      }
      if (status == Status::kError) {
        status = RecordModelError(
            this, "motion model '" + mover.model->name() + "': " + mover.model->error_text());
      }
      if (status != Status::kOk) return status;
      for (std::size_t i = 0; i < role_map_.size(); ++i) {
        const int block = role_map_[i] - mover.first;
        if (block < 0 || block >= mover.count) continue;
        memory.roles[i] = next;
        for (int b = 0; b < block; ++b) {
          memory.roles[i] += mover.model->blocks()[static_cast<std::size_t>(b)].geometry.ambient;
        }
      }
      for (const Space& block : mover.model->blocks()) next += block.geometry.ambient;
      const int n = mover.model->tangent_size();
      f += n * n;
      rate += n;
    }
    return Status::kOk;
  }

  /// Sets the destinations of the Jacobians of the sensor, which have m rows. Jacobians of roles
  /// that do not move are written to the destinations of the caller. Jacobians of roles that move
  /// are written to temporary memory.
  void SetJacobianDestinations(int m, double* const* jacobians, const int* strides,
                               Memory& memory) const {
    std::size_t size = 0;
    for (const Space& role : sensor_->roles())
      size += static_cast<std::size_t>(m * role.geometry.tangent);
    memory.jacobian.resize(std::max(memory.jacobian.size(), size));
    memory.jacobians.assign(role_map_.size(), nullptr);
    memory.strides.assign(role_map_.size(), 0);
    double* next = memory.jacobian.data();
    for (std::size_t i = 0; i < role_map_.size(); ++i) {
      const int n = sensor_->roles()[i].geometry.tangent;
      if (role_map_[i] < 0) continue;
      if (IsMoved(role_map_[i])) {
        memory.jacobians[i] = next;
        memory.strides[i] = n;
      } else {
        memory.jacobians[i] = jacobians[role_map_[i]];
        memory.strides[i] = strides[role_map_[i]];
      }
      next += m * n;
    }
  }

  /// Computes J_c = sum_i J_i F_ic for the blocks c of all movers, and J_delta = sum_i J_i
  /// df_i/ddelta. J_i, which has m rows, is the Jacobian of a role i that moves.
  void Chain(int m, double* const* jacobians, const int* strides, const Memory& memory) const {
    const auto output = [&](int role, int columns) {
      return Eigen::Map<RowMajor, 0, Eigen::OuterStride<>>(jacobians[role], m, columns,
                                                           Eigen::OuterStride<>(strides[role]));
    };
    if (jacobians[offset_] != nullptr) output(offset_, 1).setZero();
    const double *f = memory.f.data(), *rate = memory.rate.data();
    for (const Mover& mover : movers_) {
      const std::vector<Space>& blocks = mover.model->blocks();
      const auto tangent = [&](int block) {
        return blocks[static_cast<std::size_t>(block)].geometry.tangent;
      };
      const int n = mover.model->tangent_size();
      for (int c = 0; c < mover.count; ++c) {
        if (jacobians[mover.first + c] != nullptr) output(mover.first + c, tangent(c)).setZero();
      }
      for (std::size_t i = 0; i < role_map_.size(); ++i) {
        const int block = role_map_[i] - mover.first;
        if (block < 0 || block >= mover.count) continue;
        int row = 0;
        for (int b = 0; b < block; ++b) row += tangent(b);
        const Eigen::Map<const RowMajor> j(memory.jacobians[i], m, tangent(block));
        for (int k = 0; k < tangent(block); ++k) {
          if (jacobians[offset_] != nullptr) output(offset_, 1) += j.col(k) * rate[row + k];
          const double* f_row = f + (row + k) * n;
          for (int c = 0; c < mover.count; ++c) {
            const Eigen::Map<const Eigen::RowVectorXd> f_block(f_row, tangent(c));
            if (jacobians[mover.first + c] != nullptr) {
              output(mover.first + c, tangent(c)).noalias() += j.col(k) * f_block;
            }
            f_row += tangent(c);
          }
        }
      }
      f += n * n;
      rate += n;
    }
  }

  Status DoEvaluate(const Observation& observation, const double* const* roles,
                    const Output& out) const override {
    Memory& memory = MemoryOfThread();
    const bool derivatives = out.jacobians != nullptr;
    Status status = Shift(roles, derivatives, memory);
    if (status != Status::kOk) return status;
    const int m = measurement().geometry.tangent;
    Output sensor_output{out.h, nullptr, nullptr, out.sqrt_noise};
    if (derivatives) {
      SetJacobianDestinations(m, out.jacobians, out.strides, memory);
      sensor_output.jacobians = memory.jacobians.data();
      sensor_output.strides = memory.strides.data();
    }
    status = sensor_->Evaluate(observation, memory.roles.data(), sensor_output);
    if (status == Status::kError) status = RecordModelError(this, sensor_->error_text());
    if (status == Status::kOk && derivatives) Chain(m, out.jacobians, out.strides, memory);
    return status;
  }
  Status DoValid(const Observation& observation) const override {
    const Status status = sensor_->Valid(observation);
    return status == Status::kError ? RecordModelError(this, sensor_->error_text()) : status;
  }
  Status DoInitialise(const double* const* roles, const Observation& observation,
                      const double* prior, const InverseOutput& out) const override {
    Memory& memory = MemoryOfThread();
    const bool derivatives = out.jx != nullptr;
    Status status = Shift(roles, derivatives, memory);
    if (status != Status::kOk) return status;
    int rows = 0;
    const auto first = sensor_->roles().begin() + sensor_->inverse().role;
    for (auto role = first; role != first + sensor_->inverse().count; ++role) {
      rows += role->geometry.tangent;
    }
    InverseOutput sensor_output = out;
    if (derivatives) {
      SetJacobianDestinations(rows, out.jx, out.strides, memory);
      sensor_output.jx = memory.jacobians.data();
      sensor_output.strides = memory.strides.data();
    }
    status = sensor_->Initialise(memory.roles.data(), observation, prior, sensor_output);
    if (status == Status::kError) status = RecordModelError(this, sensor_->error_text());
    if (status == Status::kOk && derivatives) Chain(rows, out.jx, out.strides, memory);
    return status;
  }

  SharedSensor sensor_;
  std::vector<Mover> movers_;
  std::vector<int> role_map_;  ///< by role of the sensor: role of this model; -1: no block
  int offset_;
  /// Sizes of the arrays in Memory.
  std::size_t ambient_ = 0, tangent_ = 0, square_ = 0, noise_ = 1;
};

/// Roles of an OffsetSensor: the roles of a sensor, and the blocks of the motion models that move
/// these roles.
struct Arrangement {
  std::vector<Mover> movers;
  std::vector<Space> roles;
  std::vector<RoleBinding> bindings;
  std::vector<int> role_map;  ///< by role of the sensor: index into `roles`, or -1
  int offset = -1;            ///< index of the role that delta fills

  /// Appends a role and returns its index.
  int Add(Space space, RoleBinding binding, const std::string& name) {
    space.name = name;
    roles.push_back(std::move(space));
    bindings.push_back(binding);
    return static_cast<int>(roles.size()) - 1;
  }
};

/// Returns the roles of the OffsetSensor for `model`, which is SensorBinding::model or
/// SensorBinding::xyz.
Arrangement Arrange(const Problem& problem, BlockId offset, const SensorBinding& sensor,
                    const SensorModel& model) {
  Arrangement arrangement;
  arrangement.role_map.assign(model.roles().size(), -1);
  const auto role_of = [&](BlockId block) {
    const auto found = std::ranges::find(sensor.roles, block, &RoleBinding::block);
    return found == sensor.roles.end() ? -1 : static_cast<int>(found - sensor.roles.begin());
  };
  for (const MotionBinding& motion : problem.motions) {
    const bool moves_role =
        !motion.model->stationary() &&
        std::ranges::any_of(motion.blocks, [&](BlockId id) { return role_of(id) >= 0; });
    if (!moves_role) continue;
    arrangement.movers.push_back({motion.model,
                                  static_cast<int>(arrangement.roles.size()),
                                  static_cast<int>(motion.blocks.size()),
                                  {}});
    // Blocks of the motion model that do not fill a role of the sensor have the mode of the first
    // role that the model moves.
    const auto moved =
        std::ranges::find_if(motion.blocks, [&](BlockId id) { return role_of(id) >= 0; });
    const RoleMode mode = sensor.roles[static_cast<std::size_t>(role_of(*moved))].mode;
    for (const BlockId id : motion.blocks) {
      arrangement.movers.back().is_constant.push_back(problem.layout[id].status ==
                                                      BlockStatus::kConstant);
      const int role = role_of(id);
      if (role < 0) {
        arrangement.Add(problem.layout[id].space, RoleBinding{id, mode}, problem.layout[id].name);
        continue;
      }
      const auto index = static_cast<std::size_t>(role);
      arrangement.role_map[index] =
          arrangement.Add(model.roles()[index], sensor.roles[index], model.roles()[index].name);
    }
  }
  for (std::size_t i = 0; i < std::min(sensor.roles.size(), model.roles().size()); ++i) {
    const Space& role = model.roles()[i];
    if (role.landmark() || sensor.roles[i].block < 0 || arrangement.role_map[i] >= 0) continue;
    arrangement.role_map[i] = arrangement.Add(role, sensor.roles[i], role.name);
  }
  arrangement.offset =
      arrangement.Add(problem.layout[offset].space, RoleBinding{offset}, "time_offset");
  for (std::size_t i = 0; i < model.roles().size(); ++i) {
    const Space& role = model.roles()[i];
    if (role.landmark()) arrangement.role_map[i] = arrangement.Add(role, {}, role.name);
  }
  return arrangement;
}

SharedSensor Offset(const SharedSensor& model, Arrangement arrangement) {
  return std::make_shared<OffsetSensor>(model, std::move(arrangement.movers),
                                        std::move(arrangement.role_map),
                                        std::move(arrangement.roles), arrangement.offset);
}

}  // namespace

std::string OffsetInTime(const Problem& problem, BlockId offset, SensorBinding& sensor) {
  Arrangement arrangement = Arrange(problem, offset, sensor, *sensor.model);
  for (const Mover& mover : arrangement.movers) {
    if (mover.model->has_input()) {
      return "the motion model '" + mover.model->name() +
             "', which changes blocks of this sensor, has a control input";
    }
  }
  const auto at_measurement = [](const RoleBinding& role) {
    return role.jacobian_at == JacobianAt::kMeasurement;
  };
  if (std::ranges::any_of(sensor.roles, at_measurement)) {
    return "a role of this sensor has `jacobian_at: measurement`";
  }
  if (arrangement.movers.empty()) {
    return "no motion model changes the blocks of this sensor, so a time offset has no effect";
  }
  if (sensor.xyz) {
    sensor.xyz = Offset(sensor.xyz, Arrange(problem, offset, sensor, *sensor.xyz));
  }
  std::vector<RoleBinding> bindings = std::move(arrangement.bindings);
  sensor.model = Offset(sensor.model, std::move(arrangement));
  sensor.roles = std::move(bindings);
  return {};
}

}  // namespace alidade::internal
