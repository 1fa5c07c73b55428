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

using internal::PrintableText;
using internal::ReadPrefix;
using internal::Text;

constexpr int kMaxSize = ALIDADE_MAX_SIZE;
constexpr std::uint32_t kKnownRoleFlags = ALIDADE_ROLE_OPTIONAL | ALIDADE_ROLE_OWNED |
                                          ALIDADE_ROLE_LANDMARK | ALIDADE_ROLE_SHARED |
                                          ALIDADE_ROLE_CLONE;
constexpr std::uint32_t kKnownCapabilities = ALIDADE_CAN_INITIALISE | ALIDADE_HAS_VALIDITY |
                                             ALIDADE_RESIDUAL_ONLY | ALIDADE_NEEDS_PAYLOAD |
                                             ALIDADE_DISCRETE_NOISE;
constexpr const char* kUnsupported = ", which this version does not support";
constexpr const char* kReserved = "uses reserved members, which must be zero";

AlidadeSpace PartOf(const AlidadeSpace& space, std::size_t i) {
  return internal::ReadEntry(space.parts, space.part_stride, i);
}

Geometry GeometryOf(const AlidadeSpace& space) {
  if (space.geometry != ALIDADE_PRODUCT) return Geometry(space.geometry, space.ambient);
  std::vector<Geometry> parts;
  for (std::size_t i = 0; i < space.part_count; ++i) parts.push_back(GeometryOf(PartOf(space, i)));
  return Geometry::Product(std::move(parts));
}

/// Returns true if this version knows the geometry and the sizes are correct for it.
bool IsKnownGeometry(const AlidadeSpace& space) {
  if (FindGeometry(space.geometry) == nullptr) return false;
  const Geometry geometry = GeometryOf(space);
  return space.ambient >= 1 && space.ambient <= kMaxSize && space.ambient == geometry.ambient &&
         space.tangent == geometry.tangent;
}

/// Returns the reason why `space` breaks the rules of plugin_abi.h; "" if it breaks none.
std::string SpaceDefect(const AlidadeSpace& space);

/// Returns the reason why the parts of `space` break the rules; "" if they break none.
std::string PartsDefect(const AlidadeSpace& space) {
  const bool is_product = space.geometry == ALIDADE_PRODUCT;
  if (!is_product && (space.parts != nullptr || space.part_count != 0)) {
    return "has parts, but is not a product";
  }
  if (!is_product) return {};
  if (space.parts == nullptr || space.part_count < 1 || space.part_count > ALIDADE_MAX_ROLES ||
      !internal::IsValidStride<AlidadeSpace>(space.part_stride)) {
    return "does not describe the parts of its product";
  }
  if (!Text(space.elements).empty()) return "names its elements, although its parts name them";
  for (std::size_t i = 0; i < space.part_count; ++i) {
    const AlidadeSpace part = PartOf(space, i);
    const std::string prefix = "has a part '" + PrintableText(part.name) + "' that ";
    if (part.geometry == ALIDADE_PRODUCT) return prefix + "is a product";
    if (part.flags != 0) return prefix + "has flags";
    const std::string defect = SpaceDefect(part);
    if (!defect.empty()) return prefix + defect;
    for (std::size_t j = 0; j < i; ++j) {
      if (Text(PartOf(space, j).name) == Text(part.name)) return "has two parts of the same name";
    }
  }
  return {};
}

std::string SpaceDefect(const AlidadeSpace& space) {
  if (Text(space.name).empty()) return "has no name";
  if (!internal::IsValidName(space.name)) return "has an invalid name";
  const std::pair<const char*, const char*> texts[] = {
      {"unit", space.unit}, {"elements", space.elements}, {"doc", space.doc}};
  for (const auto& [member, text] : texts) {
    const std::string defect = internal::TextDefect(text);
    if (!defect.empty()) return std::string("has a text '") + member + "' that " + defect;
  }
  const std::string unknown = internal::UnknownBits(space.flags, kKnownRoleFlags);
  if (!unknown.empty()) return "has flags that this version does not know: " + unknown;
  if (space.reserved0 != 0 || !internal::AllZero(space.reserved)) return kReserved;
  if (std::string defect = PartsDefect(space); !defect.empty()) return defect;
  if (!IsKnownGeometry(space)) {
    return "has geometry " + std::to_string(space.geometry) + " with sizes " +
           std::to_string(space.ambient) + " and " + std::to_string(space.tangent) +
           ", which this version does not know";
  }
  const std::string elements = Text(space.elements);
  if (!elements.empty() && std::ssize(internal::SplitNames(elements)) != space.ambient) {
    return "names its elements '" + elements + "', but has " + std::to_string(space.ambient) +
           (space.ambient == 1 ? " element" : " elements");
  }
  if ((space.flags & ALIDADE_ROLE_SHARED) != 0 && (space.flags & ALIDADE_ROLE_LANDMARK) == 0) {
    return "is shared, but is not a landmark role";
  }
  if ((space.flags & ALIDADE_ROLE_CLONE) != 0) {
    return std::string("is the value at an earlier timestamp") + kUnsupported;
  }
  if (space.owned != nullptr && (space.flags & ALIDADE_ROLE_OWNED) == 0) {
    return "has a prior and dynamics, but is not a model parameter state";
  }
  return {};
}

