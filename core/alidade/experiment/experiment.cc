// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/base/text.h"
#include "alidade/config/tree.h"
#include "alidade/estimation/filter.h"
#include "alidade/experiment/build_estimator.h"
#include "alidade/experiment/calibration.h"
#include "alidade/experiment/estimator_guide.h"
#include "alidade/experiment/name_in_entry.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/experiment/read_report.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/short_forms.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/experiment/stream_patterns.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/io/text_table.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {
namespace {

using internal::NamesOf;

constexpr int kSchema = 1;

void CheckSchema(const Node& root) {
  const Node version = root.At("alidade", "every config, because it is the version of the schema",
                               "the first line `alidade: 1`");
  const std::int64_t config_version = version.Integer(1, 1'000'000);
  if (config_version > kSchema) {
    version.Fail("schema version " + std::to_string(config_version) + " is newer than this program",
                 "at most " + std::to_string(kSchema) + ", or a newer version of alidade");
  }
}

/// Reads {with: SENSOR} or {without: SENSOR}, {from_s: T, to_s: T}, or both.
Segment ReadSegment(const std::string& name, const Node& entry, const Node& root,
                    const Problem& problem, const std::vector<StreamInfo>& streams) {
  constexpr const char* kConditions =
      "`with: SENSOR` or `without: SENSOR`, or `from_s` and `to_s`, times in s";
  constexpr double kMaxTime_s = 9.2e9;
  internal::ExpectName(name, entry, "a segment");
  entry.ExpectMap("{with: SENSOR}, or {from_s: 10, to_s: 30}");
  Segment segment{.name = name};
  const auto with_node = entry.Find("with"), without_node = entry.Find("without");
  const auto first = entry.Find("from_s"), last = entry.Find("to_s");
  entry.RejectUnread();
  if (with_node && without_node) {
    entry.Fail("a segment cannot have `with` and `without`", kConditions);
  }
  if (!with_node && !without_node && !first && !last) {
    entry.Fail("a segment needs a condition", kConditions);
  }
  if (first) segment.first = TimestampFromSeconds(first->Number(-kMaxTime_s, kMaxTime_s));
  if (last) segment.last = TimestampFromSeconds(last->Number(-kMaxTime_s, kMaxTime_s));
  if (segment.first > segment.last)
    last->Fail("the segment ends before it begins", "at least from_s");
  if (!with_node && !without_node) return segment;
  const Node& sensor = with_node ? *with_node : *without_node;
  const int index = problem.FindSensor(sensor.Text());
  if (index < 0) {
    sensor.Fail("sensor '" + sensor.Text() + "' does not exist", "a name from `sensors`",
                Nearest(sensor.Text(), NamesOf(problem.sensors)));
  }
  const SensorBinding& binding = problem.sensors[static_cast<std::size_t>(index)];
  segment.sensor = binding.model;
  segment.stream =
      internal::FindStream(root.At("sensors").At(binding.name), *binding.model, streams);
  segment.has_measurement = with_node.has_value();
  return segment;
}

std::vector<Segment> ReadSegments(const Node& root, const Problem& problem,
                                  const std::vector<StreamInfo>& streams) {
  std::vector<Segment> segments;
  const auto evaluate = root.Find("evaluate");
  if (!evaluate) return segments;
  if (const auto list = evaluate->Find("segments")) {
    for (const auto& [name, entry] : list->Entries()) {
      segments.push_back(ReadSegment(name, entry, root, problem, streams));
    }
  }
  evaluate->Declare("truth_sigma");
  evaluate->RejectUnread();
  return segments;
}

/// Returns the unit of each ambient element, or "" for an element without a unit.
std::vector<std::string> ElementUnits(const Space& space) {
  std::vector<std::string> units;
  std::size_t part_index = 0;
  space.geometry.ForEachPart([&](const Geometry& part, int, int) {
    std::string unit = space.part_units.empty() ? space.unit : space.part_units[part_index++];
    if (!part.is_vector() && !part.is_angle()) unit.clear();
    units.insert(units.end(), static_cast<std::size_t>(part.ambient), unit);
  });
  return units;
}

/// Rejects a stream whose unit differs in dimension from that of the measurement or control input.
void CheckUnits(const Source& source, const Problem& problem) {
  const auto check = [&](const std::string& stream, const Space& space, const std::string& owner) {
    const auto found = std::ranges::find(source.streams(), stream, &StreamInfo::name);
    const auto index = static_cast<std::size_t>(found - source.streams().begin());
    source.CheckUnits(index, ElementUnits(space), owner);
  };
  for (const SensorBinding& sensor : problem.sensors) {
    check(sensor.stream, sensor.model->measurement(), "sensor '" + sensor.name + '\'');
  }
  for (const MotionBinding& motion : problem.motions) {
    if (!motion.model->has_input()) continue;
    check(motion.input.stream, motion.model->input(),
          "the control input of '" + motion.name + '\'');
  }
}

/// Returns the maps of true values in the config: that of the source and those of its files.
std::vector<Node> TruthMaps(const Node& source) {
  std::vector<Node> entries = {source};
  if (const auto files = source.Find("files")) {
    for (const Node& file : files->ItemsOrOne()) entries.push_back(file);
  }
  std::vector<Node> maps;
  for (const Node& entry : entries) {
    const auto map = entry.is_map() ? entry.Find("truth") : std::nullopt;
    if (map && map->is_map()) maps.push_back(*map);
  }
  return maps;
}

/// Rejects a truth in the config that does not match any block of `full_problem` or of an
/// estimator. `full_problem` contains all sensors.
void CheckTruths(const Node& source, const Experiment& experiment, const Problem& full_problem) {
  const std::vector<StreamInfo>& truths = experiment.source->truths();
  const auto check = [&](const std::string& name, const Node& node) {
    const auto truth = std::ranges::find(truths, name, &StreamInfo::name);
    const auto t = static_cast<std::size_t>(truth - truths.begin());
    const auto has_block = [&](const EstimatorSpec& estimator) {
      return internal::WhyNoBlock(estimator.problem.layout, truths, t).empty();
    };
    if (truth == truths.end() || std::ranges::any_of(experiment.estimators, has_block)) return;
    const std::string reason = internal::WhyNoBlock(full_problem.layout, truths, t);
    if (reason.empty()) return;
    std::vector<std::string> names;
    for (const Block& block : full_problem.layout.blocks()) {
      names.push_back(block.name);
      names.push_back(internal::NameInEntry(block));
    }
    std::erase(names, name);
    node.Fail("the truth does not match a block: " + reason,
              "the name and size of one block, as in ENTRY.BLOCK", Nearest(name, names));
  };
  for (const Node& map : TruthMaps(source)) {
    for (const auto& [name, node] : map.Entries()) check(name, node);
  }
}

/// Reads the policy for frames that do not arrive in the order of their timestamps.
OutOfSequencePolicy ReadOutOfSequence(const Node& root) {
  OutOfSequencePolicy policy;
  const auto entry = root.Find("out_of_sequence");
  if (!entry) return policy;
  const Node policy_node = entry->At("policy", "out_of_sequence");
  policy.policy = static_cast<OutOfSequence>(policy_node.Choice({"reject", "buffer", "rollback"}));
  const auto window = entry->Find("window_s");
  if (window && policy.policy == OutOfSequence::kReject) {
    window->Fail("this key has no effect, because 'policy: reject' does not buffer frames",
                 "'policy: buffer' or 'policy: rollback'");
  }
  if (window) policy.window = TimestampFromSeconds(window->Number(0.0, 1e9));
  if (!window && policy.policy == OutOfSequence::kRollback) {
    policy_node.Fail("'policy: rollback' needs the key 'window_s'",
                     "'window_s', the largest lag of an out-of-sequence frame in seconds");
  }
  entry->RejectUnread();
  return policy;
}

/// Returns the rank of each stream: the index of the first sensor that reads the stream, or the
/// number of sensors if no sensor does.
std::vector<int> RanksOf(const std::vector<StreamInfo>& streams, const Problem& problem) {
  std::vector<int> ranks;
  for (const StreamInfo& stream : streams) {
    const auto first = std::ranges::find(problem.sensors, stream.name, &SensorBinding::stream);
    ranks.push_back(static_cast<int>(first - problem.sensors.begin()));
  }
  return ranks;
}

/// Returns the index of the reference estimator of the metrics, or -1 for truth.
int ReadReference(const Node& root, const std::vector<EstimatorSpec>& estimators) {
  const auto reference = root.Find("reference");
  if (!reference || reference->Text() == "truth") return -1;
  const std::string name = reference->Text();
  const auto found = std::ranges::find(estimators, name, &EstimatorSpec::name);
  if (found == estimators.end()) {
    std::vector<std::string> names = NamesOf(estimators);
    const std::string expected = "truth, or an estimator: " + internal::Join(names);
    names.emplace_back("truth");
    reference->Fail("estimator '" + name + "' does not exist", expected, Nearest(name, names));
  }
  return static_cast<int>(found - estimators.begin());
}

/// Returns a text that describes the accepted values of `guide`: the recursive filters of the
/// config.
std::string GuideChoices(const std::vector<EstimatorSpec>& estimators) {
  std::vector<std::string> names;
  for (const EstimatorSpec& spec : estimators) {
    if (spec.estimator->AsFilter() != nullptr) names.push_back(spec.name);
  }
  return names.empty() ? "a recursive filter; add one to `estimators`, for example of type ekf"
                       : "a recursive filter of `estimators`: " + internal::Join(names);
}

/// Returns the filter that guides the source according to its key `guide`, or null.
const Filter* ReadGuide(const Node& source, const Experiment& experiment) {
  const std::string name = experiment.source->guide_name();
  if (name.empty()) return nullptr;
  const Node guide = source.At("guide");
  if (experiment.out_of_sequence.policy != OutOfSequence::kReject) {
    guide.Fail("a guiding filter must process each frame before the source measures the next one",
               "out_of_sequence: {policy: reject}");
  }
  const std::vector<EstimatorSpec>& estimators = experiment.estimators;
  const auto found = std::ranges::find(estimators, name, &EstimatorSpec::name);
  if (found == estimators.end()) {
    const std::vector<std::string> names = NamesOf(estimators);
    guide.Fail("estimator '" + name + "' does not exist", GuideChoices(estimators),
               Nearest(name, names));
  }
  const auto* const filter = found->estimator->AsFilter();
  if (filter == nullptr) {
    guide.Fail("estimator '" + name + "' (" + found->type + ") cannot predict measurements",
               GuideChoices(estimators));
  }
  const std::vector<StreamInfo>& streams = experiment.source->streams();
  const bool can_guide = std::ranges::any_of(streams, [&](const StreamInfo& stream) {
    return internal::GuidingSensor(filter->problem(), stream.name) != nullptr;
  });
  if (!can_guide) {
    guide.Fail("estimator '" + name + "' has no sensor that can guide the source",
               "a sensor that has no known numbers and uses a stream of the source");
  }
  return filter;
}

/// Declares the keys of the root that were read before the calibration was added, or that other
/// commands read.
void DeclareCommon(const Node& root) {
  for (const char* key :
       {"alidade", "plugins", "include", "title", "output", "source", "out_of_sequence"}) {
    root.Declare(key);
  }
  // The calibration of a stereo pair contains a baseline, even if the sensors use only one camera.
  if (const auto camera = root.Find("camera")) camera->Declare("baseline_m");
}

/// Reads `evaluate.truth_sigma`, which contains the standard deviation of the elements of each
/// truth of the source. Returns an empty list if the key is missing. Errors: kBadConfig for an
/// unknown truth, a number below 0, or a `reference` that is not truth.
std::vector<double> ReadTruthSigmas(const Node& root, const std::vector<StreamInfo>& truths,
                                    bool is_truth_reference) {
  const auto evaluate = root.Find("evaluate");
  const auto map = evaluate ? evaluate->Find("truth_sigma") : std::nullopt;
  if (!map) return {};
  if (!is_truth_reference)
    map->Fail("this key has no effect, because the reference is an estimator",
              "'reference: truth'");
  std::vector<double> sigmas(truths.size(), 0.0);
  for (const auto& [name, entry] : map->Entries()) {
    const auto truth = std::ranges::find(truths, name, &StreamInfo::name);
    if (truth == truths.end()) {
      const std::vector<std::string> names = NamesOf(truths);
      entry.Fail("the source has no truth '" + name + "'",
                 "a truth of the source" + (names.empty() ? "" : ": " + internal::Join(names)),
                 Nearest(name, names));
    }
    sigmas[static_cast<std::size_t>(truth - truths.begin())] =
        entry.Number(0.0, std::numeric_limits<double>::max());
  }
  return sigmas;
}

void AddKeysAndScalars(const Node& node, std::set<std::string>& words) {
  if (node.kind() == Node::Kind::kScalar) words.insert(node.Text());
  if (node.kind() == Node::Kind::kList) {
    for (const Node& item : node.Items()) AddKeysAndScalars(item, words);
  }
  if (!node.is_map()) return;
  for (const auto& [key, value] : node.Entries()) {
    words.insert(key);
    AddKeysAndScalars(value, words);
  }
}

}  // namespace

