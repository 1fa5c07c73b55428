// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/base/text_table.h"
#include "alidade/base/words.h"
#include "alidade/config/tree.h"
#include "alidade/filter/built_in.h"
#include "alidade/host/calibration.h"
#include "alidade/host/plugin_host.h"
#include "alidade/run/accepted_data.h"
#include "alidade/run/named_estimator.h"
#include "alidade/run/run.h"
#include "alidade/run/truth_sigma.h"
#include "alidade/system/truth_match.h"

namespace alidade {
namespace {

using internal::EstimatorType;
using internal::EstimatorTypes;
using internal::FindEstimatorType;
using internal::NamesOf;

constexpr int kSchema = 1;

void CheckSchema(const Node& root) {
  const Node version = root.At("alidade", "every config: the version of its schema");
  const std::int64_t found = version.Integer(1, 1'000'000);
  if (found > kSchema) {
    version.Fail("schema version " + std::to_string(found),
                 std::to_string(kSchema) +
                     ", the newest that this program knows; a newer alidade "
                     "reads this file");
  }
}

/// Index of the stream that an entry of a sensor or an input names, of the size `wanted_by` it.
int FindStream(const Node& entry, int size, const std::string& wanted_by,
               const std::vector<StreamInfo>& streams) {
  const Node node = entry.At("stream");
  const std::vector<std::string> names = NamesOf(streams);
  const auto found = std::find(names.begin(), names.end(), node.Text());
  if (found == names.end()) {
    node.Fail("the source has no stream '" + node.Text() + "'", "one of " + internal::Join(names),
              Nearest(node.Text(), names));
  }
  const auto index = static_cast<std::size_t>(found - names.begin());
  if (streams[index].size != size) {
    node.Fail("stream '" + names[index] + "' has " + std::to_string(streams[index].size) +
                  " values at a time",
              std::to_string(size) + ", as " + wanted_by);
  }
  return static_cast<int>(index);
}

int FindStream(const Node& sensor, const SensorModel& model,
               const std::vector<StreamInfo>& streams) {
  return FindStream(sensor, model.measurement().geometry.ambient,
                    "model '" + model.name() + "' measures", streams);
}

/// Refuses a sensor or a control input whose stream the source does not have.
void CheckStreams(const Node& root, const System& system, const std::vector<StreamInfo>& streams) {
  for (const SensorBinding& sensor : system.sensors) {
    FindStream(root.At("sensors").At(sensor.name), sensor.model, streams);
  }
  for (const MotionBinding& motion : system.motions) {
    if (!motion.model.has_input()) continue;
    const Space& input = motion.model.input();
    FindStream(root.At("state").At(motion.name).At("input"), input.geometry.ambient,
               "control input '" + input.name + "' of model '" + motion.model.name() + "'",
               streams);
  }
}

/// Names of the sensors an estimator uses, in its own order; empty: all, in the config's.
std::vector<std::string> ReadSensorList(const Node& entry, const Node& root) {
  std::vector<std::string> names;
  const auto list = entry.Find("sensors");
  if (!list) return names;
  std::vector<std::string> known;
  for (const auto& [name, sensor] : root.At("sensors").Entries()) known.push_back(name);
  for (const Node& item : list->Items()) {
    const std::string name = item.Text();
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      item.Fail("no sensor '" + name + "'", "a name from `sensors`", Nearest(name, known));
    }
    if (std::find(names.begin(), names.end(), name) != names.end()) {
      item.Fail("sensor '" + name + "' is listed twice", "each sensor once");
    }
    names.push_back(name);
  }
  if (names.empty()) list->Fail("empty", "at least one sensor, or leave the key out for all");
  return names;
}

void CheckName(const std::string& name, const Node& entry) {
  internal::ExpectName(name, entry, "an estimator");
  if (name == "figures") {
    entry.Fail("'figures' cannot name an estimator: the run folder has one of that name",
               "another name");
  }
}

/// The entry of a plugin's estimator. Error: kPlugin where none offers that type.
const PluginEntry& FindOffered(const std::string& type, const PluginHost& host, const Node& node) {
  std::vector<std::string> of_core, of_plugins;
  for (const EstimatorType& one : EstimatorTypes()) of_core.emplace_back(one.name);
  for (const PluginEntry& entry : host.entries()) {
    if (entry.kind != PluginEntry::Kind::kEstimator) continue;
    if (entry.name == type) return entry;
    of_plugins.push_back(entry.name);
  }
  std::vector<std::string> names = of_core;
  names.insert(names.end(), of_plugins.begin(), of_plugins.end());
  const std::string expected = internal::Join(of_core) + ", built in, or of a plugin: " +
                               (of_plugins.empty() ? "none was found" : internal::Join(of_plugins));
  constexpr const char* kHint =
      "\n  batch estimators come with a build that found the Ceres solver: "
      "cmake --preset release && cmake --build --preset release";
  throw Error(ExitCode::kPlugin,
              ErrorLine(node.place(), node.path(),
                        "no estimator '" + type + "' is built in, and no plugin offers it",
                        expected, Nearest(type, names)) +
                  (of_plugins.empty() ? kHint : "") + "\n" + PluginPlaces(host));
}

/// Refuses overrides of what all estimators share, and of an entry that `root` does not have and
/// that is none of `merged` either, for it has no model.
void CheckOverrides(const Node& overrides, const Node& root, const Node& merged) {
  for (const auto& [key, value] : overrides.Entries()) {
    if (key == "initial_time_s" || key == "landmarks") continue;
    if (key != "state" && key != "sensors") {
      value.Fail("'" + key + "' is common to all estimators of a run",
                 "state, sensors, landmarks or initial_time_s");
    }
    std::vector<std::string> known;
    for (const auto& [name, entry] : root.At(key).Entries()) known.push_back(name);
    for (const auto& [name, entry] : value.Entries()) {
      if (std::ranges::find(known, name) != known.end()) continue;
      if (merged.At(key).At(name).Find("model")) continue;
      entry.Fail("no entry '" + name + "' in '" + key + "' to override",
                 "one of " + internal::Join(known) + ", or a new entry with a model",
                 Nearest(name, known));
    }
  }
}

NamedEstimator BuildEstimator(const std::string& name, const Node& entry, const Config& config,
                              const PluginHost& host, const std::vector<StreamInfo>& streams,
                              const std::vector<NamedEstimator>& before) {
  CheckName(name, entry);
  NamedEstimator named;
  named.name = name;
  const Node type = entry.At("type", "an estimator");
  named.type = type.Text();
  const EstimatorType* const of_core = FindEstimatorType(named.type);
  const PluginEntry* const of_plugin =
      of_core == nullptr ? &FindOffered(named.type, host, type) : nullptr;
  named.kind = of_core != nullptr ? of_core->kind : of_plugin->estimator;
  const EstimatorMaker make =
      of_core != nullptr ? of_core->read(entry) : host.CreateEstimator(named.type, entry);
  if (const auto policy = entry.Find("on_divergence")) {
    named.on_divergence = static_cast<OnDivergence>(policy->Choice({"report", "fail"}));
  }
  const auto overrides = entry.Find("overrides");
  const Config own = overrides ? config.Merged(*overrides) : config;
  if (overrides) {
    CheckOverrides(*overrides, config.root(), own.root());
    named.overrides = overrides->ToYaml();
  }
  const std::vector<std::string> only = ReadSensorList(entry, own.root());
  const auto use = entry.Find("use");
  if (use && use->is_map()) use->Declare("accepted_by");
  internal::RefuseUnsupportedKeys(named.type, entry);
  entry.RejectUnread();
  named.system = BuildSystem(own.root(), host, only);
  if (of_core != nullptr) {
    internal::RefuseUnsupported(named.type, of_core->support, own.root(), named.system);
    internal::RefuseLoneMatches(entry, named.system);
  } else if (named.system.landmarks && !of_plugin->landmarks) {
    type.Fail("estimator type '" + named.type + "' does not support landmarks",
              "`sensors` that measure none, or type: ekf");
  }
  CheckStreams(own.root(), named.system, streams);
  const bool lent = use && use->is_map();  // landmarks are initialised as in the other estimator
  if (lent && named.system.landmarks) named.system.landmarks->min_observations = 1;
  named.estimator = make(named.system, streams);
  if (use)
    named.accepted_by = internal::ReadUse(*use, named, config.root().At("estimators"), before);
  return named;
}

std::vector<Segment> ReadSegments(const Node& root, const System& system,
                                  const std::vector<StreamInfo>& streams) {
  std::vector<Segment> segments;
  const auto evaluate = root.Find("evaluate");
  if (!evaluate) return segments;
  if (const auto list = evaluate->Find("segments")) {
    for (const auto& [name, entry] : list->Entries()) {
      internal::ExpectName(name, entry, "a segment");
      const auto with = entry.Find("with"), without = entry.Find("without");
      if (with.has_value() == without.has_value()) {
        entry.Fail("a segment is the timestamps with or without a valid measurement",
                   "one of with: SENSOR, without: SENSOR");
      }
      const Node& sensor = with ? *with : *without;
      const int index = system.FindSensor(sensor.Text());
      if (index < 0) {
        sensor.Fail("no sensor '" + sensor.Text() + "'", "a name from `sensors`",
                    Nearest(sensor.Text(), NamesOf(system.sensors)));
      }
      const SensorBinding& binding = system.sensors[static_cast<std::size_t>(index)];
      const int stream = FindStream(root.At("sensors").At(binding.name), binding.model, streams);
      segments.push_back({name, stream, with.has_value(), binding.model});
      entry.RejectUnread();
    }
  }
  evaluate->Declare("truth_sigma");
  evaluate->RejectUnread();
  return segments;
}

/// Refuses a truth that the config names where it belongs to no block, be it of `whole` or of an
/// estimator's own state.
void CheckTruths(const Node& source, const Experiment& experiment, const System& whole) {
  const auto listed = source.Find("truth");
  if (!listed || !listed->is_map()) return;
  const std::vector<StreamInfo>& truths = experiment.source->truths();
  for (std::size_t t = 0; t < truths.size(); ++t) {
    const auto node = listed->Find(truths[t].name);
    const auto has_block = [&](const NamedEstimator& one) {
      return internal::WhyNoBlock(one.system.layout, truths, t).empty();
    };
    const std::string why = internal::WhyNoBlock(whole.layout, truths, t);
    if (!node || why.empty() || std::ranges::any_of(experiment.estimators, has_block)) continue;
    std::vector<std::string> names;
    for (const Block& block : whole.layout.blocks()) {
      names.push_back(block.name);
      names.push_back(block.name.substr(block.owner.size() + 1));
    }
    std::erase(names, truths[t].name);
    node->Fail("truth of no block: " + why, "the name and size of one block, as in ENTRY.BLOCK",
               Nearest(truths[t].name, names));
  }
}

/// How the run takes frames that are not in the order of their stamps.
OutOfSequencePolicy ReadOutOfSequence(const Node& root) {
  OutOfSequencePolicy policy;
  const auto entry = root.Find("out_of_sequence");
  if (!entry) return policy;
  const Node chosen = entry->At("policy", "out_of_sequence");
  policy.policy = static_cast<OutOfSequence>(chosen.Choice({"reject", "buffer", "rollback"}));
  const auto window = entry->Find("window_s");
  if (window && policy.policy == OutOfSequence::kReject) {
    window->Fail("without a use: 'policy: reject' holds nothing back",
                 "'policy: buffer' or 'rollback'");
  }
  if (window) policy.window = StampFromSeconds(window->Number(0.0, 1e9));
  if (!window && policy.policy == OutOfSequence::kRollback) {
    chosen.Fail("'rollback' without 'window_s'",
                "'window_s', how far out of sequence a frame may be");
  }
  entry->RejectUnread();
  return policy;
}

/// For each stream the first sensor of the config that it goes to; behind them those of none.
std::vector<int> RanksOf(const std::vector<StreamInfo>& streams, const System& system) {
  std::vector<int> ranks;
  for (const StreamInfo& stream : streams) {
    const auto first = std::ranges::find(system.sensors, stream.name, &SensorBinding::stream);
    ranks.push_back(static_cast<int>(first - system.sensors.begin()));
  }
  return ranks;
}

/// Index of the estimator that metrics compare with; -1: truth.
int ReadReference(const Node& root, const std::vector<NamedEstimator>& estimators) {
  const auto reference = root.Find("reference");
  if (!reference || reference->Text() == "truth") return -1;
  const std::string name = reference->Text();
  const auto found = std::ranges::find(estimators, name, &NamedEstimator::name);
  if (found == estimators.end()) {
    std::vector<std::string> names = NamesOf(estimators);
    const std::string expected = "truth, or an estimator: " + internal::Join(names);
    names.emplace_back("truth");
    reference->Fail("no estimator '" + name + "'", expected, Nearest(name, names));
  }
  return static_cast<int>(found - estimators.begin());
}

/// Refuses an estimator that cannot do what the run asks for out-of-sequence frames.
void CheckCanRollBack(const NamedEstimator& named, const Node& entry) {
  if (named.estimator->offline() || named.estimator->Save() != nullptr) return;
  entry.At("type").Fail(
      "'" + named.type + "' cannot roll back for an out-of-sequence frame",
      "another type under 'out_of_sequence.policy: rollback', or 'out_of_sequence.policy: buffer'");
}

/// Adds the estimator of a config that has the calibration of the data.
void AddCalibrated(const Config& config, const PluginHost& host, const std::string& name,
                   Experiment& experiment) {
  const Node entry = config.root().At("estimators").At(name);
  NamedEstimator named = BuildEstimator(name, entry, config, host, experiment.source->streams(),
                                        experiment.estimators);
  if (experiment.out_of_sequence.policy == OutOfSequence::kRollback) CheckCanRollBack(named, entry);
  experiment.estimators.push_back(std::move(named));
}

/// Keys of the root that are read before the calibration is there, or by other commands.
void DeclareCommon(const Node& root) {
  for (const char* key :
       {"alidade", "plugins", "include", "title", "output", "source", "out_of_sequence"}) {
    root.Declare(key);
  }
  // Of the calibration of a pair, one of whose cameras may be used alone.
  if (const auto camera = root.Find("camera")) camera->Declare("baseline_m");
}

/// The plugins that the source, the estimators and their models come from, as far as they were
/// built without optimisation.
std::set<std::string> UnoptimisedOf(const Experiment& experiment, const std::string& source,
                                    const PluginHost& host) {
  std::set<std::filesystem::path> models;
  std::set<std::string> estimators;
  for (const NamedEstimator& one : experiment.estimators) {
    estimators.insert(one.type);
    for (const auto& sensor : one.system.sensors) models.insert(sensor.model.instance().plugin());
    for (const auto& motion : one.system.motions) models.insert(motion.model.instance().plugin());
  }
  std::set<std::string> files;
  for (const PluginEntry& entry : host.entries()) {
    const bool used = entry.kind == PluginEntry::Kind::kSource ? entry.name == source
                      : entry.kind == PluginEntry::Kind::kEstimator
                          ? estimators.contains(entry.name)
                          : models.contains(entry.plugin);
    if (used && entry.unoptimised) files.insert(entry.plugin.filename().string());
  }
  return files;
}

}  // namespace

