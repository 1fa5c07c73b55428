// SPDX-License-Identifier: Apache-2.0
#include "alidade/replay/run_inputs.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <system_error>

#include "alidade/base/text.h"
#include "alidade/io/json.h"
#include "alidade/io/output_file.h"
#include "alidade/io/read_file.h"
#include "alidade/io/sha256.h"
#include "alidade/replay/build_ids.h"
#include "alidade/replay/compare_rows.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// SHA-256 of a file. Error: kIo.
std::string HashOf(const fs::path& file) {
  std::string hash = Sha256OfFile(file);
  if (hash.empty()) {
    throw Error(ExitCode::kIo, ErrorLine(Place{file.string()}, {}, "cannot be read for its hash"));
  }
  return hash;
}

/// `{"file": FILE, "bytes": N, "sha256": HASH}`
std::string HashedFile(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file, error);
  return "{\"file\": " + JsonString(file.string()) +
         ", \"bytes\": " + std::to_string(error ? 0 : bytes) +
         ", \"sha256\": " + JsonString(HashOf(file)) + '}';
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

/// `source.path`; "" where there is none.
std::string SourcePath(const Config& config) {
  const Config copy = config.Copy();  // nothing of the original counts as read
  const auto source = copy.root().is_map() ? copy.root().Find("source") : std::nullopt;
  const auto path = source && source->is_map() ? source->Find("path") : std::nullopt;
  return path && path->kind() == Node::Kind::kScalar ? path->Text() : "";
}

/// What a source reads from `path`, as JSON.
std::vector<std::string> DataAt(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_regular_file(status)) return {HashedFile(path)};
  std::vector<std::string> data;
  if (fs::is_directory(status)) {
    std::vector<fs::path> files;
    fs::directory_iterator entry(path, error);
    for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
      std::error_code ignored;
      if (entry->is_regular_file(ignored)) files.push_back(entry->path());
    }
    if (error) FailIo(path, "read", error.value());
    std::ranges::sort(files);
    for (const fs::path& file : files) data.push_back(HashedFile(file));
  } else if (path == "-" || fs::exists(status)) {
    data.push_back("{\"file\": " + JsonString(path) + ", \"read_once\": true}");
  }
  return data;
}

/// Likewise, of all these configs; each path once, in their order.
std::vector<std::string> DataOf(const std::vector<Config>& configs) {
  std::vector<std::string> data;
  std::set<std::string> known = {""};
  for (const Config& config : configs) {
    const std::string path = SourcePath(config);
    if (!known.insert(path).second) continue;
    const std::vector<std::string> more = DataAt(path);
    data.insert(data.end(), more.begin(), more.end());
  }
  return data;
}

/// The names of plugins in a config.
struct Names {
  std::set<std::string> models, types;
};

/// Adds the values of the keys `model` and `type` at and below `node`, at any depth.
void AddNames(const Node& node, Names& names) {
  if (node.kind() == Node::Kind::kList) {
    for (const Node& item : node.Items()) AddNames(item, names);
  }
  if (!node.is_map()) return;
  for (const auto& [key, value] : node.Entries()) {
    const bool scalar = value.kind() == Node::Kind::kScalar;
    if (scalar && key == "model") names.models.insert(value.Text());
    if (scalar && key == "type") names.types.insert(value.Text());
    AddNames(value, names);
  }
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
    const bool of_machine = name == "processor" || name == "kernels";
    facts[(of_machine ? "" : "build of ") + name] = id.get<std::string>();
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

std::vector<fs::path> PluginsNamed(const std::vector<Config>& configs, const PluginHost& host) {
  Names names;
  for (const Config& config : configs) {
    const Config copy = config.Copy();  // nothing of the original counts as read
    AddNames(copy.root(), names);
  }
  std::vector<fs::path> files;
  for (const PluginEntry& entry : host.entries()) {
    if (!(entry.is_model() ? names.models : names.types).contains(entry.name)) continue;
    if (std::ranges::find(files, entry.plugin) == files.end()) files.push_back(entry.plugin);
  }
  return files;
}

PluginHashes HashesOf(const std::vector<fs::path>& files) {
  PluginHashes hashes;
  for (const fs::path& file : files) hashes.emplace(file.filename().string(), HashOf(file));
  return hashes;
}

std::string InputsJson(const CommandInputs& command, const Config& config,
                       const std::vector<Config>& runs, const PluginHashes& plugins) {
  std::vector<std::string> paths, folders, build, used;
  for (const fs::path& path : command.plugin_paths) paths.push_back(JsonString(path.string()));
  for (const fs::path& path : command.plugin_folders) folders.push_back(JsonString(path.string()));
  for (const auto& [name, id] : BuildIds())
    build.push_back(JsonString(name) + ": " + JsonString(id));
  for (const auto& [file, hash] : plugins) {
    used.push_back("{\"file\": " + JsonString(file) + ", \"sha256\": " + JsonString(hash) + '}');
  }
  return "{\n  \"arguments\": " + Bracketed('[', JsonStrings(command.arguments), ']') +
         ",\n  \"config\": {\"file\": " + JsonString(fs::path(config.name()).filename().string()) +
         ", \"sha256\": " + JsonString(Sha256(config.ToYaml())) +
         "},\n  \"plugin_paths\": " + Bracketed('[', paths, ']') +
         ",\n  \"plugin_folders\": " + Bracketed('[', folders, ']') +
         ",\n  \"build\": " + Bracketed('{', build, '}') +
         ",\n  \"plugins\": " + Bracketed('[', used, ']') +
         ",\n  \"data\": " + Bracketed('[', DataOf(runs), ']') + "\n}\n";
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

std::string WithoutOption(std::string text, const std::string& option, const std::string& value) {
  const std::string words = ",\n    " + JsonString(option) + ",\n    " + JsonString(value);
  const std::size_t place = text.find(words);
  return place == text.npos ? text : text.erase(place, words.size());
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

MadeFrom ReadMadeFrom(const fs::path& folder) {
  const auto read = [&folder](const char* name) {
    const fs::path file = folder / name;
    return ReadFile(file, [&](ExitCode code, int error) {
      throw Error(code, ErrorLine(Place{file.string()}, {},
                                  "cannot be read: " + std::generic_category().message(error),
                                  "the folder of an `alidade run` or `alidade sweep`"));
    });
  };
  MadeFrom made;
  made.inputs = read(kInputsFile);
  made.config = read(kResolvedConfig);
  return made;
}

std::string DifferenceOf(const MadeFrom& before, const std::string& file, const MadeFrom& now) {
  std::vector<std::string> differences;
  std::istringstream config_before(before.config), config_now(now.config);
  if (const auto one = CompareRows(config_before, config_now).difference) {
    differences.push_back(std::string(kResolvedConfig) + ':' + std::to_string(one->line) + ": " +
                          one->Text());
  }
  for (const std::string& one : InputDifferences(before.inputs, file, now.inputs)) {
    if (differences.empty() || !one.starts_with("config: ")) differences.push_back(one);
  }
  return Join(differences, "; ");
}

}  // namespace alidade::internal
