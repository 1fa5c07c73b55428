// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "alidade/base/text.h"
#include "alidade/config/tree.h"
#include "alidade/estimation/filter.h"
#include "alidade/experiment/build_estimator.h"
#include "alidade/experiment/calibration.h"
#include "alidade/experiment/estimator_guide.h"
#include "alidade/experiment/read_problem.h"
#include "alidade/experiment/run.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/io/text_table.h"
#include "alidade/plugin/plugin_host.h"

namespace alidade {
namespace {

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

std::vector<Segment> ReadSegments(const Node& root, const Problem& problem,
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
      const int index = problem.FindSensor(sensor.Text());
      if (index < 0) {
        sensor.Fail("no sensor '" + sensor.Text() + "'", "a name from `sensors`",
                    Nearest(sensor.Text(), NamesOf(problem.sensors)));
      }
      const SensorBinding& binding = problem.sensors[static_cast<std::size_t>(index)];
      const int stream =
          internal::FindStream(root.At("sensors").At(binding.name), *binding.model, streams);
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
void CheckTruths(const Node& source, const Experiment& experiment, const Problem& whole) {
  const auto listed = source.Find("truth");
  if (!listed || !listed->is_map()) return;
  const std::vector<StreamInfo>& truths = experiment.source->truths();
  for (std::size_t t = 0; t < truths.size(); ++t) {
    const auto node = listed->Find(truths[t].name);
    const auto has_block = [&](const EstimatorSpec& one) {
      return internal::WhyNoBlock(one.problem.layout, truths, t).empty();
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

/// How the run takes frames that are not in the order of their timestamps.
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
  if (window) policy.window = TimestampFromSeconds(window->Number(0.0, 1e9));
  if (!window && policy.policy == OutOfSequence::kRollback) {
    chosen.Fail("'rollback' without 'window_s'",
                "'window_s', how far out of sequence a frame may be");
  }
  entry->RejectUnread();
  return policy;
}

/// For each stream the first sensor of the config that it goes to; behind them those of none.
std::vector<int> RanksOf(const std::vector<StreamInfo>& streams, const Problem& problem) {
  std::vector<int> ranks;
  for (const StreamInfo& stream : streams) {
    const auto first = std::ranges::find(problem.sensors, stream.name, &SensorBinding::stream);
    ranks.push_back(static_cast<int>(first - problem.sensors.begin()));
  }
  return ranks;
}

/// Index of the estimator that metrics compare with; -1: truth.
int ReadReference(const Node& root, const std::vector<EstimatorSpec>& estimators) {
  const auto reference = root.Find("reference");
  if (!reference || reference->Text() == "truth") return -1;
  const std::string name = reference->Text();
  const auto found = std::ranges::find(estimators, name, &EstimatorSpec::name);
  if (found == estimators.end()) {
    std::vector<std::string> names = NamesOf(estimators);
    const std::string expected = "truth, or an estimator: " + internal::Join(names);
    names.emplace_back("truth");
    reference->Fail("no estimator '" + name + "'", expected, Nearest(name, names));
  }
  return static_cast<int>(found - estimators.begin());
}

/// What may stand under `guide`: the recursive filters of the config.
std::string GuidesOf(const std::vector<EstimatorSpec>& estimators) {
  std::vector<std::string> names;
  for (const EstimatorSpec& one : estimators) {
    if (one.estimator->AsFilter() != nullptr) names.push_back(one.name);
  }
  return names.empty() ? "none, for `estimators` has no recursive filter, as of type ekf"
                       : "a recursive filter of `estimators`: " + internal::Join(names);
}

/// The filter that guides the source, by its key `guide`; null: none does.
const Filter* ReadGuide(const Node& source, const Experiment& experiment) {
  const std::string name = experiment.source->guided_by();
  if (name.empty()) return nullptr;
  const Node guide = source.At("guide");
  if (experiment.out_of_sequence.policy != OutOfSequence::kReject) {
    guide.Fail("a filter that guides has to process each frame before the next is measured",
               "out_of_sequence: {policy: reject}");
  }
  const std::vector<EstimatorSpec>& estimators = experiment.estimators;
  const auto found = std::ranges::find(estimators, name, &EstimatorSpec::name);
  if (found == estimators.end()) {
    const std::vector<std::string> names = NamesOf(estimators);
    guide.Fail("no estimator '" + name + "'", GuidesOf(estimators), Nearest(name, names));
  }
  const auto* const filter = found->estimator->AsFilter();
  if (filter == nullptr) {
    guide.Fail("estimator '" + name + "' (" + found->type + ") predicts no measurements",
               GuidesOf(estimators));
  }
  const std::vector<StreamInfo>& streams = experiment.source->streams();
  const bool can = std::ranges::any_of(streams, [&](const StreamInfo& stream) {
    return internal::GuidingSensor(filter->problem(), stream.name) != nullptr;
  });
  if (!can) {
    guide.Fail("estimator '" + name + "' has no sensor that tells where features are",
               "a sensor on a stream of the source that takes no known numbers");
  }
  return filter;
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

/// `evaluate.truth_sigma` of the config's root: for each truth of the source the standard deviation
/// of its elements; empty where the key is not there. Errors: kBadConfig for a name that is no
/// truth's, a number below 0, and under a `reference` that is no truth.
std::vector<double> ReadTruthSigmas(const Node& root, const std::vector<StreamInfo>& truths,
                                    bool is_reference) {
  const auto evaluate = root.Find("evaluate");
  const auto map = evaluate ? evaluate->Find("truth_sigma") : std::nullopt;
  if (!map) return {};
  if (!is_reference)
    map->Fail("without a use: the reference is an estimator", "'reference: truth'");
  std::vector<double> sigmas(truths.size(), 0.0);
  for (const auto& [name, entry] : map->Entries()) {
    const auto truth = std::ranges::find(truths, name, &StreamInfo::name);
    if (truth == truths.end()) {
      const std::vector<std::string> names = NamesOf(truths);
      entry.Fail("no truth '" + name + "'",
                 "a truth of the source" + (names.empty() ? "" : ": " + internal::Join(names)),
                 Nearest(name, names));
    }
    sigmas[static_cast<std::size_t>(truth - truths.begin())] =
        entry.Number(0.0, std::numeric_limits<double>::max());
  }
  return sigmas;
}

void AddWords(const Node& node, std::set<std::string>& words) {
  if (node.kind() == Node::Kind::kScalar) words.insert(node.Text());
  if (node.kind() == Node::Kind::kList) {
    for (const Node& item : node.Items()) AddWords(item, words);
  }
  if (!node.is_map()) return;
  for (const auto& [key, value] : node.Entries()) {
    words.insert(key);
    AddWords(value, words);
  }
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

std::set<std::string> WordsOf(const Config& config) {
  const Config copy = config.Copy();  // nothing of the original counts as read
  std::set<std::string> words;
  AddWords(copy.root(), words);
  return words;
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
  experiment.source = CreateSource(host, config, experiment.seed,
                                   experiment.out_of_sequence.policy != OutOfSequence::kReject);
  const Config calibrated = internal::WithCalibration(config, *experiment.source);
  source.RejectUnread();
  const Node root = calibrated.root();
  DeclareCommon(root);
  const std::vector<StreamInfo>& streams = experiment.source->streams();

  // Every sensor is checked, whether or not an estimator uses it.
  const Problem whole = ReadProblem(root, host, {});
  internal::CheckStreams(root, whole, streams);
  experiment.out_of_sequence.ranks = RanksOf(streams, whole);
  experiment.segments = ReadSegments(root, whole, streams);
  for (const auto& [name, entry] : root.At("estimators", "a run").Entries()) {
    internal::AddEstimator(calibrated, host, name, experiment);
  }
  if (experiment.estimators.empty()) {
    root.At("estimators").Fail("empty", "at least one estimator");
  }
  experiment.reference = ReadReference(root, experiment.estimators);
  experiment.guide = ReadGuide(source, experiment);
  experiment.truth_sigmas =
      ReadTruthSigmas(root, experiment.source->truths(), experiment.reference < 0);
  CheckTruths(source, experiment, whole);
  root.RejectUnread();
  return experiment;
}

}  // namespace alidade
