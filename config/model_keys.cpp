// Keys that a drive model defines: terminals, their functions, and settings of its own.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <set>
#include <utility>

#include "buses/canopen/object.hpp"
#include "config/field.hpp"
#include "config/quantity.hpp"
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
     .field = field([](auto& t) -> auto& { return t.terminal->function; })},
    {.key = "active",
     .kind = Kind::choice,
     .description = "Level at which the terminal is active.",
     .example = "low",
     .default_value = "high",
     .choices = levels,
     .field = choice_field([](auto& t) -> auto& { return t.terminal->active_low; })},
};

constexpr std::string_view object_types[] = {"u8", "i8", "u16", "i16", "u32", "i32"};
constexpr std::string_view object_accesses[] = {"ro", "wo", "rw", "none"};
constexpr double lowest_value = std::numeric_limits<std::int32_t>::min();
constexpr double highest_value = std::numeric_limits<std::uint32_t>::max();

void set_of_object(Target& t, std::string_view key, SettingValue value) {
  t.axis->axis.model_settings.insert_or_assign(fmt::format("{}.{}", t.object, key), std::move(value));
}

constexpr KeySpec object_keys[] = {
    {.key = "type",
     .kind = Kind::choice,
     .description = "What the object holds.",
     .example = "i32",
     .choices = object_types,
     .field = {.apply = [](Target& t, const Value& v) { set_of_object(t, "type", v.text); }}},
    {.key = "access",
     .kind = Kind::choice,
     .description = "Whether the object can be read and written; none: the drive does not have it.",
     .example = "ro",
     .choices = object_accesses,
     .field = {.apply = [](Target& t, const Value& v) { set_of_object(t, "access", v.text); }}},
    {.key = "minimum",
     .kind = Kind::integer,
     .description = "Lowest value that the drive takes.",
     .example = "1",
     .minimum = lowest_value,
     .maximum = highest_value,
     .field = {.apply = [](Target& t, const Value& v) { set_of_object(t, "minimum", v.integer); }}},
    {.key = "maximum",
     .kind = Kind::integer,
     .description = "Highest value that the drive takes.",
     .example = "100000",
     .minimum = lowest_value,
     .maximum = highest_value,
     .field = {.apply = [](Target& t, const Value& v) { set_of_object(t, "maximum", v.integer); }}},
    {.key = "default",
     .kind = Kind::integer,
     .description = "What the object holds after a power-up; of 6502h and 1018h, always.",
     .example = "1000",
     .minimum = lowest_value,
     .maximum = highest_value,
     .field = {.apply = [](Target& t, const Value& v) { set_of_object(t, "default", v.integer); }}},
    {.key = "pdo",
     .kind = Kind::boolean,
     .description = "Whether a PDO can carry the object.",
     .example = "false",
     .field = {.apply = [](Target& t, const Value& v) { set_of_object(t, "pdo", v.boolean); }}},
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
  } else if (setting.kind == "objects") {
    spec.kind = Kind::model_objects;
    spec.pattern = "[0-9A-Fa-f]{4}h(:[0-9A-Fa-f]{2})?";
    spec.pattern_hint = "write INDEXh or INDEXh:SUB, both hexadecimal, such as 6084h or 6099h:01";
    spec.children = object_keys;
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
    const auto spec = setting_schema(*setting);
    if (spec.kind == Kind::model_objects) {
      read_model_objects(spec, node, here);
      continue;
    }
    const auto parsed = parse_value(spec, node, "");
    if (!parsed) {
      report(here, places_.mark(here), parsed.error().message, parsed.error().suggestion);
      continue;
    }
    target_.axis->axis.model_settings.insert_or_assign(std::string(setting->key),
                                                       to_setting(*setting, *parsed, folder));
  }
}

void Reader::read_model_objects(const KeySpec& spec, const Node& value, const std::string& path) {
  if (!check_is_section(value, spec.key, path)) return;
  std::set<std::string> seen;
  for (const auto& [key, section] : unique_entries(value)) {
    const auto here = fmt::format("{}.{}", path, printable(key.text));
    places_.add(here, key.mark);
    if (!matches(key.text, spec.pattern)) {
      report(here, key.mark, fmt::format("{} is no object", config::quoted(key.text)),
             std::string(spec.pattern_hint));
      continue;
    }
    const auto whole = key.text.contains(':') ? key.text : key.text + ":00";
    const auto object = canopen::to_string(canopen::Object::of(*parse_object_address(whole)));
    if (!seen.insert(object).second)
      report(here, key.mark, fmt::format("object {} stands there twice", object), "write it once");
    if (!check_is_section(section, key.text, here)) continue;
    target_.object = fmt::format("{}.{}", spec.key, object);
    read_section(section, key.mark, spec.children, here);
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
