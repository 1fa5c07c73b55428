// SPDX-License-Identifier: Apache-2.0
#include "alidade/plugin/create.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <mutex>
#include <sstream>
#include <thread>

#include "alidade/base/text.h"
#include "alidade/plugin/abi_read.h"
#include "alidade/plugin/config_noise.h"
#include "alidade/plugin/param_reader.h"

namespace alidade {
namespace {

using internal::ParamReader;
using internal::ParamRecorder;

/// Locks the creation of all objects. The mutex is recursive, because a source may create models.
/// Most creations last microseconds, so retrying is cheaper than sleeping.
std::unique_lock<std::recursive_mutex> LockCreation() {
  static std::recursive_mutex mutex;
  constexpr int kTries = 100;
  std::unique_lock lock(mutex, std::try_to_lock);
  for (int i = 0; i < kTries && !lock; ++i) {
    std::this_thread::yield();
    static_cast<void>(lock.try_lock());
  }
  if (!lock) lock.lock();
  return lock;
}

/// Instance that the plugin's `create` function fills. The destructor destroys the model unless
/// Release() was called.
class NewInstance {
 public:
  explicit NewInstance(const PluginEntry& entry) : name_(entry.name), plugin_(entry.plugin) {
    c_.struct_size = sizeof(AlidadeInstance);
  }
  ~NewInstance() {
    if (c_.self != nullptr && c_.destroy != nullptr) {
      internal::DestroyInstance(c_, name_, plugin_);
    }
  }
  NewInstance(const NewInstance&) = delete;
  NewInstance& operator=(const NewInstance&) = delete;

  /// Calls `create`. Returns the code of `create`, or ALIDADE_ERROR if `create` threw an exception.
  std::int32_t Create(const AlidadeEntry& entry, const AlidadeHost& host) {
    std::int32_t code = ALIDADE_ERROR;
    exception_text_ = internal::CatchExceptionText([&] { code = entry.create(&host, &c_); });
    return code;
  }
  /// Returns the text of the exception that `create` threw, or "".
  const std::string& exception_text() const { return exception_text_; }
  std::uint32_t kind() const { return c_.kind; }
  AlidadeInstance Release() { return std::exchange(c_, AlidadeInstance{}); }

 private:
  std::string name_, plugin_, exception_text_;
  AlidadeInstance c_{};
};

std::string QuotedName(const PluginEntry& entry) {
  return (entry.is_model() ? "model" : entry.kind) + " '" + entry.name + "'";
}

[[noreturn]] void FailCreation(const PluginEntry& entry, const Node& node,
                               const std::string& reason) {
  throw Error(ExitCode::kPlugin,
              ErrorLine(node.place(), node.path(),
                        QuotedName(entry) + " of plugin " + entry.plugin.string() +
                            " could not be created: " + reason));
}

std::string SpaceLine(const std::string& kind, const Space& space) {
  std::string line = kind + ' ' + space.name + ": " + ToString(space.geometry);
  if (!space.parts.empty()) line += " of " + internal::Join(space.parts);
  if (!space.unit.empty()) line += ", " + space.unit;
  if (!space.doc.empty()) line += "; " + space.doc;
  if (space.optional()) line += " (optional)";
  if (space.landmark()) line += " (of a landmark)";
  if ((space.flags & ALIDADE_ROLE_OWNED) != 0) line += " (model parameter state)";
  return line;
}

/// Returns a line for each capability of the model.
std::vector<std::string> Capabilities(const ModelInstance& model) {
  const auto has = [&](unsigned capability) { return (model.capabilities() & capability) != 0; };
  std::vector<std::string> lines = {
      std::string("Jacobians: ") +
      (has(ALIDADE_ANALYTIC_JACOBIAN) ? "analytic" : "automatic differentiation")};
  if (model.c().kind == ALIDADE_KIND_MOTION && model.c().description->noise_count > 0) {
    lines.emplace_back(has(ALIDADE_DISCRETE_NOISE)
                           ? "noise: discrete, constant from one update to the next"
                           : "noise: continuous, independent in each step");
  }
  if (has(ALIDADE_HAS_VALIDITY)) lines.emplace_back("rejects invalid measurements");
  if (has(ALIDADE_CAN_INITIALISE)) {
    const AlidadeDescription& description = *model.c().description;
    const auto role = static_cast<std::size_t>(description.initialise_role);
    const bool is_landmark = model.spaces()[role].landmark();
    lines.push_back("can initialise " + (is_landmark ? "a landmark" : model.spaces()[role].name));
    if (description.prior_count > 0) {
      lines.back() += ", with a prior of size " + std::to_string(description.prior_count);
    }
  }
  return lines;
}

/// Parses the `keys` of a factory. Each line has the form `key  meaning`.
std::vector<ParamInfo> ListedKeys(const std::string& keys) {
  std::vector<ParamInfo> result;
  std::istringstream lines(keys);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    ParamInfo info;
    words >> info.key >> std::ws;
    std::getline(words, info.doc);
    if (!info.key.empty()) result.push_back(info);
  }
  return result;
}

}  // namespace

