// SPDX-License-Identifier: Apache-2.0
#include "alidade/config/config.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <unordered_map>

#include "alidade/base/text.h"
#include "alidade/config/data_paths.h"
#include "alidade/config/tree.h"
#include "alidade/io/near_file.h"
#include "alidade/io/read_file.h"

namespace alidade {
namespace fs = std::filesystem;
using internal::Budget;
using internal::Child;
using internal::Clone;
using internal::FailAt;
using internal::KeyPlace;
using internal::Origin;
using internal::PathOf;
using internal::Quoted;

namespace {

bool NamesAnotherModel(const ConfigTree& old_map, const ConfigTree& new_map) {
  for (const char* key : {"model", "type"}) {
    const ConfigTree* old_name = Child(old_map, key);
    const ConfigTree* new_name = Child(new_map, key);
    if (old_name != nullptr && new_name != nullptr && old_name->text != new_name->text) {
      return true;
    }
  }
  return false;
}

/// Sets the key paths of `copy` and of all nodes below it to those of `original`.
void CopyPaths(const ConfigTree& original, const ConfigTree& copy) {
  copy.path = PathOf(original);
  for (std::size_t i = 0; i < copy.children.size(); ++i) {
    CopyPaths(*original.children[i], *copy.children[i]);
  }
}

/// Moves the children of the map `overrides` into the map `base`.
void Merge(ConfigTree* base, ConfigTree* overrides) {
  std::unordered_map<std::string, std::size_t> index_by_key;
  for (std::size_t i = 0; i < base->children.size(); ++i) {
    index_by_key.emplace(base->children[i]->key, i);
  }
  for (auto& child : overrides->children) {
    child->parent = base;
    const auto found = index_by_key.find(child->key);
    if (found == index_by_key.end()) {
      base->children.push_back(std::move(child));
      continue;
    }
    auto& old = base->children[found->second];
    const bool are_maps = old->kind == Node::Kind::kMap && child->kind == Node::Kind::kMap;
    if (are_maps && !NamesAnotherModel(*old, *child)) {
      Merge(old.get(), child.get());
    } else {
      old = std::move(child);
    }
  }
}

/// Reads at most one byte more than the maximum size of a config. The parser then detects a file
/// that is too large.
std::string ReadConfig(const fs::path& file, const Place& place, std::string_view key) {
  constexpr std::size_t kLimit = (1 << 20) + 1;
  const auto fail = [&](ExitCode code, int error) {
    const std::string name = key.empty() ? "" : Quoted(file.string()) + ' ';
    const char* const reason = error == EISDIR ? "it is a directory" : std::strerror(error);
    const std::string meant = error == EISDIR ? internal::ConfigIn(file) : internal::NearFile(file);
    throw Error(code, ErrorLine(place, key, name + "cannot be read: " + reason, {}, meant));
  };
  return internal::ReadFile(file, fail, kLimit);
}

void ExpandEstimatorNames(const ConfigTree& root) {
  if (ConfigTree* const estimators = Child(root, "estimators")) internal::ExpandNames(*estimators);
}

std::unique_ptr<ConfigTree> ParseRoot(std::string_view text, const std::string& name,
                                      Budget* budget) {
  auto root = internal::ParseYaml(text, Origin{name}, budget);
  if (root == nullptr || root->kind == Node::Kind::kNull) {
    FailAt(Place{name}, {}, "the file is empty", "a map of keys");
  }
  if (root->kind != Node::Kind::kMap) {
    const bool scalar = root->kind == Node::Kind::kScalar;
    FailAt(root->place, {}, scalar ? Quoted(root->text) : "a list",
           "a map of keys, as in 'key: value'");
  }
  ExpandEstimatorNames(*root);
  return root;
}

/// Returns the values of `source` that are paths of input files. Omits lists and `-`. The value of
/// `path` always counts as a path. A plugin may use the other keys for values that are not paths.
/// Such a value counts as a path only if it contains a slash or names an existing file in `folder`.
std::vector<ConfigTree*> SourcePaths(const ConfigTree& root, const fs::path& folder) {
  std::vector<ConfigTree*> paths;
  const ConfigTree* const source = Child(root, "source");
  if (source == nullptr) return paths;
  const auto add = [&](const char* key, bool is_always_path) {
    ConfigTree* const node = Child(*source, key);
    if (node == nullptr || node->kind != Node::Kind::kScalar) return;
    std::error_code error;
    const std::string& text = node->text;
    if (text.empty() || text == "-") return;
    if (is_always_path || text.find('/') != text.npos || fs::exists(folder / text, error)) {
      paths.push_back(node);
    }
  };
  add("path", true);
  for (const char* key : {"known", "left", "right", "stereo", "boxes", "timestamps", "truth"}) {
    add(key, false);
  }
  return paths;
}

/// Makes the relative paths of `source` and the items of `plugins` absolute. Removes each `.`, but
/// retains each `..`, because `..` may follow a symlink.
void AnchorPaths(const ConfigTree& root, const fs::path& folder) {
  const auto anchor = [&](ConfigTree* node) {
    if (node->kind != Node::Kind::kScalar || node->text.empty() || node->text == "-") return;
    std::error_code error;
    fs::path anchored;
    for (const fs::path& part : fs::absolute(folder / node->text, error)) {
      if (part != ".") anchored /= part;
    }
    if (!error) node->text = anchored.string();
  };
  for (ConfigTree* const path : SourcePaths(root, folder)) anchor(path);
  const ConfigTree* plugins = Child(root, "plugins");
  if (plugins == nullptr) return;
  for (const auto& plugin : plugins->children) anchor(plugin.get());
}

/// Makes the folder of the config the folder of `source.files` if `source` has no `path`.
void AddFolderOfFiles(const ConfigTree& root) {
  ConfigTree* const source = Child(root, "source");
  if (source == nullptr || Child(*source, "path") != nullptr) return;
  const ConfigTree* const files = Child(*source, "files");
  if (files == nullptr) return;
  auto path = std::make_unique<ConfigTree>();
  path->kind = Node::Kind::kScalar;
  path->place = files->place;
  path->text = ".";
  path->parent = source;
  path->key = "path";
  source->children.push_back(std::move(path));
}

/// Removes the key `include` from the map. Returns its value, or null if the key does not exist.
std::unique_ptr<ConfigTree> ExtractInclude(ConfigTree* root) {
  auto& children = root->children;
  const auto found = std::find_if(children.begin(), children.end(),
                                  [](const auto& child) { return child->key == "include"; });
  if (found == children.end()) return nullptr;
  auto include = std::move(*found);
  children.erase(found);
  return include;
}

/// Reader of a config file and of the files that it includes.
class Loader {
 public:
  explicit Loader(bool allow_outside) : allow_outside_(allow_outside) {}

