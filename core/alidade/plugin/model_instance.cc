// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/model_instance.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "alidade/base/error.h"
#include "alidade/io/log.h"
#include "alidade/plugin/abi_read.h"
#include "alidade/state/element_names.h"

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
  if (!elements.empty() && std::ssize(internal::SplitNames(elements)) != space.ambient) {
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
    space.elements = internal::ElementsOf(elements, space.geometry);
    return space;
  }
  for (std::size_t i = 0; i < from.part_count; ++i) {
    const Space part = ToSpace(PartOf(from, i));
    space.parts.push_back(part.name);
    for (const std::string& name : ColumnNames(part.name, part)) space.elements.push_back(name);
  }
  return space;
}

}  // namespace

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
  const auto n = static_cast<std::size_t>(role.geometry.tangent);
  const auto read = [](const double* from, std::size_t size) {
    return from == nullptr ? std::vector<double>() : std::vector<double>(from, from + size);
  };
  OwnedRole own{read(owned.mean, static_cast<std::size_t>(role.geometry.ambient)),
                read(owned.sqrt_prior, n * n), static_cast<OwnedDynamics>(owned.dynamics),
                read(owned.sqrt_density, n * n), owned.time_constant_s};
  const std::string defect = internal::CheckOwned(role.geometry, own);
  if (!defect.empty()) Refuse(what + defect);
  owned_[index] = std::move(own);
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
  if (instance_.error_text == nullptr) return "";
  std::string text;
  const std::string failure =
      internal::ThrownBy([&] { text = ShownText(instance_.error_text(instance_.self)); });
  return failure.empty()
             ? text
             : "error_text of model '" + name_ + "' of plugin " + plugin_ + " threw: " + failure;
}

}  // namespace alidade
