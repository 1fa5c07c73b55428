// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/evaluate/evaluate.h"
#include "alidade/io/wrap_text.h"

/// Reports of evaluations. Each report includes the alignment, the scale of the alignment, the
/// number of matched and possible poses, and the time tolerance. An evaluation with an error has
/// the entry `failed`.
namespace alidade {

/// Returns a text for a terminal of this width. For one evaluation, the text contains all
/// statistics. For several evaluations, the text is a table with a column for each evaluation.
std::string EvaluationText(const std::vector<Evaluation>& evaluations,
                           std::size_t width = internal::kDefaultTextWidth);

/// Returns a Markdown table with a row for each evaluation.
std::string EvaluationMarkdown(const std::vector<Evaluation>& evaluations);

/// Returns a LaTeX `tabular` with a row for each evaluation.
std::string EvaluationLatex(const std::vector<Evaluation>& evaluations);

/// Returns all results as JSON (docs/eval.md). Missing results are omitted.
std::string EvaluationJson(const std::vector<Evaluation>& evaluations);

}  // namespace alidade
