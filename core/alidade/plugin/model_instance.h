// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alidade/model/plugin_abi.h"
#include "alidade/model/status.h"
#include "alidade/state/manifold.h"

namespace alidade {

namespace detail {
/// A call of that slot has returned ALIDADE_ERROR, or a code that the ABI does not have: kError.
[[gnu::cold]] Status Failed(const void* slot) noexcept;
/// It has thrown, in a call of that slot: kError. What it threw, which is in flight, becomes the
/// error text of its instance in this thread.
[[gnu::cold]] Status Thrown(const void* slot) noexcept;

inline Status ToStatus(std::int32_t code) {
  const bool known = code >= ALIDADE_OK && code < ALIDADE_ERROR;
  return known ? static_cast<Status>(code) : Status::kError;
}

/// The status of `call`, of a model's function in `slot` of its call table. Unless `kGuarded` what
/// it throws goes on to the caller, and of a failure there is no text, which costs less
/// (bench_small_filter): for who then calls it again.
template <bool kGuarded, class Call>
[[gnu::always_inline]] inline Status CallModel(const void* slot, const Call& call) {
  if constexpr (!kGuarded) return ToStatus(call());
  try {
    const Status status = ToStatus(call());
    return status == Status::kError ? Failed(slot) : status;
  } catch (...) {
    return Thrown(slot);
  }
}
/// A measurement as its sensor is shown it, with the known numbers of a sensor that takes any;
/// null: a prediction alone is asked for.
constexpr AlidadeObservation Seen(const double* z, const double* known = nullptr) {
  AlidadeObservation seen{};
  seen.struct_size = sizeof(seen);
  seen.z = z;
  seen.known = known;
  return seen;
}
inline constexpr AlidadeObservation kUnseen = Seen(nullptr);

inline Status CopyNoise(const std::vector<double>& root, double* l) {
  std::copy(root.begin(), root.end(), l);
  return Status::kOk;
}
}  // namespace detail

namespace internal {
/// Destroys the model of `instance`. An exception is a warning.
void DestroyInstance(const AlidadeInstance& instance, const std::string& name,
                     const std::string& plugin) noexcept;
}  // namespace internal

/// How a state that its sensor owns moves.
enum class OwnedDynamics : std::uint32_t {
  kConstant = ALIDADE_STAYS,
  kRandomWalk = ALIDADE_RANDOM_WALK,
  kGaussMarkov = ALIDADE_GAUSS_MARKOV,
};

/// Prior and dynamics of a role that is a state of its sensor, n: its tangent size.
struct OwnedRole {
  std::vector<double> mean;        ///< ambient
  std::vector<double> sqrt_prior;  ///< L of P = L L', n x n row-major; empty: known exactly
  OwnedDynamics dynamics = OwnedDynamics::kConstant;
  std::vector<double> sqrt_density;  ///< L of the driving noise, per sqrt(s); empty: none
  double time_constant_s = 0.0;      ///< of a Gauss-Markov process
};

/// The most roles of a sensor, and blocks of a motion model.
inline constexpr int kMaxRoles = ALIDADE_MAX_ROLES;

/// Owns one instance that a plugin created, and its description as C++ values.
class ModelInstance {
 public:
  /// Takes `instance` over. `name` is the model's, `plugin` the file it came from, for messages.
  /// Errors: kPlugin where the description breaks the rules of plugin_abi.h.
  ModelInstance(const AlidadeInstance& instance, std::string name, std::string plugin);
  ~ModelInstance();
  ModelInstance(const ModelInstance&) = delete;
  ModelInstance& operator=(const ModelInstance&) = delete;

