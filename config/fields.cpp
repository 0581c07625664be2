#include "config/fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include "config/reader.hpp"
#include "config/schema.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

std::string setting_text(const SettingValue& value) {
  return fmt::format("{}:{}", value.index(),
                     std::visit([](const auto& v) { return fmt::format("{}", v); }, value));
}

bool is_path(const DriveDescriptor& descriptor, std::string_view key) {
  const auto found = std::ranges::find(descriptor.settings, key, &SettingSpec::key);
  return found != descriptor.settings.end() && found->kind == "path";
}

std::vector<NamedTarget> inside(const KeySpec& spec, const Target& target) {
  if (spec.field.inside != nullptr) return spec.field.inside(target);
  return {{{}, target}};
}

/// Fills one section along the schema.
class Fields {
 public:
  explicit Fields(Section& section) : section_(section) {}
  /// `path`: with a dot at its end, or empty.
  void add(std::span<const KeySpec> keys, const Target& target, const std::string& path) {
    for (const auto& spec : keys) add(spec, target, path + std::string(spec.key));
  }

 private:
  void add(const KeySpec& spec, const Target& target, const std::string& path) {
    switch (spec.kind) {
      case Kind::section:
      case Kind::named_sections:
      case Kind::numbered_sections:
        for (const auto& [name, in] : inside(spec, target))
          add(spec.children, in, fmt::format("{}.{}{}", path, name, name.empty() ? "" : "."));
        return;
      case Kind::terminals:
        add_terminals(spec.key == "inputs" ? target.axis->axis.inputs : target.axis->axis.outputs, path);
        return;
      case Kind::model_settings:
        add_model_settings(target.axis->axis, path);
        return;
      default:
        if (spec.field.show != nullptr) section_.fields.emplace(path, spec.field.show(target));
    }
  }
  void add_terminals(std::vector<TerminalSettings>& terminals, const std::string& path) {
    for (auto& terminal : terminals) {
      std::string text;
      for (const auto& spec : terminal_schema()) text += spec.field.show({.terminal = &terminal}) + " ";
      section_.fields.emplace(fmt::format("{}.{}", path, terminal.terminal), text);
    }
  }
  void add_model_settings(const AxisSettings& axis, const std::string& path) {
    for (const auto& [key, value] : axis.model_settings) {
      auto text = setting_text(value);
      if (axis.own_descriptor && is_path(*axis.own_descriptor, key))
        text += fmt::format(" {:x}", axis.own_descriptor_source);
      section_.fields.emplace(fmt::format("{}.{}", path, key), text);
    }
  }

  Section& section_;
};

std::vector<std::string> keys_that_differ(const Section& before, const Section& after) {
  std::vector<std::string> keys;
  const auto look = [&](const Section& here, const Section& there) {
    for (const auto& [key, value] : here.fields) {
      const auto found = there.fields.find(key);
      if (found == there.fields.end() || found->second != value) keys.push_back(key);
    }
  };
  look(before, after);
  look(after, before);
  std::ranges::sort(keys);
  keys.erase(std::ranges::unique(keys).begin(), keys.end());
  return keys;
}

const Section* find(const std::vector<Section>& all, const Section& like) {
  const auto found = std::ranges::find_if(
      all, [&](const Section& each) { return each.section == like.section && each.name == like.name; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

std::vector<Section> sections(Configuration configuration) {
  std::vector<Section> all;
  for (const auto& spec : schema()) {
    for (const auto& [name, target] : inside(spec, {.configuration = &configuration})) {
      auto& section = all.emplace_back(Section{.section = std::string(spec.key), .name = name});
      if (spec.children.empty())
        section.fields.emplace(std::string(), spec.field.show(target));
      else
        Fields(section).add(spec.children, target, {});
    }
  }
  return all;
}

std::vector<ConfigurationChange> differences(const Configuration& before, const Configuration& after) {
  using Kind = ConfigurationChangeKind;
  const auto old = sections(before), now = sections(after);
  std::vector<ConfigurationChange> changes;
  for (const auto& section : old) {
    const auto* other = find(now, section);
    if (other == nullptr) {
      changes.push_back({.section = section.section, .name = section.name, .kind = Kind::removed});
    } else if (other->fields != section.fields) {
      auto keys = keys_that_differ(section, *other);
      std::erase(keys, std::string());
      changes.push_back(
          {.section = section.section, .name = section.name, .kind = Kind::changed, .keys = std::move(keys)});
    }
  }
  for (const auto& section : now)
    if (find(old, section) == nullptr)
      changes.push_back({.section = section.section, .name = section.name, .kind = Kind::added});
  return changes;
}

}  // namespace axisd::config
