// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/sweep.h"

/// What every table and file of a sweep tells alike.
namespace alidade::internal {

/// Runs that came to their end.
std::int64_t CountWhole(const SweepResult& result);

/// Those of them in which there was no reference to compare with.
std::int64_t CountWithheld(const SweepResult& result);

/// What the errors of a sweep are differences from, and how often that was withheld, as lines
/// behind an empty one; "" where that is truth. Of a varied sweep: by value, where they differ.
std::string ReferenceLines(const SweepResult& result);
std::string ReferenceLines(const VariedSweep& sweep);

}  // namespace alidade::internal
