// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/build_estimator.h"

#include <algorithm>
#include <exception>
#include <new>
#include <optional>

#include "alidade/base/text.h"
#include "alidade/config/tree.h"
#include "alidade/estimation/invariant_error.h"
#include "alidade/experiment/calibration.h"
#include "alidade/experiment/defect_node.h"
#include "alidade/experiment/estimator_registry.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/experiment/short_forms.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade::internal {
namespace {

/// Returns the capabilities of a plugin's estimator. An estimator that does not declare its
/// capabilities must itself reject problems that it does not support.
const EstimatorCapabilities& CapabilitiesOf(const PluginEntry& entry) {
  static constexpr EstimatorCapabilities kUndeclared = {
      .consider = true, .at_measurement = true, .from_measurement = true};
  const EstimatorCapabilities* const capabilities = EstimatorOf(entry).capabilities;
  return capabilities != nullptr ? *capabilities : kUndeclared;
}

/// Returns the index of the stream that the entry of a sensor or an input names.
std::size_t FindStreamOf(const Node& entry, const std::vector<StreamInfo>& streams) {
  const Node node = entry.At("stream");
  const std::vector<std::string> names = NamesOf(streams);
  const auto found = std::find(names.begin(), names.end(), node.Text());
  if (found == names.end()) {
    node.Fail("the source has no stream '" + node.Text() + "'", "one of " + Join(names),
              Nearest(node.Text(), names));
  }
  return static_cast<std::size_t>(found - names.begin());
}

/// Returns a text such as `stream 'gyro' has 1 value per measurement`.
std::string SizeText(const StreamInfo& stream) {
  return "stream '" + stream.name + "' has " + std::to_string(stream.size) +
         (stream.size == 1 ? " value" : " values") + " per measurement";
}

/// Rejects a stream whose size differs from that of the measurement. If a role has the geometry and
/// the unit of the measurement, its block may be the error, because it can select the size.
void CheckSize(const Node& sensor, const SensorModel& model, const StreamInfo& stream) {
  const Space& measurement = model.measurement();
  const int size = measurement.geometry.ambient;
  if (stream.size == size) return;
  const std::string of_model = "the measurement of model '" + model.name() + "'";
  for (const Space& role : model.roles()) {
    const bool is_measured = role.geometry == measurement.geometry && role.unit == measurement.unit;
    const auto node = is_measured ? sensor.At("roles").Find(role.name) : std::nullopt;
    if (!node) continue;
    const std::string block = (node->is_map() ? node->At("block") : *node).Text();
    node->Fail("block '" + block + "' has the geometry " + ToString(role.geometry) + ", so " +
                   of_model + " has " + std::to_string(size) + " values, but " + SizeText(stream),
               "another block, or a stream of " + std::to_string(size) + " values");
  }
  sensor.At("stream").Fail(SizeText(stream), std::to_string(size) + ", the size of " + of_model);
}

/// Returns the names of the sensors that an estimator lists, in the order of the list. Returns
/// nullopt if there is no list: all sensors, in the order of the config.
std::optional<std::vector<std::string>> ReadSensorList(const Node& entry, const Node& root) {
  const auto list = entry.Find("sensors");
  if (!list) return std::nullopt;
  std::vector<std::string> names;
  std::vector<std::string> known_names;
  for (const auto& [name, sensor] : root.At("sensors").Entries()) known_names.push_back(name);
  for (const Node& item : list->Items()) {
    const std::string name = item.Text();
    if (std::find(known_names.begin(), known_names.end(), name) == known_names.end()) {
      item.Fail("sensor '" + name + "' does not exist", "a name from `sensors`",
                Nearest(name, known_names));
    }
    if (std::find(names.begin(), names.end(), name) != names.end()) {
      item.Fail("sensor '" + name + "' is listed twice", "each sensor only once");
    }
    names.push_back(name);
  }
  return names;
}

bool ExpectsPoor(const Node& entry) {
  const auto expect = entry.Find("expect");
  return expect && expect->Choice({"good", "poor"}) == 1;
}

[[noreturn]] void FailUnknownType(const std::string& name, const PluginHost& host,
                                  const Node& node) {
  std::vector<std::string> of_core, of_plugins;
  for (const EstimatorType& type : EstimatorTypes()) of_core.emplace_back(type.name);
  for (const PluginEntry& entry : host.entries()) {
    if (entry.kind == kEstimatorKind) of_plugins.push_back(entry.name);
  }
  std::vector<std::string> names = of_core;
  names.insert(names.end(), of_plugins.begin(), of_plugins.end());
  const std::string nearest = Nearest(name, names);
  const std::string expected = "a built-in type (" + Join(of_core) + ") or a type of a plugin (" +
                               (of_plugins.empty() ? "none was found" : Join(of_plugins)) + ')';
  constexpr const char* kHint =
      "\n  batch estimators need a build with the Ceres solver: "
      "cmake --preset release && cmake --build --preset release";
  const std::string places = (of_plugins.empty() ? kHint : "") + ("\n" + PluginPlaces(host));
  throw Error(ExitCode::kPlugin,
              ErrorLine(node.place(), node.path(),
                        "estimator type '" + name + "' is neither built in nor in a plugin",
                        expected, nearest) +
                  (nearest.empty() || !host.refusals().empty() ? places : ""));
}

/// Returns the entry of the estimator `type` of a plugin. Error: kPlugin if no plugin provides this
/// estimator.
const PluginEntry& FindPluginEstimator(const std::string& type, const PluginHost& host,
                                       const Node& node) {
  for (const PluginEntry& entry : host.entries()) {
    if (entry.kind == kEstimatorKind && entry.name == type) return entry;
  }
  if (!host.has_all_plugins()) FailUnknownType(type, host.WithAllPlugins(), node);
  FailUnknownType(type, host, node);
}

/// Rejects a problem that needs a capability that `capabilities` does not contain. The problem was
/// read from the config `root`.
void RefuseUnsupported(const std::string& type, const EstimatorCapabilities& capabilities,
                       const Node& root, const Problem& problem) {
  const auto defect = FindUnsupported(problem, capabilities);
  if (!defect) return;
  FindDefectNode(*defect, root, problem)
      .Fail("estimator type '" + type + "' does not support " + defect->description,
            defect->remedy + " (possibly in the estimator's `overrides`), or type: ekf");
}

/// Rejects keys that only other estimator types have. Must be called after the keys of this type
/// were read.
void RefuseUnsupportedKeys(const std::string& type, const Node& entry) {
  constexpr std::pair<const char*, const char*> kKeys[] = {
      {"gate", "gate"},
      {"fuse", "option for the grouping of updates"},
      {"jacobian", "option for the Jacobian"},
      {"rejection_recovery", "rejection recovery"}};
  for (const auto& [key, feature] : kKeys) {
    if (!entry.HasUnread(key)) continue;
    entry.At(key).Fail("estimator type '" + type + "' has no " + feature +
                       "; remove this key, or use type: ekf");
  }
}

/// Rejects `fuse: per_measurement` if a sensor has `outlier_rejection`, which compares several
/// matches.
void RefuseSingleMatches(const Node& entry, const Problem& problem) {
  const auto fuse = entry.Find("fuse");
  if (!fuse || fuse->Text() != "per_measurement") return;
  for (const SensorBinding& sensor : problem.sensors) {
    if (!sensor.outlier_rejection) continue;
    fuse->Fail("the `outlier_rejection` of sensor '" + sensor.name +
                   "' needs several matches in one update",
               "joint or per_sensor");
  }
}

/// Rejects overrides of keys that all estimators share. Also rejects an override of an entry that
/// `root` does not contain, unless the entry in `merged` has a model.
void CheckOverrides(const Node& overrides, const Node& root, const Node& merged) {
  for (const auto& [key, value] : overrides.Entries()) {
    if (key == "initial_time_s" || key == "landmarks") continue;
    if (key != "state" && key != "sensors") {
      value.Fail("an estimator cannot override '" + key + "', which all estimators of a run share",
                 "state, sensors, landmarks or initial_time_s");
    }
    std::vector<std::string> known_names;
    for (const auto& [name, entry] : root.At(key).Entries()) known_names.push_back(name);
    for (const auto& [name, entry] : value.Entries()) {
      if (std::ranges::find(known_names, name) != known_names.end()) continue;
      if (merged.At(key).At(name).Find("model")) continue;
      entry.Fail("'" + key + "' has no entry '" + name + "' to override",
                 "one of " + Join(known_names) + ", or a new entry with a model",
                 Nearest(name, known_names));
    }
  }
}

/// Rejects `filter` if the measurements that it accepts do not determine the data of `spec`. Errors
/// refer to the node `key`.
void CheckAccepts(const EstimatorSpec& filter, const EstimatorSpec& spec, const Node& key) {
  const std::string quoted = '\'' + filter.name + '\'';
  if (filter.estimator->offline()) {
    key.Fail(quoted + " has estimates only at the end of the run", "a filter");
  }
  for (const SensorBinding& sensor : spec.problem.sensors) {
    const int index = filter.problem.FindSensor(sensor.name);
    const auto& sensors = filter.problem.sensors;
    if (index < 0 || sensors[static_cast<std::size_t>(index)].stream != sensor.stream) {
      key.Fail(
          quoted + " does not use sensor '" + sensor.name + "' on stream '" + sensor.stream + "'",
          "an estimator with the same sensors");
    }
    if (std::ranges::count(sensors, sensor.stream, &SensorBinding::stream) > 1) {
      key.Fail("several sensors of " + quoted + " use stream '" + sensor.stream +
                   "', and may accept different measurements",
               "a different stream for each sensor");
    }
  }
}

/// Rejects a control input of `spec` that is also a measurement of `filter`, because `filter` may
/// reject this measurement.
void CheckInputs(const EstimatorSpec& filter, const EstimatorSpec& spec, const Node& key) {
  for (const MotionBinding& motion : spec.problem.motions) {
    const std::string& stream = motion.input.stream;
    const auto& sensors = filter.problem.sensors;
    const auto sensor = std::ranges::find(sensors, stream, &SensorBinding::stream);
    if (!motion.model->has_input() || sensor == sensors.end()) continue;
    key.Fail("stream '" + stream + "' is the control input of '" + motion.name +
                 "' and also the stream of sensor '" + sensor->name + "' of '" + filter.name +
                 "', so measurements that '" + filter.name + "' rejects would be missing as inputs",
             "a filter without a sensor on that stream");
  }
}

/// Returns the index of the estimator whose accepted measurements `spec` uses according to the key
/// `use`; -1 if it uses all measurements. `earlier_estimators` are the estimators listed before
/// `spec`. Error: kBadConfig.
int ReadUse(const Node& use, const EstimatorSpec& spec, const Node& estimators,
            const std::vector<EstimatorSpec>& earlier_estimators) {
  if (!use.is_map()) {
    if (use.Text() == "all") return -1;
    use.Fail("'" + use.Text() + "' is not a valid choice of measurements",
             "all, or {accepted_by: NAME}");
  }
  const Node key = use.At("accepted_by", "use");
  const std::string name = key.Text();
  if (name == spec.name) key.Fail("'" + name + "' is this estimator itself", "another estimator");
  const auto found = std::ranges::find(earlier_estimators, name, &EstimatorSpec::name);
  if (found == earlier_estimators.end()) {
    std::vector<std::string> known_names;
    for (const auto& [listed, entry] : estimators.Entries()) known_names.push_back(listed);
    if (std::ranges::find(known_names, name) != known_names.end()) {
      key.Fail("'" + name + "' is listed after '" + spec.name + "'",
               "an earlier estimator, which processes each frame before '" + spec.name + "'");
    }
    std::erase(known_names, spec.name);
    key.Fail("estimator '" + name + "' does not exist", "a name from `estimators`",
             Nearest(name, known_names));
  }
  CheckAccepts(*found, spec, key);
  const int first = static_cast<int>(found - earlier_estimators.begin());
  for (int i = first; i >= 0; i = earlier_estimators[static_cast<std::size_t>(i)].accepted_by) {
    CheckInputs(earlier_estimators[static_cast<std::size_t>(i)], spec, key);
  }
  return first;
}

/// Reads the key `invariant_error`: {side: left | right, blocks: [...]}.
InvariantError ReadInvariantError(const Node& key, const Problem& problem) {
  InvariantError error;
  error.side = static_cast<ErrorSide>(key.At("side").Choice({"left", "right"}));
  const Node blocks = key.At("blocks");
  std::vector<std::string> known_names;
  for (const Block& block : problem.layout.blocks()) known_names.push_back(block.name);
  for (const Node& item : blocks.Items()) {
    const std::string name = item.Text();
    error.blocks.push_back(problem.layout.Find(name));
    if (error.blocks.back() >= 0) continue;
    item.Fail("block '" + name + "' does not exist", "one of " + Join(known_names),
              Nearest(name, known_names));
  }
  if (const std::string defect = FindDefect(error, problem); !defect.empty()) {
    blocks.Fail(defect,
                "blocks of one motion model that are estimated, as in [robot.position, "
                "robot.orientation, robot.velocity]; or no `invariant_error`");
  }
  return error;
}

/// Creates the estimator of the entry `node`. `plugin` is null for a built-in type. Error: kPlugin.
std::unique_ptr<Estimator> Create(const EstimatorMaker& make, const Problem& problem,
                                  const std::vector<StreamInfo>* streams, const PluginEntry* plugin,
                                  const Node& node) {
  const auto create = [&] {
    return make(problem, streams != nullptr ? *streams : problem.streams);
  };
  if (plugin == nullptr) return create();
  std::string reason = "an exception of unknown type";
  try {
    return create();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    reason = e.what();
  } catch (...) {
  }
  throw Error(ExitCode::kPlugin,
              ErrorLine(node.place(), node.path(),
                        "estimator '" + plugin->name + "' of plugin " + plugin->plugin.string() +
                            " failed while being created: " + reason));
}

/// Rejects an estimator that cannot roll back for out-of-sequence frames.
void CheckCanRollBack(const EstimatorSpec& spec, const Node& entry) {
  if (spec.estimator->offline() || spec.estimator->Clone() != nullptr) return;
  entry.At("type").Fail("'" + spec.type + "' cannot roll back for an out-of-sequence frame",
                        "another type of estimator, or 'out_of_sequence.policy: buffer'");
}

/// Reads `on_plugin_failure`, whose value `disable` excludes a rollback.
OnPluginFailure ReadPluginFailure(const Node& policy, const Node& root) {
  const auto choice = static_cast<OnPluginFailure>(policy.Choice({"skip", "disable", "abort"}));
  const auto order = root.Find("out_of_sequence");
  const auto rollback = order ? order->Find("policy") : std::nullopt;
  if (choice == OnPluginFailure::kDisable && rollback && rollback->Text() == "rollback") {
    policy.Fail("a rollback would use the disabled sensor again for earlier frames",
                "skip or abort, or another out_of_sequence.policy");
  }
  return choice;
}

}  // namespace

