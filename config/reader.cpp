#include "config/reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "config/quantity.hpp"
#include "config/text.hpp"
#include "config/unit_conversion.hpp"
#include "config/value.hpp"

namespace axisd::config {

namespace {

std::vector<std::string_view> keys_of(std::span<const KeySpec> keys) {
  return names_of(keys, [](const KeySpec& spec) { return spec.key; });
}

const KeySpec* find(std::span<const KeySpec> keys, std::string_view key) {
  const auto spec = std::ranges::find(keys, key, &KeySpec::key);
  return spec == keys.end() ? nullptr : &*spec;
}

std::string join(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

/// "limits or homing": the sections beside it that have this key.
std::string sections_with(std::span<const KeySpec> keys, std::string_view key) {
  std::vector<std::string_view> sections;
  for (const auto& spec : keys) {
    if (spec.kind == Kind::section && find(spec.children, key) != nullptr) sections.push_back(spec.key);
  }
  return alternatives(sections);
}

/// "mm" of an axis with `scale: { travel: 5 mm/rev }`; empty: it has none that can be read.
std::string unit_of_travel(const Node& axis) {
  const auto* scale = axis.find("scale");
  const auto* travel = scale == nullptr ? nullptr : scale->find("travel");
  if (travel == nullptr || travel->kind != Node::Kind::scalar) return {};
  const auto quantity = parse_quantity(travel->text);
  return quantity ? quantity->unit.substr(0, quantity->unit.find('/')) : std::string();
}

}  // namespace

bool Places::usable(std::string_view path) const {
  while (!bad_.contains(path)) {
    const auto dot = path.rfind('.');
    if (dot == std::string_view::npos) return true;
    path = path.substr(0, dot);
  }
  return false;
}

bool Places::clean(std::string_view path) const {
  const auto inside = std::string(path) + ".";
  const auto next = bad_.lower_bound(inside);
  return usable(path) && (next == bad_.end() || !next->starts_with(inside));
}

Mark Places::mark(std::string_view path) const {
  for (;;) {
    if (const auto found = marks_.find(path); found != marks_.end()) return found->second;
    const auto dot = path.rfind('.');
    if (dot == std::string_view::npos) return {};
    path = path.substr(0, dot);
  }
}

void Reader::report(const std::string& path, Mark mark, std::string message, std::string suggestion) {
  places_.mark_bad(path);
  diagnostics_.add(mark, std::move(message), std::move(suggestion));
}

void Reader::read(const Node& root) {
  if (root.kind != Node::Kind::section) {
    report("", root.mark, fmt::format("the file must be a section of keys, not {}", kind_name(root)),
           "begin with machine: NAME");
    return;
  }
  read_section(root, root.mark, schema(), "");
}

void Reader::check_unit(const Node& axis, const std::string& path) {
  const auto* unit = axis.find("unit");
  if (unit == nullptr || unit->kind != Node::Kind::scalar || !matches(unit->text, "[A-Za-z]{1,16}") ||
      !units_like(unit->text).empty())
    return;  // usual, or told as no unit at all
  const auto travel = unit_of_travel(axis);
  if (travel == unit->text || units_like(travel).empty()) return;
  report(join(path, "unit"), unit->mark,
         fmt::format("{} is no usual unit, and scale.travel is in {}", quoted(unit->text), travel),
         fmt::format("write unit: {}, or give travel in {}", travel, printable(unit->text)));
}

void Reader::read_section(const Node& node, Mark where, std::span<const KeySpec> keys,
                          const std::string& path) {
  std::set<std::string_view> probably_meant;
  const auto entries = unique_entries(node);
  check_keys(entries, keys, path, probably_meant);
  for (const auto& spec : keys) {  // in the schema's order: some values depend on earlier ones
    const auto entry =
        std::ranges::find_if(node.entries, [&](const auto& e) { return e.first->text == spec.key; });
    if (entry != node.entries.end()) {
      read_key(spec, *entry->first, *entry->second, join(path, spec.key));
    } else if (spec.required) {
      places_.mark_bad(join(path, spec.key));
      if (probably_meant.contains(spec.key)) continue;  // reported as misspelt
      diagnostics_.add(where, fmt::format("missing key '{}'{}", spec.key, path.empty() ? "" : " in " + path),
                       spec.example.empty() ? "" : fmt::format("for example {}: {}", spec.key, spec.example));
    }
  }
}

void Reader::check_keys(std::span<const Entry> entries, std::span<const KeySpec> keys,
                        const std::string& path, std::set<std::string_view>& probably_meant) {
  const auto known = keys_of(keys);
  for (const auto& [key, value] : entries) {
    if (find(keys, key.text) != nullptr) continue;
    const auto here = join(path, printable(key.text));
    const auto message = fmt::format("unknown key {}{}", quoted(key.text), path.empty() ? "" : " in " + path);
    if (const auto sections = sections_with(keys, key.text); !sections.empty()) {
      report(here, key.mark, message, fmt::format("it belongs under {}", sections));
    } else {
      report(here, key.mark, message, suggest(key.text, known));
      probably_meant.insert(nearest(key.text, known));
    }
  }
}

std::vector<Reader::Entry> Reader::unique_entries(const Node& section) {
  std::vector<Entry> result;
  std::map<std::string_view, int> lines;
  for (const auto& [key, value] : section.entries) {
    const auto [first, is_first] = lines.try_emplace(key->text, key->mark.line);
    if (is_first) {
      result.push_back({*key, *value});
    } else {
      diagnostics_.add(key->mark, fmt::format("duplicate key {}", quoted(key->text)),
                       fmt::format("it stands in line {} already", first->second));
    }
  }
  return result;
}

bool Reader::check_is_section(const Node& value, std::string_view name, const std::string& path) {
  if (value.kind == Node::Kind::section) return true;
  const auto mark = value.kind == Node::Kind::null ? places_.mark(path) : value.mark;
  report(path, mark, fmt::format("{} must be a section of keys, not {}", quoted(name), kind_name(value)),
         "indent its keys below it");
  return false;
}

void Reader::read_key(const KeySpec& spec, const Node& key, const Node& value, const std::string& path) {
  const bool one_value = value.kind == Node::Kind::scalar || value.kind == Node::Kind::list;
  places_.add(path, one_value ? value.mark : key.mark);
  switch (spec.kind) {
    case Kind::section:
      if (!check_is_section(value, spec.key, path)) return;
      if (spec.field.apply != nullptr) spec.field.apply(target_, {});
      read_section(value, key.mark, spec.children, path);
      return;
    case Kind::named_sections:
    case Kind::numbered_sections:
      read_sections(spec, value, path);
      return;
    case Kind::terminals:
      read_terminals(value, path, spec.key == "inputs");
      return;
    case Kind::model_settings:
      read_model_settings(value, path);
      return;
    default:
      read_value(spec, value, path);
      return;
  }
}

void Reader::read_value(const KeySpec& spec, const Node& value, const std::string& path) {
  if (value.kind == Node::Kind::null) {
    report(path, places_.mark(path), fmt::format("'{}' has no value", spec.key),
           spec.example.empty() ? "" : fmt::format("for example {}: {}", spec.key, spec.example));
    return;
  }
  // An axis's unit is known once it was read; ScaleSettings has a default that nobody wrote.
  std::string_view unit;
  if (target_.axis != nullptr && places_.usable(fmt::format("axes.{}.unit", target_.axis->axis.name))) {
    unit = target_.axis->axis.scale.unit;
  }
  const auto parsed = parse_value(spec, value, unit);
  if (!parsed) {
    report(path, parsed.error().mark, parsed.error().message, parsed.error().suggestion);
    return;
  }
  if (spec.field.apply != nullptr) spec.field.apply(target_, *parsed);
}

void Reader::check_one_of(const KeySpec& spec, const Node& key, const Node& section,
                          const std::string& path) {
  const auto known = alternatives(keys_of(spec.children));
  const KeySpec* first = nullptr;
  for (const auto& [name, value] : section.entries) {
    const auto* child = find(spec.children, name->text);
    if (child == nullptr || child == first) continue;
    if (first == nullptr) {
      first = child;
      continue;
    }
    report(path, name->mark, fmt::format("{} has both '{}' and '{}'", path, first->key, child->key),
           fmt::format("leave one out: it is either {}", known));
    return;
  }
  if (first == nullptr && places_.clean(path))
    report(path, key.mark, fmt::format("{} is of no kind", path), fmt::format("write {} below it", known));
}

std::optional<Value> Reader::read_section_key(const KeySpec& spec, const Node& key, const std::string& path) {
  if (spec.kind == Kind::named_sections) {
    if (key.text.size() <= longest_name && matches(key.text, name_pattern)) return Value{.text = key.text};
    report(path, key.mark, fmt::format("{} is not a name", quoted(key.text)),
           fmt::format("a letter, then letters, digits, - or _; lower case; {} characters at most",
                       longest_name));
    return std::nullopt;
  }
  const auto number = matches(key.text, "[1-9][0-9]{0,5}") ? std::stoi(key.text) : 0;
  if (number >= *spec.minimum && number <= *spec.maximum) return Value{.integer = number};
  report(path, key.mark, fmt::format("{} is not a number of '{}'", quoted(key.text), spec.key),
         fmt::format("write a whole number between {} and {}", *spec.minimum, *spec.maximum));
  return std::nullopt;
}

void Reader::read_sections(const KeySpec& spec, const Node& value, const std::string& path) {
  if (spec.may_be_empty && value.kind == Node::Kind::null) return;
  if (!check_is_section(value, spec.key, path)) return;
  if (value.entries.empty() && !spec.may_be_empty)
    report(path, places_.mark(path), fmt::format("'{}' is empty", spec.key));
  for (const auto& [key, section] : unique_entries(value)) {
    const auto here = join(path, printable(key.text));
    places_.add(here, key.mark);
    const auto name = read_section_key(spec, key, here);
    if (!name || !check_is_section(section, key.text, here)) continue;
    const auto outside = target_;
    spec.field.apply(target_, *name);
    if (target_.axis != nullptr && outside.axis == nullptr) check_unit(section, here);
    read_section(section, key.mark, spec.children, here);
    if (spec.one_of) check_one_of(spec, key, section, here);
    target_ = outside;
  }
}

}  // namespace axisd::config
