// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/page.h"

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include "alidade/base/text.h"
#include "alidade/compare/run_files.h"
#include "alidade/config/config.h"
#include "alidade/io/read_file.h"
#include "alidade/report/comparison_data.h"
#include "alidade/report/embedded.h"
#include "alidade/report/quotation.h"
#include "alidade/report/run_data.h"
#include "alidade/report/sweep_data.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using internal::Json;

/// Returns the content of a JSON file, or null if the file does not exist.
Json JsonIfExists(const fs::path& file) {
  return fs::exists(file) ? internal::ReadJsonFile(file) : Json();
}

std::string TextIfExists(const fs::path& file) {
  if (!fs::exists(file)) return "";
  return internal::ReadFile(
      file, [&](ExitCode, int) { internal::FailFile(file, 0, "the file cannot be read"); });
}

/// Files of a finished folder that describe the whole folder. A missing JSON file is null.
struct Folder {
  explicit Folder(const fs::path& folder)
      : path(folder),
        name(fs::weakly_canonical(folder).filename().string()),
        run(JsonIfExists(folder / "run.json")),
        comparison(JsonIfExists(folder / "compare.json")),
        sweep(JsonIfExists(folder / "sweep.json")),
        inputs(JsonIfExists(folder / "inputs.json")),
        config(TextIfExists(folder / "config.resolved.yaml")),
        config_tree(Config::FromText(config.empty() ? "{}" : config, "config.resolved.yaml")) {}

  /// Returns the JSON file with the status of the folder.
  const Json& main() const {
    return !run.is_null() ? run : !comparison.is_null() ? comparison : sweep;
  }

  fs::path path;
  std::string name;
  Json run, comparison, sweep, inputs;
  std::string config;
  Config config_tree;
};

/// Returns the name of the config, which the page shows in commands.
std::string ConfigName(const Folder& folder) {
  if (folder.inputs.contains("config")) return folder.inputs.at("config").value("file", "CONFIG");
  return "CONFIG";
}

/// Returns the command that repeats the folder, without -o.
std::string CommandOf(const Folder& folder) {
  std::vector<std::string> arguments;
  if (folder.inputs.contains("arguments")) {
    arguments = folder.inputs.at("arguments").get<std::vector<std::string>>();
  } else if (!folder.comparison.is_null()) {
    arguments = {"compare"};
    const int runs = folder.comparison.value("runs", 1);
    if (runs > 1) arguments.insert(arguments.end(), {"--runs", std::to_string(runs)});
  }
  if (arguments.empty()) arguments = {"run"};
  arguments.insert(arguments.begin() + 1, ConfigName(folder));
  return "alidade " + internal::Join(arguments, " ");
}

/// Returns the place, the message and the quoted lines of an error, or null if the reason does not
/// begin with a place.
Json FailureOf(const std::string& reason) {
  constexpr int kBefore = 3, kAfter = 2;
  const auto quotation = internal::QuotationOf(reason, kBefore, kAfter);
  if (!quotation) return {};
  Json lines = Json::array();
  for (const auto& [number, text] : quotation->lines) lines.push_back({number, text});
  return {{"file", fs::path(quotation->place.file).filename().string()},
          {"line", quotation->place.line},
          {"column", quotation->place.column},
          {"text", quotation->message},
          {"lines", lines}};
}

std::string TitleOf(const Folder& folder) {
  const Node root = folder.config_tree.root();
  const auto title = root.is_map() ? root.Find("title") : std::nullopt;
  return title ? title->Text() : folder.name;
}

Json LinesOf(const std::string& text) {
  Json lines = Json::array();
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Returns the facts about the folder.
Json FactsOf(const Folder& folder) {
  const Json& main = folder.main();
  const std::string reason = main.value("reason", "");
  Json facts = {{"format", "alidade-report"},
                {"version", 1},
                {"name", folder.name},
                {"title", TitleOf(folder)},
                {"status", main.value("status", "ok")},
                {"reason", reason},
                {"failure", FailureOf(reason)},
                {"command", CommandOf(folder)},
                {"config_file", ConfigName(folder)}};
  constexpr std::size_t kHashDigits = 12;
  std::string hash, version;
  if (folder.run.contains("data")) hash = folder.run.at("data").value("measurements", "");
  if (folder.run.contains("versions")) version = folder.run.at("versions").value("alidade", "");
  facts["program"] = version;
  facts["verdict"] = main.value("verdict", Json());
  facts["seed"] = main.value("seed", Json());
  facts["frames"] = main.value("frames", Json());
  facts["reference"] = main.value("reference", "");
  facts["hash"] = hash.substr(0, kHashDigits);
  facts["config"] = folder.config;
  facts["files"] = LinesOf(TextIfExists(folder.path / "files.txt"));
  return facts;
}

/// Returns the data of the page as JSON. Error: kBadData if a JSON file has an unexpected content.
std::string DataText(const Folder& folder) try {
  internal::ColumnPool pool;
  Json data = FactsOf(folder);
  const auto& [run, comparison, sweep] = std::tie(folder.run, folder.comparison, folder.sweep);
  const Node config = folder.config_tree.root();
  data["run"] = run.is_null() ? Json() : internal::RunData(folder.path, run, config, pool);
  data["compare"] =
      comparison.is_null() ? Json() : internal::ComparisonData(folder.path, comparison, pool);
  data["sweep"] = sweep.is_null() ? Json() : internal::SweepData(folder.path, sweep, pool);
  std::string text = data.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.back() = ',';  // the columns follow
  return text + "\"columns\":" + pool.Text() + '}';
} catch (const Json::exception& error) {
  internal::FailFile(folder.path, 0, std::string("a JSON file is invalid (") + error.what() + ')');
}

/// Replaces all occurrences of `pattern`.
std::string Replaced(std::string_view text, std::string_view pattern, std::string_view value) {
  std::string result;
  for (std::size_t found; (found = text.find(pattern)) != text.npos;) {
    result.append(text.substr(0, found)).append(value);
    text.remove_prefix(found + pattern.size());
  }
  return result.append(text);
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

std::string ReportPage(const fs::path& path) {
  const Folder folder(path);
  if (folder.main().is_null()) {
    throw Error(ExitCode::kInputMissing,
                ErrorLine(Place{path.string()}, {},
                          "the folder has none of run.json, compare.json and sweep.json",
                          "a folder that `alidade run`, `compare` or `sweep` has written"));
  }
  const std::string title = Replaced(Replaced(TitleOf(folder), "&", "&amp;"), "<", "&lt;");
  return Filled(internal::kPageTemplate, {{"title", title},
                                          {"style", internal::kPageStyle},
                                          {"script", internal::kPageScript},
                                          {"data", ScriptEscaped(DataText(folder))}});
}

}  // namespace alidade
