// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/model_instance.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/io/log.h"
#include "alidade/plugin/abi_read.h"

namespace alidade {
namespace {

using internal::ReadPrefix;
using internal::ShownText;
using internal::Text;

constexpr int kMaxSize = ALIDADE_MAX_SIZE;
constexpr std::uint32_t kKnownRoleFlags = ALIDADE_ROLE_OPTIONAL | ALIDADE_ROLE_OWNED |
                                          ALIDADE_ROLE_LANDMARK | ALIDADE_ROLE_SHARED |
                                          ALIDADE_ROLE_CLONE;
constexpr std::uint32_t kKnownCapabilities = ALIDADE_CAN_INITIALISE | ALIDADE_HAS_VALIDITY |
                                             ALIDADE_RESIDUAL_ONLY | ALIDADE_NEEDS_PAYLOAD |
                                             ALIDADE_DISCRETE_NOISE;
constexpr const char* kUnsupported = ", which this version does not support";
constexpr const char* kReserved = "uses reserved members";

AlidadeSpace PartOf(const AlidadeSpace& space, std::size_t i) {
  return internal::ReadEntry(space.parts, space.part_stride, i);
}

Geometry GeometryOf(const AlidadeSpace& space) {
  if (space.geometry != ALIDADE_PRODUCT) {
    return {static_cast<GeometryKind>(space.geometry), space.ambient, space.tangent};
  }
  std::vector<Geometry> parts;
  for (std::size_t i = 0; i < space.part_count; ++i) parts.push_back(GeometryOf(PartOf(space, i)));
  return Geometry::Product(std::move(parts));
}

/// Whether the sizes are those of a geometry that this version knows.
bool KnownGeometry(const AlidadeSpace& space) {
  const auto is = [&](const Geometry& g) {
    return space.ambient == g.ambient && space.tangent == g.tangent;
  };
  switch (space.geometry) {
    case ALIDADE_VECTOR:
      return space.ambient >= 1 && space.ambient <= kMaxSize && space.tangent == space.ambient;
    case ALIDADE_ANGLE:
      return is(Geometry::Angle());
    case ALIDADE_UNIT_QUATERNION:
      return is(Geometry::UnitQuaternion());
    case ALIDADE_UNIT_VECTOR:
      return is(Geometry::UnitVector());
    case ALIDADE_PRODUCT:
      return space.ambient <= kMaxSize && is(GeometryOf(space));
    default:
      return false;
  }
}

std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> parts{""};
  for (const char c : text) {
    if (c == ',') {
      parts.emplace_back();
    } else if (c != ' ') {
      parts.back() += c;
    }
  }
  return parts;
}

/// Names of the elements where the model gives none.
std::vector<std::string> DefaultElements(const AlidadeSpace& space) {
  if (space.ambient == 1) return {""};
  if (space.geometry == ALIDADE_UNIT_QUATERNION) return {"w", "x", "y", "z"};
  if (space.geometry == ALIDADE_UNIT_VECTOR) return {"x", "y", "z"};
  std::vector<std::string> names;
  for (int i = 0; i < space.ambient; ++i) names.push_back(std::to_string(i));
  return names;
}

/// What is wrong with `space`, or "".
std::string Defect(const AlidadeSpace& space);

/// The same of the parts of one.
std::string DefectOfParts(const AlidadeSpace& space) {
  const bool is_product = space.geometry == ALIDADE_PRODUCT;
  if (!is_product && (space.parts != nullptr || space.part_count != 0)) {
    return "has parts, but is no product";
  }
  if (!is_product) return {};
  if (space.parts == nullptr || space.part_count < 1 || space.part_count > ALIDADE_MAX_ROLES ||
      !internal::GoodStride<AlidadeSpace>(space.part_stride)) {
    return "does not describe the parts of its product";
  }
  if (!Text(space.elements).empty()) return "names its elements, which are those of its parts";
  for (std::size_t i = 0; i < space.part_count; ++i) {
    const AlidadeSpace part = PartOf(space, i);
    const std::string which = "has a part '" + ShownText(part.name) + "' that ";
    if (part.geometry == ALIDADE_PRODUCT) return which + "is a product";
    if (part.flags != 0) return which + "has flags";
    const std::string defect = Defect(part);
    if (!defect.empty()) return which + defect;
    for (std::size_t j = 0; j < i; ++j) {
      if (Text(PartOf(space, j).name) == Text(part.name)) return "has two parts of one name";
    }
  }
  return {};
}

std::string Defect(const AlidadeSpace& space) {
  if (Text(space.name).empty()) return "has no name";
  if (!internal::GoodName(space.name)) return "has a name that is none";
  const std::pair<const char*, const char*> texts[] = {
      {"unit", space.unit}, {"elements", space.elements}, {"doc", space.doc}};
  for (const auto& [what, text] : texts) {
    const std::string defect = internal::TextDefect(text);
    if (!defect.empty()) return std::string("has a text '") + what + "' that " + defect;
  }
  const std::string unknown = internal::UnknownBits(space.flags, kKnownRoleFlags);
  if (!unknown.empty()) return "has flags that this version does not know: " + unknown;
  if (space.reserved0 != 0 || !internal::AllZero(space.reserved)) return kReserved;
  if (std::string defect = DefectOfParts(space); !defect.empty()) return defect;
  if (!KnownGeometry(space)) {
    return "has geometry " + std::to_string(space.geometry) + " with sizes " +
           std::to_string(space.ambient) + " and " + std::to_string(space.tangent) +
           ", which this version does not know";
  }
  const std::string elements = Text(space.elements);
  if (!elements.empty() && std::ssize(SplitAtCommas(elements)) != space.ambient) {
    return "names its elements '" + elements + "', but has " + std::to_string(space.ambient);
  }
  if ((space.flags & ALIDADE_ROLE_SHARED) != 0 && (space.flags & ALIDADE_ROLE_LANDMARK) == 0) {
    return "is shared, but not a landmark's";
  }
  if ((space.flags & ALIDADE_ROLE_CLONE) != 0) {
    return std::string("is of an earlier timestamp") + kUnsupported;
  }
  if (space.owned != nullptr && (space.flags & ALIDADE_ROLE_OWNED) == 0) {
    return "has a prior and dynamics, but is no state of its model";
  }
  return {};
}

Space ToSpace(const AlidadeSpace& from) {
  Space space;
  space.name = Text(from.name);
  space.unit = Text(from.unit);
  space.doc = Text(from.doc);
  const std::string elements = Text(from.elements);
  space.geometry = GeometryOf(from);
  space.flags = from.flags;
  if (from.geometry != ALIDADE_PRODUCT) {
    space.elements = elements.empty() ? DefaultElements(from) : SplitAtCommas(elements);
    return space;
  }
  for (std::size_t i = 0; i < from.part_count; ++i) {
    const Space part = ToSpace(PartOf(from, i));
    space.parts.push_back(part.name);
    for (const std::string& name : ColumnNames(part.name, part)) space.elements.push_back(name);
  }
  return space;
}

/// A call that failed: what it threw, where it did.
struct FailedCall {
  const void* slot;
  std::optional<std::string> thrown;
};

/// The last of this thread, each of another slot; the last one is the latest.
thread_local std::vector<FailedCall> failed_calls;

/// The author's name of the function in that slot; null if the slot is not of this instance.
const char* NameOfCall(const AlidadeInstance& c, const void* slot) {
  if (c.sensor != nullptr) {
    if (slot == &c.sensor->eval) return "Predict";
    if (slot == &c.sensor->sqrt_noise) return "SqrtNoise";
    if (slot == &c.sensor->valid) return "Valid";
    if (slot == &c.sensor->initialise) return "Initialise";
  }
  if (c.motion != nullptr) {
    if (slot == &c.motion->step) return "Step";
    if (slot == &c.motion->sqrt_q) return "SqrtQ";
  }
  return nullptr;
}

/// Without memory for it, it is one that says nothing.
void NoteFailure(const void* slot, std::optional<std::string> thrown) noexcept {
  constexpr std::size_t kMost = 64;
  try {
    std::erase_if(failed_calls, [&](const FailedCall& call) { return call.slot == slot; });
    if (failed_calls.size() == kMost) failed_calls.erase(failed_calls.begin());
    failed_calls.push_back({slot, std::move(thrown)});
  } catch (const std::bad_alloc&) {
  }
}

}  // namespace