EstimatorSpec BuildEstimator(const std::string& name, const Node& entry, const Config& config,
                             const PluginHost& host, const std::vector<StreamInfo>* streams,
                             const std::vector<EstimatorSpec>& earlier_estimators) {
  ExpectName(name, entry, "an estimator");
  entry.ExpectMap("{type: ekf}");
  EstimatorSpec spec;
  spec.name = name;
  const Node type = entry.At("type", "an estimator");
  spec.type = type.Text();
  const EstimatorType* const of_core = FindEstimatorType(spec.type);
  const PluginEntry* const of_plugin =
      of_core == nullptr ? &FindPluginEstimator(spec.type, host, type) : nullptr;
  spec.kind = of_core != nullptr ? of_core->kind : EstimatorOf(*of_plugin).kind;
  const EstimatorCapabilities& capabilities =
      of_core != nullptr ? of_core->capabilities : CapabilitiesOf(*of_plugin);
  const EstimatorMaker make =
      of_core != nullptr ? of_core->read(entry) : CreateEstimator(host, spec.type, entry);
  spec.expects_poor = ExpectsPoor(entry);
  if (const auto policy = entry.Find("on_divergence")) {
    spec.on_divergence = static_cast<OnDivergence>(policy->Choice({"report", "fail"}));
  }
  if (const auto policy = entry.Find("on_plugin_failure")) {
    spec.on_plugin_failure = ReadPluginFailure(*policy, config.root());
  }
  const auto overrides = entry.Find("overrides");
  Config merged = overrides ? config.Merged(*overrides) : config;
  if (overrides) {
    ExpandShortForms(merged, host);
    CheckOverrides(*overrides, config.root(), merged.root());
    spec.overrides = overrides->ToYaml();
  }
  const std::optional<std::vector<std::string>> sensor_names = ReadSensorList(entry, merged.root());
  const auto use = entry.Find("use");
  if (use && use->is_map()) use->Declare("accepted_by");
  const auto invariant_error = entry.Find("invariant_error");
  for (const char* key : {"side", "blocks"}) {
    if (invariant_error && invariant_error->is_map()) invariant_error->Declare(key);
  }
  RefuseUnsupportedKeys(spec.type, entry);
  entry.RejectUnread();
  spec.problem = ReadProblem(merged.root(), host, sensor_names);
  RefuseUnsupported(spec.type, capabilities, merged.root(), spec.problem);
  if (of_core != nullptr) RefuseSingleMatches(entry, spec.problem);
  if (streams != nullptr) CheckStreams(merged.root(), spec.problem, *streams);
  // This estimator must initialise each landmark at the same frame as the estimator whose accepted
  // measurements it uses.
  if (use && use->is_map() && spec.problem.landmarks) {
    LandmarkOptions& landmarks = *spec.problem.landmarks;
    landmarks.min_observations = 1;
    if (landmarks.prior) landmarks.prior->min_observations = 0;
  }
  const auto create = [&](const Problem& problem) {
    return Create(make, problem, streams, of_plugin, entry);
  };
  spec.estimator =
      invariant_error
          ? MakeInvariant(ReadInvariantError(*invariant_error, spec.problem), spec.problem, create)
          : create(spec.problem);
  if (use)
    spec.accepted_by = ReadUse(*use, spec, config.root().At("estimators"), earlier_estimators);
  return spec;
}