  const AlidadeInstance& c() const { return instance_; }
  const std::string& name() const { return name_; }
  const std::string& plugin() const { return plugin_; }
  const std::vector<Space>& spaces() const { return spaces_; }             ///< roles, or blocks
  const std::vector<std::int32_t>& tangents() const { return tangents_; }  ///< of the spaces
  /// Of a role with ALIDADE_ROLE_OWNED: the model's own, or constant at the neutral element.
  OwnedRole owned(std::size_t role) const;
  /// The measurement of a sensor, the control input of a motion model (empty name: none).
  const Space& space() const { return space_; }
  /// What comes with each measurement and is no state (empty name: nothing).
  const Space& known() const { return known_; }
  bool has_input() const { return description_.input_count > 0; }
  unsigned capabilities() const { return capabilities_; }
  /// Takes L, n x n row-major, in place of the model's noise, while no sensor or motion model has
  /// it: of a sensor R = L L', of a motion model Qw = L L'.
  void GiveNoise(std::vector<double> root);
  /// What GiveNoise took; empty: the noise is the model's.
  const std::vector<double>& given_noise() const { return given_noise_; }
  /// Of its last call in this thread that gave kError.
  std::string error_text() const;

 private:
  void ReadCalls();
  void ReadDescription();
  void CheckSupported() const;
  void ReadRoles();
  void ReadOwned(const AlidadeOwned& owned, const Space& role, std::size_t index);
  Space ReadSpace(const AlidadeSpace& space, const std::string& what) const;
  [[noreturn]] void Refuse(const std::string& why) const;

  AlidadeInstance instance_;  ///< its pointers lead to the copies below
  AlidadeDescription description_{};
  AlidadeSensor sensor_{};
  AlidadeMotion motion_{};
  std::string name_, plugin_;
  std::vector<Space> spaces_;
  std::vector<std::int32_t> tangents_;
  std::map<std::size_t, OwnedRole> owned_;  ///< by role, where the model says
  Space space_, known_;
  std::vector<double> given_noise_;
  unsigned capabilities_ = 0;
};

/// What Initialise of a sensor computes.
struct InverseModel {
  int role = -1;       ///< the first role, of a landmark the first of it; -1: it has none
  int count = 0;       ///< of roles from there on: those of a landmark together, else one
  int prior_size = 0;  ///< numbers that it needs besides the measurement
};

/// A sensor z = h(roles) + n behind the plugin ABI. Cheap to copy; calls as in plugin_abi.h.
/// `known` is what came with the measurement, of a sensor that takes known numbers; null of others.
class SensorModel {
 public:
  explicit SensorModel(std::shared_ptr<const ModelInstance> instance);

  const std::string& name() const { return instance_->name(); }
  const ModelInstance& instance() const { return *instance_; }
  const std::vector<Space>& roles() const { return instance_->spaces(); }
  const Space& measurement() const { return instance_->space(); }
  const InverseModel& inverse() const { return inverse_; }
  /// Whether its roles are filled by the landmark that a measurement names.
  bool has_landmark() const;
  /// The known numbers of a measurement, and how many.
  const Space& known() const { return instance_->known(); }
  int known_size() const { return known_size_; }

  /// z = h(roles), ambient values; kOutOfDomain where h is not defined.
  Status Predict(const double* const* roles, double* z, const double* known = nullptr) const {
    return Linearise(roles, z, nullptr, nullptr, known);
  }
  /// z and jacobians[i] = dz/d role_i, row stride strides[i]; a null jacobian is skipped.
  template <bool kGuarded = true>
  Status Linearise(const double* const* roles, double* z, double* const* jacobians,
                   const int* strides, const double* known = nullptr) const {
    if (known_size_ > 0) return LineariseKnowing(roles, z, jacobians, strides, known);
    return detail::CallModel<kGuarded>(&sensor_->eval, [&] {
      return sensor_->eval(self_, &detail::kUnseen, roles, z, jacobians, strides);
    });
  }
  /// l, row-major m x m, with R = l l': what was given in place of the model's noise, if anything.
  Status SqrtNoise(const double* const* roles, const double* z, double* l,
                   const double* known = nullptr) const {
    return SqrtNoise(roles, detail::Seen(z, known), l);
  }
  /// The same of a measurement as it is shown to the plugin, which takes as long to make as a call.
  template <bool kGuarded = true>
  Status SqrtNoise(const double* const* roles, const AlidadeObservation& seen, double* l) const {
    if (!instance_->given_noise().empty()) return detail::CopyNoise(instance_->given_noise(), l);
    return detail::CallModel<kGuarded>(&sensor_->sqrt_noise, [&] {
      return sensor_->sqrt_noise(self_, &seen, roles, l, measurement().geometry.tangent);
    });
  }
  Status Valid(const double* z, const double* known = nullptr) const {
    return Valid(detail::Seen(z, known));
  }
  template <bool kGuarded = true>
  Status Valid(const AlidadeObservation& seen) const {
    if (sensor_->valid == nullptr) return Status::kOk;
    return detail::CallModel<kGuarded>(&sensor_->valid,
                                       [&] { return sensor_->valid(self_, &seen); });
  }
  /// y = g(other roles, z), dense row-major Jacobians jx[i] = dy/d role_i and jz = dy/dz. kInvalid
  /// where a prior is needed.
  Status Initialise(const double* const* roles, const double* z, double* y, double* const* jx,
                    double* jz, const double* known = nullptr) const {
    return Initialise(roles, z, nullptr, y, jx, jz, nullptr, known);
  }
  /// y = g(other roles, z, prior), the initialised roles one after the other; Jacobians dense and
  /// row-major, jp = dy/d prior; each may be null.
  Status Initialise(const double* const* roles, const double* z, const double* prior, double* y,
                    double* const* jx, double* jz, double* jp, const double* known = nullptr) const;
  std::string error_text() const { return instance_->error_text(); }

