// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <exception>
#include <iterator>
#include <mutex>
#include <sstream>
#include <thread>

#include "alidade/base/words.h"
#include "alidade/plugin/abi_read.h"
#include "alidade/plugin/cpp_plugin.h"
#include "alidade/plugin/given_noise.h"
#include "alidade/plugin/param_reader.h"
#include "alidade/plugin/plugin_file.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {
namespace {

using internal::ParamReader;
using internal::ParamRecorder;

std::uint32_t ToKind(PluginEntry::Kind kind) {
  return kind == PluginEntry::Kind::kSensor ? ALIDADE_KIND_SENSOR : ALIDADE_KIND_MOTION;
}

/// For what takes some microseconds, as most creations do: to look again takes less than to sleep.
std::unique_lock<std::recursive_mutex> LockShortly(std::recursive_mutex& mutex) {
  constexpr int kLooks = 100;
  std::unique_lock lock(mutex, std::try_to_lock);
  for (int i = 0; i < kLooks && !lock; ++i) {
    std::this_thread::yield();
    static_cast<void>(lock.try_lock());
  }
  if (!lock) lock.lock();
  return lock;
}

/// An instance that `create` fills, destroyed unless it is released.
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

  /// The code of `create`, that of an error where it threw.
  std::int32_t Create(const AlidadeEntry& entry, const AlidadeHost& host) {
    std::int32_t code = ALIDADE_ERROR;
    thrown_ = internal::ThrownBy([&] { code = entry.create(&host, &c_); });
    return code;
  }
  /// What `create` threw, or "".
  const std::string& thrown() const { return thrown_; }
  std::uint32_t kind() const { return c_.kind; }
  AlidadeInstance Release() { return std::exchange(c_, AlidadeInstance{}); }

 private:
  std::string name_, plugin_, thrown_;
  AlidadeInstance c_{};
};

std::string Named(PluginEntry::Kind kind, const std::string& name) {
  const bool model = kind != PluginEntry::Kind::kSource && kind != PluginEntry::Kind::kEstimator;
  return std::string(model ? "model" : internal::KindName(kind)) + " '" + name + "'";
}

[[noreturn]] void FailCreation(const PluginEntry& entry, const Node& node, const std::string& why) {
  throw Error(ExitCode::kPlugin,
              ErrorLine(node.place(), node.path(),
                        Named(entry.kind, entry.name) + " of plugin " + entry.plugin.string() +
                            " failed while being created: " + why));
}

std::string Line(const std::string& what, const Space& space) {
  std::string line = what + ' ' + space.name + ": " + ToString(space.geometry);
  if (!space.parts.empty()) line += " of " + internal::Join(space.parts);
  if (!space.unit.empty()) line += ", " + space.unit;
  if (!space.doc.empty()) line += "; " + space.doc;
  if (space.optional()) line += " (optional)";
  if (space.landmark()) line += " (of a landmark)";
  if ((space.flags & ALIDADE_ROLE_OWNED) != 0) line += " (model parameter state)";
  return line;
}

/// What the model says of itself besides its blocks.
std::vector<std::string> Capabilities(const ModelInstance& model) {
  const auto can = [&](unsigned what) { return (model.capabilities() & what) != 0; };
  std::vector<std::string> lines = {
      std::string("Jacobians: ") +
      (can(ALIDADE_ANALYTIC_JACOBIAN) ? "analytic" : "automatic differentiation")};
  if (model.c().kind == ALIDADE_KIND_MOTION && model.c().description->noise_count > 0) {
    lines.emplace_back(can(ALIDADE_DISCRETE_NOISE)
                           ? "noise: discrete, held from one update to the next"
                           : "noise: continuous, adds up over steps");
  }
  if (can(ALIDADE_HAS_VALIDITY)) lines.emplace_back("refuses measurements of no use by itself");
  if (can(ALIDADE_CAN_INITIALISE)) {
    const AlidadeDescription& description = *model.c().description;
    const auto role = static_cast<std::size_t>(description.initialise_role);
    const bool landmark = model.spaces()[role].landmark();
    lines.push_back("can initialise " + (landmark ? "a landmark" : model.spaces()[role].name));
    if (description.prior_count > 0) {
      lines.back() += ", given a prior of " + std::to_string(description.prior_count);
    }
  }
  return lines;
}

