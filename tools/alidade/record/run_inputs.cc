// SPDX-License-Identifier: Apache-2.0
#include "alidade/record/run_inputs.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>

#include "alidade/base/json.h"
#include "alidade/base/sha256.h"
#include "alidade/base/words.h"
#include "alidade/record/build_ids.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// `{"file": FILE, "bytes": N, "sha256": HASH}`
std::string HashedFile(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file, error);
  return "{\"file\": " + JsonString(file.string()) +
         ", \"bytes\": " + std::to_string(error ? 0 : bytes) +
         ", \"sha256\": " + JsonString(Sha256OfFile(file)) + '}';
}

/// The texts between two brackets, a line each.
std::string Bracketed(char open, const std::vector<std::string>& texts, char close) {
  std::string all(1, open);
  for (const std::string& text : texts) {
    all.append("\n    ").append(text);
    if (&text != &texts.back()) all += ',';
  }
  return all + (texts.empty() ? "" : "\n  ") + close;
}

std::vector<std::string> JsonStrings(const std::vector<std::string>& texts) {
  std::vector<std::string> strings;
  for (const std::string& text : texts) strings.push_back(JsonString(text));
  return strings;
}

/// The value of `source.KEY` as text; "" where there is none.
std::string SourceText(const Config& config, const char* key) {
  const Config copy = config.Copy();  // nothing of the original counts as read
  const auto source = copy.root().is_map() ? copy.root().Find("source") : std::nullopt;
  const auto value = source && source->is_map() ? source->Find(key) : std::nullopt;
  return value && value->kind() == Node::Kind::kScalar ? value->Text() : "";
}

std::vector<std::string> DataOf(const Config& config) {
  const std::string path = SourceText(config, "path");
  if (path.empty()) return {};
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_regular_file(status)) return {HashedFile(path)};
  std::vector<std::string> data;
  if (fs::is_directory(status)) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(path, error)) {
      if (entry.is_regular_file(error)) files.push_back(entry.path());
    }
    std::ranges::sort(files);
    for (const fs::path& file : files) data.push_back(HashedFile(file));
  } else if (path == "-" || fs::exists(status)) {
    data.push_back("{\"file\": " + JsonString(path) + ", \"read_once\": true}");
  }
  return data;
}

/// Calls `read` on the value that `text` is.
template <class F>
auto Reading(const std::string& text, const std::string& file, const F& read) {
  const Json json = ParseJson(text, file);
  try {
    return read(json);
  } catch (const Json::exception&) {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{file}, {}, "is not what a run of this version records"));
  }
}

/// What the text says, a line for each name.
using Facts = std::map<std::string, std::string>;

Facts FactsIn(const Json& json) {
  Facts facts;
  facts["command"] = Join(json.at("arguments").get<std::vector<std::string>>(), " ");
  facts["plugin paths"] = Join(json.at("plugin_paths").get<std::vector<std::string>>(), ":");
  facts["config"] = json.at("config").at("sha256").get<std::string>();
  for (const auto& [name, id] : json.at("build").items()) {
    facts[(name == "processor" ? "" : "build of ") + name] = id.get<std::string>();
  }
  for (const char* const kind : {"plugin", "data"}) {
    for (const Json& one : json.at(kind == std::string("data") ? "data" : "plugins")) {
      facts[kind + (' ' + one.at("file").get<std::string>())] += one.value("sha256", "");
    }
  }
  return facts;
}

/// A hash by its first digits, any other text as it is.
std::string Shortened(const std::string& text) {
  constexpr std::size_t kShortHash = 40, kShown = 12;
  const bool hash =
      text.size() >= kShortHash && text.find_first_not_of("0123456789abcdef") == text.npos;
  return hash ? text.substr(0, kShown) + "..." : '\'' + text + '\'';
}

}  // namespace

