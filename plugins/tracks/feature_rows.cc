// SPDX-License-Identifier: Apache-2.0
#include "feature_rows.h"

#include <algorithm>

#include "alidade/base/error.h"

namespace alidade {

FeatureRows::FeatureRows(const std::filesystem::path& path, const Place& place,
                         const std::string& key)
    : rows_(path, place, key) {
  Advance();
}

std::optional<std::int64_t> FeatureRows::next_frame() const {
  return next_ ? std::optional(next_->frame) : std::nullopt;
}

std::map<std::int64_t, FeatureRows::Feature> FeatureRows::ReadFrame(std::int64_t frame) {
  std::map<std::int64_t, Feature> features;
  while (next_ && next_->frame == frame) {
    Feature& feature = features[next_->feature];
    int& line = feature.lines[next_->dim];
    if (line != 0) {
      FailLine("there is a second value for frame " + std::to_string(frame) + ", feature " +
                   std::to_string(next_->feature) + ", dim " + std::to_string(next_->dim) +
                   "; the first value is in line " + std::to_string(line),
               "one value");
    }
    line = next_->line;
    feature.values[next_->dim] = next_->value;
    Advance();
  }
  return features;
}

std::optional<std::vector<double>> FeatureRows::Values(std::int64_t frame, std::int64_t id,
                                                       const Feature& feature,
                                                       std::size_t size) const {
  for (std::size_t dim = 0; dim < size; ++dim) {
    if (feature.lines[dim] != 0) continue;
    if (dim >= 2) return std::nullopt;
    const int line = *std::max_element(feature.lines.begin(), feature.lines.end());
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{rows_.name(), line, 0}, {},
                          "feature " + std::to_string(id) + " of frame " + std::to_string(frame) +
                              " has no dim " + std::to_string(dim),
                          "both 0 (u) and 1 (v)"));
  }
  return std::vector<double>(feature.values.begin(),
                             feature.values.begin() + static_cast<std::ptrdiff_t>(size));
}

void FeatureRows::FailLine(const std::string& problem, std::string_view expected) const {
  rows_.FailLine(problem, expected);
}

void FeatureRows::Advance() {
  const bool first = !next_;
  if (!rows_.Next()) {
    if (first) FailLine("the file contains no rows", std::string("rows ") + kColumns);
    next_.reset();
    return;
  }
  if (first && rows_.text(0) == "frame") {
    rows_.ExpectColumns(kDims, kColumns);
    if (!rows_.Next()) FailLine("the file contains no rows", "a row below the header");
  }
  rows_.ExpectColumns(kDims, kColumns);
  Row row{rows_.Index(0, "frame"), rows_.Index(1, "feature"), 0, rows_.Number(3, "value"),
          rows_.line()};
  const std::int64_t dim = rows_.Index(2, "dim");
  if (dim >= static_cast<std::int64_t>(kDims)) {
    rows_.FailCell(2, "dim", "is unknown", "0 (u), 1 (v), 2 (u_right or depth) or 3 (v_right)");
  }
  row.dim = static_cast<std::size_t>(dim);
  if (!first && row.frame < next_->frame) {
    rows_.FailCell(0, "frame", "is smaller than in line " + std::to_string(next_->line),
                   "frames in increasing order");
  }
  next_ = row;
}

}  // namespace alidade
