// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/model/status.h"
#include "alidade/state/manifold.h"

/// Interfaces through which estimators call sensor and motion models. Model structs
/// (direct_models.h) and plugins implement these interfaces.
namespace alidade {

/// Maximum number of roles of a sensor, and of blocks of a motion model.
inline constexpr int kMaxRoles = ALIDADE_MAX_ROLES;

/// Dynamics of a model parameter state of a sensor, such as a bias.
enum class OwnedDynamics : std::uint32_t {
  kConstant = ALIDADE_STAYS,
  kRandomWalk = ALIDADE_RANDOM_WALK,
  kGaussMarkov = ALIDADE_GAUSS_MARKOV,
};

/// Prior and dynamics of a role that is a model parameter state. n: tangent size of the role.
struct OwnedRole {
  std::vector<double> mean;  ///< ambient
  /// L of the prior P = L L', n x n row-major. Empty: the value is known exactly.
  std::vector<double> sqrt_prior;
  OwnedDynamics dynamics = OwnedDynamics::kConstant;
  std::vector<double> sqrt_density;  ///< L of the driving noise density, per sqrt(s); empty: zero
  double time_constant_s = 0.0;      ///< time constant of a Gauss-Markov process
};

/// Roles that the inverse measurement model of a sensor determines (SensorModel::Initialise).
struct InverseModel {
  int role = -1;       ///< first role that the model determines; -1: no inverse model
  int count = 0;       ///< number of roles from `role` on: all roles of a landmark, or one
  int prior_size = 0;  ///< number of prior values that the model needs
};

/// Measurement that is the input of a sensor model.
struct Observation {
  const double* z = nullptr;  ///< ambient; null for a prediction
  /// Known numbers of the measurement. May be null if known_size() is 0.
  const double* known = nullptr;
};

/// Sensor model z = h(roles) + n, n ~ N(0, L L'). m: tangent size of the measurement. All member
/// functions are const. They are thread-safe if the functions of the derived class are thread-safe.
class SensorModel {
 public:
  struct Description {
    std::string name;    ///< name of the model
    std::string origin;  ///< path of the plugin; empty: not from a plugin
    std::vector<Space> roles;
    Space measurement;
    Space known = {};  ///< known numbers of each measurement; not used if the name is empty
    InverseModel inverse = {};
    /// By role: prior and dynamics, if the model defines them.
    std::map<std::size_t, OwnedRole> owned = {};
    bool has_validity = false;  ///< whether Valid may reject a measurement
    /// L of R = L L', m x m row-major, which replaces the L of the model. Empty: the L of the model
    /// is used.
    std::vector<double> sqrt_noise = {};
  };
  /// Destinations of an evaluation. A quantity is not computed if its pointer is null.
  struct Output {
    double* h = nullptr;                 ///< ambient
    double* const* jacobians = nullptr;  ///< dh / d role_i, row-major; each may be null
    const int* strides = nullptr;        ///< distance between the rows of each Jacobian
    double* sqrt_noise = nullptr;        ///< L, m x m row-major
  };
  /// Destinations of the inverse model. A quantity is not computed if its pointer is null.
  struct InverseOutput {
    double* y = nullptr;           ///< ambient
    double* const* jx = nullptr;   ///< dy / d role_i of the other roles, row-major
    const int* strides = nullptr;  ///< distance between the rows of each jx; null: dense
    double* jz = nullptr;          ///< dy / dz, row-major
    double* jp = nullptr;          ///< dy / d prior, row-major
  };

  virtual ~SensorModel();
  SensorModel(const SensorModel&) = delete;
  SensorModel& operator=(const SensorModel&) = delete;

  const Description& description() const { return description_; }
  const std::string& name() const { return description_.name; }
  const std::vector<Space>& roles() const { return description_.roles; }
  const Space& measurement() const { return description_.measurement; }
  const Space& known() const { return description_.known; }
  int known_size() const { return known_size_; }
  const InverseModel& inverse() const { return description_.inverse; }
  /// Returns whether the sensor measures landmarks, so that some of its roles belong to a landmark.
  bool has_landmark() const;
  /// Returns the prior and dynamics of a role with the flag ALIDADE_ROLE_OWNED. If the model does
  /// not define them, returns an exactly known constant at the neutral element.
  OwnedRole owned(std::size_t role) const;

