// SPDX-License-Identifier: Apache-2.0
#include "alidade/replay/run_inputs.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <system_error>

#include "alidade/base/text.h"
#include "alidade/config/data_paths.h"
#include "alidade/io/json.h"
#include "alidade/io/output_file.h"
#include "alidade/io/read_file.h"
#include "alidade/io/sha256.h"
#include "alidade/replay/build_ids.h"
#include "alidade/replay/compare_rows.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// Computes the SHA-256 of a file. Error: kIo.
std::string HashOf(const fs::path& file) {
  std::string hash = Sha256OfFile(file);
  if (hash.empty()) {
    throw Error(ExitCode::kIo,
                ErrorLine(Place{file.string()}, {}, "the file cannot be read to compute its hash"));
  }
  return hash;
}

/// Returns the entry of a file: `{"file": FILE, "bytes": N, "sha256": HASH}`.
std::string FileEntry(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file, error);
  return "{\"file\": " + JsonString(file.string()) +
         ", \"bytes\": " + std::to_string(error ? 0 : bytes) +
         ", \"sha256\": " + JsonString(HashOf(file)) + '}';
}

/// Returns a list in brackets. Each line contains one text.
std::string BracketedList(char open, const std::vector<std::string>& texts, char close) {
  std::string list(1, open);
  for (const std::string& text : texts) {
    list.append("\n    ").append(text);
    if (&text != &texts.back()) list += ',';
  }
  return list + (texts.empty() ? "" : "\n  ") + close;
}

std::vector<std::string> JsonStrings(const std::vector<std::string>& texts) {
  std::vector<std::string> strings;
  for (const std::string& text : texts) strings.push_back(JsonString(text));
  return strings;
}

/// Returns a JSON entry for each file that a source reads from `path`.
std::vector<std::string> DataEntriesAt(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_regular_file(status)) return {FileEntry(path)};
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
    for (const fs::path& file : files) data.push_back(FileEntry(file));
  } else if (path == "-" || fs::exists(status)) {
    data.push_back("{\"file\": " + JsonString(path) + ", \"read_once\": true}");
  }
  return data;
}

/// Returns the JSON entries for the data of all configs, in the order of the configs. A path that
/// several configs contain has only one entry.
std::vector<std::string> DataEntriesOf(const std::vector<Config>& configs) {
  std::vector<std::string> data;
  std::set<std::string> visited_paths;
  for (const Config& config : configs) {
    for (const std::string& path : DataPaths(config.root().tree())) {
      if (!visited_paths.insert(path).second) continue;
      const std::vector<std::string> entries = DataEntriesAt(path);
      data.insert(data.end(), entries.begin(), entries.end());
    }
  }
  return data;
}

/// Names of models and types in a config.
struct PluginNames {
  std::set<std::string> models, types;
};

/// Adds the values of the keys `model` and `type` at `node` and at any depth below it.
void AddNames(const Node& node, PluginNames& names) {
  if (node.kind() == Node::Kind::kList) {
    for (const Node& item : node.Items()) AddNames(item, names);
  }
  if (!node.is_map()) return;
  for (const auto& [key, value] : node.Entries()) {
    const bool is_scalar = value.kind() == Node::Kind::kScalar;
    if (is_scalar && key == "model") names.models.insert(value.Text());
    if (is_scalar && key == "type") names.types.insert(value.Text());
    AddNames(value, names);
  }
}

/// Parses `text` as JSON and returns `read(json)`. Error: kBadData if parsing or `read` fails.
template <class F>
auto ReadJsonText(const std::string& text, const std::string& file, const F& read) {
  const Json json = ParseJson(text, file);
  try {
    return read(json);
  } catch (const Json::exception&) {
    throw Error(ExitCode::kBadData,
                ErrorLine(Place{file}, {}, "this is not an inputs.json of this alidade version"));
  }
}

/// Values of an inputs.json that are compared, by name.
using InputValues = std::map<std::string, std::string>;

InputValues InputValuesOf(const Json& json) {
  InputValues values;
  values["command"] = Join(json.at("arguments").get<std::vector<std::string>>(), " ");
  values["plugin paths"] = Join(json.at("plugin_paths").get<std::vector<std::string>>(), ":");
  values["config"] = json.at("config").at("sha256").get<std::string>();
  for (const auto& [name, id] : json.at("build").items()) {
    const bool is_machine_property = name == "processor" || name == "kernels";
    values[(is_machine_property ? "" : "build of ") + name] = id.get<std::string>();
  }
  for (const char* const kind : {"plugin", "data"}) {
    for (const Json& entry : json.at(kind == std::string("data") ? "data" : "plugins")) {
      values[kind + (' ' + entry.at("file").get<std::string>())] += entry.value("sha256", "");
    }
  }
  return values;
}

/// Shortens a hash to the first digits. Encloses any other text in quotes.
std::string Shortened(const std::string& text) {
  constexpr std::size_t kMinHashLength = 40, kShownDigits = 12;
  const bool is_hash =
      text.size() >= kMinHashLength && text.find_first_not_of("0123456789abcdef") == text.npos;
  return is_hash ? text.substr(0, kShownDigits) + "..." : '\'' + text + '\'';
}

}  // namespace

std::vector<fs::path> FindUsedPlugins(const std::vector<Config>& configs, const PluginHost& host) {
  PluginNames names;
  for (const Config& config : configs) {
    const Config copy = config.Copy();  // a copy, because a query marks keys as read
    AddNames(copy.root(), names);
  }
  std::vector<fs::path> files;
  for (const PluginEntry& entry : host.entries()) {
    if (!(entry.is_model() ? names.models : names.types).contains(entry.name)) continue;
    if (std::ranges::find(files, entry.plugin) == files.end()) files.push_back(entry.plugin);
  }
  return files;
}

