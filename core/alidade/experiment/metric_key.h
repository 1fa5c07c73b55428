// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

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

}  // namespace alidade
