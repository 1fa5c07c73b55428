// SPDX-License-Identifier: Apache-2.0
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <sstream>
#include <unordered_map>

#include "alidade/config/tree.h"
#include "alidade/io/utf8.h"

namespace alidade::internal {
namespace {

constexpr std::size_t kMaxSize = 1 << 20;
constexpr int kMaxUnclosed = 4096;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Checker of the characters and the indentation of a YAML text.
class TextCheck {
 public:
  explicit TextCheck(const Origin& origin) : origin_(origin) {}

  /// Returns the text without carriage returns.
  std::string Run(std::string_view text) {
    std::string clean;
    clean.reserve(text.size());
    while (!text.empty()) {
      const std::size_t size = Utf8Length(text);
      if (size == 0) Fail("invalid UTF-8", "UTF-8 text");
      const std::string_view character = text.substr(0, size);
      text.remove_prefix(size);
      if (character == kByteOrderMark) {
        Fail("a byte order mark is allowed only at the start of the text");
      }
      if (character[0] == '\r') {
        if (!text.starts_with('\n')) Fail("a carriage return is not followed by a line feed");
        continue;
      }
      CheckCharacter(character[0]);
      clean += character;
      column_ += static_cast<int>(size);
      if (character[0] == '\n') {
        ++line_;
        column_ = 1;
        in_indent_ = true;
      }
    }
    return clean;
  }

 private:
  void CheckCharacter(char c) {
    if (c == '\0') Fail("the text contains a NUL byte");
    if ((c > 0 && c < ' ' && c != '\t' && c != '\n') || c == 0x7F) {
      constexpr std::string_view kHex = "0123456789abcdef";
      Fail(std::string("control character 0x") + kHex[c >> 4] + kHex[c & 15] + " is not allowed");
    }
    if (in_indent_ && c == '\t') Fail("the indentation contains a tab", "spaces");
    if (column_ == 1) {
      // yaml-cpp ignores a line that begins with '%'.
      if (c == '%' && has_begun_)
        Fail("the line begins with '%'", "quotes around a text that begins with '%'");
      has_begun_ = has_begun_ || (c != '%' && c != '#' && c != ' ' && c != '\n');
    }
    if (c != ' ') in_indent_ = false;
    if (c == '[' || c == '{') ++unclosed_;
    if (c == ']' || c == '}') unclosed_ = std::max(0, unclosed_ - 1);
    // Without this limit, the scanner of yaml-cpp would queue a token for each open bracket before
    // the depth is checked.
    if (unclosed_ > kMaxUnclosed) {
      Fail("nested too deep", "at most " + std::to_string(kMaxDepth) + " levels");
    }
  }

  [[noreturn]] void Fail(std::string_view message, std::string_view expected = {}) {
    Place place{origin_.file};
    if (origin_.has_lines) place = Place{origin_.file, line_, column_};
    FailAt(place, origin_.key_prefix, message, expected);
  }

  const Origin& origin_;
  int line_ = 1;
  int column_ = 1;
  int unclosed_ = 0;
  bool in_indent_ = true;
  bool has_begun_ = false;  ///< true after the first content, which no directive may follow
};

/// Checks size, encoding and indentation. Returns the text without BOM and carriage returns.
std::string CleanText(std::string_view text, const Origin& origin) {
  if (text.size() > kMaxSize) {
    FailAt(Place{origin.file}, origin.key_prefix, "the config is larger than 1 MiB",
           "at most 1 MiB");
  }
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  return TextCheck(origin).Run(text);
}

/// Size of a tree.
struct Extent {
  int depth = 0;
  int nodes = 0;
  std::size_t bytes = 0;
};

Extent Measure(const ConfigTree& tree) {
  Extent extent{0, 1, tree.text.size() + tree.key.size()};
  for (const auto& child : tree.children) {
    const Extent part = Measure(*child);
    extent.depth = std::max(extent.depth, part.depth);
    extent.nodes += part.nodes;
    extent.bytes += part.bytes;
  }
  if (tree.kind == Node::Kind::kMap || tree.kind == Node::Kind::kList) ++extent.depth;
  return extent;
}

/// Returns a clearer wording of a short message of yaml-cpp, or `message` itself.
std::string RewordMessage(const std::string& message) {
  struct Phrase {
    std::string_view original, replacement;
  };
  static constexpr Phrase kPhrases[] = {
      {"end of map not found", "wrong indentation, or text after a value"},
      {"end of sequence not found", "wrong indentation in a list"},
      {"end of map flow not found", "'{' is not closed, or a comma is missing"},
      {"end of sequence flow not found", "'[' is not closed, or a comma is missing"},
      {"illegal flow end", "']' or '}' has no opening bracket"},
      {"illegal EOF in scalar", "a quote is not closed"},
      {"illegal map value", "':' is not allowed here"},
      {"illegal block entry", "'-' is not allowed here"},
      {"unknown token", "text that starts like this must be quoted"},
  };
  for (const Phrase& phrase : kPhrases) {
    if (message == phrase.original) return std::string(phrase.replacement);
  }
  return message;
}

/// Builder of the tree, which handles the events of yaml-cpp.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(std::string_view text, const Origin& origin, Budget* budget)
      : text_(text), origin_(origin), budget_(budget) {}

