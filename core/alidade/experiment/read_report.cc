// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/read_report.h"

#include <algorithm>

#include "alidade/base/text.h"
#include "alidade/experiment/metric_key.h"
#include "alidade/experiment/metric_table.h"

namespace alidade::internal {
namespace {

/// Returns the key of each metric with each of its subjects, and of each outcome with each sensor,
/// for the whole run and for each segment.
std::vector<std::string> MetricKeysOf(const Problem& problem,
                                      const std::vector<Segment>& segments) {
  std::vector<std::string> blocks, owners, sensors = NamesOf(problem.sensors);
  for (const Block& block : problem.layout.blocks()) {
    blocks.push_back(block.name);
    owners.push_back(block.owner);
  }
  std::vector<std::string> keys;
  const auto add = [&](const char* name, const std::vector<std::string>& subjects) {
    for (const std::string& subject : subjects) {
      keys.push_back(MetricKey{name, subject, ""}.text());
      for (const Segment& segment : segments) {
        keys.push_back(MetricKey{name, subject, segment.name}.text());
      }
    }
  };
  for (const MetricInfo& metric : kMetrics) {
    add(metric.name, metric.subject == MetricSubject::kBlock    ? blocks
                     : metric.subject == MetricSubject::kOwner  ? owners
                     : metric.subject == MetricSubject::kSensor ? sensors
                                                                : std::vector<std::string>{""});
  }
  for (const OutcomeInfo& outcome : kOutcomes) add(outcome.name, sensors);
  return keys;
}

}  // namespace

std::vector<std::string> ReadReportRows(const Node& root, const Problem& problem,
                                        const std::vector<Segment>& segments) {
  const auto report = root.Find("report");
  if (!report) return {};
  std::vector<std::string> rows;
  const std::vector<std::string> keys = MetricKeysOf(problem, segments);
  for (const Node& item : report->At("rows").Items()) {
    const std::string row = item.Text();
    if (std::ranges::count(keys, row) == 0) {
      item.Fail("metric '" + row + "' does not exist",
                "the key of a metric or of an outcome, as in rmse:BLOCK, nees.mean:ENTRY, "
                "nis.mean:SENSOR or accepted:SENSOR",
                Nearest(row, keys));
    }
    rows.push_back(row);
  }
  report->RejectUnread();
  return rows;
}

}  // namespace alidade::internal
