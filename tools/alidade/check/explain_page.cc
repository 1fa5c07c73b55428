// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <nlohmann/json.hpp>

#include "alidade/base/text.h"
#include "alidade/check/explain.h"
#include "alidade/check/explain_parts.h"
#include "alidade/check/plugin_listing.h"
#include "alidade/estimation/observability.h"
#include "alidade/experiment/estimator_plugin.h"
#include "alidade/experiment/source_plugin.h"
#include "alidade/report/page_text.h"

namespace alidade {
namespace {

using internal::ExplainedProblem;
using internal::Json;

/// Describes the sensors. `effects` lists the blocks of the roles with the effect on each.
Json SensorsJson(const Problem& problem) {
  Json list = Json::array();
  for (const SensorBinding& sensor : problem.sensors) {
    Json effects = Json::array();
    for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
      const RoleBinding& role = sensor.roles[i];
      if (role.block >= 0) {
        const Block& block = problem.layout[role.block];
        effects.push_back({block.name, internal::EffectText(block, role.mode)});
      } else if (sensor.model->roles()[i].landmark()) {
        effects.push_back({internal::kLandmarks, "corrects"});
      }
    }
    list.push_back({{"name", sensor.name},
                    {"stream", sensor.stream},
                    {"model", sensor.model->name()},
                    {"noise", internal::MeasurementNoise(problem, sensor)},
                    {"effects", effects}});
  }
  return list;
}

Json BlocksJson(const Problem& problem) {
  Json list = Json::array();
  for (const Prior& prior : problem.priors) {
    const Block& block = problem.layout[prior.block];
    list.push_back({{"name", block.name},
                    {"unit", internal::UnitOf(problem, prior.block)},
                    {"status", internal::StatusText(block.status)},
                    {"prior", internal::PriorText(prior, block)}});
  }
  if (problem.landmarks) {
    list.push_back(
        {{"name", internal::kLandmarks}, {"unit", "m"}, {"status", "estimated"}, {"prior", ""}});
  }
  return list;
}

Json MotionsJson(const Problem& problem, double step_s) {
  Json list = Json::array();
  for (const MotionBinding& motion : problem.motions) {
    Json effects = Json::array();
    for (const BlockId id : motion.blocks) {
      const Block& block = problem.layout[id];
      const bool is_constant = block.status == BlockStatus::kConstant;
      effects.push_back({block.name, is_constant ? "knows" : "moves"});
    }
    list.push_back({{"name", motion.name},
                    {"model", motion.model->name()},
                    {"input", motion.input.stream},
                    {"noise", internal::ProcessNoise(problem, motion, step_s)},
                    {"effects", effects}});
  }
  return list;
}

Json ProblemJson(const Config& config, const ExplainedProblem& explained, double step_s) {
  Json estimators = Json::array(), tables = Json::array();
  for (const EstimatorSpec* spec : explained.estimators) {
    const Node entry = config.root().At("estimators").At(spec->name);
    estimators.push_back({{"name", spec->name},
                          {"type", spec->type},
                          {"options", internal::OptionRows(entry, *spec)}});
  }
  for (const internal::ExplainedTable& table : explained.tables) {
    tables.push_back({{"title", table.title}, {"rows", table.rows}, {"notes", table.notes}});
  }
  const Problem& problem = explained.estimators.front()->problem;
  return {{"estimators", estimators},
          {"sensors", SensorsJson(problem)},
          {"blocks", BlocksJson(problem)},
          {"motions", MotionsJson(problem, step_s)},
          {"tables", tables},
          {"observability", explained.observability}};
}

Json StreamsJson(const Config& config, const Source& source) {
  Json list = Json::array();
  for (const StreamInfo& stream : source.streams()) {
    list.push_back({{"name", stream.name},
                    {"size", stream.size},
                    {"users", internal::UsersOf(config, stream.name)}});
  }
  return list;
}

/// Appends a row for each scalar and list of a map: path, value, unit and meaning. `keys` are the
/// documented keys of the entry at `entry_path`, whose keys are relative to this path.
void AppendKeys(const Node& map, const std::string& path, const std::string& entry_path,
                const std::vector<ParamInfo>& keys, Json& rows) {
  for (const auto& [name, value] : map.Entries()) {
    const std::string key = path.empty() ? name : path + '.' + name;
    if (value.is_map()) {
      AppendKeys(value, key, entry_path, keys, rows);
      continue;
    }
    const bool is_inside = key.size() > entry_path.size() && !entry_path.empty();
    const std::string relative = is_inside ? key.substr(entry_path.size() + 1) : key;
    const auto info = std::ranges::find(keys, relative, &ParamInfo::key);
    const bool is_known = info != keys.end();
    std::string text = value.kind() == Node::Kind::kScalar ? value.Text() : value.ToYaml();
    if (value.is_filled()) text += " (filled in)";
    rows.push_back({key, text, is_known ? info->unit : "", is_known ? info->doc : ""});
  }
}

/// Keys that the framework reads from the entries of a section, with their meanings.
std::vector<ParamInfo> SectionKeys(const std::string& section) {
  const auto key = [](const char* name, const char* doc) {
    return ParamInfo{name, "", doc, "", "", "", {}, ""};
  };
  if (section == "sensors") {
    return {key("model", "sensor model"), key("stream", "stream of the source"),
            key("loss.huber", "threshold of the robust loss, in sigma")};
  }
  if (section == "state") {
    return {key("model", "motion model"), key("constant", "blocks that are known exactly"),
            key("consider", "blocks that are not corrected (Schmidt)")};
  }
  return {key("type", section == "source" ? "type of the source" : "type of the estimator"),
          key("seed", "seed of the random numbers")};
}

/// Returns a row for each key of the config: path, value, unit and meaning.
Json KeysJson(const Config& config, const PluginHost& host) {
  Json rows = Json::array();
  const auto append_entry = [&](const Node& entry, const std::string& path,
                                const std::string& section, const char* kind) {
    const auto model = entry.Find(section == "sensors" || section == "state" ? "model" : "type");
    std::vector<ParamInfo> keys = SectionKeys(section);
    if (model) {
      const std::vector<ParamInfo> more = internal::KeysOf(host, kind, model->Text());
      keys.insert(keys.end(), more.begin(), more.end());
    }
    AppendKeys(entry, path, path, keys, rows);
  };
  const std::vector<ParamInfo> none;
  for (const auto& [section, value] : config.root().Entries()) {
    const char* const kind = section == "sensors"      ? kSensorKind
                             : section == "state"      ? kMotionKind
                             : section == "estimators" ? kEstimatorKind
                             : section == "source"     ? kSourceKind
                                                       : nullptr;
    if (section == "source") {
      append_entry(value, section, section, kind);
    } else if (kind != nullptr) {
      for (const auto& [name, entry] : value.Entries()) {
        append_entry(entry, section + '.' + name, section, kind);
      }
    } else if (value.is_map()) {
      AppendKeys(value, section, "", none, rows);
    } else {
      rows.push_back(
          {section, value.kind() == Node::Kind::kScalar ? value.Text() : value.ToYaml(), "", ""});
    }
  }
  return rows;
}

}  // namespace

std::string ExplainPage(const Config& config, const Experiment& experiment,
                        const PluginHost& host) {
  const double step_s = internal::NominalStep(config);
  Json problems = Json::array();
  for (const ExplainedProblem& explained : internal::ExplainProblems(experiment, step_s)) {
    problems.push_back(ProblemJson(config, explained, step_s));
  }
  const auto title = config.root().Find("title");
  const std::filesystem::path name(config.name());
  return internal::PageText({{"title", title ? title->Text() : name.stem().string()},
                             {"config_file", name.filename().string()},
                             {"config", config.ToYaml()},
                             {"explain",
                              {{"step_s", step_s},
                               {"source", internal::ExplainSource(config, experiment)},
                               {"streams", StreamsJson(config, *experiment.source)},
                               {"problems", problems},
                               {"keys", KeysJson(config, host)}}}},
                            internal::ColumnPool());
}

}  // namespace alidade