Status detail::Failed(const void* slot) noexcept {
  NoteFailure(slot, std::nullopt);
  return Status::kError;
}

Status detail::Thrown(const void* slot) noexcept {
  NoteFailure(slot, internal::ThrownBy([] { throw; }));
  return Status::kError;
}

void internal::DestroyInstance(const AlidadeInstance& instance, const std::string& name,
                               const std::string& plugin) noexcept {
  const std::string thrown = ThrownBy([&] { instance.destroy(instance.self); });
  if (thrown.empty()) return;
  Log(LogLevel::kWarning,
      "Destroy of model '" + name + "' of plugin " + plugin + " threw: " + thrown);
}

ModelInstance::ModelInstance(const AlidadeInstance& instance, std::string name, std::string plugin)
    : instance_(ReadPrefix(&instance)), name_(std::move(name)), plugin_(std::move(plugin)) {
  if (instance_.self == nullptr || instance_.destroy == nullptr) {
    Refuse("was created without an object or without a way to destroy it");
  }
  try {
    if (!internal::AllZero(instance_.reserved)) Refuse(kReserved);
    ReadCalls();
    ReadDescription();
  } catch (...) {
    internal::DestroyInstance(instance_, name_, plugin_);
    throw;
  }
}

ModelInstance::~ModelInstance() { internal::DestroyInstance(instance_, name_, plugin_); }