int FindStream(const Node& sensor, const SensorModel& model,
               const std::vector<StreamInfo>& streams) {
  const std::size_t index = FindStreamOf(sensor, streams);
  const StreamInfo& stream = streams[index];
  CheckSize(sensor, model, stream);
  if (stream.known != model.known_size()) {
    sensor.At("stream").Fail(
        "stream '" + stream.name + "' has " + std::to_string(stream.known) +
            (stream.known == 1 ? " known number" : " known numbers") + " per measurement",
        std::to_string(model.known_size()) + " for model '" + model.name() + "'" +
            (model.known_size() > 0 ? ": " + Join(ColumnNames(model.known().name, model.known()))
                                    : std::string()));
  }
  return static_cast<int>(index);
}

void CheckStreams(const Node& root, const Problem& problem,
                  const std::vector<StreamInfo>& streams) {
  for (const SensorBinding& sensor : problem.sensors) {
    FindStream(root.At("sensors").At(sensor.name), *sensor.model, streams);
  }
  for (const MotionBinding& motion : problem.motions) {
    if (!motion.model->has_input()) continue;
    const Space& input = motion.model->input();
    const Node node = root.At("state").At(motion.name).At("input");
    const StreamInfo& stream = streams[FindStreamOf(node, streams)];
    if (stream.size == input.geometry.ambient) continue;
    node.At("stream").Fail(SizeText(stream), std::to_string(input.geometry.ambient) +
                                                 ", the size of the control input '" + input.name +
                                                 "' of model '" + motion.model->name() + "'");
  }
}

void AddEstimator(const Config& config, const PluginHost& host, const std::string& name,
                  Experiment& experiment) {
  const Node entry = config.root().At("estimators").At(name);
  EstimatorSpec spec = BuildEstimator(name, entry, config, host, &experiment.source->streams(),
                                      experiment.estimators);
  if (experiment.out_of_sequence.policy == OutOfSequence::kRollback) CheckCanRollBack(spec, entry);
  experiment.estimators.push_back(std::move(spec));
}

}  // namespace alidade::internal
