// YAML text as a tree with positions. Everything that makes YAML dangerous is refused or bounded here.
#pragma once

#include <cstdint>
#include <expected>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axisd::config {

/// 1-based.
struct Mark {
  int line = 1, column = 1;
  friend auto operator<=>(const Mark&, const Mark&) = default;
};

struct Node;
using NodePtr = std::shared_ptr<const Node>;

struct Node {
  enum class Kind : std::uint8_t { null, scalar, list, section };
  Kind kind = Kind::null;
  Mark mark;
  std::string text;            ///< of a scalar
  bool plain = true;           ///< scalar without quotes
  std::vector<NodePtr> items;  ///< of a list
  std::vector<std::pair<NodePtr, NodePtr>>
      entries;             ///< of a section, in the order of the file, with duplicates
  std::size_t weight = 1;  ///< nodes in this subtree, aliases expanded

  /// The first value under this key; nullptr if there is none.
  [[nodiscard]] const Node* find(std::string_view key) const;
};

/// Why a text is no document.
struct SyntaxError {
  Mark mark;
  std::string message, suggestion;
};

inline constexpr std::size_t largest_text = std::size_t{1024} * 1024;  ///< bytes
inline constexpr std::size_t largest_tree = 50'000;                    ///< nodes, aliases expanded

/// Parses one YAML document. Plain aliases are resolved; merge keys, tags and a second document are refused,
/// and so is anything larger than the limits. Never throws.
std::expected<NodePtr, SyntaxError> parse_document(std::string_view text);

}  // namespace axisd::config
