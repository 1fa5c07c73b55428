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

/// Sensors and motion models as estimators see them, whatever they are made of: the struct of an
/// author (direct_models.h) or a plugin.
namespace alidade {

/// The most roles of a sensor, and blocks of a motion model.
inline constexpr int kMaxRoles = ALIDADE_MAX_ROLES;

/// The process of a state that comes with its sensor.
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

/// The output of Initialise of a sensor.
struct InverseModel {
  int role = -1;       ///< the first role, of a landmark the first of it; -1: it has none
  int count = 0;       ///< of roles from there on: those of a landmark together, else one
  int prior_size = 0;  ///< numbers that it needs besides the measurement
};

/// A measurement as a sensor model sees it.
struct Observation {
  const double* z = nullptr;      ///< ambient; null: a prediction alone is asked for
  const double* known = nullptr;  ///< numbers that came with it, of a sensor that takes some
};

/// A sensor z = h(roles) + n, n ~ N(0, L L'). m: tangent size of the measurement. Thread-safe as
/// far as its author made it: each call is const.
class SensorModel {
 public:
  struct Description {
    std::string name;    ///< of the model
    std::string origin;  ///< the plugin file; empty: none
    std::vector<Space> roles;
    Space measurement;
    Space known = {};  ///< numbers that come with each measurement; empty name: none
    InverseModel inverse = {};
    std::map<std::size_t, OwnedRole> owned = {};  ///< by role, if the model says
    bool has_validity = false;                    ///< whether Valid may refuse a measurement
    /// L of R = L L', m x m row-major, in place of the model's; empty: the model's.
    std::vector<double> sqrt_noise = {};
  };
  /// Destinations of an evaluation; null: not wanted.
  struct Output {
    double* h = nullptr;                 ///< ambient
    double* const* jacobians = nullptr;  ///< dh / d role_i, row-major; each may be null
    const int* strides = nullptr;        ///< from row to row of each Jacobian
    double* sqrt_noise = nullptr;        ///< L, m x m row-major
  };
  /// Destinations of the inverse model; null: not wanted.
  struct InverseOutput {
    double* y = nullptr;           ///< ambient
    double* const* jx = nullptr;   ///< dy / d role_i of the other roles, row-major
    const int* strides = nullptr;  ///< from row to row of each jx; null: dense
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
  /// Whether its roles are filled by the landmark that a measurement names.
  bool has_landmark() const;
  /// Of a role with ALIDADE_ROLE_OWNED: the model's own, or constant at the neutral element.
  OwnedRole owned(std::size_t role) const;

  /// h, its Jacobians and L at the roles. kOutOfDomain: h is not defined there, and the outputs are
  /// unspecified. ContractViolation if the known numbers that it takes are missing.
  Status Evaluate(const Observation& seen, const double* const* roles, const Output& out) const {
    ALIDADE_EXPECTS(seen.known != nullptr || known_size_ == 0);
    if (out.sqrt_noise == nullptr || description_.sqrt_noise.empty()) {
      return DoEvaluate(seen, roles, out);
    }
    std::ranges::copy(description_.sqrt_noise, out.sqrt_noise);
    if (out.h == nullptr) return Status::kOk;
    return DoEvaluate(seen, roles, {out.h, out.jacobians, out.strides, nullptr});
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
  /// kInvalid: the measurement is of no use, whatever the state is.
  Status Valid(const Observation& seen) const {
    return description_.has_validity ? DoValid(seen) : Status::kOk;
  }
  /// y = g(other roles, z, prior), the initialised roles one after the other. kInvalid: it needs a
  /// prior. ContractViolation if the sensor has no inverse model.
  Status Initialise(const double* const* roles, const Observation& seen, const double* prior,
                    InverseOutput out) const;
  /// Why its last call in this thread returned kError.
  std::string error_text() const;

 protected:
  explicit SensorModel(Description description);

 private:
  virtual Status DoEvaluate(const Observation& seen, const double* const* roles,
                            const Output& out) const = 0;
  virtual Status DoValid(const Observation& /*seen*/) const { return Status::kOk; }
  virtual Status DoInitialise(const double* const* /*roles*/, const Observation& /*seen*/,
                              const double* /*prior*/, const InverseOutput& /*out*/) const {
    return Status::kError;
  }

  Description description_;
  int known_size_ = 0;
  std::vector<int> tangents_;  ///< of the roles
};

/// A motion model x' = f(x, u, w, dt), w ~ N(0, L L'). n: tangent size of all blocks, n_w of w.
class MotionModel {
 public:
  struct Description {
    std::string name;    ///< of the model
    std::string origin;  ///< the plugin file; empty: none
    std::vector<Space> blocks;
    Space input = {};  ///< the control input; empty name: none
    int noise_size = 0;
    bool stationary = false;      ///< its blocks stay as they are: Step need not be called
    bool discrete_noise = false;  ///< one w is held from an update to the next
    /// L of Qw = L L', n_w x n_w row-major, in place of the model's; empty: the model's.
    std::vector<double> sqrt_noise = {};
  };
  /// Destinations of a step; null: not wanted.
  struct Output {
    double* const* next = nullptr;  ///< x', by block
    double* f = nullptr;            ///< F = dx' / dx, n x n row-major; G has to be wanted too
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

  /// x' with its Jacobians, and L, at the blocks, input u and noise w; w null: zero.
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
  /// Why its last call in this thread returned kError.
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

/// The defect of a prior and dynamics of a role of this geometry; empty: none, and its mean is the
/// neutral element if it had none, normalised if it had one.
std::string CheckOwned(const Geometry& geometry, OwnedRole& owned);

/// Keeps `text` as the error text of a model in this thread, and returns kError.
[[gnu::cold]] Status NoteModelError(const void* model, const std::string& text) noexcept;

}  // namespace internal

}  // namespace alidade