Space ToSpace(const AlidadeSpace& source) {
  Space space;
  space.name = Text(source.name);
  space.unit = Text(source.unit);
  space.doc = Text(source.doc);
  const std::string elements = Text(source.elements);
  space.geometry = GeometryOf(source);
  space.flags = source.flags;
  if (source.geometry != ALIDADE_PRODUCT) {
    space.elements = internal::ElementsOf(elements, space.geometry);
    return space;
  }
  for (std::size_t i = 0; i < source.part_count; ++i) {
    const Space part = ToSpace(PartOf(source, i));
    space.parts.push_back(part.name);
    space.part_units.push_back(part.unit);
    for (const std::string& name : ColumnNames(part.name, part)) space.elements.push_back(name);
  }
  return space;
}

}  // namespace

void internal::DestroyInstance(const AlidadeInstance& instance, const std::string& name,
                               const std::string& plugin) noexcept {
  const std::string exception_text = CatchExceptionText([&] { instance.destroy(instance.self); });
  if (exception_text.empty()) return;
  Log(LogLevel::kWarning,
      "function destroy of model '" + name + "' of plugin " + plugin + " threw: " + exception_text);
}

ModelInstance::ModelInstance(const AlidadeInstance& instance, std::string name, std::string plugin)
    : instance_(ReadPrefix(&instance)), name_(std::move(name)), plugin_(std::move(plugin)) {
  if (instance_.self == nullptr || instance_.destroy == nullptr) {
    Refuse("was created without an object or a function that destroys it");
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

void ModelInstance::Refuse(const std::string& reason) const {
  throw Error(ExitCode::kPlugin, ErrorLine({plugin_}, {}, "model '" + name_ + "' " + reason));
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
      Refuse("lacks a function that every motion model must have (step or sqrt_q)");
    }
  } else {
    Refuse("is of kind " + std::to_string(instance_.kind) +
           ", which this version does not know, or lacks the functions of this kind");
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
      known_ = ReadSpace(ReadPrefix(description_.known), "the known quantity");
      if (!known_.geometry.is_vector()) {
        Refuse("is invalid: the known quantity is not a vector");
      }
    }
  } else if (has_input()) {
    space_ = ReadSpace(ReadPrefix(description_.inputs), "the control input");
    if (space_.geometry.is_product()) Refuse("is invalid: the control input is a product");
  }
  const int y = description_.initialise_role;
  if (is_sensor && (capabilities_ & ALIDADE_CAN_INITIALISE) != 0 &&
      (y < 0 || y >= std::ssize(spaces_) || sensor_.initialise == nullptr)) {
    Refuse("claims to initialise a role, but does not define the role or the function");
  }
  if (is_sensor && (description_.prior_count < 0 || description_.prior_count > kMaxSize)) {
    Refuse("states an invalid prior size: " + std::to_string(description_.prior_count));
  }
  if (!is_sensor && (description_.noise_count < 0 || description_.noise_count > kMaxSize)) {
    Refuse("states an invalid noise size: " + std::to_string(description_.noise_count));
  }
}

