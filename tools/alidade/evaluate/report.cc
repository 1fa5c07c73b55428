// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/io/json.h"
#include "alidade/io/text_table.h"

namespace alidade {
namespace {

using internal::FixedText;
using internal::Json;
using internal::NumberText;
using internal::RoundedText;

constexpr int kDecimals = 6;  // number of decimals in evo

/// Statistics. Names and order are those of evo.
constexpr std::pair<const char*, double ErrorStatistics::*> kStatistics[] = {
    {"rmse", &ErrorStatistics::rmse},     {"mean", &ErrorStatistics::mean},
    {"median", &ErrorStatistics::median}, {"std", &ErrorStatistics::std},
    {"min", &ErrorStatistics::min},       {"max", &ErrorStatistics::max},
    {"sse", &ErrorStatistics::sse}};

std::string WithUnit(const std::string& text, const std::string& unit) {
  return unit.empty() ? text : text + " [" + unit + ']';
}

std::string MatchedText(const Evaluation& evaluation) {
  return std::to_string(evaluation.estimate.size()) + " of " + std::to_string(evaluation.possible);
}

std::string ToleranceText(const Evaluation& evaluation) {
  return evaluation.by_row ? "by row" : NumberText(Seconds(evaluation.options.max_diff));
}

std::string AlignText(const Evaluation& evaluation) {
  const EvaluateOptions& options = evaluation.options;
  std::string text = ToString(options.alignment);
  const bool least_squares =
      options.alignment != Alignment::kNone && options.alignment != Alignment::kOrigin;
  if (options.align_poses != 0 && least_squares) {
    text += " by the first " + std::to_string(options.align_poses) + " poses";
  }
  if (options.plane != Plane::kNone)
    text += std::string(", projected to ") + ToString(options.plane);
  return text;
}

/// Describes the poses that options select before matching. Returns "" if all are selected.
std::string SelectionText(const EvaluateOptions& options) {
  std::vector<std::string> parts;
  if (options.downsample != 0) {
    parts.push_back("at most " + std::to_string(options.downsample) + " of each file");
  }
  if (options.range.start) {
    parts.push_back("from " + internal::SecondsText(*options.range.start));
  }
  if (options.range.end) parts.push_back("to " + internal::SecondsText(*options.range.end));
  return internal::Join(parts);
}

std::string PairsText(const Evaluation& evaluation) {
  const PairOptions& pairs = evaluation.options.pairs;
  return std::to_string(evaluation.pairs.size()) + (pairs.all ? " of all" : " consecutive") +
         " pairs, " + NumberText(pairs.delta) + ' ' + ToString(pairs.unit) + " apart";
}

std::string TrajectoryText(const Trajectory& trajectory) {
  return trajectory.name + ": " + ToString(trajectory.format) + ", length " +
         RoundedText(trajectory.Length(0, trajectory.size() - 1)) + " m";
}

std::string NeesText(const char* name, const Nees& nees, int poses) {
  return std::string("NEES ") + name + " (" + std::to_string(nees.dof) + " dof) " +
         RoundedText(nees.mean, 4) + " per dof, " + RoundedText(100.0 * nees.within95, 3) +
         " % within the 95 % bound, " + std::to_string(nees.poses) + " of " +
         std::to_string(poses) + " poses\n";
}

/// Returns a table of all statistics of one evaluation, with a row for each relation.
std::string StatisticsTable(const Evaluation& evaluation, std::size_t width) {
  std::vector<std::string> names;
  for (const auto& [name, member] : kStatistics) names.emplace_back(name);
  std::vector<internal::TableRow> rows;
  const auto add = [&](const char* kind, const std::vector<PoseErrors>& relations) {
    for (const PoseErrors& errors : relations) {
      const std::string label = std::string(kind) + ' ' + ToString(errors.relation);
      internal::TableRow& row =
          rows.emplace_back(internal::TableRow{WithUnit(label, UnitOf(errors.relation)), {}});
      for (const auto& [name, member] : kStatistics) {
        row.cells.push_back(FixedText(errors.statistics.*member, kDecimals));
      }
    }
  };
  add("ATE", evaluation.absolute);
  add("RPE", evaluation.relative);
  return FormatTable(internal::MakeTable(names, rows), internal::TableFormat::kText, width);
}

std::string ConsistencyText(const Evaluation& evaluation) {
  const int poses = evaluation.estimate.size();
  std::string text;
  if (evaluation.position_nees) text += NeesText("position", *evaluation.position_nees, poses);
  if (evaluation.orientation_nees) {
    text += NeesText("orientation", *evaluation.orientation_nees, poses);
  }
  if (!text.empty()) {
    text +=
        "This NEES is marginal: position and orientation are evaluated separately. nees.mean in "
        "run.json is the joint NEES of all states of a model.\n";
  }
  if (!evaluation.nees_withheld.empty()) {
    text += "NEES withheld: " + evaluation.nees_withheld + '\n';
  }
  for (const InnovationStatistics& statistics : evaluation.innovations) {
    text += "NIS " + statistics.sensor + ' ' + RoundedText(statistics.nis_mean, 4) + " per dof, " +
            RoundedText(100.0 * statistics.nis_within95, 3) + " % within the 95 % bound, " +
            std::to_string(statistics.measurements) + " measurements";
    if (std::isfinite(statistics.autocorrelation)) {
      text += "; autocorrelation " + RoundedText(statistics.autocorrelation, 3) +
              ", white if within " + RoundedText(statistics.white_within, 2);
    }
    text += '\n';
  }
  return text;
}

std::string DetailText(const Evaluation& evaluation, std::size_t width) {
  std::string text = "reference  " + TrajectoryText(evaluation.reference) + '\n';
  text += "estimate   " + TrajectoryText(evaluation.estimate) + '\n';
  const std::string selection = SelectionText(evaluation.options);
  if (!selection.empty()) text += "selected   " + selection + '\n';
  text += "matched    " + MatchedText(evaluation) + " possible poses, ";
  if (evaluation.by_row) {
    text += "by row\n";
  } else {
    text += "within " + ToleranceText(evaluation) + " s";
    if (evaluation.options.offset != 0) {
      text += ", " + NumberText(Seconds(evaluation.options.offset)) +
              " s added to the estimate's timestamps";
    }
    text += '\n';
  }
  text += "aligned    " + AlignText(evaluation) + ", scale " +
          FixedText(evaluation.alignment.scale, kDecimals) + '\n';
  if (evaluation.sim3_scale) {
    text += "scale      " + FixedText(*evaluation.sim3_scale, kDecimals) + " by sim3";
    if (evaluation.scale_drift) {
      text += ", drift " + FixedText(100.0 * *evaluation.scale_drift, 2) +
              " % from the first half to the second";
    }
    text += '\n';
  }
  if (!evaluation.pairs.empty()) text += "RPE        " + PairsText(evaluation) + '\n';
  text += '\n' + StatisticsTable(evaluation, width);
  const std::string consistency = ConsistencyText(evaluation);
  return consistency.empty() ? text : text + '\n' + consistency;
}

/// Returns a column header such as `NEES position (3 dof)`, with all numbers of dof that occur.
std::string NeesHeader(const char* name, std::optional<Nees> Evaluation::*nees,
                       const std::vector<Evaluation>& evaluations) {
  std::set<int> dofs;
  for (const Evaluation& evaluation : evaluations) {
    if (evaluation.*nees) dofs.insert((evaluation.*nees)->dof);
  }
  std::vector<std::string> texts;
  for (const int dof : dofs) texts.push_back(std::to_string(dof));
  const std::string header = std::string("NEES ") + name;
  return texts.empty() ? header : header + " (" + internal::Join(texts, " or ") + " dof)";
}

/// Returns the summary table with a row for each evaluation.
internal::Table SummaryTable(const std::vector<Evaluation>& evaluations) {
  internal::TextRow header = {"estimate", "align", "scale", "matched", "within [s]"};
  for (const char* kind : {"ATE", "RPE"}) {
    for (const PoseRelation relation : evaluations.front().options.relations) {
      header.push_back(WithUnit(std::string(kind) + ' ' + ToString(relation), UnitOf(relation)));
    }
  }
  const bool nees = std::ranges::any_of(evaluations, [](const Evaluation& evaluation) {
    return evaluation.position_nees || evaluation.orientation_nees;
  });
  if (nees) {
    header.push_back(NeesHeader("position", &Evaluation::position_nees, evaluations));
    header.push_back(NeesHeader("orientation", &Evaluation::orientation_nees, evaluations));
  }
  internal::Table table{header, {}, 2};
  for (const Evaluation& evaluation : evaluations) {
    if (!evaluation.error.empty()) {
      table.rows.push_back({evaluation.label, "failed"});
      table.rows.back().resize(header.size(), "-");
      continue;
    }
    internal::TextRow row = {evaluation.label, AlignText(evaluation),
                             FixedText(evaluation.alignment.scale, kDecimals),
                             MatchedText(evaluation), ToleranceText(evaluation)};
    for (const auto* errors : {&evaluation.absolute, &evaluation.relative}) {
      for (std::size_t r = 0; r < evaluation.options.relations.size(); ++r) {
        row.push_back(r < errors->size() ? FixedText((*errors)[r].statistics.rmse, kDecimals)
                                         : "-");
      }
    }
    for (const auto& quantity_nees : {evaluation.position_nees, evaluation.orientation_nees}) {
      if (nees) row.push_back(quantity_nees ? RoundedText(quantity_nees->mean, 4) : "-");
    }
    table.rows.push_back(row);
  }
  return table;
}

/// Describes the options that all rows of a table share.
std::string SharedText(const std::vector<Evaluation>& evaluations) {
  const Evaluation& first = evaluations.front();
  std::string text = "RMSE, compared with " + first.reference.name;
  if (std::ranges::any_of(evaluations,
                          [](const auto& evaluation) { return !evaluation.pairs.empty(); })) {
    text += "; RPE of " + std::string(first.options.pairs.all ? "all" : "consecutive") +
            " pairs, " + NumberText(first.options.pairs.delta) + ' ' +
            ToString(first.options.pairs.unit) + " apart";
  }
  if (first.options.offset != 0) {
    text +=
        "; " + NumberText(Seconds(first.options.offset)) + " s added to the estimates' timestamps";
  }
  const std::string selection = SelectionText(first.options);
  if (!selection.empty()) text += "; selected poses: " + selection;
  return text + '.';
}

/// Appends the rows with the mean, the minimum and the maximum of the errors of one relation, if
/// the column `header` of the summary contains these errors.
void AppendExtent(const std::string& header, bool relative,
                  const std::vector<Evaluation>& evaluations,
                  std::vector<internal::TableRow>& rows) {
  const auto& relations = evaluations.front().options.relations;
  for (std::size_t r = 0; r < relations.size(); ++r) {
    const std::string kind = relative ? "RPE " : "ATE ";
    if (header != WithUnit(kind + ToString(relations[r]), UnitOf(relations[r]))) continue;
    for (const auto& [name, member] : kStatistics) {
      const std::string_view statistic = name;
      if (statistic != "mean" && statistic != "min" && statistic != "max") continue;
      internal::TableRow& row = rows.emplace_back(internal::TableRow{std::string("  ") + name, {}});
      for (const Evaluation& evaluation : evaluations) {
        const auto& errors = relative ? evaluation.relative : evaluation.absolute;
        row.cells.push_back(r < errors.size() ? FixedText(errors[r].statistics.*member, kDecimals)
                                              : "-");
      }
    }
  }
}

/// Returns the summary for a terminal, with a column for each evaluation.
std::string SummaryText(const std::vector<Evaluation>& evaluations, std::size_t width) {
  const internal::Table summary = SummaryTable(evaluations);
  std::vector<std::string> names;
  std::vector<internal::TableRow> rows;
  for (std::size_t c = 1; c < summary.header.size(); ++c) {
    rows.push_back({summary.header[c], {}});
    for (const internal::TextRow& row : summary.rows) rows.back().cells.push_back(row[c]);
    for (const bool relative : {false, true})
      AppendExtent(summary.header[c], relative, evaluations, rows);
  }
  for (const Evaluation& evaluation : evaluations) names.push_back(evaluation.label);
  return FormatTable(internal::MakeTable(names, rows), internal::TableFormat::kText, width) + '\n' +
         SharedText(evaluations) + '\n';
}

Json JsonOf(const std::vector<PoseErrors>& relations) {
  Json json = Json::object();
  for (const PoseErrors& errors : relations) {
    Json& entry = json[ToString(errors.relation)];
    entry["unit"] = UnitOf(errors.relation);
    for (const auto& [name, member] : kStatistics) entry[name] = errors.statistics.*member;
  }
  return json;
}

Json JsonOf(const Nees& nees) {
  return {
      {"mean", nees.mean}, {"within95", nees.within95}, {"dof", nees.dof}, {"poses", nees.poses}};
}

Json JsonOf(const std::vector<InnovationStatistics>& innovations) {
  Json json = Json::object();
  for (const InnovationStatistics& statistics : innovations) {
    json[statistics.sensor] = {{"mean", statistics.nis_mean},
                               {"within95", statistics.nis_within95},
                               {"measurements", statistics.measurements},
                               {"autocorrelation", statistics.autocorrelation},
                               {"white_within", statistics.white_within}};
  }
  return json;
}

Json JsonOf(const Evaluation& evaluation) {
  Json json = {{"estimate", evaluation.label},
               {"file", evaluation.estimate.name},
               {"reference", evaluation.reference.name}};
  if (!evaluation.error.empty()) {
    json["error"] = evaluation.error;
    return json;
  }
  json["align"] = ToString(evaluation.options.alignment);
  json["align_poses"] = evaluation.options.align_poses;
  json["scale"] = evaluation.alignment.scale;
  json["matched"] = evaluation.estimate.size();
  json["possible"] = evaluation.possible;
  json["by_row"] = evaluation.by_row;
  json["t_max_diff"] = Seconds(evaluation.options.max_diff);
  json["t_offset"] = Seconds(evaluation.options.offset);
  const TimeRange& range = evaluation.options.range;
  if (range.start) json["t_start"] = Seconds(*range.start);
  if (range.end) json["t_end"] = Seconds(*range.end);
  json["downsample"] = evaluation.options.downsample;
  json["project_to_plane"] = ToString(evaluation.options.plane);
  json["reference_length_m"] = evaluation.reference.Length(0, evaluation.reference.size() - 1);
  json["estimate_length_m"] = evaluation.estimate.Length(0, evaluation.estimate.size() - 1);
  if (evaluation.sim3_scale) json["sim3_scale"] = *evaluation.sim3_scale;
  if (evaluation.scale_drift) json["scale_drift"] = *evaluation.scale_drift;
  json["ate"] = JsonOf(evaluation.absolute);
  json["rpe"] = JsonOf(evaluation.relative);
  json["pairs"] = {{"count", evaluation.pairs.size()},
                   {"delta", evaluation.options.pairs.delta},
                   {"delta_unit", ToString(evaluation.options.pairs.unit)},
                   {"all_pairs", evaluation.options.pairs.all}};
  if (evaluation.position_nees) json["nees_position"] = JsonOf(*evaluation.position_nees);
  if (evaluation.orientation_nees) json["nees_orientation"] = JsonOf(*evaluation.orientation_nees);
  if (!evaluation.nees_withheld.empty()) json["nees_withheld"] = evaluation.nees_withheld;
  if (!evaluation.innovations.empty()) json["nis"] = JsonOf(evaluation.innovations);
  json["warnings"] = evaluation.warnings;
  return json;
}

}  // namespace

std::string EvaluationText(const std::vector<Evaluation>& evaluations, std::size_t width) {
  ALIDADE_EXPECTS(!evaluations.empty());
  const bool details = evaluations.size() == 1 && evaluations.front().error.empty();
  if (details) return DetailText(evaluations.front(), width);
  return SummaryText(evaluations, width);
}

std::string EvaluationMarkdown(const std::vector<Evaluation>& evaluations) {
  ALIDADE_EXPECTS(!evaluations.empty());
  return FormatTable(SummaryTable(evaluations), internal::TableFormat::kMarkdown) + '\n' +
         SharedText(evaluations) + '\n';
}

std::string EvaluationLatex(const std::vector<Evaluation>& evaluations) {
  ALIDADE_EXPECTS(!evaluations.empty());
  return "% " + SharedText(evaluations) + '\n' +
         FormatTable(SummaryTable(evaluations), internal::TableFormat::kLatex);
}

std::string EvaluationJson(const std::vector<Evaluation>& evaluations) {
  Json array = Json::array();
  for (const Evaluation& evaluation : evaluations) array.push_back(JsonOf(evaluation));
  return internal::JsonText({{"evaluations", std::move(array)}});
}

}  // namespace alidade