void ModelInstance::Refuse(const std::string& why) const {
  throw Error(ExitCode::kPlugin, ErrorLine({plugin_}, {}, "model '" + name_ + "' " + why));
}

void ModelInstance::ReadCalls() {
  if (instance_.kind == ALIDADE_KIND_SENSOR && instance_.sensor != nullptr) {
    sensor_ = ReadPrefix(instance_.sensor);
    instance_.sensor = &sensor_;
    if (!internal::AllZero(sensor_.reserved)) Refuse(kReserved);
  } else if (instance_.kind == ALIDADE_KIND_MOTION && instance_.motion != nullptr) {
    motion_ = ReadPrefix(instance_.motion);
    instance_.motion = &motion_;
    if (!internal::AllZero(motion_.reserved)) Refuse(kReserved);
    if (motion_.step == nullptr || motion_.sqrt_q == nullptr) {
      Refuse("lacks a function that every motion model must have: step, sqrt_q");
    }
  } else {
    Refuse("is of kind " + std::to_string(instance_.kind) + " or lacks the functions of its kind");
  }
}

void ModelInstance::ReadDescription() {
  if (instance_.description == nullptr) Refuse("has no description");
  description_ = ReadPrefix(instance_.description);
  instance_.description = &description_;
  capabilities_ = description_.capabilities;
  CheckSupported();
  ReadRoles();
  const bool is_sensor = instance_.kind == ALIDADE_KIND_SENSOR;
  if (is_sensor) {
    if (description_.output == nullptr) Refuse("does not describe its measurement");
    space_ = ReadSpace(ReadPrefix(description_.output), "the measurement");
    if (description_.known != nullptr) {
      known_ = ReadSpace(ReadPrefix(description_.known), "what comes with a measurement");
      if (known_.geometry.kind != GeometryKind::kVector) {
        Refuse(": what comes with a measurement is no vector");
      }
    }
  } else if (has_input()) {
    space_ = ReadSpace(ReadPrefix(description_.inputs), "the control input");
    if (space_.geometry.kind == GeometryKind::kProduct) Refuse(": the control input is a product");
  }
  const int y = description_.initialise_role;
  if (is_sensor && (capabilities_ & ALIDADE_CAN_INITIALISE) != 0 &&
      (y < 0 || y >= std::ssize(spaces_) || sensor_.initialise == nullptr)) {
    Refuse("says that it can initialise, but not what or how");
  }
  if (is_sensor && (description_.prior_count < 0 || description_.prior_count > kMaxSize)) {
    Refuse("states a prior of size " + std::to_string(description_.prior_count));
  }
  if (!is_sensor && (description_.noise_count < 0 || description_.noise_count > kMaxSize)) {
    Refuse("states a noise of size " + std::to_string(description_.noise_count));
  }
}

