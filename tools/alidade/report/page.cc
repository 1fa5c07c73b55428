// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/page.h"

#include <nlohmann/json.hpp>
#include <set>

#include "alidade/base/text.h"
#include "alidade/config/config.h"
#include "alidade/io/near_file.h"
#include "alidade/io/read_file.h"
#include "alidade/io/run_files.h"
#include "alidade/report/bundle_data.h"
#include "alidade/report/bundle_scene.h"
#include "alidade/report/comparison_data.h"
#include "alidade/report/page_text.h"
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

/// Files that describe a whole folder. A missing JSON file is null.
struct Folder {
  explicit Folder(const fs::path& folder)
      : path(folder),
        run(JsonIfExists(folder / "run.json")),
        comparison(JsonIfExists(folder / "compare.json")),
        sweep(JsonIfExists(folder / "sweep.json")),
        bundle(JsonIfExists(folder / "bundle.json")),
        inputs(JsonIfExists(folder / "inputs.json")),
        config(TextIfExists(folder / "config.resolved.yaml")),
        config_tree(Config::FromText(config.empty() ? "{}" : config, "config.resolved.yaml")) {}

  /// Returns the JSON file with the status of the folder.
  const Json& main() const {
    for (const Json* const file : {&run, &comparison, &sweep}) {
      if (!file->is_null()) return *file;
    }
    return bundle;
  }

  fs::path path;
  Json run, comparison, sweep, bundle, inputs;
  std::string config;
  Config config_tree;
};

/// Returns the name of the config, which the page shows in commands; "" if it is not recorded.
std::string ConfigName(const Folder& folder) {
  return folder.inputs.contains("config") ? folder.inputs.at("config").value("file", "") : "";
}

/// Returns `alidade COMMAND CONFIG` with the recorded options --set.
std::string CommandWithConfig(const Folder& folder, const std::string& command) {
  const std::string name = ConfigName(folder);
  std::string text =
      "alidade " + command + ' ' + (name.empty() ? "CONFIG" : internal::ShellWord(name));
  if (!folder.inputs.contains("settings")) return text;
  for (const Json& setting : folder.inputs.at("settings")) {
    text += " --set " + internal::ShellWord(setting.get<std::string>());
  }
  return text;
}

/// Returns the command that repeats the folder, without -o; "" if it is not recorded.
std::string CommandOf(const Folder& folder) {
  if (!folder.inputs.contains("arguments")) return "";
  const auto arguments = folder.inputs.at("arguments").get<std::vector<std::string>>();
  if (arguments.empty()) return "";
  std::string text = CommandWithConfig(folder, arguments.front());
  for (std::size_t i = 1; i < arguments.size(); ++i) text += ' ' + arguments[i];
  return text;
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

/// Returns the title of the config, or else the name of the config without its extension. The name
/// of the folder is not used, because a repeated run has the same page in another folder.
std::string TitleOf(const Folder& folder) {
  const Node root = folder.config_tree.root();
  const auto title = root.is_map() ? root.Find("title") : std::nullopt;
  if (title) return title->Text();
  if (const std::string name = ConfigName(folder); !name.empty()) return fs::path(name).stem();
  return !folder.run.is_null()          ? "Run"
         : !folder.comparison.is_null() ? "Comparison"
         : !folder.sweep.is_null()      ? "Sweep"
                                        : "Bundle adjustment";
}

/// Returns the names of all files except the page and the list of files, sorted.
Json FilesOf(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) names.insert(fs::relative(entry.path(), folder).string());
  }
  for (const char* const name : {"report.html", "files.txt"}) names.erase(name);
  return names;
}

/// Returns the facts about the folder.
Json FactsOf(const Folder& folder) {
  const Json& main = folder.main();
  const std::string status = main.value("status", "ok");
  const std::string reason = main.value("reason", main.value("message", ""));
  Json facts = {{"title", TitleOf(folder)},
                {"status", status == "converged" ? "ok" : status},
                {"reason", reason},
                {"failure", FailureOf(reason)},
                {"command", CommandOf(folder)},
                {"config_file", ConfigName(folder)}};
  constexpr std::size_t kHashDigits = 12;
  std::string hash;
  if (folder.run.contains("data")) hash = folder.run.at("data").value("measurements", "");
  facts["verdict"] = main.value("verdict", Json());
  facts["seed"] = main.value("seed", Json());
  facts["frames"] = main.value("frames", Json());
  facts["reference"] = main.value("reference", "");
  facts["hash"] = hash.substr(0, kHashDigits);
  facts["config"] = folder.config;
  facts["files"] = FilesOf(folder.path);
  return facts;
}

/// Returns the facts about the folder, and its results. Error: kBadData if a JSON file has an
/// unexpected content.
Json DataOf(const Folder& folder, internal::ColumnPool& pool) try {
  Json data = FactsOf(folder);
  const Node config = folder.config_tree.root();
  if (!folder.run.is_null()) {
    data["run"] = internal::RunData(folder.path, folder.run, config, {}, pool);
  }
  if (!folder.comparison.is_null()) {
    data["compare"] = internal::ComparisonData(folder.path, folder.comparison, pool);
  }
  if (!folder.sweep.is_null()) {
    data["sweep"] =
        internal::SweepData(folder.path, folder.sweep, CommandWithConfig(folder, "run"), pool);
  }
  if (!folder.bundle.is_null()) {
    data["bundle"] = internal::BundleData(folder.path, folder.bundle, pool);
    data["run"] = internal::BundleScene(folder.path, pool);
  }
  return data;
} catch (const Json::exception& error) {
  internal::FailFile(folder.path, 0, std::string("a JSON file is invalid (") + error.what() + ')');
}

}  // namespace

std::string ReportPage(const fs::path& path) {
  if (!fs::exists(path)) {
    throw Error(ExitCode::kInputMissing,
                ErrorLine(Place{path.string()}, {}, "the folder does not exist",
                          "a folder that `alidade run`, `compare`, `sweep` or `bundle` has written",
                          internal::NearFile(path)));
  }
  const Folder folder(path);
  if (folder.main().is_null()) {
    throw Error(
        ExitCode::kInputMissing,
        ErrorLine(Place{path.string()}, {},
                  "the folder has none of run.json, compare.json, sweep.json and bundle.json",
                  "a folder that `alidade run`, `compare`, `sweep` or `bundle` has written"));
  }
  internal::ColumnPool pool;
  return internal::PageText(DataOf(folder, pool), pool);
}

}  // namespace alidade
