// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/evaluate/evaluate.h"

/// Evaluations for people and programs. Every figure comes with what it means nothing without: the
/// alignment and its scale, the poses matched of those possible, the tolerance of their times. One
/// with an error has a row all the same, `failed`.
namespace alidade {

/// For a terminal: of one evaluation all statistics, of several a row each.
std::string EvaluationText(const std::vector<Evaluation>& evaluations);

/// A table of Markdown, a row for each evaluation.
std::string EvaluationMarkdown(const std::vector<Evaluation>& evaluations);

/// The same as a `tabular` of LaTeX.
std::string EvaluationLatex(const std::vector<Evaluation>& evaluations);

/// All of it as JSON (docs/eval.md); what is not there is left out.
std::string EvaluationJson(const std::vector<Evaluation>& evaluations);

}  // namespace alidade