std::vector<std::filesystem::path> PluginPaths(const Config& config) {
  std::vector<std::filesystem::path> paths;
  if (const auto list = config.root().Find("plugins")) {
    for (const Node& item : list->Items()) {
      const std::filesystem::path path = item.Text();
      if (path.empty()) item.Fail("empty path", "a plugin file, or a folder of plugins");
      paths.push_back(path.is_absolute() ? path : config.folder() / path);
    }
  }
  return paths;
}

void internal::AddEstimator(const Config& config, const PluginHost& host, const std::string& name,
                            Experiment& experiment) {
  AddCalibrated(WithCalibration(config, *experiment.source), host, name, experiment);
}

Experiment BuildExperiment(const Config& config, const PluginHost& host) {
  CheckSchema(config.root());
  for (const char* key : {"title", "output"}) {
    if (const auto text = config.root().Find(key)) static_cast<void>(text->Text());
  }

  Experiment experiment;
  const Node source = config.root().At("source", "a run: where measurements come from");
  if (const auto seed = source.Find("seed")) {
    experiment.seed = static_cast<std::uint64_t>(seed->Integer(0, INT64_MAX));
  }
  experiment.out_of_sequence = ReadOutOfSequence(config.root());
  experiment.source = host.CreateSource(
      source.At("type", "a source").Text(), source, experiment.seed, config.folder(),
      experiment.out_of_sequence.policy != OutOfSequence::kReject);
  const Config calibrated = internal::WithCalibration(config, *experiment.source);
  source.RejectUnread();
  const Node root = calibrated.root();
  DeclareCommon(root);
  const std::vector<StreamInfo>& streams = experiment.source->streams();

  // Every sensor is checked, whether or not an estimator uses it.
  const System whole = BuildSystem(root, host, {});
  CheckStreams(root, whole, streams);
  experiment.out_of_sequence.ranks = RanksOf(streams, whole);
  experiment.segments = ReadSegments(root, whole, streams);
  for (const auto& [name, entry] : root.At("estimators", "a run").Entries()) {
    AddCalibrated(calibrated, host, name, experiment);
  }
  if (experiment.estimators.empty()) {
    root.At("estimators").Fail("empty", "at least one estimator");
  }
  experiment.reference = ReadReference(root, experiment.estimators);
  experiment.truth_sigmas =
      internal::ReadTruthSigmas(root, experiment.source->truths(), experiment.reference < 0);
  CheckTruths(source, experiment, whole);
  experiment.unoptimised = UnoptimisedOf(experiment, source.At("type").Text(), host);
  root.RejectUnread();
  return experiment;
}

}  // namespace alidade
