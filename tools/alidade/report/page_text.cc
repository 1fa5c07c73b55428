// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/page_text.h"

#include <exception>
#include <map>
#include <nlohmann/json.hpp>

#include "alidade/base/error.h"
#include "alidade/io/utf8.h"
#include "alidade/report/embedded.h"
#include "alidade/report/page.h"

namespace alidade::internal {
namespace {

/// Replaces all occurrences of `pattern`.
std::string Replaced(std::string_view text, std::string_view pattern, std::string_view value) {
  std::string result;
  for (std::size_t found; (found = text.find(pattern)) != text.npos;) {
    result.append(text.substr(0, found)).append(value);
    text.remove_prefix(found + pattern.size());
  }
  return result.append(text);
}

/// Escapes a text for the content of an HTML element.
std::string HtmlEscaped(const std::string& text) {
  const std::string printable = PrintableUtf8(text, "\n\t");
  return Replaced(Replaced(printable, "&", "&amp;"), "<", "&lt;");
}

/// Returns the conclusions and the verdicts as items of a list, for a browser without scripts.
std::string SummaryItems(const Json& data) {
  std::string items;
  const auto add = [&](const std::string& text) {
    items += "<li>" + HtmlEscaped(text) + "</li>\n";
  };
  const std::string reason = data.value("reason", "");
  if (!reason.empty()) add(reason);
  for (const char* const key : {"compare", "sweep", "evaluation", "bundle"}) {
    if (!data.contains(key) || !data.at(key).is_object()) continue;
    for (const Json& conclusion : data.at(key).value("conclusions", Json::array())) {
      add(conclusion.at("text").get<std::string>());
    }
  }
  if (!data.contains("run") || !data.at("run").is_object()) return items;
  for (const Json& estimator : data.at("run").at("estimators")) {
    if (!estimator.contains("verdict")) continue;
    const Json& verdict = estimator.at("verdict");
    add(estimator.at("name").get<std::string>() + ": " + verdict.at("state").get<std::string>() +
        ": " + verdict.at("because").get<std::string>());
  }
  return items;
}

/// Escapes JSON for a script element. The text then contains neither a tag nor a line separator.
std::string ScriptEscaped(std::string_view json) {
  const std::string text = Replaced(json, "<", "\\u003c");
  return Replaced(Replaced(text, "\u2028", "\\u2028"), "\u2029", "\\u2029");
}

/// Replaces each `{{KEY}}` of the template by its text. The texts are not searched for keys.
std::string Filled(std::string_view page,
                   const std::map<std::string, std::string, std::less<>>& texts) {
  std::string result;
  for (std::size_t begin; (begin = page.find("{{")) != page.npos;) {
    const std::size_t end = page.find("}}", begin);
    result.append(page.substr(0, begin));
    result.append(texts.at(std::string(page.substr(begin + 2, end - begin - 2))));
    page.remove_prefix(end + 2);
  }
  return result.append(page);
}

}  // namespace

std::string DataText(const Json& data, const ColumnPool& pool) {
  Json whole = {{"format", "alidade-report"},
                {"version", 1},
                {"status", "ok"},
                {"reason", ""},
                {"failure", {}},
                {"command", ""},
                {"config_file", ""},
                {"program", ALIDADE_VERSION},
                {"verdict", {}},
                {"seed", {}},
                {"frames", {}},
                {"reference", ""},
                {"hash", ""},
                {"config", ""},
                {"files", Json::array()},
                {"run", {}},
                {"compare", {}},
                {"sweep", {}},
                {"evaluation", {}},
                {"bundle", {}},
                {"explain", {}}};
  whole.update(data);
  std::string text = whole.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.back() = ',';  // the columns follow
  return text + "\"columns\":" + pool.Text() + '}';
}

std::string PageText(const Json& data, const ColumnPool& pool) {
  return Filled(kPageTemplate, {{"title", HtmlEscaped(data.at("title").get<std::string>())},
                                {"summary", SummaryItems(data)},
                                {"style", kPageStyle},
                                {"script", kPageScript},
                                {"data", ScriptEscaped(DataText(data, pool))}});
}

std::string LiveDataOf(const std::string& page, const Json& live) {
  constexpr std::string_view kBegin = R"(<script type="application/json" id="data">{)";
  const std::size_t begin = page.find(kBegin);
  ALIDADE_EXPECTS(begin != page.npos);
  const std::size_t content = begin + kBegin.size();
  return "{\"live\":" + live.dump() + ',' +
         page.substr(content, page.find("</script>", content) - content);
}

void WritePage(const OutputFolder& folder) {
  folder.Write("report.html", ReportPage(folder.partial()));
}

void CommitWithPage(OutputFolder& folder) {
  std::exception_ptr error;
  try {
    WritePage(folder);
  } catch (...) {  // a write failed, or memory ran out
    error = std::current_exception();
    folder.Remove("report.html");
  }
  folder.Commit();
  if (error) std::rethrow_exception(error);
}

}  // namespace alidade::internal