std::shared_ptr<const ModelInstance> CreateModel(
    const PluginEntry& entry, const Node& node, const std::string& representation,
    const std::map<std::string, std::string>& bound_geometries) {
  ALIDADE_EXPECTS(entry.is_model());
  const std::optional<Node> covariance = internal::FindNoiseCovariance(node, entry.model.kind);
  ParamReader reader(node, QuotedName(entry), representation, covariance.has_value(),
                     bound_geometries);
  NewInstance instance(entry);
  std::int32_t code;
  {
    const auto lock = LockCreation();
    code = instance.Create(entry.model, reader.host());
  }
  reader.Check();
  if (!instance.exception_text().empty())
    FailCreation(entry, node, "it threw: " + instance.exception_text());
  if (code != ALIDADE_OK) {
    FailCreation(entry, node,
                 reader.failure().empty() ? "it did not report a reason" : reader.failure());
  }
  if (!reader.failure().empty()) node.Fail(reader.failure());
  if (instance.kind() != entry.model.kind)
    FailCreation(entry, node, "its kind differs from the kind in the plugin's table");
  auto model =
      std::make_shared<ModelInstance>(instance.Release(), entry.name, entry.plugin.string());
  if (covariance) model->SetNoise(internal::ReadNoiseRoot(*covariance, *model));
  return model;
}

void CallFactory(const PluginEntry& entry, const Node& node,
                 const std::function<bool(Params&)>& call) {
  ParamReader reader(node, QuotedName(entry));
  Params params(&reader.host());
  bool is_created = false;
  try {
    const auto lock = LockCreation();
    is_created = call(params);
  } catch (const Error&) {
    reader.Check();
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    reader.Check();
    FailCreation(entry, node, e.what());
  } catch (...) {
    reader.Check();
    FailCreation(entry, node, "an exception of unknown type");
  }
  reader.Check();
  if (!reader.failure().empty()) node.Fail(reader.failure());
  if (!is_created) FailCreation(entry, node, "it did not create an object");
}

std::vector<ParamInfo> ModelSchema(const PluginEntry& entry) {
  ParamRecorder recorder;
  ALIDADE_EXPECTS(entry.is_model());
  const auto lock = LockCreation();
  recorder.Run([&] {
    NewInstance instance(entry);
    static_cast<void>(instance.Create(entry.model, recorder.host()));
  });
  return recorder.Result();
}

std::vector<ParamInfo> FactorySchema(const PluginEntry& entry,
                                     const std::function<void(Params&)>& call) {
  ParamRecorder recorder;
  const auto lock = LockCreation();
  recorder.Run([&] {
    Params params(&recorder.host());
    try {
      call(params);
    } catch (...) {
      // The factory may need a file that does not exist. The parameters that it read before the
      // failure are valid.
    }
  });
  std::vector<ParamInfo> result = ListedKeys(entry.keys);
  for (const ParamInfo& info : recorder.Result()) result.push_back(info);
  return result;
}

std::vector<std::string> DescribeModel(const PluginEntry& entry) {
  if (!entry.is_model()) return {};
  ParamRecorder recorder;
  NewInstance instance(entry);
  const auto lock = LockCreation();
  if (instance.Create(entry.model, recorder.host()) != ALIDADE_OK) return {};
  const ModelInstance model(instance.Release(), entry.name, entry.plugin.string());
  const bool is_sensor = entry.kind == kSensorKind;
  std::vector<std::string> lines;
  for (const Space& space : model.spaces())
    lines.push_back(SpaceLine(is_sensor ? "role" : "block", space));
  if (!model.space().name.empty()) {
    lines.push_back(SpaceLine(is_sensor ? "measurement" : "input", model.space()));
  }
  if (!model.known().name.empty()) {
    lines.push_back(SpaceLine("known with each measurement", model.known()));
  }
  std::ranges::copy(Capabilities(model), std::back_inserter(lines));
  return lines;
}

}  // namespace alidade
