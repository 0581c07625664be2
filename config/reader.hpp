// Walks a document along the schema and fills the configuration.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostics.hpp"
#include "config/document.hpp"
#include "config/schema.hpp"

namespace axisd {
struct DriveDescriptor;
struct SettingSpec;
}  // namespace axisd

namespace axisd::config {

/// Where the keys stand, by path ("axes.feeder.limits.velocity"), and which of them were wrong: later checks
/// speak only of what was read without errors.
class Places {
 public:
  void add(const std::string& path, Mark mark) { marks_.insert_or_assign(path, mark); }
  void mark_bad(const std::string& path) { bad_.insert(path); }
  [[nodiscard]] bool given(std::string_view path) const { return marks_.contains(path); }
  /// Neither this key nor one above it was wrong or is missing though required.
  [[nodiscard]] bool usable(std::string_view path) const;
  /// Nothing in the section of this path was wrong either.
  [[nodiscard]] bool clean(std::string_view path) const;
  /// Of the key's value; if it is not given, of the section that it would be in.
  [[nodiscard]] Mark mark(std::string_view path) const;

 private:
  std::map<std::string, Mark, std::less<>> marks_;
  std::set<std::string, std::less<>> bad_;
};

class Reader {
 public:
  Reader(Configuration& configuration, Diagnostics& diagnostics, Places& places)
      : target_{.configuration = &configuration}, diagnostics_(diagnostics), places_(places) {}
  void read(const Node& root);

 private:
  struct Entry {
    const Node& key;
    const Node& value;
  };

  /// Reports a unit that nothing of the axis is written in: once, in place of each of its values.
  void check_unit(const Node& axis, const std::string& path);
  void read_section(const Node& node, Mark where, std::span<const KeySpec> keys, const std::string& path);
  void check_keys(std::span<const Entry> entries, std::span<const KeySpec> keys, const std::string& path,
                  std::set<std::string_view>& probably_meant);
  void read_key(const KeySpec& spec, const Node& key, const Node& value, const std::string& path);
  void read_value(const KeySpec& spec, const Node& value, const std::string& path);
  /// Sections under names or numbers.
  void read_sections(const KeySpec& spec, const Node& value, const std::string& path);
  /// Reports a section that has none or several of the keys of which it must have one.
  void check_one_of(const KeySpec& spec, const Node& key, const Node& section, const std::string& path);
  /// The name or number of a section; reports what is neither.
  std::optional<Value> read_section_key(const KeySpec& spec, const Node& key, const std::string& path);
  // Of a model (model_keys.cpp).
  void read_terminals(const Node& value, const std::string& path, bool inputs);
  void read_terminal(const Node& value, const std::string& path, bool inputs);
  void read_model_settings(const Node& value, const std::string& path);
  void read_model_objects(const KeySpec& spec, const Node& value, const std::string& path);

  bool check_is_section(const Node& value, std::string_view name, const std::string& path);
  /// The entries of a section without those whose key was there before; reports these.
  std::vector<Entry> unique_entries(const Node& section);
  void report(const std::string& path, Mark mark, std::string message, std::string suggestion = {});

  Target target_;
  Diagnostics& diagnostics_;
  Places& places_;
};

/// What a terminal's long form has: {function, active}.
std::span<const KeySpec> terminal_schema();
/// The definition of a model's setting, as far as the schema can say it.
KeySpec setting_schema(const SettingSpec& setting);
/// Adds the model's default for each setting that was not given.
void add_default_settings(AxisSettings& axis, const DriveDescriptor& model);

}  // namespace axisd::config
