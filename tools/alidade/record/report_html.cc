// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/report_html.h"

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/io/text_table.h"
#include "alidade/io/utf8.h"
#include "alidade/record/embedded.h"

namespace alidade::internal {
namespace {

std::string Element(const std::string& tag, std::string_view text) {
  return '<' + tag + '>' + HtmlEscaped(text) + "</" + tag + ">\n";
}

/// Returns a heading and a table of two columns: key and value.
template <class Map, class Print>
std::string Pairs(const std::string& heading, const Map& values, const Print& print) {
  if (values.empty()) return {};
  std::string html = "<div>" + Element("h3", heading) + "<table>\n";
  for (const auto& [key, value] : values) {
    html +=
        "<tr><td>" + HtmlEscaped(key) + "</td><td>" + HtmlEscaped(print(value)) + "</td></tr>\n";
  }
  return html + "</table></div>\n";
}

/// Returns a badge with the name of a verdict.
std::string Badge(VerdictState verdict) {
  const bool is_good = verdict == VerdictState::kConsistent;
  const bool is_open =
      verdict == VerdictState::kNotTested || verdict == VerdictState::kUnderconfident;
  return std::string("<span class=\"badge ") +
         (is_good   ? "ok"
          : is_open ? "stopped"
                    : "failed") +
         "\">" + ToString(verdict) + "</span>";
}

/// Returns the badge of the run: its status if it did not finish, else the worst verdict.
std::string Badge(const RunResult& result) {
  const auto verdict = WorstVerdict(result);
  if (verdict && result.status == RunStatus::kOk) return Badge(*verdict);
  return std::string("<span class=\"badge ") + ToString(result.status) + "\">" +
         ToString(result.status) + "</span>";
}

std::string Head(const RunResult& result, const Report& report) {
  std::string html = "<h1>" + HtmlEscaped(report.title) + ' ' + Badge(result) + "</h1>\n";
  html += "<p class=\"soft\">" + std::to_string(result.frames) + " frames, seed " +
          std::to_string(report.facts.seed) + ", " + std::to_string(result.estimators.size()) +
          (result.estimators.size() == 1 ? " estimator" : " estimators") + "</p>\n";
  if (!result.reason.empty()) html += Element("p", result.reason);
  html += "<nav><a href=\"#comparison\">Comparison</a><a href=\"#figures\">Figures</a>";
  for (std::size_t i = 0; i < result.estimators.size(); ++i) {
    html += "<a href=\"#estimator-" + std::to_string(i) + "\">" +
            HtmlEscaped(result.estimators[i].name) + "</a>";
  }
  return html + "<a href=\"#config\">Config</a></nav>\n";
}

std::string Table(const RunResult& result, const std::vector<TableRow>& rows) {
  std::string html = "<div class=\"scroll\"><table>\n<tr><th></th>";
  for (const EstimatorResult& estimator : result.estimators) {
    html += "<th>" + HtmlEscaped(estimator.name) + "</th>";
  }
  html += "</tr>\n";
  for (const TableRow& row : rows) {
    html += "<tr><td>" + HtmlEscaped(row.label) + "</td>";
    for (const std::string& cell : row.cells) {
      html += cell == "yes" ? "<td class=\"alarm\">" : "<td>";
      html += HtmlEscaped(cell) + "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string Comparison(const RunResult& result, const std::vector<std::string>& subjects) {
  const std::vector<TableRow> rows = MainRows(result, subjects), all_rows = ComparisonRows(result);
  std::string html = "<h2 id=\"comparison\">Comparison</h2>\n" + Table(result, rows);
  if (all_rows.size() > rows.size()) {
    html += "<details><summary>all rows</summary>\n" + Table(result, all_rows) + "</details>\n";
  }
  if (const std::string reference = ReferenceText(result); !reference.empty()) {
    html += Element("p", reference);
  }
  return html +
         "<p class=\"soft\">NEES and NIS are divided by their degrees of freedom: "
         "about 1 means consistent, a larger value means overconfident. "
         "A positive lag means that the estimate is delayed.</p>\n";
}

std::string FiguresOf(const Report& report, const std::string& estimator) {
  std::string html;
  for (const Figure& figure : report.figures.drawn) {
    const auto svg = report.svgs.find(figure.name);
    if (figure.estimator != estimator || svg == report.svgs.end()) continue;
    html += "<figure>\n" + svg->second + "\n<figcaption>" + HtmlEscaped(figure.title) +
            "; redraw with <code>gnuplot figures/" + HtmlEscaped(figure.name) +
            ".gp</code></figcaption>\n</figure>\n";
  }
  return html;
}

std::string Events(const EstimatorResult& result) {
  constexpr std::size_t kMaxEvents = 50;
  if (result.events.empty()) return {};
  std::string html = Element("h3", "events") + "<div class=\"scroll\"><table>\n" +
                     "<tr><th>t [s]</th><th>kind</th><th class=\"text\">text</th></tr>\n";
  for (std::size_t i = 0; i < std::min(result.events.size(), kMaxEvents); ++i) {
    const Event& event = result.events[i];
    std::string time;
    if (event.timestamp != kNoTimestamp) AppendSeconds(time, event.timestamp);
    html += "<tr><td>" + time + "</td><td>" + ToString(event.kind) + "</td><td class=\"text\">" +
            HtmlEscaped(event.text) + "</td></tr>\n";
  }
  html += "</table></div>\n";
  if (result.events.size() <= kMaxEvents) return html;
  return html + "<p class=\"soft\">Events not shown: " +
         std::to_string(result.events.size() - kMaxEvents) + "; the whole list is in " +
         HtmlEscaped(result.name) + "/events.csv</p>\n";
}

std::string Estimator(const EstimatorResult& result, std::size_t index, const Report& report) {
  std::string html =
      "<h2 id=\"estimator-" + std::to_string(index) + "\">" + HtmlEscaped(result.name);
  if (!result.type.empty() && result.type != result.name) {
    html += " <span class=\"soft\">(" + HtmlEscaped(result.type) + ")</span>";
  }
  html += ' ' + Badge(result.verdict.state) + "</h2>\n<p>" + HtmlEscaped(result.verdict.because) +
          "</p>\n";
  for (const Finding& finding : result.findings) {
    html += "<p><b>" + std::string(ToString(finding.kind)) + ":</b> " + HtmlEscaped(finding.text) +
            "</p>\n";
  }
  for (const std::vector<std::string>& direction : result.unobservable) {
    html += "<p><b>Unobservable:</b> " + HtmlEscaped(Join(direction)) + "</p>\n";
  }
  const auto count = [](std::int64_t n) { return std::to_string(n); };
  html += "<div class=\"columns\">\n" + Pairs("counts", result.counts, count) +
          Pairs("events", CountEvents(result), count) + "</div>\n";
  html += "<details><summary>all metrics</summary>\n" +
          Pairs("metrics", result.metrics, NumberText) + "</details>\n";
  return html + FiguresOf(report, result.name) + Events(result);
}

}  // namespace

std::string HtmlEscaped(std::string_view text) {
  std::string escaped;
  for (const char c : PrintableUtf8(text, "\n\t")) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string ReportHtml(const RunResult& result, const Report& report) {
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  html +=
      Element("title", report.title) + "<style>" + kReportCss + "</style>\n</head>\n<body><main>\n";
  html += Head(result, report) + Comparison(result, report.subjects);
  html += "<h2 id=\"figures\">Figures</h2>\n" + FiguresOf(report, "");
  if (!report.figures.note.empty()) html += Element("p", report.figures.note);
  for (std::size_t i = 0; i < result.estimators.size(); ++i) {
    html += Estimator(result.estimators[i], i, report);
  }
  html += "<h2 id=\"config\">Config</h2>\n" + Element("pre", report.config);
  if (!report.facts.plugins.empty()) {
    html += Element("h3", "plugins (SHA-256)") + "<table>\n";
    for (const auto& [file, hash] : report.facts.plugins) {
      html += "<tr><td>" + HtmlEscaped(file) + "</td><td class=\"text\"><code>" + hash +
              "</code></td></tr>\n";
    }
    html += "</table>\n";
  }
  return html + "</main></body>\n</html>\n";
}

}  // namespace alidade::internal