PluginHashes HashFiles(const std::vector<fs::path>& files) {
  PluginHashes hashes;
  for (const fs::path& file : files) hashes.emplace(file.filename().string(), HashOf(file));
  return hashes;
}

std::string InputsJson(const CommandInputs& command, const Config& config,
                       const std::vector<Config>& runs, const PluginHashes& plugins) {
  std::vector<std::string> paths, folders, build, plugin_entries;
  for (const fs::path& path : command.plugin_paths) paths.push_back(JsonString(path.string()));
  for (const fs::path& path : command.plugin_folders) folders.push_back(JsonString(path.string()));
  for (const auto& [name, id] : BuildIds())
    build.push_back(JsonString(name) + ": " + JsonString(id));
  for (const auto& [file, hash] : plugins) {
    plugin_entries.push_back("{\"file\": " + JsonString(file) +
                             ", \"sha256\": " + JsonString(hash) + '}');
  }
  return "{\n  \"arguments\": " + BracketedList('[', JsonStrings(command.arguments), ']') +
         ",\n  \"settings\": " + BracketedList('[', JsonStrings(command.settings), ']') +
         ",\n  \"config\": {\"file\": " + JsonString(fs::path(config.name()).filename().string()) +
         ", \"sha256\": " + JsonString(Sha256(config.ToYaml())) +
         "},\n  \"plugin_paths\": " + BracketedList('[', paths, ']') +
         ",\n  \"plugin_folders\": " + BracketedList('[', folders, ']') +
         ",\n  \"build\": " + BracketedList('{', build, '}') +
         ",\n  \"plugins\": " + BracketedList('[', plugin_entries, ']') +
         ",\n  \"data\": " + BracketedList('[', DataEntriesOf(runs), ']') + "\n}\n";
}

RecordedInputs ReadInputs(const std::string& text, const std::string& file) {
  return ReadJsonText(text, file, [](const Json& json) {
    RecordedInputs inputs;
    inputs.command.arguments = json.at("arguments").get<std::vector<std::string>>();
    inputs.command.settings = json.at("settings").get<std::vector<std::string>>();
    for (const Json& path : json.at("plugin_paths"))
      inputs.command.plugin_paths.emplace_back(path.get<std::string>());
    for (const Json& path : json.at("plugin_folders"))
      inputs.command.plugin_folders.emplace_back(path.get<std::string>());
    inputs.config = json.at("config").at("file").get<std::string>();
    for (const Json& entry : json.at("data")) {
      if (entry.value("read_once", false)) inputs.read_once = entry.at("file").get<std::string>();
    }
    return inputs;
  });
}

std::string WithoutOption(std::string text, const std::string& option, const std::string& value) {
  const std::string words = ",\n    " + JsonString(option) + ",\n    " + JsonString(value);
  const std::size_t position = text.find(words);
  return position == text.npos ? text : text.erase(position, words.size());
}

std::vector<std::string> InputDifferences(const std::string& recorded, const std::string& file,
                                          const std::string& current) {
  InputValues recorded_values = ReadJsonText(recorded, file, InputValuesOf);
  const InputValues current_values = ReadJsonText(current, kInputsFile, InputValuesOf);
  std::vector<std::string> differences;
  for (const auto& [name, value] : current_values) {
    const auto found = recorded_values.find(name);
    if (found == recorded_values.end()) {
      differences.push_back(name + ": this input is new");
    } else if (found->second != value) {
      differences.push_back(name + ": now " + Shortened(value) + ", was " +
                            Shortened(found->second));
    }
    recorded_values.erase(name);
  }
  for (const auto& [name, value] : recorded_values) {
    differences.push_back(name + ": this input is missing now");
  }
  return differences;
}

std::vector<std::string> DataDifferences(const std::string& recorded, const std::string& file,
                                         const std::string& current) {
  std::vector<std::string> differences = InputDifferences(recorded, file, current);
  std::erase_if(differences, [](const std::string& text) { return !text.starts_with("data "); });
  return differences;
}

InputTexts ReadInputTexts(const fs::path& folder) {
  const auto read = [&folder](const char* name) {
    const fs::path file = folder / name;
    return ReadFile(file, [&](ExitCode code, int error) {
      throw Error(code,
                  ErrorLine(Place{file.string()}, {},
                            "the file cannot be read: " + std::generic_category().message(error),
                            "a folder written by `alidade run` or `alidade sweep`"));
    });
  };
  InputTexts texts;
  texts.inputs = read(kInputsFile);
  texts.config = read(kResolvedConfig);
  return texts;
}

std::string DescribeDifferences(const InputTexts& recorded, const std::string& file,
                                const InputTexts& current) {
  std::vector<std::string> differences;
  std::istringstream recorded_config(recorded.config), current_config(current.config);
  if (const auto row = CompareRows(recorded_config, current_config).difference) {
    differences.push_back(std::string(kResolvedConfig) + ':' + std::to_string(row->line) + ": " +
                          row->Text());
  }
  for (const std::string& input : InputDifferences(recorded.inputs, file, current.inputs)) {
    if (differences.empty() || !input.starts_with("config: ")) differences.push_back(input);
  }
  return Join(differences, "; ");
}

}  // namespace alidade::internal
