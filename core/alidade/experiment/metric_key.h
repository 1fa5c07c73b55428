// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace alidade {

/// Key of a metric or a count. Its text form is
///
///   NAME[:SUBJECT][@SEGMENT]      `rmse:target.depth@blind`, `accepted:stereo`, `map.rmse`
struct MetricKey {
  std::string name;     ///< name of the metric or count, such as `rmse` or `accepted`
  std::string subject;  ///< name of a block, an owner or a sensor; "" for the run
  std::string segment;  ///< name of a segment in `evaluate.segments`; "" for the whole run

  /// Returns the key whose text form is `text`.
  static MetricKey Parse(std::string_view text) {
    MetricKey key;
    const std::size_t segment = text.find('@');
    if (segment != text.npos) key.segment = text.substr(segment + 1);
    text = text.substr(0, segment);
    const std::size_t subject = text.find(':');
    if (subject != text.npos) key.subject = text.substr(subject + 1);
    key.name = text.substr(0, subject);
    return key;
  }
  std::string text() const {
    return name + (subject.empty() ? "" : ':' + subject) + (segment.empty() ? "" : '@' + segment);
  }
};

/// Returns the key of the error that ranks estimators: the RMSE of the first position or depth, or
/// else the first RMSE over the whole run. Returns "" if `keys` contains no RMSE.
inline std::string MainErrorKey(const std::vector<std::string>& keys) {
  std::string main;
  for (const std::string& text : keys) {
    const MetricKey key = MetricKey::Parse(text);
    if (key.name != "rmse" || !key.segment.empty()) continue;
    if (key.subject.ends_with("position") || key.subject.ends_with("depth")) return text;
    if (main.empty()) main = text;
  }
  return main;
}

}  // namespace alidade