/// Refuses what has to be understood and is not, and what is understood but not done.
void ModelInstance::CheckSupported() const {
  const bool is_sensor = instance_.kind == ALIDADE_KIND_SENSOR;
  const std::string unknown = internal::UnknownBits(capabilities_, kKnownCapabilities);
  if (!unknown.empty()) Refuse("has capabilities that this version does not know: " + unknown);
  if (description_.reserved0 != 0 || !internal::AllZero(description_.reserved)) Refuse(kReserved);
  if ((capabilities_ & ALIDADE_RESIDUAL_ONLY) != 0 || description_.residual != nullptr) {
    Refuse(std::string("gives a residual alone") + kUnsupported);
  }
  if ((capabilities_ & ALIDADE_NEEDS_PAYLOAD) != 0) {
    Refuse(std::string("needs what comes beside a measurement") + kUnsupported);
  }
  if (is_sensor) {
    if (sensor_.eval == nullptr || sensor_.sqrt_noise == nullptr) {
      Refuse("lacks a function that every sensor must have: eval, sqrt_noise");
    }
  } else if (description_.input_count > 1) {
    Refuse("has " + std::to_string(description_.input_count) + " control inputs" + kUnsupported);
  } else if (description_.input_count == 1 &&
             (description_.inputs == nullptr ||
              !internal::GoodStride<AlidadeSpace>(description_.input_stride))) {
    Refuse("does not describe its control input");
  }
}

void ModelInstance::ReadRoles() {
  const int count = static_cast<int>(std::min<std::uint32_t>(description_.role_count, 1 << 16));
  if (count < 1 || count > kMaxRoles || description_.roles == nullptr) {
    Refuse("has " + std::to_string(count) + " roles; 1 to 64 are allowed");
  }
  if (!internal::GoodStride<AlidadeSpace>(description_.role_stride)) {
    Refuse("states a role stride of " + std::to_string(description_.role_stride) + " bytes");
  }
  for (int i = 0; i < count; ++i) {
    const auto role = internal::ReadEntry(description_.roles, description_.role_stride, i);
    spaces_.push_back(ReadSpace(role, "role '" + ShownText(role.name) + "'"));
    if (role.owned != nullptr) {
      ReadOwned(ReadPrefix(role.owned), spaces_.back(), static_cast<std::size_t>(i));
    }
    if (role.geometry == ALIDADE_PRODUCT) {
      Refuse(": role '" + spaces_.back().name + "' is a product: each part is a role of its own");
    }
    tangents_.push_back(role.tangent);
    const auto same = [&](const Space& other) { return other.name == spaces_.back().name; };
    if (std::count_if(spaces_.begin(), spaces_.end(), same) > 1) {
      Refuse("has two roles named '" + spaces_.back().name + "'");
    }
  }
}

void ModelInstance::ReadOwned(const AlidadeOwned& owned, const Space& role, std::size_t index) {
  const std::string what = ": the prior or dynamics of role '" + role.name + "' ";
  if (instance_.kind != ALIDADE_KIND_SENSOR) Refuse(what + "are a motion model's own affair");
  if (role.landmark()) Refuse(what + "are those of a landmark");
  if (!internal::AllZero(owned.reserved)) Refuse(kReserved);
  if (owned.dynamics > ALIDADE_GAUSS_MARKOV) {
    Refuse(what + "are of kind " + std::to_string(owned.dynamics));
  }
  const bool returns = owned.dynamics == ALIDADE_GAUSS_MARKOV;
  const auto n = static_cast<std::size_t>(role.geometry.tangent);
  const auto read = [](const double* from, std::size_t size) {
    return from == nullptr ? std::vector<double>() : std::vector<double>(from, from + size);
  };
  OwnedRole known{read(owned.mean, static_cast<std::size_t>(role.geometry.ambient)),
                  read(owned.sqrt_prior, n * n), static_cast<OwnedDynamics>(owned.dynamics),
                  read(owned.sqrt_density, n * n), returns ? owned.time_constant_s : 0.0};
  if (known.mean.empty()) known.mean = this->owned(index).mean;
  const bool finite = internal::AllFinite(known.mean) && internal::AllFinite(known.sqrt_prior) &&
                      internal::AllFinite(known.sqrt_density) &&
                      std::isfinite(known.time_constant_s);
  if (!finite) Refuse(what + "are not finite");
  if (DistanceFrom(role.geometry, known.mean.data()) > kUnitTolerance) {
    Refuse(what + "have a mean that is not of unit length");
  }
  role.geometry.Normalise(known.mean.data());
  if (returns && !(known.time_constant_s > 0.0))
    Refuse(what + "have a time constant of 0 s or less");
  owned_[index] = std::move(known);
}