 private:
  Status LineariseKnowing(const double* const* roles, double* z, double* const* jacobians,
                          const int* strides, const double* known) const;

  std::shared_ptr<const ModelInstance> instance_;
  const AlidadeSensor* sensor_;
  const void* self_;
  int known_size_ = 0;
  InverseModel inverse_;
};

/// A motion model x' = f(x, u, w, dt) behind the plugin ABI. Cheap to copy.
class MotionModel {
 public:
  explicit MotionModel(std::shared_ptr<const ModelInstance> instance);

  const std::string& name() const { return instance_->name(); }
  const ModelInstance& instance() const { return *instance_; }
  const std::vector<Space>& blocks() const { return instance_->spaces(); }
  int noise_size() const { return noise_size_; }
  /// Its blocks stay as they are, without noise: Step need not be called.
  bool stationary() const { return (instance_->capabilities() & ALIDADE_STATIONARY) != 0; }
  /// Whether w is held over the whole of an interval between updates, or drawn for each step.
  bool discrete_noise() const { return (instance_->capabilities() & ALIDADE_DISCRETE_NOISE) != 0; }
  int tangent_size() const { return tangent_size_; }
  bool has_input() const { return instance_->has_input(); }
  /// The control input, where it has one.
  const Space& input() const { return instance_->space(); }

  /// x', where `w` may be null (zero), F (n x n) and G (n x n_w) dense row-major; F and G may both
  /// be null.
  template <bool kGuarded = true>
  Status Step(const double* const* blocks, const double* input, const double* w, double dt_s,
              double* const* next, double* f, double* g) const {
    return detail::CallModel<kGuarded>(&motion_->step, [&] {
      return motion_->step(self_, blocks, &input, w != nullptr ? w : zero_noise_.data(), dt_s, next,
                           f, tangent_size_, g, noise_size_, nullptr, 0);
    });
  }
  /// l, row-major n_w x n_w, with Qw = l l': what was given in place of the model's, if anything.
  template <bool kGuarded = true>
  Status SqrtQ(const double* const* blocks, const double* input, double dt_s, double* l) const {
    if (!instance_->given_noise().empty()) return detail::CopyNoise(instance_->given_noise(), l);
    return detail::CallModel<kGuarded>(&motion_->sqrt_q, [&] {
      return motion_->sqrt_q(self_, blocks, &input, dt_s, l, noise_size_);
    });
  }
  std::string error_text() const { return instance_->error_text(); }

 private:
  std::shared_ptr<const ModelInstance> instance_;
  const AlidadeMotion* motion_;
  const void* self_;
  int noise_size_ = 0;
  int tangent_size_ = 0;
  std::vector<double> zero_noise_;  ///< so that a model of dynamic noise allocates none in a step
};

}  // namespace alidade
