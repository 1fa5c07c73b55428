// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/check/explain_parts.h"
#include "alidade/estimation/observability.h"
#include "alidade/experiment/name_in_entry.h"
#include "alidade/experiment/truth_match.h"
#include "alidade/plugin/built_in_models.h"

namespace alidade::internal {

const char* StatusText(BlockStatus status) {
  switch (status) {
    case BlockStatus::kEstimated:
      return "estimated";
    case BlockStatus::kConsider:
      return "consider";
    case BlockStatus::kConstant:
      break;
  }
  return "constant";
}

std::string PriorText(const Prior& prior, const Block& block) {
  const bool measured = !prior.sensor.empty();
  std::string text = measured ? "first measurement of " + prior.sensor : RoundedList(prior.mean);
  if (block.status == BlockStatus::kConstant) return text + ", exact";
  if (measured) return text;
  return text + " +- " + SigmasText(prior.covariance);
}

const char* EffectText(const Block& block, RoleMode mode) {
  if (block.status == BlockStatus::kConstant || mode == RoleMode::kKnown) return "knows";
  const bool considers = block.status == BlockStatus::kConsider || mode == RoleMode::kConsider;
  return considers ? "considers" : "corrects";
}

namespace {

/// Returns a table of the blocks. A note explains the status `constant` if a block has it, and one
/// note for each unused truth states the reason.
ExplainedTable StateTable(const Problem& problem, const std::vector<StreamInfo>& truths) {
  const std::vector<int> block_truths = MatchTruths(problem.layout, truths);
  std::vector<TextRow> rows = {
      {"block", "geometry", "size", "unit", "owner", "status", "truth", "starts from"}};
  for (const Prior& prior : problem.priors) {
    const Block& block = problem.layout[prior.block];
    const Geometry& geometry = block.geometry();
    std::string size = std::to_string(geometry.ambient);
    if (geometry.tangent != geometry.ambient) {
      size.append(" (").append(std::to_string(geometry.tangent)).append(" free)");
    }
    const int truth_index = block_truths[static_cast<std::size_t>(prior.block)];
    rows.push_back({block.name, geometry.name(), size, UnitOf(problem, prior.block), block.owner,
                    StatusText(block.status),
                    truth_index >= 0 ? truths[static_cast<std::size_t>(truth_index)].name
                    : truths.empty() ? ""
                                     : "-",
                    PriorText(prior, block)});
  }
  ExplainedTable table{"state", rows};
  const auto is_fixed = [](const Block& block) { return block.status == BlockStatus::kConstant; };
  if (std::ranges::any_of(problem.layout.blocks(), is_fixed)) {
    table.notes.emplace_back(
        "constant: the value is known exactly and never changes; it has no covariance");
  }
  for (std::size_t t = 0; t < truths.size(); ++t) {
    const std::string reason = WhyNoBlock(problem.layout, truths, t);
    if (!reason.empty()) {
      table.notes.push_back("truth " + truths[t].name + " is not used: " + reason);
    }
  }
  return table;
}

/// Returns the control input of a motion model, as in `speed <- odom, up to 0.2 s old`.
std::string InputText(const MotionBinding& motion) {
  if (!motion.model->has_input()) return "none";
  const InputBinding& input = motion.input;
  return motion.model->input().name + " <- " + input.stream +
         (std::isfinite(input.timeout_s) ? ", up to " + NumberText(input.timeout_s) + " s old"
                                         : "");
}

/// Adds a note about a state or sensor entry whose noise is a covariance in the config.
void AddConfigNoise(const std::string& name, const std::vector<double>& root, int size,
                    ExplainedTable& table) {
  if (root.empty()) return;
  const RowMajor l = Eigen::Map<const RowMajor>(root.data(), size, size);
  table.notes.push_back("noise of " + name + ": covariance from the config, with sigma " +
                        SigmasText(l * l.transpose()));
}

/// Adds the equations of a model if they are in the config.
void AddEquations(const std::string& name, const std::string& model,
                  const std::vector<Space>& spaces, ExplainedTable& table) {
  if (!HasEquationsInConfig(model)) return;
  for (const Space& space : spaces) {
    if (!space.doc.empty()) table.notes.push_back(name + ": " + space.doc);
  }
}

/// Returns true unless all blocks of a motion model are constant.
bool HasEffect(const Problem& problem, const MotionBinding& motion) {
  return std::ranges::any_of(motion.blocks, [&](BlockId id) {
    return problem.layout[id].status != BlockStatus::kConstant;
  });
}

ExplainedTable MotionTable(const Problem& problem, double step_s) {
  const bool has_input = std::ranges::any_of(
      problem.motions, [](const MotionBinding& motion) { return motion.model->has_input(); });
  ExplainedTable table{"motion", {{"entry", "model", "moves", "noise inputs"}}};
  std::vector<TextRow>& rows = table.rows;
  if (has_input) rows[0].emplace_back("control input");
  for (const MotionBinding& motion : problem.motions) {
    if (!HasEffect(problem, motion)) continue;
    std::vector<std::string> blocks;
    for (const BlockId id : motion.blocks) {
      if (problem.layout[id].status == BlockStatus::kConstant) continue;
      blocks.push_back(NameInEntry(problem.layout[id]));
    }
    const int noise = motion.model->noise_size();
    const char* const kind = motion.model->discrete_noise() ? " discrete" : " continuous";
    rows.push_back({motion.name, motion.model->name(), Join(blocks),
                    noise == 0 ? "none" : std::to_string(noise) + kind});
    if (has_input) rows.back().push_back(InputText(motion));
    const MotionModel::Description& description = motion.model->description();
    AddEquations(motion.name, description.name, description.blocks, table);
    AddConfigNoise(motion.name, description.sqrt_noise, noise, table);
    const std::string sigmas = Join(ProcessNoise(problem, motion, step_s));
    if (sigmas.empty()) continue;
    table.notes.push_back("Q of " + motion.name + " for a step of " + RoundedText(step_s, 4) +
                          " s, as sigma: " + sigmas);
  }
  return table;
}

const char* ModeText(RoleMode mode) {
  switch (mode) {
    case RoleMode::kEstimate:
      return "estimate";
    case RoleMode::kConsider:
      return "consider";
    case RoleMode::kKnown:
      break;
  }
  return "known";
}

/// Removes the column `name` if each of its cells is `default_text` or empty.
void RemoveDefaultColumn(const std::string& name, const std::string& default_text,
                         std::vector<TextRow>& rows) {
  const auto column = std::ranges::find(rows[0], name) - rows[0].begin();
  const bool is_default = std::all_of(rows.begin() + 1, rows.end(), [&](const TextRow& row) {
    const std::string& cell = row[static_cast<std::size_t>(column)];
    return cell.empty() || cell == default_text;
  });
  if (!is_default) return;
  for (TextRow& row : rows) row.erase(row.begin() + column);
}

ExplainedTable SensorTable(const Problem& problem) {
  ExplainedTable table{
      "sensors", {{"sensor", "stream", "model", "sigma", "role", "block", "mode", "jacobian_at"}}};
  std::vector<TextRow>& rows = table.rows;
  for (const SensorBinding& sensor : problem.sensors) {
    TextRow sensor_columns = {sensor.name, sensor.stream, sensor.model->name(),
                              MeasurementNoise(problem, sensor)};
    const SensorModel::Description& description = sensor.model->description();
    AddEquations(sensor.name, description.name, {description.measurement}, table);
    AddConfigNoise(sensor.name, description.sqrt_noise, description.measurement.geometry.tangent,
                   table);
    for (std::size_t i = 0; i < sensor.roles.size(); ++i) {
      const RoleBinding& role = sensor.roles[i];
      TextRow row = std::exchange(sensor_columns, TextRow(sensor_columns.size()));
      row.push_back(sensor.model->roles()[i].name);
      if (sensor.model->roles()[i].landmark()) {
        row.insert(row.end(), {"landmarks", ModeText(RoleMode::kEstimate), "prediction"});
      } else if (role.block < 0) {
        row.insert(row.end(), {"(unbound)", "", ""});
      } else {
        const bool prediction = role.jacobian_at == JacobianAt::kPrediction;
        row.insert(row.end(), {problem.layout[role.block].name, ModeText(role.mode),
                               prediction ? "prediction" : "measurement"});
      }
      rows.push_back(std::move(row));
    }
  }
  RemoveDefaultColumn("mode", ModeText(RoleMode::kEstimate), rows);
  RemoveDefaultColumn("jacobian_at", "prediction", rows);
  return table;
}

/// Returns a table of effects with a row for each block and a column for each motion entry and
/// sensor.
ExplainedTable EffectTable(const Problem& problem) {
  std::vector<TextRow> rows(1 + problem.layout.blocks().size());
  rows[0].push_back("block");
  for (std::size_t b = 0; b + 1 < rows.size(); ++b) {
    rows[b + 1].push_back(problem.layout.blocks()[b].name);
  }
  const auto add_column = [&](const std::string& name) {
    for (TextRow& row : rows) row.emplace_back("-");
    rows[0].back() = name;
  };
  for (const MotionBinding& motion : problem.motions) {
    if (!HasEffect(problem, motion)) continue;
    add_column(motion.name);
    for (const BlockId id : motion.blocks) {
      const bool constant = problem.layout[id].status == BlockStatus::kConstant;
      rows[static_cast<std::size_t>(id) + 1].back() = constant ? "knows" : "moves";
    }
  }
  for (const SensorBinding& sensor : problem.sensors) {
    add_column(sensor.name);
    for (const RoleBinding& role : sensor.roles) {
      if (role.block < 0) continue;
      rows[static_cast<std::size_t>(role.block) + 1].back() =
          EffectText(problem.layout[role.block], role.mode);
    }
  }
  return {"effects on blocks", rows};
}

/// Returns the names of a direction, as in `target.depth together with target.depth_rate`.
std::string DirectionText(const std::vector<std::string>& names) {
  const std::string other_names = Join({names.begin() + 1, names.end()});
  return names[0] + (other_names.empty() ? "" : " together with " + other_names);
}

/// Returns a sentence for each direction that is observable only while a control input changes.
std::vector<std::string> NeedExcitation(const Problem& problem,
                                        const std::vector<std::vector<std::string>>& unobservable) {
  const auto constant = UnobservableDirections(problem, Excitation::kConstant);
  std::vector<std::string> lines;
  for (const auto& names : std::set(constant.begin(), constant.end())) {
    if (std::ranges::count(unobservable, names) > 0) continue;
    lines.push_back("observable only while the control input changes: " + DirectionText(names));
  }
  return lines;
}

std::vector<std::string> Observability(const Problem& problem) {
  if (problem.landmarks && !PlaceLandmarks(problem)) {
    return {"observability is not analysed, because it depends on the landmarks"};
  }
  if (!IsObservabilityComputed(problem)) {
    return {"observability is not analysed, because the state has more than " +
            std::to_string(kMaxObservabilityElements) + " elements"};
  }
  const std::vector<std::vector<std::string>> unobservable =
      alidade::UnobservableDirections(problem);
  std::map<std::vector<std::string>, int> directions;
  for (const auto& names : unobservable) ++directions[names];
  std::vector<std::string> lines;
  if (directions.empty()) lines.emplace_back("the state is fully observable");
  for (const auto& [names, count] : directions) {
    lines.push_back("unobservable: " + DirectionText(names) + " (" + std::to_string(count) +
                    (count == 1 ? " direction)" : " directions)"));
    if (names[0] == "scale") {
      lines.emplace_back(
          "the prior alone determines the scale of trajectory and map; depth, a stereo pair, "
          "odometry or known landmarks would make the scale observable");
    }
  }
  const std::vector<std::string> more = NeedExcitation(problem, unobservable);
  lines.insert(lines.end(), more.begin(), more.end());
  return lines;
}

ExplainedProblem ExplainProblem(const EstimatorSpec& spec, const std::vector<StreamInfo>& truths,
                                double step_s) {
  const Problem& problem = spec.problem;
  ExplainedProblem explained{
      {&spec},
      {StateTable(problem, truths), MotionTable(problem, step_s), SensorTable(problem)},
      Observability(problem)};
  if (problem.landmarks) explained.tables.push_back({"landmarks", LandmarkRows(problem)});
  explained.tables.push_back(EffectTable(problem));
  return explained;
}

bool AreEqual(const ExplainedProblem& a, const ExplainedProblem& b) {
  return a.observability == b.observability && a.tables == b.tables;
}

}  // namespace

std::vector<ExplainedProblem> ExplainProblems(const Experiment& experiment, double step_s) {
  std::vector<ExplainedProblem> problems;
  for (const EstimatorSpec& spec : experiment.estimators) {
    ExplainedProblem explained = ExplainProblem(spec, experiment.source->truths(), step_s);
    const auto equal = std::ranges::find_if(
        problems, [&](const ExplainedProblem& other) { return AreEqual(other, explained); });
    if (equal == problems.end()) {
      problems.push_back(std::move(explained));
    } else {
      equal->estimators.push_back(&spec);
    }
  }
  return problems;
}

}  // namespace alidade::internal
