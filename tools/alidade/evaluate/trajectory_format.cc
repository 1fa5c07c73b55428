// SPDX-License-Identifier: Apache-2.0
#include "alidade/evaluate/trajectory_format.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>
#include <vector>

#include "alidade/base/text.h"

namespace alidade {
namespace {

using Format = TrajectoryFormat;
using internal::RowFormat;

constexpr std::array<const char*, 20> kTum = {
    "t",    "x",    "y",    "z",    "qx",   "qy",   "qz",   "qw",   "Pr11", "Pr12",
    "Pr13", "Pr22", "Pr23", "Pr33", "Pt11", "Pt12", "Pt13", "Pt22", "Pt23", "Pt33"};
constexpr std::array<const char*, 12> kKitti = {"r11", "r12", "r13", "x",   "r21", "r22",
                                                "r23", "y",   "r31", "r32", "r33", "z"};
constexpr std::array<const char*, 8> kEuroc = {"t", "x", "y", "z", "qw", "qx", "qy", "qz"};

constexpr std::array<RowFormat, 6> kRowFormats = {{
    {Format::kTum, 8, false, false, std::span(kTum).first<8>(), "t x y z qx qy qz qw"},
    {Format::kTum, 20, false, false, kTum, "t x y z qx qy qz qw and two covariances"},
    {Format::kKitti, 12, false, false, kKitti, "the upper three rows of world_from_body"},
    {Format::kEuroc, 8, true, true, kEuroc, "t,x,y,z,qw,qx,qy,qz"},
    {Format::kEuroc, 11, true, true, kEuroc, "t,x,y,z,qw,qx,qy,qz and the velocity"},
    {Format::kEuroc, 17, true, true, kEuroc, "t,x,y,z,qw,qx,qy,qz, the velocity and two biases"},
}};

bool IsNumber(std::string_view text) {
  double value = 0.0;
  return cell::ParseNumber(text, value) == nullptr || !std::isfinite(value);
}

bool IsWholeNumber(std::string_view text) {
  return std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// Returns the element of a quaternion that a column's name means, such as 'w' for `qw` or
/// `q_RS_w []`, or '\0' if the column is not part of a quaternion.
char QuaternionElement(std::string_view name) {
  name = name.substr(0, name.find_first_of(" ["));
  return name.starts_with('q') ? name.back() : '\0';
}

/// Describes the first row, as in `8 columns with commas`.
std::string RowText(const NumberRows& rows, internal::HeaderOrder header_order) {
  std::string text = std::to_string(rows.size()) + (rows.size() == 1 ? " column" : " columns");
  if (rows.has_commas()) text += " with commas";
  if (header_order)
    text += std::string(", q") + (*header_order ? 'w' : 'x') + " first in the header";
  return text;
}

/// Returns the names of the other formats with as many columns, as in `euroc`.
std::string OtherFormats(const RowFormat& chosen) {
  std::vector<std::string> names;
  for (const RowFormat& other : kRowFormats) {
    if (other.columns == chosen.columns && other.format != chosen.format)
      names.emplace_back(ToString(other.format));
  }
  return internal::Join(names, " or ");
}

}  // namespace

bool internal::IsHeader(const NumberRows& rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (IsNumber(rows.text(i))) return false;
  }
  return true;
}

internal::HeaderOrder internal::QuaternionOrder(const NumberRows& header) {
  std::optional<std::size_t> w, x;
  for (std::size_t i = 0; i < header.size(); ++i) {
    const char element = QuaternionElement(header.text(i));
    if (element == 'w') w = i;
    if (element == 'x') x = i;
  }
  return w && x ? HeaderOrder(*w < *x) : std::nullopt;
}

RowFormat internal::RowFormatOf(TrajectoryFormat format, const NumberRows& rows) {
  const auto is_same = [&](const RowFormat& candidate) { return candidate.format == format; };
  const auto fits = [&](const RowFormat& candidate) {
    return is_same(candidate) && candidate.columns == rows.size();
  };
  const auto fitting = std::ranges::find_if(kRowFormats, fits);
  return fitting != kRowFormats.end() ? *fitting : *std::ranges::find_if(kRowFormats, is_same);
}

internal::DetectedFormat internal::DetectFormat(const NumberRows& rows, HeaderOrder header_order) {
  std::vector<RowFormat> candidates;
  for (const RowFormat& candidate : kRowFormats) {
    const bool has_quaternion = candidate.format != Format::kKitti;
    if (candidate.columns != rows.size() || (candidate.only_commas && !rows.has_commas())) continue;
    if (has_quaternion && candidate.w_first != header_order.value_or(candidate.w_first)) continue;
    candidates.push_back(candidate);
  }
  std::string reason = RowText(rows, header_order);
  if (candidates.empty()) rows.FailLine(reason, kDetectedFormats);
  const bool is_whole = IsWholeNumber(rows.text(0));
  if (candidates.size() > 1) {
    reason += is_whole ? ", t is a whole number" : ", t is not a whole number";
  }
  DetectedFormat detected;
  detected.row_format = is_whole ? candidates.back() : candidates.front();
  const std::string alternatives = OtherFormats(detected.row_format);
  detected.assumption =
      std::string("; read as ") + ToString(detected.row_format.format) + " (" + reason + ')';
  if (!alternatives.empty()) detected.assumption += "; the alternative is --format " + alternatives;
  return detected;
}

}  // namespace alidade