/// What `create` of a C++ plugin makes of its parameters, checked.
template <class Create>
auto CreateBuilt(const PluginEntry& entry, const Node& node, std::recursive_mutex& mutex,
                 const Create& create) {
  ParamReader reader(node, Named(entry.kind, entry.name));
  Params params(&reader.host());
  decltype(create(params)) made;
  try {
    const auto lock = LockShortly(mutex);
    made = create(params);
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
  if (made == nullptr) FailCreation(entry, node, "it gives nothing");
  return made;
}

/// The `keys` of a source: `key  meaning` on each line.
std::vector<ParamInfo> ListedKeys(const char* keys) {
  std::vector<ParamInfo> result;
  std::istringstream lines(keys == nullptr ? "" : keys);
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

AlidadeEntry PluginHost::EntryOf(const PluginEntry& entry) const {
  const AlidadeTable table = internal::ReadPrefix(LoadedFrom(entry.plugin).table);
  for (std::uint32_t i = 0; i < table.entry_count; ++i) {
    const AlidadeEntry c = internal::ReadEntry(table.entries, table.entry_stride, i);
    if (c.kind == ToKind(entry.kind) && entry.name == c.name) return c;
  }
  throw ContractViolation("no such entry: " + entry.name);
}

const SourceEntry& PluginHost::SourceOf(const PluginEntry& entry) const {
  const CppPluginTable& table = *LoadedFrom(entry.plugin).cpp_table;
  for (int i = 0; i < table.source_count; ++i) {
    if (entry.name == table.sources[i].name) return table.sources[i];
  }
  throw ContractViolation("no such entry: " + entry.name);
}

const EstimatorEntry& PluginHost::EstimatorOf(const PluginEntry& entry) const {
  const CppPluginTable& table = *LoadedFrom(entry.plugin).cpp_table;
  for (int i = 0; i < table.estimator_count; ++i) {
    if (entry.name == table.estimators[i].name) return table.estimators[i];
  }
  throw ContractViolation("no such entry: " + entry.name);
}

std::shared_ptr<const ModelInstance> PluginHost::Create(const PluginEntry& entry, const Node& node,
                                                        const std::string& representation) const {
  const AlidadeEntry c = EntryOf(entry);
  const std::optional<Node> covariance = internal::GivenCovariance(node, c.kind);
  ParamReader reader(node, Named(entry.kind, entry.name), representation, covariance.has_value());
  NewInstance instance(entry);
  std::int32_t code;
  {
    const auto lock = LockShortly(create_mutex_);
    code = instance.Create(c, reader.host());
  }
  reader.Check();
  if (!instance.thrown().empty()) FailCreation(entry, node, "it threw: " + instance.thrown());
  if (code != ALIDADE_OK) {
    FailCreation(entry, node, reader.failure().empty() ? "it does not say why" : reader.failure());
  }
  if (!reader.failure().empty()) node.Fail(reader.failure());
  if (instance.kind() != c.kind) FailCreation(entry, node, "it is not what its table says");
  auto model =
      std::make_shared<ModelInstance>(instance.Release(), entry.name, entry.plugin.string());
  if (covariance) model->GiveNoise(internal::RootForModel(*covariance, *model));
  return model;
}

SensorModel PluginHost::CreateSensor(const std::string& name, const Node& entry,
                                     const std::string& representation) const {
  return SensorModel(Create(Find(PluginEntry::Kind::kSensor, name, entry), entry, representation));
}

MotionModel PluginHost::CreateMotion(const std::string& name, const Node& entry) const {
  return MotionModel(Create(Find(PluginEntry::Kind::kMotion, name, entry), entry));
}

std::unique_ptr<Source> PluginHost::CreateSource(const Config& config, std::uint64_t seed,
                                                 bool any_order) const {
  const Node node = config.root().At("source", "a run: where measurements come from");
  const PluginEntry& entry =
      Find(PluginEntry::Kind::kSource, node.At("type", "a source").Text(), node);
  return CreateBuilt(entry, node, create_mutex_, [&](Params& params) {
    return SourceOf(entry).create(
        SourceArguments{node, params, seed, config.folder(), any_order, &config, this});
  });
}

EstimatorMaker PluginHost::CreateEstimator(const std::string& name, const Node& node) const {
  const PluginEntry& entry = Find(PluginEntry::Kind::kEstimator, name, node);
  return CreateBuilt(entry, node, create_mutex_, [&](Params& params) {
    return EstimatorOf(entry).create(EstimatorArguments{node, params});
  });
}

std::vector<ParamInfo> PluginHost::Schema(const PluginEntry& entry) const {
  ParamRecorder recorder;
  const std::lock_guard lock(create_mutex_);
  if (entry.kind != PluginEntry::Kind::kSource && entry.kind != PluginEntry::Kind::kEstimator) {
    const AlidadeEntry c = EntryOf(entry);
    recorder.Run([&] {
      NewInstance instance(entry);
      static_cast<void>(instance.Create(c, recorder.host()));
    });
    return recorder.Result();
  }
  const bool is_source = entry.kind == PluginEntry::Kind::kSource;
  const Config stand_in = Config::FromText("type: " + entry.name, "stand-in");
  recorder.Run([&] {
    Params params(&recorder.host());
    try {
      if (is_source) {
        static_cast<void>(SourceOf(entry).create(SourceArguments{stand_in.root(), params, 1, {}}));
      } else {
        static_cast<void>(EstimatorOf(entry).create(EstimatorArguments{stand_in.root(), params}));
      }
    } catch (...) {
      // It wants a file, say, that stand-ins do not give; what it read before counts.
    }
  });
  std::vector<ParamInfo> result = ListedKeys(is_source ? SourceOf(entry).keys : nullptr);
  for (const ParamInfo& info : recorder.Result()) result.push_back(info);
  return result;
}

std::vector<std::string> PluginHost::Describe(const PluginEntry& entry) const {
  if (entry.kind == PluginEntry::Kind::kSource || entry.kind == PluginEntry::Kind::kEstimator) {
    return {};
  }
  ParamRecorder recorder;
  NewInstance instance(entry);
  const std::lock_guard lock(create_mutex_);
  if (instance.Create(EntryOf(entry), recorder.host()) != ALIDADE_OK) return {};
  const ModelInstance model(instance.Release(), entry.name, entry.plugin.string());
  const bool sensor = entry.kind == PluginEntry::Kind::kSensor;
  std::vector<std::string> lines;
  for (const Space& space : model.spaces()) lines.push_back(Line(sensor ? "role" : "block", space));
  if (!model.space().name.empty()) {
    lines.push_back(Line(sensor ? "measurement" : "input", model.space()));
  }
  if (!model.known().name.empty()) {
    lines.push_back(Line("known with each measurement", model.known()));
  }
  std::ranges::copy(Capabilities(model), std::back_inserter(lines));
  return lines;
}

}  // namespace alidade
