// Keys that a drive model defines: terminals, their functions, and settings of its own.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "config/reader.hpp"
#include "config/text.hpp"
#include "config/value.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

constexpr std::string_view levels[] = {"high", "low"};

constexpr KeySpec terminal_keys[] = {
    {.key = "function",
     .kind = Kind::text,
     .required = true,
     .description = "What the terminal is for; one of the model's functions.",
     .example = "home",
     .pattern = "[a-z][a-z0-9_]*",
     .pattern_hint = "write the name of one of the model's functions",
     .apply = [](Target& t, const Value& v) { t.terminal->function = v.text; }},
    {.key = "active",
     .kind = Kind::choice,
     .description = "Level at which the terminal is active.",
     .example = "low",
     .default_value = "high",
     .choices = levels,
     .apply = [](Target& t, const Value& v) { t.terminal->active_low = v.text == "low"; }},
};

/// Then it is no typing error: this model lacks it.
bool other_model_has(std::string_view function, bool inputs) {
  return std::ranges::any_of(drive_models(), [&](const DriveDescriptor* model) {
    return find_function(inputs ? model->input_functions : model->output_functions, function) != nullptr;
  });
}

/// `folder`: of the file; relative paths count from there.
SettingValue to_setting(const SettingSpec& setting, const Value& value, const std::filesystem::path& folder) {
  if (setting.kind == "integer") return value.integer;
  if (setting.kind == "boolean") return value.boolean;
  if (setting.kind == "path") return (folder / value.text).lexically_normal().string();
  return value.text;
}

}  // namespace

std::span<const KeySpec> terminal_schema() { return terminal_keys; }

KeySpec setting_schema(const SettingSpec& setting) {
  KeySpec spec{.key = setting.key,
               .kind = Kind::choice,
               .description = setting.description,
               .default_value = setting.default_value,
               .choices = setting.choices};
  if (setting.kind == "boolean") {
    spec.kind = Kind::boolean;
    spec.example = "true";
  } else if (setting.kind == "path") {
    spec.kind = Kind::text;
    spec.required = setting.required;
    spec.example = "standard-drive.eds";
    spec.pattern = "[^\\n]+";
    spec.pattern_hint = "write the path of a file";
  } else if (setting.kind == "integer") {
    spec.kind = Kind::integer;
    spec.example = "1";
    spec.minimum = static_cast<double>(setting.minimum);
    spec.maximum = static_cast<double>(setting.maximum);
  }
  return spec;
}

void Reader::read_terminals(const Node& value, const std::string& path, bool inputs) {
  if (!check_is_section(value, inputs ? "inputs" : "outputs", path)) return;
  const auto* model = find_drive_model(target_.axis->axis.model);
  if (model == nullptr) return;  // reported
  const auto names =
      names_of(inputs ? model->inputs : model->outputs, [](const TerminalSpec& t) { return t.name; });
  auto& terminals = inputs ? target_.axis->axis.inputs : target_.axis->axis.outputs;
  for (const auto& [key, terminal] : unique_entries(value)) {
    const auto here = fmt::format("{}.{}", path, printable(key.text));
    places_.add(here, key.mark);
    if (std::ranges::find(names, key.text) == names.end()) {
      report(here, key.mark,
             fmt::format("model {} has no {} terminal {}", model->model, inputs ? "input" : "output",
                         config::quoted(key.text)),
             names.empty() ? "it has none" : "it has " + alternatives(names));
      continue;
    }
    target_.terminal = &terminals.emplace_back();
    target_.terminal->terminal = key.text;
    read_terminal(terminal, here, inputs);
    target_.terminal = nullptr;
  }
}

void Reader::read_terminal(const Node& value, const std::string& path, bool inputs) {
  const auto function_path = path + ".function";
  if (value.kind == Node::Kind::section) {
    read_section(value, places_.mark(path), terminal_keys, path);
  } else {
    places_.add(function_path, value.kind == Node::Kind::null ? places_.mark(path) : value.mark);
    read_value(terminal_keys[0], value, function_path);
  }
  if (!places_.usable(function_path)) return;

  const auto* model = find_drive_model(target_.axis->axis.model);
  const auto functions = inputs ? model->input_functions : model->output_functions;
  auto& terminal = *target_.terminal;
  if (find_function(functions, terminal.function) == nullptr) {
    const auto names = names_of(functions, [](const TerminalFunctionSpec& f) { return f.name; });
    report(function_path, places_.mark(function_path),
           fmt::format("model {} has no {} function {}", model->model, inputs ? "input" : "output",
                       config::quoted(terminal.function)),
           other_model_has(terminal.function, inputs) ? "permitted: " + alternatives(names)
                                                      : suggest(terminal.function, names));
  }
}

void Reader::read_model_settings(const Node& value, const std::string& path) {
  if (!check_is_section(value, "drive", path)) return;
  const auto* model = find_drive_model(target_.axis->axis.model);
  if (model == nullptr) return;  // reported
  const auto names = names_of(model->settings, [](const SettingSpec& s) { return s.key; });
  const auto folder = std::filesystem::path(diagnostics_.file()).parent_path();
  for (const auto& [key, node] : unique_entries(value)) {
    const auto here = fmt::format("{}.{}", path, printable(key.text));
    places_.add(here, node.kind == Node::Kind::scalar ? node.mark : key.mark);
    const auto setting = std::ranges::find(model->settings, key.text, &SettingSpec::key);
    if (setting == model->settings.end()) {
      report(here, key.mark,
             fmt::format("model {} has no setting {}", model->model, config::quoted(key.text)),
             suggest(key.text, names));
      continue;
    }
    const auto parsed = parse_value(setting_schema(*setting), node, "");
    if (!parsed) {
      report(here, places_.mark(here), parsed.error().message, parsed.error().suggestion);
      continue;
    }
    target_.axis->axis.model_settings.insert_or_assign(std::string(setting->key),
                                                       to_setting(*setting, *parsed, folder));
  }
}

void add_default_settings(AxisSettings& axis, const DriveDescriptor& model) {
  for (const auto& setting : model.settings) {
    if (setting.default_value.empty()) continue;
    Node node;
    node.kind = Node::Kind::scalar;
    node.text = setting.default_value;
    const auto value = parse_value(setting_schema(setting), node, "");
    // A default that its own model refuses is a bug there; the tests of this folder go through all models.
    if (value) axis.model_settings.try_emplace(std::string(setting.key), to_setting(setting, *value, {}));
  }
}

}  // namespace axisd::config
