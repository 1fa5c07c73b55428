// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/evaluate/evaluate.h"

namespace alidade {

/// Returns the interactive page of evaluations with the same reference: one HTML file that needs no
/// network. Evaluations with an error are omitted. Error: kBadData if all have an error.
std::string EvaluationPage(const std::vector<Evaluation>& evaluations);

}  // namespace alidade
