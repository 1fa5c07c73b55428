// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
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

/// Error: kCannotCreate where `zip` is there without `force`.
void CheckEvoResult(const std::filesystem::path& zip, bool force);

/// Which errors of an evaluation are saved.
enum class SavedErrors { kAbsolute, kRelative };
/// Writes the errors of the first relation as a result of evo, which `evo_res` reads: a zip of
/// info.json, stats.json, error_array.npy and, where there are timestamps, timestamps.npy,
/// seconds_from_start.npy, distances_from_start.npy (along the reference) and distances.npy, of a
/// pair those of its second pose; of an aligned estimate alignment_transformation_sim3.npy. Errors:
/// that of CheckEvoResult; kBadData where there are no such errors; kIo.
void SaveEvoResult(const Evaluation& evaluation, SavedErrors which,
                   const std::filesystem::path& zip, bool force);

}  // namespace alidade