  /// Computes h, its Jacobians and L at the values of the roles. Returns kOutOfDomain if h is not
  /// defined at these values; the outputs are then unspecified. ContractViolation if the known
  /// numbers are missing.
  Status Evaluate(const Observation& observation, const double* const* roles,
                  const Output& out) const {
    ALIDADE_EXPECTS(observation.known != nullptr || known_size_ == 0);
    if (out.sqrt_noise == nullptr || description_.sqrt_noise.empty()) {
      return DoEvaluate(observation, roles, out);
    }
    std::ranges::copy(description_.sqrt_noise, out.sqrt_noise);
    if (out.h == nullptr) return Status::kOk;
    return DoEvaluate(observation, roles, {out.h, out.jacobians, out.strides, nullptr});
  }
  Status Predict(const double* const* roles, double* h, const double* known = nullptr) const {
    return Evaluate({nullptr, known}, roles, {.h = h});
  }
  Status Linearise(const double* const* roles, double* h, double* const* jacobians,
                   const int* strides, const double* known = nullptr) const {
    return Evaluate({nullptr, known}, roles, {h, jacobians, strides, nullptr});
  }
  Status SqrtNoise(const double* const* roles, const double* z, double* l,
                   const double* known = nullptr) const {
    return Evaluate({z, known}, roles, {.sqrt_noise = l});
  }
  /// Returns kInvalid if the measurement cannot be used, whatever the state is.
  Status Valid(const Observation& observation) const {
    return description_.has_validity ? DoValid(observation) : Status::kOk;
  }
  /// Computes y = g(other roles, z, prior), the concatenated values of the initialised roles.
  /// Returns kInvalid if a required prior is missing. ContractViolation if the sensor does not have
  /// an inverse model.
  Status Initialise(const double* const* roles, const Observation& observation, const double* prior,
                    InverseOutput out) const;
  /// Returns the reason why the last call in this thread returned kError.
  std::string error_text() const;

 protected:
  explicit SensorModel(Description description);

 private:
  virtual Status DoEvaluate(const Observation& observation, const double* const* roles,
                            const Output& out) const = 0;
  virtual Status DoValid(const Observation& /*observation*/) const { return Status::kOk; }
  virtual Status DoInitialise(const double* const* /*roles*/, const Observation& /*observation*/,
                              const double* /*prior*/, const InverseOutput& /*out*/) const {
    return Status::kError;
  }

  Description description_;
  int known_size_ = 0;
  std::vector<int> tangents_;  ///< tangent sizes of the roles
};

/// Motion model x' = f(x, u, w, dt), w ~ N(0, L L'). n: total tangent size of the blocks, n_w: size
/// of w.
class MotionModel {
 public:
  struct Description {
    std::string name;    ///< name of the model
    std::string origin;  ///< path of the plugin; empty: not from a plugin
    std::vector<Space> blocks;
    Space input = {};  ///< the control input; not used if the name is empty
    int noise_size = 0;
    bool stationary = false;      ///< the blocks never change: Step need not be called
    bool discrete_noise = false;  ///< w is constant from one update to the next
    /// L of Qw = L L', n_w x n_w row-major, which replaces the L of the model. Empty: the L of the
    /// model is used.
    std::vector<double> sqrt_noise = {};
  };
  /// Destinations of a step. A quantity is not computed if its pointer is null.
  struct Output {
    double* const* next = nullptr;  ///< by block: x'
    double* f = nullptr;            ///< F = dx' / dx, n x n row-major; computed only with g
    double* g = nullptr;            ///< G = dx' / dw, n x n_w row-major
    double* sqrt_q = nullptr;       ///< L, n_w x n_w row-major
  };

  virtual ~MotionModel();
  MotionModel(const MotionModel&) = delete;
  MotionModel& operator=(const MotionModel&) = delete;

  const Description& description() const { return description_; }
  const std::string& name() const { return description_.name; }
  const std::vector<Space>& blocks() const { return description_.blocks; }
  int noise_size() const { return description_.noise_size; }
  int tangent_size() const { return tangent_size_; }
  bool stationary() const { return description_.stationary; }
  bool discrete_noise() const { return description_.discrete_noise; }
  bool has_input() const { return !description_.input.name.empty(); }
  const Space& input() const { return description_.input; }

  /// Computes x', its Jacobians and L for the control input u and the noise w. A null pointer w
  /// means that w is 0.
  Status Step(const double* const* blocks, const double* input, const double* w, double dt_s,
              const Output& out) const {
    if (w == nullptr) w = zero_noise_.data();
    if (out.sqrt_q == nullptr || description_.sqrt_noise.empty()) {
      return DoStep(blocks, input, w, dt_s, out);
    }
    std::ranges::copy(description_.sqrt_noise, out.sqrt_q);
    if (out.next == nullptr) return Status::kOk;
    return DoStep(blocks, input, w, dt_s, {out.next, out.f, out.g, nullptr});
  }
  Status SqrtQ(const double* const* blocks, const double* input, double dt_s, double* l) const {
    return Step(blocks, input, nullptr, dt_s, {.sqrt_q = l});
  }
  /// Returns the reason why the last call in this thread returned kError.
  std::string error_text() const;

 protected:
  explicit MotionModel(Description description);

 private:
  virtual Status DoStep(const double* const* blocks, const double* input, const double* w,
                        double dt_s, const Output& out) const = 0;

  Description description_;
  int tangent_size_ = 0;
  std::vector<double> zero_noise_;
};

using SharedSensor = std::shared_ptr<const SensorModel>;
using SharedMotion = std::shared_ptr<const MotionModel>;

namespace internal {

/// Checks the prior and dynamics of a role with this geometry. Returns the defect, or "" if they
/// are valid. Sets a missing mean to the neutral element, and normalises a given mean.
std::string CheckOwned(const Geometry& geometry, OwnedRole& owned);

/// Records `text` as the last error text of a model in this thread, and returns kError.
[[gnu::cold]] Status RecordModelError(const void* model, const std::string& text) noexcept;

}  // namespace internal

}  // namespace alidade