std::vector<fs::path> PluginsInUse(const Experiment& experiment, const Config& config,
                                   const PluginHost& host) {
  std::vector<fs::path> files;
  const auto add = [&](const fs::path& file) {
    if (!file.is_absolute()) return;  // a model made in this process
    if (std::ranges::find(files, file) == files.end()) files.push_back(file);
  };
  for (const NamedEstimator& named : experiment.estimators) {
    for (const auto& sensor : named.system.sensors) add(sensor.model.instance().plugin());
    for (const auto& motion : named.system.motions) add(motion.model.instance().plugin());
  }
  const std::string source = SourceText(config, "type");
  for (const PluginEntry& entry : host.entries()) {
    const auto is_used = [&](const NamedEstimator& named) { return named.type == entry.name; };
    const bool used = entry.kind == PluginEntry::Kind::kSource
                          ? entry.name == source
                          : entry.kind == PluginEntry::Kind::kEstimator &&
                                std::ranges::any_of(experiment.estimators, is_used);
    if (used) add(entry.plugin);
  }
  return files;
}

std::string PluginHash(const fs::path& file) {
  std::string hash = Sha256OfFile(file);
  if (hash.empty()) {
    throw Error(ExitCode::kIo, ErrorLine(Place{file.string()}, {}, "cannot be read for its hash"));
  }
  return hash;
}

std::string InputsJson(const CommandInputs& command, const Config& config,
                       const std::vector<fs::path>& plugins) {
  std::vector<std::string> paths, folders, build, used;
  for (const fs::path& path : command.plugin_paths) paths.push_back(JsonString(path.string()));
  for (const fs::path& path : command.plugin_folders) folders.push_back(JsonString(path.string()));
  for (const auto& [name, id] : BuildIds())
    build.push_back(JsonString(name) + ": " + JsonString(id));
  std::multimap<std::string, std::string> hashes;  // by name, wherever they lie
  for (const fs::path& file : plugins) hashes.emplace(file.filename().string(), PluginHash(file));
  for (const auto& [file, hash] : hashes) {
    used.push_back("{\"file\": " + JsonString(file) + ", \"sha256\": " + JsonString(hash) + '}');
  }
  return "{\n  \"arguments\": " + Bracketed('[', JsonStrings(command.arguments), ']') +
         ",\n  \"config\": {\"file\": " + JsonString(fs::path(config.name()).filename().string()) +
         ", \"sha256\": " + JsonString(Sha256(config.ToYaml())) +
         "},\n  \"plugin_paths\": " + Bracketed('[', paths, ']') +
         ",\n  \"plugin_folders\": " + Bracketed('[', folders, ']') +
         ",\n  \"build\": " + Bracketed('{', build, '}') +
         ",\n  \"plugins\": " + Bracketed('[', used, ']') +
         ",\n  \"data\": " + Bracketed('[', DataOf(config), ']') + "\n}\n";
}

RecordedInputs ReadInputs(const std::string& text, const std::string& file) {
  return Reading(text, file, [](const Json& json) {
    RecordedInputs inputs;
    inputs.command.arguments = json.at("arguments").get<std::vector<std::string>>();
    for (const Json& path : json.at("plugin_paths"))
      inputs.command.plugin_paths.emplace_back(path.get<std::string>());
    for (const Json& path : json.at("plugin_folders"))
      inputs.command.plugin_folders.emplace_back(path.get<std::string>());
    inputs.config = json.at("config").at("file").get<std::string>();
    for (const Json& one : json.at("data")) {
      if (one.value("read_once", false)) inputs.read_once = one.at("file").get<std::string>();
    }
    return inputs;
  });
}

std::vector<std::string> InputDifferences(const std::string& before, const std::string& file,
                                          const std::string& now) {
  Facts was = Reading(before, file, FactsIn);
  const Facts is = Reading(now, kInputsFile, FactsIn);
  std::vector<std::string> differences;
  for (const auto& [name, value] : is) {
    const auto recorded = was.find(name);
    if (recorded == was.end()) {
      differences.push_back(name + ": new");
    } else if (recorded->second != value) {
      differences.push_back(name + ": now " + Shortened(value) + ", was " +
                            Shortened(recorded->second));
    }
    was.erase(name);
  }
  for (const auto& [name, value] : was) differences.push_back(name + ": missing now");
  return differences;
}

}  // namespace alidade::internal