std::vector<std::filesystem::path> PluginPaths(const Config& config) {
  std::vector<std::filesystem::path> paths;
  if (const auto list = config.root().Find("plugins")) {
    for (const Node& item : list->Items()) {
      const std::filesystem::path path = item.Text();
      if (path.empty()) item.Fail("the path is empty", "a plugin file, or a folder of plugins");
      paths.push_back(path.is_absolute() ? path : config.folder() / path);
    }
  }
  return paths;
}

std::set<std::string> KeysAndScalarsOf(const Config& config) {
  // Reading the copy does not mark keys of the original as read.
  const Config copy = config.Copy();
  std::set<std::string> words;
  AddKeysAndScalars(copy.root(), words);
  return words;
}

Experiment BuildExperiment(const Config& written, const PluginHost& host) {
  const Config config = written.Copy();
  CheckSchema(config.root());
  for (const char* key : {"title", "output"}) {
    if (const auto text = config.root().Find(key)) static_cast<void>(text->Text());
  }

  Experiment experiment;
  const Node source = config.root().At("source", "a run, because it provides the measurements");
  if (const auto seed = source.Find("seed")) {
    experiment.seed = static_cast<std::uint64_t>(seed->Integer(0, INT64_MAX));
  }
  experiment.out_of_sequence = ReadOutOfSequence(config.root());
  experiment.source = CreateSource(host, config, experiment.seed,
                                   experiment.out_of_sequence.policy != OutOfSequence::kReject);
  Config calibrated = internal::WithCalibration(config, *experiment.source);
  ExpandStreamPatterns(calibrated, experiment.source->streams());
  ExpandShortForms(calibrated, host);
  experiment.config = internal::WithoutCalibration(calibrated);
  source.RejectUnread();
  const Node root = calibrated.root();
  DeclareCommon(root);
  const std::vector<StreamInfo>& streams = experiment.source->streams();

  // Check every sensor, even if no estimator uses it.
  const Problem full_problem = ReadProblem(root, host, {});
  internal::CheckStreams(root, full_problem, streams);
  experiment.out_of_sequence.ranks = RanksOf(streams, full_problem);
  experiment.segments = ReadSegments(root, full_problem, streams);
  experiment.report_rows = internal::ReadReportRows(root, full_problem, experiment.segments);
  constexpr const char* kEstimators = "[ekf, ukf]";
  const Node estimators = root.At("estimators", "a run", "estimators: [ekf]");
  estimators.ExpectMap("{ekf: {gate: 0.999}}, or a list of types, as in [ekf, ukf]");
  for (const auto& [name, entry] : estimators.Entries()) {
    internal::AddEstimator(calibrated, host, name, experiment);
  }
  if (experiment.estimators.empty()) {
    estimators.Fail("there are no estimators",
                    "at least one estimator, as in " + std::string(kEstimators));
  }
  experiment.reference = ReadReference(root, experiment.estimators);
  experiment.guide = ReadGuide(source, experiment);
  experiment.truth_sigmas =
      ReadTruthSigmas(root, experiment.source->truths(), experiment.reference < 0);
  CheckTruths(source, experiment, full_problem);
  CheckUnits(*experiment.source, full_problem);
  for (const EstimatorSpec& spec : experiment.estimators) {
    CheckUnits(*experiment.source, spec.problem);
  }
  root.RejectUnread();
  return experiment;
}

}  // namespace alidade
