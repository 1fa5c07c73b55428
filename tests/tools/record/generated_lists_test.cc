// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "alidade/diagnosis/verdict.h"
#include "alidade/estimation/event.h"
#include "alidade/experiment/metric_table.h"
#include "alidade/record/column_tables.h"

/// The lists of metrics, events, outcomes and columns in the documentation are generated from
/// tables in the code. With ALIDADE_UPDATE_DOCS=1 the tests rewrite the lists.
namespace alidade {
namespace {

std::string Row(const std::vector<std::string>& cells) {
  std::string row = "|";
  for (const std::string& cell : cells) row += cell.empty() ? " |" : " " + cell + " |";
  return row + '\n';
}

std::string Quoted(const std::string& name) { return '`' + name + '`'; }

std::string UnitText(const MetricInfo& metric) {
  switch (metric.unit) {
    case MetricUnit::kSubject:
      return "of the block";
    case MetricUnit::kMetre:
      return "m";
    case MetricUnit::kMillisecond:
      return "ms";
    case MetricUnit::kMicrosecond:
      return "us";
    case MetricUnit::kFrames:
      return "frames";
    case MetricUnit::kShare:
      return "0 to 1";
    case MetricUnit::kNone:
      break;
  }
  return "";
}

std::string MetricList() {
  constexpr const char* kSubjects[] = {"", ":BLOCK", ":OWNER", ":SENSOR"};
  constexpr const char* kGoals[] = {"", "0", "1", "0.95"};
  std::string list =
      Row({"key", "meaning", "unit", "best", "truth", "segments"}) + "|---|---|---|---|---|---|\n";
  for (const MetricInfo& metric : kMetrics) {
    list += Row({Quoted(std::string(metric.name) + kSubjects[static_cast<int>(metric.subject)]),
                 metric.meaning, UnitText(metric), kGoals[static_cast<int>(metric.goal)],
                 metric.needs_truth ? "yes" : "no", metric.has_segments ? "yes" : "no"});
  }
  return list;
}

std::string EventList() {
  std::string list = Row({"kind", "severity", "meaning"}) + "|---|---|---|\n";
  for (const EventKindInfo& kind : kEventKinds) {
    list += Row({Quoted(kind.name), ToString(kind.severity), kind.meaning});
  }
  return list;
}

std::string FindingList() {
  std::string list = Row({"code", "meaning"}) + "|---|---|\n";
  for (const FindingKindInfo& kind : kFindingKinds) list += Row({Quoted(kind.name), kind.meaning});
  return list;
}

std::string VerdictList() {
  std::string list = Row({"verdict", "meaning"}) + "|---|---|\n";
  for (const VerdictInfo& verdict : kVerdicts) list += Row({Quoted(verdict.name), verdict.meaning});
  return list;
}

std::string OutcomeList() {
  std::string list = Row({"outcome", "meaning", "counts as rejection"}) + "|---|---|---|\n";
  for (const OutcomeInfo& outcome : kOutcomes) {
    list += Row({Quoted(outcome.name), outcome.meaning, outcome.is_rejection ? "yes" : "no"});
  }
  return list;
}

constexpr const char* kColumnHead = "| column | unit | meaning |\n|---|---|---|\n";

template <class Layout, class Data, std::size_t n>
std::string ColumnList(const std::array<internal::ColumnInfo<Layout, Data>, n>& table) {
  std::string list = kColumnHead;
  for (const auto& column : table) {
    list += Row({*column.names == '\0' ? Quoted(column.quantity) : column.names, column.unit,
                 column.meaning});
  }
  return list;
}

template <std::size_t n>
std::string ColumnList(const std::array<internal::BlockColumnInfo, n>& table) {
  std::string list = kColumnHead + Row({"`t_s`", "s", "timestamp of the frame"});
  for (const auto& column : table) list += Row({column.names, column.unit, column.meaning});
  return list;
}

std::string Read(const std::string& page) {
  std::ifstream file(page);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Expects that `page` contains `list` between `<!-- list: NAME -->` and `<!-- end of list -->`.
void ExpectList(const std::string& page, const std::string& name, const std::string& list) {
  const std::string file = std::string(ALIDADE_SOURCE_DIR) + "/docs/" + page;
  const std::string begin = "<!-- list: " + name + " -->\n\n", end = "\n<!-- end of list -->";
  std::string text = Read(file);
  const std::size_t first = text.find(begin), last = text.find(end, first + begin.size() - 1);
  ASSERT_TRUE(first != text.npos && last != text.npos) << page << " has no list " << name;
  const std::size_t start = first + begin.size();
  if (std::getenv("ALIDADE_UPDATE_DOCS") != nullptr) {
    std::ofstream(file) << text.replace(start, last - start, list);
    return;
  }
  EXPECT_EQ(text.substr(start, last - start), list)
      << page << ", list " << name << ": ALIDADE_UPDATE_DOCS=1 rewrites it";
}

TEST(GeneratedLists, AreInTheDocumentation) {
  ExpectList("metrics.md", "metrics", MetricList());
  ExpectList("metrics.md", "verdicts", VerdictList());
  ExpectList("diagnose.md", "findings", FindingList());
  const std::string page = "run_folder.md";
  ExpectList(page, "events", EventList());
  ExpectList(page, "outcomes", OutcomeList());
  ExpectList(page, "measurements.csv", ColumnList(internal::kMeasurementColumns));
  ExpectList(page, "truth.csv", ColumnList(internal::kTruthColumns));
  ExpectList(page, "expected.csv", ColumnList(internal::kExpectedColumns));
  ExpectList(page, "implied_states.csv", ColumnList(internal::kImpliedColumns));
  ExpectList(page, "estimates.csv", ColumnList(internal::kEstimateColumns));
  ExpectList(page, "errors.csv", ColumnList(internal::kErrorColumns));
  ExpectList(page, "owners of errors.csv", ColumnList(internal::kOwnerColumns));
  ExpectList(page, "final_covariance.csv", ColumnList(internal::kCovarianceColumns));
  ExpectList(page, "innovations.csv", ColumnList(internal::kInnovationColumns));
  ExpectList(page, "gains.csv", ColumnList(internal::kGainColumns));
  ExpectList(page, "reprojection.csv", ColumnList(internal::kReprojectionColumns));
  ExpectList(page, "landmarks.csv", ColumnList(internal::kLandmarkColumns));
  ExpectList(page, "events.csv", ColumnList(internal::kEventColumns));
  ExpectList(page, "timing.csv", ColumnList(internal::kTimingColumns));
}

}  // namespace
}  // namespace alidade
