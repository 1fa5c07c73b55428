// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "alidade/compare/compare.h"
#include "alidade/compare/seed_figures.h"
#include "alidade/io/read_file.h"
#include "alidade/record/embedded.h"
#include "alidade/record/report_html.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

std::string TitleOf(const Config& config) {
  const auto title = config.root().Find("title");
  return title ? title->Text() : fs::path(config.name()).stem().string();
}

/// Returns the svg element of an svg file, without the XML prolog.
std::string SvgOf(const fs::path& file) {
  const std::string svg = internal::ReadFile(file, [](ExitCode, int) {});
  const std::size_t start = svg.find("<svg");
  return start == svg.npos ? "" : svg.substr(start);
}

}  // namespace

std::string WriteSeedReport(const internal::OutputFolder& folder, const Comparison& comparison,
                            const Config& config, const std::function<bool()>& stop) {
  using internal::HtmlEscaped;
  const internal::Figures figures = internal::WriteSeedFigures(folder, comparison, stop);
  const std::string title = HtmlEscaped(TitleOf(config));
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  html += "<title>" + title + "</title>\n<style>" + internal::kReportCss +
          "</style>\n</head>\n<body><main>\n<h1>" + title + "</h1>\n";
  html +=
      "<nav><a href=\"#tables\">Tables</a><a href=\"#figures\">Figures</a>"
      "<a href=\"#config\">Config</a></nav>\n<h2 id=\"tables\">Tables</h2>\n";
  html += CompareReport(comparison, TableStyle::kHtml);
  html += "<h2 id=\"figures\">Figures</h2>\n";
  for (const internal::Figure& figure : figures.drawn) {
    const std::string name = HtmlEscaped(figure.name);
    html += "<figure>\n" + SvgOf(folder.partial() / "figures" / (figure.name + ".svg")) +
            "\n<figcaption>" + HtmlEscaped(figure.title) + "; redraw with <code>gnuplot figures/" +
            name + ".gp</code></figcaption>\n</figure>\n";
  }
  if (!figures.note.empty()) html += "<p>" + HtmlEscaped(figures.note) + "</p>\n";
  html += "<h2 id=\"config\">Config</h2>\n<pre>" + HtmlEscaped(config.ToYaml()) + "</pre>\n";
  folder.Write("report.html", html + "</main></body>\n</html>\n");
  return figures.note;
}

}  // namespace alidade
