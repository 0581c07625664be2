// A file of settings as a table of its keys: every error with its line and column, all of them at once. What
// the programs beside the daemon have in common; the daemon's own file has a schema (config/schema.hpp).
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <expected>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "config/diagnostics.hpp"
#include "config/document.hpp"
#include "config/quantity.hpp"
#include "config/text.hpp"

namespace axisd::settings {

/// One key, and where its value goes: one of the functions is set.
template <class Settings>
struct Key {
  std::string_view path;  ///< "limits.body"
  std::string* (*text)(Settings&) = nullptr;
  std::vector<std::string>* (*texts)(Settings&) = nullptr;  ///< a list, of at least one
  int* (*number)(Settings&) = nullptr;
  Duration* (*duration)(Settings&) = nullptr;
  /// Whatever else: it reads the value itself, and tells what is wrong with it.
  void (*value)(Settings&, const config::Node&, config::Diagnostics&) = nullptr;
  std::int64_t minimum = 0, maximum = 0;  ///< of a number; of a duration in ms
};

/// The whole file. Errors: why not, for people; an empty one counts as such. Blocks for the disk.
[[nodiscard]] std::expected<std::string, std::string> text_of_file(const std::string& path);

/// The entries of a section, each key once. `wrong`: what is told of anything else.
template <class Read>
void for_each_entry(const config::Node& section, config::Diagnostics& diagnostics, std::string_view wrong,
                    Read read) {
  if (section.kind != config::Node::Kind::section) {
    diagnostics.add(section.mark, std::string(wrong), "write keys with their values below it");
    return;
  }
  std::set<std::string_view> seen;
  for (const auto& [key, value] : section.entries) {
    if (!seen.insert(key->text).second)
      diagnostics.add(key->mark, fmt::format("{} for the second time", config::quoted(key->text)),
                      "once is enough");
    else
      read(*key, *value);
  }
}

/// The text of a single value; nothing: it is none, which was told.
[[nodiscard]] inline std::optional<std::string> text_of(const config::Node& value, std::string_view key,
                                                        config::Diagnostics& diagnostics) {
  if (value.kind == config::Node::Kind::scalar && !value.text.empty()) return value.text;
  diagnostics.add(value.mark, fmt::format("'{}' has to be a single value", key), "");
  return std::nullopt;
}

template <class Settings>
class TableReader {
 public:
  TableReader(std::span<const Key<Settings>> keys, Settings& settings, config::Diagnostics& diagnostics)
      : keys_(keys), settings_(settings), diagnostics_(diagnostics) {}

  /// `path`: of the section, with a point behind it; empty: the whole file.
  void read_section(const config::Node& section, const std::string& path) {
    if (section.kind == config::Node::Kind::null && path.empty()) return;
    for_each_entry(section, diagnostics_,
                   path.empty() ? "the file is no section" : "this has to be a section",
                   [&](const config::Node& key, const config::Node& value) { read_entry(key, value, path); });
  }

 private:
  void read_entry(const config::Node& name, const config::Node& value, const std::string& path) {
    const auto full = path + name.text;
    const auto key = std::ranges::find(keys_, full, &Key<Settings>::path);
    if (key != keys_.end()) return read_value(*key, value);
    if (std::ranges::any_of(keys_, [&](const auto& k) { return k.path.starts_with(full + '.'); }))
      return read_section(value, full + '.');
    diagnostics_.add(name.mark, fmt::format("unknown key {}", config::quoted(name.text)),
                     config::suggest(name.text, candidates(path)));
  }

  std::vector<std::string_view> candidates(const std::string& path) const {
    std::vector<std::string_view> names;
    for (const auto& key : keys_) {
      if (!key.path.starts_with(path)) continue;
      const auto rest = key.path.substr(path.size());
      const auto word = rest.substr(0, rest.find('.'));
      if (std::ranges::find(names, word) == names.end()) names.push_back(word);
    }
    return names;
  }

  void read_value(const Key<Settings>& key, const config::Node& value) {
    if (key.value != nullptr) return key.value(settings_, value, diagnostics_);
    if (key.texts != nullptr) return read_list(key, value);
    const auto text = text_of(value, key.path, diagnostics_);
    if (!text) return;
    if (key.text != nullptr)
      *key.text(settings_) = *text;
    else if (key.number != nullptr)
      read_number(key, value);
    else
      read_duration(key, value);
  }

  void read_list(const Key<Settings>& key, const config::Node& value) {
    if (value.kind != config::Node::Kind::list || value.items.empty()) {
      diagnostics_.add(value.mark, fmt::format("'{}' has to be a list", key.path), "write [ a, b ]");
      return;
    }
    for (const auto& item : value.items)
      if (auto text = text_of(*item, key.path, diagnostics_))
        key.texts(settings_)->push_back(*std::move(text));
  }

  void read_number(const Key<Settings>& key, const config::Node& value) {
    int number = 0;
    const auto* end = value.text.data() + value.text.size();
    const auto [read, error] = std::from_chars(value.text.data(), end, number);
    if (error != std::errc() || read != end || number < key.minimum || number > key.maximum)
      diagnostics_.add(value.mark, fmt::format("'{}' cannot be {}", key.path, config::quoted(value.text)),
                       fmt::format("a whole number from {} to {}", key.minimum, key.maximum));
    else
      *key.number(settings_) = number;
  }

  void read_duration(const Key<Settings>& key, const config::Node& value) {
    const auto duration = config::parse_duration(value.text);
    const std::chrono::milliseconds least(key.minimum), most(key.maximum);
    if (!duration)
      diagnostics_.add(value.mark, fmt::format("'{}': {}", key.path, duration.error().message),
                       duration.error().suggestion);
    else if (*duration < least || *duration > most)
      diagnostics_.add(
          value.mark, fmt::format("'{}' cannot be {}", key.path, config::quoted(value.text)),
          fmt::format("from {} to {}", config::format_duration(least), config::format_duration(most)));
    else
      *key.duration(settings_) = *duration;
  }

  std::span<const Key<Settings>> keys_;
  Settings& settings_;
  config::Diagnostics& diagnostics_;
};

/// Reads a whole file. What no single key can tell is the caller's to check.
template <class Settings>
void read_keys(const config::Node& document, std::span<const Key<Settings>> keys, Settings& settings,
               config::Diagnostics& diagnostics) {
  TableReader<Settings>(keys, settings, diagnostics).read_section(document, {});
}

/// The marks of keys at the top of the file; its beginning where it has no such key.
[[nodiscard]] inline config::Mark mark_of(const config::Node& document, std::string_view key) {
  const auto* found = document.kind == config::Node::Kind::section ? document.find(key) : nullptr;
  return found == nullptr ? config::Mark{} : found->mark;
}

}  // namespace axisd::settings