  std::unique_ptr<ConfigTree> Load(const fs::path& file, const Place& place, std::string_view key) {
    constexpr std::size_t kMaxFiles = 64;
    std::error_code ignored;
    const fs::path canonical = fs::weakly_canonical(file, ignored);
    if (std::find(open_files_.begin(), open_files_.end(), canonical) != open_files_.end()) {
      FailAt(place, key, Quoted(file.string()) + " includes itself");
    }
    files_.push_back(file.string());
    if (files_.size() > kMaxFiles) FailAt(place, key, "too many includes", "at most 64 files");
    auto root = ParseRoot(ReadConfig(file, place, key), file.string(), &budget_);
    AddFolderOfFiles(*root);
    AnchorPaths(*root, file.parent_path());
    const auto include = ExtractInclude(root.get());
    if (include == nullptr) return root;
    open_files_.push_back(canonical);
    auto merged = LoadIncludes(*include, file.parent_path());
    open_files_.pop_back();
    Merge(merged.get(), root.get());
    merged->place = root->place;
    return merged;
  }
  const std::vector<std::string>& files() const { return files_; }

 private:
  std::unique_ptr<ConfigTree> LoadIncludes(const ConfigTree& include, const fs::path& folder) {
    const Node node(&include);
    auto merged = std::make_unique<ConfigTree>();
    merged->kind = Node::Kind::kMap;
    for (const Node& name : node.ItemsOrOne()) {
      if (name.kind() != Node::Kind::kScalar)
        name.Fail("not a file name", "a file name or a list of file names");
      const fs::path file =
          ResolveInside(folder, name.Text(), allow_outside_, name.place(), name.path());
      const auto part = Load(file, name.place(), name.path());
      Merge(merged.get(), part.get());
    }
    return merged;
  }

