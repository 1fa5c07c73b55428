// SPDX-License-Identifier: Apache-2.0
#include "alidade/check/explain.h"

#include <algorithm>
#include <map>
#include <set>
#include <span>

#include "alidade/base/text.h"
#include "alidade/check/explain_parts.h"

namespace alidade {
namespace {

using internal::ExplainedProblem;
using internal::ExplainedTable;
using internal::TextRow;
using internal::TextTable;

constexpr std::size_t kIndent = 4;

/// Returns the first line about estimators, such as `estimators ekf (ekf), smoother (rts)`.
std::string Heading(const ExplainedProblem& problem) {
  std::vector<std::string> names;
  for (const EstimatorSpec* spec : problem.estimators) {
    names.push_back(spec->name + " (" + spec->type + ')');
  }
  return (names.size() == 1 ? "\nestimator " : "\nestimators ") + internal::Join(names) + '\n';
}

/// Returns the tables of a problem. Tables that an earlier problem also has are only named.
std::string TablesText(const ExplainedProblem& problem,
                       std::span<const ExplainedProblem> earlier_problems) {
  std::map<std::string, std::vector<std::string>> repeated;  // estimator -> titles
  std::string text;
  for (const ExplainedTable& table : problem.tables) {
    const auto has_table = [&](const ExplainedProblem& other) {
      return std::ranges::find(other.tables, table) != other.tables.end();
    };
    const auto earlier = std::ranges::find_if(earlier_problems, has_table);
    if (earlier != earlier_problems.end()) {
      repeated[earlier->estimators.front()->name].push_back(table.title);
      continue;
    }
    text += "  " + table.title + '\n' + TextTable(table.rows, kIndent);
    for (const std::string& note : table.notes) text += "    " + note + '\n';
  }
  std::string names;
  for (const auto& [name, titles] : repeated) {
    names += "  " + internal::Join(titles) + ": as estimator " + name + '\n';
  }
  return names + text;
}

/// Returns the options of the estimators. The options of all estimators except `first` are listed
/// only if they differ from those of `first`.
std::string OptionsText(const Config& config, const ExplainedProblem& problem,
                        const EstimatorSpec& first) {
  const auto rows_of = [&](const EstimatorSpec& spec) {
    return internal::OptionRows(config.root().At("estimators").At(spec.name), spec);
  };
  const std::vector<TextRow> first_rows = rows_of(first);
  std::string text;
  for (const EstimatorSpec* spec : problem.estimators) {
    std::vector<TextRow> rows = rows_of(*spec);
    std::string title = "options";
    if (spec != &first) {
      std::erase_if(rows, [&](const TextRow& row) {
        return std::ranges::find(first_rows, row) != first_rows.end();
      });
      title += " of " + spec->name + " that differ from those of " + first.name;
    }
    if (!rows.empty()) text += "  " + title + '\n' + TextTable(rows, kIndent);
  }
  return text;
}

/// Returns the features that the types of the estimators support, once for each type.
std::string TypesText(const Experiment& experiment) {
  std::set<std::string> types;
  for (const EstimatorSpec& spec : experiment.estimators) types.insert(spec.type);
  std::string text;
  for (const std::string& type : types) {
    const std::string support = internal::CapabilitiesText(type);
    if (!support.empty()) text += "\ntype " + type + " supports\n" + support;
  }
  return text;
}

/// Appends a row with path and value for each value of `map` that the program filled in.
void AppendFilled(const Node& map, const std::string& prefix, std::vector<TextRow>& rows) {
  for (const auto& [name, value] : map.Entries()) {
    if (value.is_map()) {
      AppendFilled(value, prefix + name + '.', rows);
    } else if (value.is_filled()) {
      rows.push_back({prefix + name, internal::ValueText(value)});
    }
  }
}

/// Returns the values that the config does not contain, or contains as short forms.
std::string FilledText(const Config& config) {
  std::vector<TextRow> rows;
  AppendFilled(config.root(), "", rows);
  return rows.empty() ? "" : "\nfilled in (short forms and defaults)\n" + TextTable(rows, kIndent);
}

}  // namespace

std::string Explain(const Config& config, const Experiment& experiment) {
  std::string text = internal::ExplainSource(config, experiment) + FilledText(config);
  const double step_s = internal::NominalStep(config);
  const std::vector<ExplainedProblem> problems = internal::ExplainProblems(experiment, step_s);
  for (std::size_t i = 0; i < problems.size(); ++i) {
    text += Heading(problems[i]) + TablesText(problems[i], std::span(problems).first(i));
    for (const std::string& line : problems[i].observability) text += "  " + line + '\n';
    text += OptionsText(config, problems[i], experiment.estimators.front());
  }
  return text + TypesText(experiment);
}

}  // namespace alidade
