// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "alidade/base/timestamp.h"

namespace alidade::internal {

/// The shortest decimal that reads back to `value`, whatever the locale: `0.1`, `1e-05`, `nan`,
/// `-inf`.
void AppendNumber(std::string& text, double value);
std::string NumberText(double value);

/// `decimals` digits after the point.
std::string FixedText(double value, int decimals);

/// At most `digits` significant digits, for people to read: `0.02346`, `1.5e+09`.
std::string RoundedText(double value, int digits = 6);

/// `digits` digits after the point and an exponent.
std::string ScientificText(double value, int digits);

/// `1.500000 s`, for people to read.
std::string SecondsText(Timestamp timestamp);

/// Seconds with nine decimals, exact: `-0.033000000`.
void AppendSeconds(std::string& text, Timestamp timestamp);

}  // namespace alidade::internal