/// Refuses capabilities that this version does not know or does not support.
void ModelInstance::CheckSupported() const {
  const bool is_sensor = instance_.kind == ALIDADE_KIND_SENSOR;
  const std::string unknown = internal::UnknownBits(capabilities_, kKnownCapabilities);
  if (!unknown.empty()) Refuse("has capabilities that this version does not know: " + unknown);
  if (description_.reserved0 != 0 || !internal::AllZero(description_.reserved)) Refuse(kReserved);
  if ((capabilities_ & ALIDADE_RESIDUAL_ONLY) != 0 || description_.residual != nullptr) {
    Refuse(std::string("only provides a residual") + kUnsupported);
  }
  if ((capabilities_ & ALIDADE_NEEDS_PAYLOAD) != 0) {
    Refuse(std::string("needs the payload of a measurement") + kUnsupported);
  }
  if (is_sensor) {
    if (sensor_.eval == nullptr || sensor_.sqrt_noise == nullptr) {
      Refuse("lacks a function that every sensor must have (eval or sqrt_noise)");
    }
  } else if (description_.input_count > 1) {
    Refuse("has " + std::to_string(description_.input_count) + " control inputs" + kUnsupported);
  } else if (description_.input_count == 1 &&
             (description_.inputs == nullptr ||
              !internal::IsValidStride<AlidadeSpace>(description_.input_stride))) {
    Refuse("does not describe its control input");
  }
}

void ModelInstance::ReadRoles() {
  const int count = static_cast<int>(std::min<std::uint32_t>(description_.role_count, 1 << 16));
  if (count < 1 || count > kMaxRoles || description_.roles == nullptr) {
    Refuse("has " + std::to_string(count) + " roles; expected 1 to 64 roles");
  }
  if (!internal::IsValidStride<AlidadeSpace>(description_.role_stride)) {
    Refuse("states an invalid role stride of " + std::to_string(description_.role_stride) +
           " bytes");
  }
  for (int i = 0; i < count; ++i) {
    const auto role = internal::ReadEntry(description_.roles, description_.role_stride, i);
    spaces_.push_back(ReadSpace(role, "role '" + PrintableText(role.name) + "'"));
    if (role.owned != nullptr) {
      ReadOwned(ReadPrefix(role.owned), spaces_.back(), static_cast<std::size_t>(i));
    }
    if (role.geometry == ALIDADE_PRODUCT) {
      Refuse("is invalid: role '" + spaces_.back().name +
             "' is a product; expected a role for each part");
    }
    const auto same = [&](const Space& other) { return other.name == spaces_.back().name; };
    if (std::count_if(spaces_.begin(), spaces_.end(), same) > 1) {
      Refuse("has two roles named '" + spaces_.back().name + "'");
    }
  }
}

void ModelInstance::ReadOwned(const AlidadeOwned& owned, const Space& role, std::size_t index) {
  const std::string subject = "is invalid: the prior or dynamics of role '" + role.name + "' ";
  if (instance_.kind != ALIDADE_KIND_SENSOR) {
    Refuse(subject + "belong to a motion model; only a sensor can have a prior");
  }
  if (role.landmark()) Refuse(subject + "belong to a landmark; a landmark cannot have a prior");
  if (!internal::AllZero(owned.reserved)) Refuse(kReserved);
  if (owned.dynamics > ALIDADE_GAUSS_MARKOV) {
    Refuse(subject + "are of kind " + std::to_string(owned.dynamics));
  }
  const auto n = static_cast<std::size_t>(role.geometry.tangent);
  const auto read = [](const double* values, std::size_t size) {
    return values == nullptr ? std::vector<double>() : std::vector<double>(values, values + size);
  };
  OwnedRole prior{read(owned.mean, static_cast<std::size_t>(role.geometry.ambient)),
                  read(owned.sqrt_prior, n * n), static_cast<OwnedDynamics>(owned.dynamics),
                  read(owned.sqrt_density, n * n), owned.time_constant_s};
  const std::string defect = internal::CheckOwned(role.geometry, prior);
  if (!defect.empty()) Refuse(subject + defect);
  owned_[index] = std::move(prior);
}

void ModelInstance::SetNoise(std::vector<double> root) {
  const bool is_sensor = instance_.kind == ALIDADE_KIND_SENSOR;
  const int n = is_sensor ? space_.geometry.tangent : description_.noise_count;
  ALIDADE_EXPECTS(std::ssize(root) == std::ptrdiff_t{n} * n);
  noise_root_ = std::move(root);
}

Space ModelInstance::ReadSpace(const AlidadeSpace& space, const std::string& subject) const {
  const std::string defect = SpaceDefect(space);
  if (!defect.empty()) Refuse("is invalid: " + subject + ' ' + defect);
  return ToSpace(space);
}

std::string ModelInstance::error_text() const {
  if (instance_.error_text == nullptr) return "";
  std::string text;
  const std::string failure = internal::CatchExceptionText(
      [&] { text = PrintableText(instance_.error_text(instance_.self)); });
  return failure.empty() ? text
                         : "function error_text of model '" + name_ + "' of plugin " + plugin_ +
                               " threw: " + failure;
}

}  // namespace alidade
