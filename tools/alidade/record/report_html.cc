// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/report_html.h"

#include "alidade/base/number_text.h"
#include "alidade/base/text_table.h"
#include "alidade/base/words.h"
#include "alidade/run/metric_rows.h"

namespace alidade::internal {
namespace {

constexpr const char* kStyle = R"(
:root { --ink: #1c2733; --soft: #5b6875; --line: #dde3e9; --wash: #f5f7f9; --blue: #0072b2; }
* { box-sizing: border-box; }
body { margin: 0; color: var(--ink); background: #fff;
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
main { max-width: 1040px; margin: 0 auto; padding: 32px 24px 64px; }
h1 { font-size: 26px; margin: 0 0 4px; }
h2 { font-size: 20px; margin: 44px 0 12px; padding-bottom: 6px;
  border-bottom: 2px solid var(--line); }
h3 { font-size: 15px; margin: 24px 0 8px; color: var(--soft); font-weight: 600; }
p { margin: 6px 0; }
.soft { color: var(--soft); }
.badge { display: inline-block; padding: 1px 10px; border-radius: 10px; color: #fff;
  font-size: 13px; font-weight: 600; vertical-align: 2px; }
.ok { background: #2f855a; } .stopped { background: #b7791f; }
.failed, .diverged { background: #c53030; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 4px 14px; border-bottom: 1px solid var(--line); text-align: right;
  white-space: nowrap; }
th { background: var(--wash); font-weight: 600; }
th:first-child, td:first-child { text-align: left; padding-left: 8px; }
td.text { text-align: left; white-space: normal; }
td.alarm { color: #c53030; font-weight: 600; }
.columns { display: flex; flex-wrap: wrap; gap: 8px 40px; align-items: flex-start; }
figure { margin: 14px 0; border: 1px solid var(--line); border-radius: 6px; padding: 8px; }
figure svg { display: block; width: 100%; height: auto; }
figcaption { color: var(--soft); font-size: 13px; padding: 4px 8px; }
pre { background: var(--wash); border: 1px solid var(--line); border-radius: 6px; padding: 14px;
  overflow-x: auto; font: 13px/1.45 ui-monospace, Menlo, "DejaVu Sans Mono", monospace; }
code { font: 13px ui-monospace, Menlo, "DejaVu Sans Mono", monospace; word-break: break-all; }
details { margin: 12px 0; } summary { cursor: pointer; color: var(--blue); }
nav a { margin-right: 18px; }
a { color: var(--blue); text-decoration: none; }
a:hover { text-decoration: underline; }
@media print { figure, table { break-inside: avoid; } nav { display: none; } }
)";

std::string Element(const std::string& tag, std::string_view text) {
  return '<' + tag + '>' + HtmlEscaped(text) + "</" + tag + ">\n";
}

/// A table of two columns.
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

std::string Head(const RunResult& result, const Report& report) {
  std::string html = "<h1>" + HtmlEscaped(report.title) + " <span class=\"badge " +
                     ToString(result.status) + "\">" + ToString(result.status) + "</span></h1>\n";
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
  for (const EstimatorResult& one : result.estimators) {
    html += "<th>" + HtmlEscaped(one.name) + "</th>";
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
  const std::vector<TableRow> rows = MainRows(result, subjects), all = ComparisonRows(result);
  std::string html = "<h2 id=\"comparison\">Comparison</h2>\n" + Table(result, rows);
  if (all.size() > rows.size()) {
    html += "<details><summary>all rows</summary>\n" + Table(result, all) + "</details>\n";
  }
  if (const std::string reference = ReferenceText(result); !reference.empty()) {
    html += Element("p", reference);
  }
  return html +
         "<p class=\"soft\">NEES and NIS are divided by their degrees of freedom: "
         "1 is consistent, more is too sure of itself. A positive lag is late.</p>\n";
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
    if (event.stamp != kNoStamp) AppendSeconds(time, event.stamp);
    html += "<tr><td>" + time + "</td><td>" + HtmlEscaped(event.kind) + "</td><td class=\"text\">" +
            HtmlEscaped(event.text) + "</td></tr>\n";
  }
  html += "</table></div>\n";
  if (result.events.size() <= kMaxEvents) return html;
  return html + "<p class=\"soft\">and " + std::to_string(result.events.size() - kMaxEvents) +
         " more, in " + HtmlEscaped(result.name) + "/events.csv</p>\n";
}

std::string Estimator(const EstimatorResult& result, std::size_t index, const Report& report) {
  std::string html =
      "<h2 id=\"estimator-" + std::to_string(index) + "\">" + HtmlEscaped(result.name);
  const auto known = report.facts.estimators.find(result.name);
  if (known != report.facts.estimators.end() && known->second.type != result.name) {
    html += " <span class=\"soft\">(" + HtmlEscaped(known->second.type) + ")</span>";
  }
  if (result.diverged) html += " <span class=\"badge diverged\">diverged</span>";
  if (result.inconsistent) html += " <span class=\"badge diverged\">inconsistent</span>";
  html += "</h2>\n";
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
  for (const char c : text) {
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
  html += Element("title", report.title) + "<style>" + kStyle + "</style>\n</head>\n<body><main>\n";
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
