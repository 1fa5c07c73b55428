// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/base/timestamp.h"

namespace alidade::internal {

/// Appends the shortest decimal number that parses to exactly `value`, such as `0.1`, `1e-05`,
/// `nan` or `-inf`. The text does not depend on the locale.
void AppendNumber(std::string& text, double value);
std::string NumberText(double value);

/// Returns `value` with `decimals` digits after the decimal point.
std::string FixedText(double value, int decimals);

/// Returns `value` with at most `digits` significant digits, for display: `0.02346`, `1.5e+09`.
std::string RoundedText(double value, int digits = 6);

/// Returns `value` with `digits` digits after the decimal point and an exponent.
std::string ScientificText(double value, int digits);

/// Returns the time in seconds for display, such as `1.500000 s`.
std::string SecondsText(Timestamp timestamp);

/// Appends the exact time in seconds with nine decimals, such as `-0.033000000`.
void AppendSeconds(std::string& text, Timestamp timestamp);

}  // namespace alidade::internal
