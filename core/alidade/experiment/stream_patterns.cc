// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/stream_patterns.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "alidade/base/text.h"
#include "alidade/config/tree.h"

namespace alidade {
namespace {

using internal::Child;
using internal::Quoted;

/// Texts for which `*` stands in the stream of each sensor with a pattern, by the sensor's name.
using Matches = std::map<std::string, std::vector<std::string>, std::less<>>;

std::string Replaced(std::string pattern, const std::string& text) {
  const std::size_t star = pattern.find('*');
  return star == pattern.npos ? pattern : pattern.replace(star, 1, text);
}

/// Returns the texts for which `*` stands in the names of the streams that match `pattern`.
std::vector<std::string> MatchesOf(const std::string& pattern,
                                   const std::vector<StreamInfo>& streams) {
  const std::size_t star = pattern.find('*');
  const std::string prefix = pattern.substr(0, star), suffix = pattern.substr(star + 1);
  std::vector<std::string> texts;
  for (const StreamInfo& stream : streams) {
    const std::string& name = stream.name;
    if (name.size() > prefix.size() + suffix.size() && name.starts_with(prefix) &&
        name.ends_with(suffix)) {
      texts.push_back(name.substr(star, name.size() - prefix.size() - suffix.size()));
    }
  }
  return texts;
}

Matches FindMatches(const ConfigTree& sensors, const std::vector<StreamInfo>& streams) {
  Matches matches;
  for (const auto& sensor : sensors.children) {
    const ConfigTree* const stream = Child(*sensor, "stream");
    if (stream == nullptr || stream->text.find('*') == stream->text.npos) continue;
    if (sensor->key.find('*') == sensor->key.npos) {
      Node(stream).Fail("the name of the sensor does not contain `*`, but its stream does",
                        "a name such as " + Quoted(sensor->key + "_*"));
    }
    std::vector<std::string> texts = MatchesOf(stream->text, streams);
    if (texts.empty()) {
      std::vector<std::string> names;
      for (const StreamInfo& info : streams) names.push_back(info.name);
      Node(stream).Fail("the source has no stream that matches " + Quoted(stream->text),
                        "one of " + internal::Join(names));
    }
    matches[sensor->key] = std::move(texts);
  }
  return matches;
}

/// Replaces each child of `parent` whose name is in `matches` by one copy for each text. The names
/// are the keys of a map or the items of a list.
void ExpandNames(ConfigTree* parent, const Matches& matches) {
  if (parent == nullptr) return;
  std::vector<std::unique_ptr<ConfigTree>> children;
  for (auto& child : parent->children) {
    const bool is_item = parent->kind == Node::Kind::kList;
    const auto found = matches.find(is_item ? child->text : child->key);
    if (found == matches.end()) {
      children.push_back(std::move(child));
      continue;
    }
    for (const std::string& text : found->second) {
      auto& copy = children.emplace_back(internal::Clone(*child));
      copy->parent = parent;
      std::string& name = is_item ? copy->text : copy->key;
      name = Replaced(name, text);
      ConfigTree* const stream = Child(*copy, "stream");
      if (stream != nullptr) stream->text = Replaced(stream->text, text);
    }
  }
  parent->children = std::move(children);
}

}  // namespace

void ExpandStreamPatterns(Config& config, const std::vector<StreamInfo>& streams) {
  const ConfigTree& root = config.tree();
  ConfigTree* const sensors = Child(root, "sensors");
  if (sensors == nullptr || sensors->kind != Node::Kind::kMap) return;
  const Matches matches = FindMatches(*sensors, streams);
  ExpandNames(sensors, matches);
  const ConfigTree* const estimators = Child(root, "estimators");
  if (estimators == nullptr) return;
  for (const auto& estimator : estimators->children) {
    ExpandNames(Child(*estimator, "sensors"), matches);
    const ConfigTree* const overrides = Child(*estimator, "overrides");
    if (overrides != nullptr) ExpandNames(Child(*overrides, "sensors"), matches);
  }
}

}  // namespace alidade