  bool allow_outside_;
  std::vector<std::string> files_;
  Budget budget_;
  std::vector<fs::path> open_files_;
};

/// Step of a dotted key: the name of an entry of a map, or the index of an item of a list.
struct Step {
  std::string name;  ///< empty for an item of a list
  std::size_t index = 0;
};

std::vector<Step> ParseDotted(std::string_view dotted, const Place& place) {
  std::vector<Step> steps;
  const auto fail = [&] {
    FailAt(place, dotted, "not a key path", "a path such as 'a.b' or 'a.b[0]'");
  };
  for (std::string_view remaining = dotted;;) {
    const std::size_t end = std::min(remaining.find('.'), remaining.size());
    std::string_view part = remaining.substr(0, end);
    const std::size_t name_end = std::min(part.find('['), part.size());
    if (name_end == 0) fail();
    steps.push_back({std::string(part.substr(0, name_end))});
    part.remove_prefix(name_end);
    while (!part.empty()) {
      Step step;
      const char* last = part.data() + part.size();
      const auto [digits_end, error] = std::from_chars(part.data() + 1, last, step.index);
      if (part[0] != '[' || error != std::errc() || digits_end == last || *digits_end != ']')
        fail();
      part.remove_prefix(static_cast<std::size_t>(digits_end + 1 - part.data()));
      steps.push_back(step);
    }
    if (end == remaining.size()) return steps;
    remaining.remove_prefix(end + 1);
  }
}

/// Rejects a key below an entry that `root` does not contain, because the user names the entries of
/// these maps, and a misspelt name would create a new entry.
void RejectNewEntry(const ConfigTree& root, const std::vector<Step>& steps, const Place& place,
                    std::string_view dotted) {
  constexpr std::pair<const char*, const char*> kMaps[] = {
      {"estimators", "estimator"}, {"sensors", "sensor"}, {"state", "state entry"}};
  for (const auto& [key, noun] : kMaps) {
    if (steps.size() < 3 || steps[0].name != key || steps[1].name.empty()) continue;
    const ConfigTree* const map = Child(root, key);
    const std::string& name = steps[1].name;
    if (map != nullptr && Child(*map, name) != nullptr) continue;
    std::vector<std::string> names;
    if (map != nullptr) {
      for (const auto& child : map->children) names.push_back(child->key);
    }
    const std::string entries = names.empty() ? "" : internal::Join(names) + ", or ";
    FailAt(place, dotted, std::string(noun) + ' ' + Quoted(name) + " does not exist",
           entries + "a whole new entry, as in " + key + '.' + name + "={KEY: VALUE}",
           Nearest(name, names));
  }
}

/// Returns the child of `node` at `step`. Adds an empty child if `node` is a map without this key.
std::unique_ptr<ConfigTree>* Descend(ConfigTree* node, const Step& step, const Place& place,
                                     std::string_view dotted) {
  const bool is_map_key = !step.name.empty();
  if (is_map_key && node->kind == Node::Kind::kNull) {
    node->kind = Node::Kind::kMap;
    node->place = place;
    node->key_line = node->key_column = 0;
  }
  const std::string& path = PathOf(*node);
  if (node->kind != (is_map_key ? Node::Kind::kMap : Node::Kind::kList)) {
    FailAt(place, dotted, Quoted(path) + (is_map_key ? " is not a map" : " is not a list"),
           !is_map_key ? "a list before each index"
           : node->kind == Node::Kind::kList
               ? "an index of the list, as in " + path + "[0]"
               : "the whole map, as in " + path + "={" + step.name + ": VALUE}");
  }
  auto& children = node->children;
  if (!is_map_key) {
    if (step.index < children.size()) return &children[step.index];
    FailAt(place, dotted,
           Quoted(path) + " has " + std::to_string(children.size()) +
               (children.size() == 1 ? " item" : " items") + ", numbered from 0");
  }
  const auto found = std::find_if(children.begin(), children.end(),
                                  [&](const auto& child) { return child->key == step.name; });
  if (found != children.end()) return &*found;
  children.push_back(std::make_unique<ConfigTree>());
  children.back()->parent = node;
  children.back()->key = step.name;
  children.back()->place = place;
  return &children.back();
}

}  // namespace

Config Config::FromFile(const fs::path& file, bool allow_outside) {
  Config config;
  Loader loader(allow_outside);
  config.tree_ = loader.Load(file, Place{file.string()}, {});
  config.files_ = loader.files();
  config.folder_ = file.has_parent_path() ? file.parent_path() : fs::path(".");
  config.name_ = file.string();
  return config;
}

Config Config::FromText(std::string_view text, std::string_view name) {
  Config config;
  Budget budget;
  config.name_ = name;
  config.folder_ = ".";
  auto root = ParseRoot(text, config.name_, &budget);
  if (const ConfigTree* include = Child(*root, "include")) {
    FailAt(KeyPlace(*include), "include", "only a config file can include another config");
  }
  config.tree_ = std::move(root);
  return config;
}

Node Config::root() const { return Node(tree_.get()); }

void Config::Set(std::string_view dotted_key, std::string_view value, std::string_view origin) {
  const Place place{std::string(origin)};
  const std::vector<Step> steps = ParseDotted(dotted_key, place);
  for (const Step& step : steps) {
    const std::string defect = internal::KeyDefect(step.name);
    if (!defect.empty()) FailAt(place, {}, defect);
  }
  if (steps[0].name == "include") {
    FailAt(place, dotted_key, "cannot be set, because files are included before keys are set",
           "`include:` in the file");
  }
  const int depth = internal::kMaxDepth - static_cast<int>(steps.size());
  if (depth < 0) FailAt(place, dotted_key, "nested too deep", "at most 64 levels");
  Budget budget;
  if (value == "-") value = "'-'";  // YAML reads an unquoted `-` as a list with an empty item
  auto next = internal::ParseYaml(value, Origin{place.file, std::string(dotted_key), false, depth},
                                  &budget);
  if (next == nullptr) FailAt(place, dotted_key, "no value", "a value, or \"\" for an empty text");
  RejectNewEntry(*tree_, steps, place, dotted_key);
  ConfigTree* node = tree_.get();
  std::unique_ptr<ConfigTree>* slot = nullptr;
  for (const Step& step : steps) {
    slot = Descend(node, step, place, dotted_key);
    node = slot->get();
  }
  next->parent = node->parent;
  next->key = node->key;
  next->index = node->index;
  *slot = std::move(next);
  ExpandEstimatorNames(*tree_);
  AnchorPaths(*tree_, {});
}

std::vector<std::string> Config::inputs() const {
  std::vector<std::string> inputs = files_;
  for (const ConfigTree* const path : SourcePaths(*tree_, {})) inputs.push_back(path->text);
  for (const std::string& path : internal::DataPaths(*tree_)) {
    if (path != "-") inputs.push_back(path);
  }
  return inputs;
}

Config Config::Copy() const {
  Config config(*this);
  config.tree_ = Clone(*tree_);
  return config;
}

Config Config::Merged(const Node& overrides) const {
  if (!overrides.is_map()) overrides.Fail("not a map", "a map of keys to override");
  const auto copy = Clone(overrides.tree());
  CopyPaths(overrides.tree(), *copy);
  Config config = Copy();
  Merge(config.tree_.get(), copy.get());
  return config;
}

std::string Config::ToYaml() const { return internal::ToYaml(*tree_); }

}  // namespace alidade