OwnedRole ModelInstance::owned(std::size_t role) const {
  if (const auto found = owned_.find(role); found != owned_.end()) return found->second;
  OwnedRole neutral;
  const Geometry& geometry = spaces_[role].geometry;
  neutral.mean.resize(static_cast<std::size_t>(geometry.ambient));
  geometry.Identity(neutral.mean.data());
  return neutral;
}

void ModelInstance::GiveNoise(std::vector<double> root) {
  const bool sensor = instance_.kind == ALIDADE_KIND_SENSOR;
  const int n = sensor ? space_.geometry.tangent : description_.noise_count;
  ALIDADE_EXPECTS(std::ssize(root) == std::ptrdiff_t{n} * n);
  given_noise_ = std::move(root);
}

Space ModelInstance::ReadSpace(const AlidadeSpace& space, const std::string& what) const {
  const std::string defect = Defect(space);
  if (!defect.empty()) Refuse(": " + what + ' ' + defect);
  return ToSpace(space);
}

std::string ModelInstance::error_text() const {
  const auto of_this = [&](const FailedCall& call) {
    return NameOfCall(instance_, call.slot) != nullptr;
  };
  const auto last = std::find_if(failed_calls.rbegin(), failed_calls.rend(), of_this);
  if (last != failed_calls.rend() && last->thrown) {
    return std::string(NameOfCall(instance_, last->slot)) + " of model '" + name_ + "' of plugin " +
           plugin_ + " threw: " + *last->thrown;
  }
  if (instance_.error_text == nullptr) return "";
  std::string text;
  const std::string failure =
      internal::ThrownBy([&] { text = ShownText(instance_.error_text(instance_.self)); });
  return failure.empty()
             ? text
             : "error_text of model '" + name_ + "' of plugin " + plugin_ + " threw: " + failure;
}

SensorModel::SensorModel(std::shared_ptr<const ModelInstance> instance)
    : instance_(std::move(instance)), sensor_(instance_->c().sensor), self_(instance_->c().self) {
  ALIDADE_EXPECTS(instance_->c().kind == ALIDADE_KIND_SENSOR);
  if (!known().name.empty()) known_size_ = known().geometry.ambient;
  if ((instance_->capabilities() & ALIDADE_CAN_INITIALISE) != 0) {
    const AlidadeDescription& description = *instance_->c().description;
    inverse_.role = description.initialise_role;
    inverse_.prior_size = description.prior_count;
    const auto is_landmark = [&](int i) {
      return i < std::ssize(roles()) && roles()[static_cast<std::size_t>(i)].landmark();
    };
    inverse_.count = 1;
    while (is_landmark(inverse_.role) && is_landmark(inverse_.role + inverse_.count))
      ++inverse_.count;
  }
}

bool SensorModel::has_landmark() const {
  return std::any_of(roles().begin(), roles().end(), [](const Space& r) { return r.landmark(); });
}

Status SensorModel::LineariseKnowing(const double* const* roles, double* z,
                                     double* const* jacobians, const int* strides,
                                     const double* known) const {
  ALIDADE_EXPECTS(known != nullptr);
  const AlidadeObservation seen = detail::Seen(nullptr, known);
  return detail::CallModel<true>(
      &sensor_->eval, [&] { return sensor_->eval(self_, &seen, roles, z, jacobians, strides); });
}

Status SensorModel::Initialise(const double* const* roles, const double* z, const double* prior,
                               double* y, double* const* jx, double* jz, double* jp,
                               const double* known) const {
  ALIDADE_EXPECTS(inverse_.role >= 0);
  const AlidadeObservation seen = detail::Seen(z, known);
  return detail::CallModel<true>(&sensor_->initialise, [&] {
    return sensor_->initialise(self_, &seen, roles, prior, y, jx, instance_->tangents().data(), jz,
                               measurement().geometry.tangent, jp, inverse_.prior_size);
  });
}

MotionModel::MotionModel(std::shared_ptr<const ModelInstance> instance)
    : instance_(std::move(instance)), motion_(instance_->c().motion), self_(instance_->c().self) {
  ALIDADE_EXPECTS(instance_->c().kind == ALIDADE_KIND_MOTION);
  noise_size_ = instance_->c().description->noise_count;
  for (const std::int32_t tangent : instance_->tangents()) tangent_size_ += tangent;
  zero_noise_.assign(static_cast<std::size_t>(noise_size_) + 1, 0.0);
}

}  // namespace alidade
