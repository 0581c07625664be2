#include "config/document.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <map>
#include <optional>
#include <sstream>

#include "config/text.hpp"

namespace axisd::config {

namespace {

Mark to_mark(const YAML::Mark& mark) { return {std::max(mark.line, 0) + 1, std::max(mark.column, 0) + 1}; }

/// Builds the tree from parser events: the node API of yaml-cpp would hide duplicate keys. Throws
/// SyntaxError.
class TreeBuilder : public YAML::EventHandler {
 public:
  NodePtr root() const { return root_; }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add(make(Node::Kind::null, mark, ""), anchor);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    const auto node = make(Node::Kind::scalar, mark, tag == "!" ? "" : tag);
    node->text = value;
    node->plain = tag != "!";
    add(node, anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto target = anchors_.find(anchor);
    if (target == anchors_.end()) throw SyntaxError{to_mark(mark), "an alias inside of its own anchor", ""};
    attach(target->second, to_mark(mark));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open_.push_back({make(Node::Kind::list, mark, tag), anchor, nullptr});
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open_.push_back({make(Node::Kind::section, mark, tag), anchor, nullptr});
  }
  void OnMapEnd() override { close(); }

 private:
  struct Open {
    std::shared_ptr<Node> node;
    YAML::anchor_t anchor;
    NodePtr key;  ///< of a section: read, waiting for its value
  };

  static std::shared_ptr<Node> make(Node::Kind kind, const YAML::Mark& mark, const std::string& tag) {
    if (!tag.empty() && tag != "?") {
      throw SyntaxError{to_mark(mark), fmt::format("tag {} is not supported", quoted(tag)),
                        "leave the tag out"};
    }
    auto node = std::make_shared<Node>();
    node->kind = kind;
    node->mark = to_mark(mark);
    return node;
  }

  void close() {
    const auto done = open_.back();
    open_.pop_back();
    add(done.node, done.anchor);
  }

  void add(const std::shared_ptr<Node>& node, YAML::anchor_t anchor) {
    if (anchor != YAML::NullAnchor) anchors_[anchor] = node;
    attach(node, node->mark);
  }

  void attach(const NodePtr& node, Mark mark) {
    if (open_.empty()) {
      root_ = node;
      return;
    }
    auto& parent = open_.back();
    parent.node->weight += node->weight;
    if (parent.node->weight > largest_tree) {
      throw SyntaxError{mark, "the file has too many values", fmt::format("at most {}", largest_tree)};
    }
    if (parent.node->kind == Node::Kind::list) {
      parent.node->items.push_back(node);
    } else if (parent.key == nullptr) {
      parent.key = check_key(node, mark);
    } else {
      parent.node->entries.emplace_back(std::exchange(parent.key, nullptr), node);
    }
  }

  static NodePtr check_key(const NodePtr& key, Mark mark) {
    if (key->kind != Node::Kind::scalar)
      throw SyntaxError{mark, "a key must be a word", "one brace or bracket too many?"};
    if (key->plain && key->text == "<<") {
      throw SyntaxError{mark, "merge keys ('<<') are not supported",
                        "write the keys out, or use an alias for a value"};
    }
    return key;
  }

  std::vector<Open> open_;
  std::map<YAML::anchor_t, NodePtr> anchors_;
  NodePtr root_;
};

std::expected<NodePtr, SyntaxError> failed(Mark mark, std::string message, std::string suggestion = {}) {
  return std::unexpected(SyntaxError{mark, std::move(message), std::move(suggestion)});
}

/// yaml-cpp has several messages for it, none of which says so. `line` is 0-based.
std::optional<Mark> tab_in_indentation(std::string_view text, int line) {
  std::size_t start = 0;
  for (int i = 0; i < line; ++i) {
    const auto end = text.find('\n', start);
    if (end == std::string_view::npos) return std::nullopt;
    start = end + 1;
  }
  const auto indentation = text.substr(start, text.find_first_not_of(" \t", start) - start);
  const auto tab = indentation.find('\t');
  if (tab == std::string_view::npos) return std::nullopt;
  return Mark{line + 1, static_cast<int>(tab) + 1};
}

}  // namespace

const Node* Node::find(std::string_view key) const {
  const auto entry = std::ranges::find_if(entries, [&](const auto& e) { return e.first->text == key; });
  return entry == entries.end() ? nullptr : entry->second.get();
}

std::expected<NodePtr, SyntaxError> parse_document(std::string_view text) try {
  if (text.size() > largest_text) {
    return failed({}, "the file is too large", fmt::format("at most {} bytes", largest_text));
  }
  if (const auto nul = text.find('\0'); nul != std::string_view::npos) {
    const auto before = text.substr(0, nul);
    const auto line_start = before.rfind('\n') + 1;  // npos + 1 is 0
    return failed(
        {static_cast<int>(std::ranges::count(before, '\n')) + 1, static_cast<int>(nul - line_start) + 1},
        "a NUL byte: this is no YAML text", "save the file as UTF-8");
  }
  std::istringstream stream{std::string(text)};
  YAML::Parser parser(stream);
  TreeBuilder builder;
  if (!parser.HandleNextDocument(builder) || builder.root() == nullptr) {
    return failed({}, "the file is empty", "start from config/examples/demo.yaml");
  }
  TreeBuilder second;
  if (parser.HandleNextDocument(second)) {
    return failed(second.root() == nullptr ? Mark{} : second.root()->mark, "a second YAML document ('---')",
                  "one file holds one machine");
  }
  return builder.root();
} catch (const SyntaxError& error) {
  return std::unexpected(error);
} catch (const YAML::Exception& error) {
  if (const auto tab = tab_in_indentation(text, error.mark.line)) {
    return failed(*tab, "not valid YAML: a tab in the indentation", "indent with spaces");
  }
  return failed(to_mark(error.mark), fmt::format("not valid YAML: {}", printable(error.msg)),
                "check indentation, brackets and quotes here and in the line above");
} catch (const std::exception& error) {
  return failed({}, fmt::format("not valid YAML: {}", printable(error.what())));
}

}  // namespace axisd::config