  std::unique_ptr<ConfigTree> ReleaseRoot() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ < 2) return;
    const bool marker =
        text_.substr(std::min<std::size_t>(mark.pos, text_.size())).starts_with("---");
    Fail(mark, marker ? "a second document begins here" : "text after the end of the document",
         "one document in a file");
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    RejectAsKey(mark, "empty key");
    ConfigTree* node = Add(mark, anchor, Node::Kind::kNull);
    if (node->key_line > 0 && node->place.line != node->key_line) node->place = KeyPlace(*node);
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    RejectAsKey(mark, "an alias is used as a key");
    const auto target = anchors_.find(anchor);
    if (target == anchors_.end()) Fail(mark, "an alias cannot refer to a key");
    for (const Frame& frame : stack_) {
      if (frame.node == target->second) Fail(mark, "the alias refers to itself");
    }
    const Extent extent = Measure(*target->second);
    AddToBudget(mark, extent.nodes, extent.bytes);
    CheckDepth(mark, extent.depth);
    Attach(Clone(*target->second));
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    RejectTag(mark, tag);
    if (value.find('\0') != std::string::npos) Fail(mark, "the text contains a NUL character");
    // The escapes \N and \_ of yaml-cpp 0.7 yield single bytes, which are not UTF-8.
    if (!IsUtf8(value)) Fail(mark, "the escape sequence is not a valid character");
    if (ExpectsKey()) return SetKey(mark, tag, value);
    ConfigTree* node = Add(mark, anchor, Node::Kind::kScalar, value.size());
    node->quoted = tag != "?";
    const auto first = std::min<std::size_t>(mark.pos + (node->quoted ? 1 : 0), text_.size());
    node->is_verbatim = origin_.has_lines && text_.substr(first).starts_with(value);
    node->text = value;
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    RejectAsKey(mark, "a list is used as a key, or '[' is not closed");
    Open(mark, tag, anchor, Node::Kind::kList);
  }
  void OnSequenceEnd() override { stack_.pop_back(); }

  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    RejectAsKey(mark, "a map is used as a key, or '{' is not closed");
    Open(mark, tag, anchor, Node::Kind::kMap);
  }
  void OnMapEnd() override { stack_.pop_back(); }

  [[noreturn]] void FailSyntax(const YAML::Exception& error) const {
    const std::string message = "not valid YAML: " + RewordMessage(error.msg);
    if (stack_.empty() || error.msg.find("flow not found") == std::string::npos) {
      Fail(error.mark, message, error.msg == "end of map not found" ? Indentation() : "");
    }
    const ConfigTree& unclosed = *stack_.back().node;
    FailAt(unclosed.place, FullPath({}), message);
  }

  [[noreturn]] void Fail(const YAML::Mark& mark, std::string_view message,
                         std::string_view expected = {}, std::string_view key = {}) const {
    FailAt(PlaceOf(mark), FullPath(key), message, expected);
  }

 private:
  struct Frame {
    ConfigTree* node = nullptr;
    bool has_key = false;
    std::string key = {};
    YAML::Mark key_mark = {};
    std::unordered_map<std::string, int> key_lines = {};
  };

  Place PlaceOf(const YAML::Mark& mark) const {
    if (!origin_.has_lines) return Place{origin_.file};
    return Place{origin_.file, mark.line + 1, mark.column + 1};
  }

  /// Returns a text about the indentation of the map being read, or "" if it has no keys yet.
  std::string Indentation() const {
    if (!origin_.has_lines || stack_.empty() || stack_.back().node->children.empty()) return {};
    const ConfigTree& map = *stack_.back().node;
    const int spaces = map.children.front()->key_column - 1;
    if (PathOf(map).empty()) return "a key of the file in column 1";
    return std::to_string(spaces) + (spaces == 1 ? " space" : " spaces") + " before each key of " +
           Quoted(PathOf(map));
  }

  /// Returns the key path of the value being read, or of `key` in the map being read.
  std::string FullPath(std::string_view key) const {
    std::string path = origin_.key_prefix;
    const auto append = [&](std::string_view part) {
      if (!path.empty() && !part.empty() && part[0] != '[') path += '.';
      path += part;
    };
    if (stack_.empty()) return path;
    append(PathOf(*stack_.back().node));
    append(stack_.back().has_key ? stack_.back().key : key);
    return path;
  }

  bool ExpectsKey() const {
    return !stack_.empty() && stack_.back().node->kind == Node::Kind::kMap &&
           !stack_.back().has_key;
  }

  void RejectAsKey(const YAML::Mark& mark, std::string_view message) const {
    if (ExpectsKey()) Fail(mark, message, "text");
  }

  void RejectTag(const YAML::Mark& mark, const std::string& tag) const {
    if (tag.empty() || tag == "?" || tag == "!") return;
    constexpr std::string_view kStandard = "tag:yaml.org,2002:";
    const std::string tag_text =
        tag.starts_with(kStandard) ? "!!" + tag.substr(kStandard.size()) : tag;
    Fail(mark, "tag " + Quoted(tag_text) + " is not supported");
  }

  void SetKey(const YAML::Mark& mark, const std::string& tag, const std::string& key) {
    Frame& frame = stack_.back();
    if (key.empty()) Fail(mark, "empty key", "text");
    if (key == "<<" && tag == "?")
      Fail(mark, "merge key '<<' is not supported", "the keys themselves");
    if (const std::string defect = KeyDefect(key); !defect.empty()) Fail(mark, defect);
    const auto [first, is_new] = frame.key_lines.emplace(key, mark.line + 1);
    if (!is_new) {
      std::string message = "duplicate key";
      if (origin_.has_lines)
        message += "; the first one is at line " + std::to_string(first->second);
      Fail(mark, message, {}, key);
    }
    AddToBudget(mark, 0, key.size());
    frame.has_key = true;
    frame.key = key;
    frame.key_mark = mark;
  }

  void AddToBudget(const YAML::Mark& mark, int nodes, std::size_t bytes) {
    budget_->nodes += nodes;
    budget_->bytes += bytes;
    if (budget_->is_within_limits()) return;
    Fail(mark, "the config is too large after its aliases are expanded",
         budget_->nodes > Budget::kMaxNodes ? "at most 100000 values" : "at most 8 MiB of text");
  }

  void CheckDepth(const YAML::Mark& mark, int added) const {
    if (static_cast<int>(stack_.size()) + added <= origin_.max_depth) return;
    FailAt(PlaceOf(mark), origin_.key_prefix, "nested too deep",
           "at most " + std::to_string(kMaxDepth) + " levels");
  }

  ConfigTree* Add(const YAML::Mark& mark, YAML::anchor_t anchor, Node::Kind kind,
                  std::size_t bytes = 0) {
    AddToBudget(mark, 1, bytes);
    auto node = std::make_unique<ConfigTree>();
    node->kind = kind;
    node->place = PlaceOf(mark);
    if (anchor != YAML::NullAnchor) anchors_[anchor] = node.get();
    return Attach(std::move(node));
  }

  ConfigTree* Attach(std::unique_ptr<ConfigTree> node) {
    node->key.clear();
    node->index = -1;
    node->key_line = node->key_column = 0;
    node->parent = nullptr;
    if (stack_.empty()) {
      root_ = std::move(node);
      return root_.get();
    }
    Frame& frame = stack_.back();
    auto& siblings = frame.node->children;
    node->parent = frame.node;
    if (frame.node->kind == Node::Kind::kMap) {
      const Place key_place = PlaceOf(frame.key_mark);
      node->key = std::move(frame.key);
      node->key_line = key_place.line;
      node->key_column = key_place.column;
      frame.has_key = false;
    } else {
      node->index = static_cast<int>(siblings.size());
    }
    siblings.push_back(std::move(node));
    return siblings.back().get();
  }

  void Open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
            Node::Kind kind) {
    RejectTag(mark, tag);
    CheckDepth(mark, 1);
    stack_.push_back(Frame{Add(mark, anchor, kind)});
  }

  std::string_view text_;
  const Origin& origin_;
  Budget* budget_;
  int documents_ = 0;
  std::unique_ptr<ConfigTree> root_;
  std::vector<Frame> stack_;
  std::unordered_map<YAML::anchor_t, const ConfigTree*> anchors_;
};

}  // namespace

std::string KeyDefect(const std::string& key) {
  constexpr std::size_t kMaxKeyLength = 256;
  if (!IsUtf8(key)) return "the key is not UTF-8";
  if (key.size() > kMaxKeyLength) return "the key is longer than 256 bytes: " + Quoted(key);
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == 0x7F; };
  if (std::any_of(key.begin(), key.end(), is_control)) {
    return "the key contains a control character: " + Quoted(key);
  }
  return {};
}

std::unique_ptr<ConfigTree> ParseYaml(std::string_view text, const Origin& origin, Budget* budget) {
  const std::string clean = CleanText(text, origin);
  std::istringstream stream(clean);
  TreeBuilder builder(clean, origin, budget);
  try {
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const YAML::Exception& e) {
    builder.FailSyntax(e);
  }
  return builder.ReleaseRoot();
}

}  // namespace alidade::internal
