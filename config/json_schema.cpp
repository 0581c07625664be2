#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/json.hpp>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "config/configuration.hpp"
#include "config/quantity.hpp"
#include "config/reader.hpp"
#include "config/schema.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

namespace json = boost::json;

constexpr std::string_view number = "[+-]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?";

json::array strings(std::span<const std::string_view> items) {
  json::array result;
  for (const auto item : items) result.emplace_back(item);
  return result;
}

/// Permitted texts; one that YAML reads as a number, such as 1000, also as that.
json::array choices_of(const KeySpec& spec) {
  json::array result;
  for (const auto choice : spec.choices) {
    result.emplace_back(choice);
    if (std::ranges::all_of(choice, [](char c) { return c >= '0' && c <= '9'; }))
      result.push_back(json::parse(choice));
  }
  return result;
}

/// "[terminals, segments]" as JSON.
json::array parts(std::string_view list) {
  json::array items;
  for (list = list.substr(1, list.size() - 2); !list.empty();) {
    const auto end = std::min(list.find(", "), list.size());
    items.emplace_back(list.substr(0, end));
    list.remove_prefix(std::min(end + 2, list.size()));
  }
  return items;
}

/// "{ anna: operator }" as JSON.
json::object one_role(std::string_view section) {
  const auto entry = section.substr(2, section.size() - 4);
  const auto colon = entry.rfind(": ");
  return {{entry.substr(0, colon), entry.substr(colon + 2)}};
}

/// What YAML makes of it: numbers and booleans as such, lists as they are written, the rest as text.
json::value as_written(const KeySpec& spec, std::string_view text) {
  if (spec.kind == Kind::register_address) return std::stol(std::string(text), nullptr, 0);
  if (spec.kind == Kind::roles) return one_role(text);
  if ((spec.kind == Kind::parts || spec.kind == Kind::names) && text.starts_with('[')) return parts(text);
  const bool bare = spec.kind == Kind::integer || spec.kind == Kind::number || spec.kind == Kind::boolean ||
                    spec.kind == Kind::parts || spec.kind == Kind::position_range ||
                    (spec.kind == Kind::position && parse_decimal(text));
  return bare ? json::parse(text) : json::value(text);
}

std::string whole(std::string_view pattern) { return fmt::format("^(?:{})$", pattern); }

/// Without an exponent where it can be.
json::value number_value(double value) {
  constexpr double exact_integers = 9007199254740992.0;
  if (std::trunc(value) == value && std::abs(value) <= exact_integers)
    return static_cast<std::int64_t>(value);
  return value;
}

void add_bounds(json::object& object, const KeySpec& spec) {
  if (spec.minimum) object[spec.above_minimum ? "exclusiveMinimum" : "minimum"] = number_value(*spec.minimum);
  if (spec.maximum) object["maximum"] = number_value(*spec.maximum);
}

json::array type_of_position(const KeySpec& spec) {
  json::object bare{{"type", "number"}};
  add_bounds(bare, spec);
  const json::object with_unit{{"type", "string"},
                               {"pattern", whole(fmt::format("{} *([A-Za-z]{{1,16}})?", number))}};
  return {bare, with_unit};
}

json::object section(std::span<const KeySpec> keys);

json::object quantity(std::string_view pattern) {
  return {{"type", "string"}, {"pattern", whole(fmt::format("{} *{}", number, pattern))}};
}

json::object named_sections(const KeySpec& spec) {
  json::object result;
  if (spec.may_be_empty) {
    result["type"] = json::array{"object", "null"};
  } else {
    result = json::object{{"type", "object"}, {"minProperties", 1}};
  }
  auto each = section(spec.children);
  if (spec.one_of) {
    each["minProperties"] = 1;
    each["maxProperties"] = 1;
  }
  result["propertyNames"] = json::object{{"pattern", whole(name_pattern)}, {"maxLength", longest_name}};
  result["additionalProperties"] = std::move(each);
  return result;
}

/// What a key may be that stands for a number, from 1 on: JSON's keys are strings.
json::object numbers_to(int last) {
  json::array keys;
  for (int i = 1; i <= last; ++i) keys.emplace_back(std::to_string(i));
  return {{"enum", keys}};
}

json::object numbered_sections(const KeySpec& spec) {
  return {{"type", "object"},
          {"minProperties", 1},
          {"propertyNames", numbers_to(static_cast<int>(*spec.maximum))},
          {"additionalProperties", section(spec.children)}};
}

json::object parts_of(std::span<const std::string_view> names) {
  const json::object list{{"type", "array"},
                          {"items", json::object{{"enum", strings(names)}}},
                          {"minItems", 1},
                          {"uniqueItems", true}};
  return {{"anyOf", json::array{json::object{{"type", "boolean"}}, list}}};
}

std::vector<std::string_view> model_names() {
  std::vector<std::string_view> names;
  for (const auto* model : drive_models()) names.push_back(model->model);
  return names;
}

json::object type_of_objects(const KeySpec& spec) {
  return {{"type", "object"},
          {"minProperties", 1},
          {"propertyNames", json::object{{"pattern", whole(spec.pattern)}}},
          {"additionalProperties", section(spec.children)}};
}

json::object type_of_choice(const KeySpec& spec) {
  json::object named{{"enum", choices_of(spec)}};
  if (!spec.maximum) return named;
  json::object numbered{{"type", "integer"}};
  add_bounds(numbered, spec);
  return {{"anyOf", json::array{named, numbered}}};
}

json::object type_of_names(const KeySpec& spec) {
  return {{"type", "array"},
          {"items", json::object{{"type", "string"}, {"pattern", whole(spec.pattern)}}},
          {"minItems", 2},
          {"uniqueItems", true}};
}

json::object type_of_roles(const KeySpec& spec) {
  return {{"type", "object"},
          {"propertyNames", json::object{{"pattern", whole(spec.pattern)}}},
          {"additionalProperties", json::object{{"enum", strings(spec.choices)}}}};
}

json::object type_of(const KeySpec& spec) {
  json::object result;
  switch (spec.kind) {
    case Kind::section:
      return section(spec.children);
    case Kind::named_sections:
      return named_sections(spec);
    case Kind::numbered_sections:
      return numbered_sections(spec);
    case Kind::terminals:
    case Kind::model_settings:
      return {{"type", "object"}};  // refined per model
    case Kind::model_objects:
      return type_of_objects(spec);
    case Kind::text:
      return {{"type", "string"}, {"pattern", whole(spec.pattern)}, {"maxLength", longest_text_value}};
    case Kind::model:
      return {{"enum", strings(model_names())}};
    case Kind::integer:
    case Kind::register_address:
      result["type"] = "integer";
      break;
    case Kind::number:
      return {{"type", "number"}, {"not", json::object{{"const", 0}}}};
    case Kind::boolean:
      return {{"type", "boolean"}};
    case Kind::choice:
      return type_of_choice(spec);
    case Kind::names:
      return type_of_names(spec);
    case Kind::roles:
      return type_of_roles(spec);
    case Kind::parts:
      return parts_of(spec.choices);
    case Kind::duration:
      return quantity("(us|ms|s|min)");
    case Kind::motor_speed:
      return quantity("r */ *min");
    case Kind::microstep:
      return quantity("pulses */ *rev");
    case Kind::ratio:
      return {{"type", "string"}, {"pattern", whole(fmt::format("{0} */ *{0}", number))}};
    case Kind::travel:
      return quantity(fmt::format("(/ *{} *)?[A-Za-z]{{1,16}} */ *rev", number));
    case Kind::velocity:
      return quantity("[A-Za-z]{1,16} */ *s");
    case Kind::position:
      return {{"anyOf", type_of_position(spec)}};
    case Kind::position_range:
      return {{"type", "array"},
              {"items", json::object{{"anyOf", type_of_position(spec)}}},
              {"minItems", 2},
              {"maxItems", 2}};
  }
  add_bounds(result, spec);
  return result;
}

json::object documented(const KeySpec& spec) {
  auto result = type_of(spec);
  result["description"] = spec.description;
  if (!spec.example.empty()) result["examples"].emplace_array().push_back(as_written(spec, spec.example));
  if (!spec.default_value.empty()) result["default"] = as_written(spec, spec.default_value);
  return result;
}

json::object closed(json::object properties) {
  return {{"type", "object"}, {"additionalProperties", false}, {"properties", std::move(properties)}};
}

/// A device of this model has the one kind of values and not the other.
json::object device_of(std::string_view model, std::string_view values, std::string_view others) {
  return {{"properties", json::object{{"model", json::object{{"const", model}}}, {others, false}}},
          {"required", json::array{values}}};
}

json::object section(std::span<const KeySpec> keys) {
  json::object properties;
  json::array required;
  for (const auto& spec : keys) {
    properties[spec.key] = documented(spec);
    if (spec.required) required.emplace_back(spec.key);
  }
  auto result = closed(std::move(properties));
  if (!required.empty()) result["required"] = std::move(required);
  if (keys.data() == device_schema().data())
    result["oneOf"] = json::array{device_of("modbus-generic", "registers", "objects"),
                                  device_of("canopen-generic", "objects", "registers")};
  if (keys.data() == axis_schema().data()) {  // what the model adds
    json::array models;
    for (const auto* model : drive_models())
      models.push_back(json::object{{"$ref", fmt::format("#/$defs/{}", model->model)}});
    result["allOf"] = std::move(models);
  }
  return result;
}

/// A terminal's function alone, or with its level.
json::object short_or_long(const json::object& function, json::object properties) {
  auto long_form = closed(std::move(properties));
  long_form["required"] = json::array{"function"};
  return {{"anyOf", json::array{function, long_form}}};
}

/// It has one function, or on an inverted axis the mirrored one, and one level.
json::object fixed_terminal(const TerminalSpec& terminal, std::span<const TerminalFunctionSpec> functions) {
  json::array names{terminal.function};
  if (const auto* known = find_function(functions, terminal.function); !known->mirror.empty())
    names.emplace_back(known->mirror);
  const json::object function{{"enum", names}};
  return short_or_long(function, {{"function", function}, {"active", json::object{{"const", "high"}}}});
}

/// The short form (a function) or the long one ({function, active}).
json::object terminals(std::span<const TerminalSpec> list, std::span<const TerminalFunctionSpec> functions) {
  json::array names;
  for (const auto& function : functions)
    if (function.unusable.empty()) names.emplace_back(function.name);
  const json::object function{{"enum", names}};
  json::object properties;
  for (const auto& spec : terminal_schema())
    properties[spec.key] = spec.key == "function" ? function : documented(spec);
  json::object all;
  for (const auto& terminal : list)
    all[terminal.name] =
        terminal.function.empty() ? short_or_long(function, properties) : fixed_terminal(terminal, functions);
  return closed(std::move(all));
}

/// Tables of segments whose numbers the model's inputs can select.
json::object segments_to(int last) {
  json::object tables;
  for (const auto& spec : segment_schema())
    if (spec.kind == Kind::numbered_sections)
      tables[spec.key] = json::object{{"propertyNames", numbers_to(last)}};
  return tables;
}

json::object scale_of(const DriveDescriptor& model) {
  const auto& microsteps = model.capabilities.pulses_per_revolution;
  json::object scale;
  if (!microsteps.empty()) {
    const auto pattern = fmt::format("^(?:{}) *pulses */ *rev$", fmt::join(microsteps, "|"));
    scale["microstep"] = json::object{{"pattern", pattern}};
  }
  return {{"properties", std::move(scale)}};
}

json::object if_model(const DriveDescriptor& model) {
  json::object settings;
  json::array required;
  for (const auto& setting : model.settings) {
    settings[setting.key] = documented(setting_schema(setting));
    if (setting.required) required.emplace_back(setting.key);
  }
  auto drive = closed(std::move(settings));
  if (!required.empty()) drive["required"] = required;
  json::object then{{"node", json::object{{"minimum", model.minimum_node}, {"maximum", model.maximum_node}}},
                    {"scale", scale_of(model)},
                    {"inputs", terminals(model.inputs, model.input_functions)},
                    {"outputs", terminals(model.outputs, model.output_functions)},
                    {"drive", std::move(drive)}};
  if (model.capabilities.maximum_start_rpm == 0)
    then["limits"] = json::object{{"properties", json::object{{"start_speed", false}}}};
  if (const int last = model.capabilities.maximum_segments; last > 0)
    then["segments"] = json::object{{"properties", segments_to(last)}};
  else
    then["segments"] = false;
  if (find_function(model.output_functions, "brake") == nullptr) then["brake"] = false;

  json::object consequence{{"properties", std::move(then)}};
  if (!required.empty()) consequence["required"] = json::array{"drive"};
  return {{"if", json::object{{"properties", json::object{{"model", json::object{{"const", model.model}}}}},
                              {"required", json::array{"model"}}}},
          {"then", std::move(consequence)}};
}

/// Two spaces per level; for people who read it.
std::string indented(std::string_view json) {
  std::string result;
  int depth = 0;
  bool in_string = false, escaped = false;
  const auto new_line = [&] { result.append("\n").append(2 * static_cast<std::size_t>(depth), ' '); };
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string) {
      in_string = escaped || c != '"';
      escaped = !escaped && c == '\\';
      result += c;
      continue;
    }
    const bool opens = c == '{' || c == '[', closes = c == '}' || c == ']';
    const bool was_empty = closes && (json[i - 1] == '{' || json[i - 1] == '[');
    in_string = c == '"';
    if (closes) --depth;
    if (closes && !was_empty) new_line();
    result += c;
    if (opens) ++depth;
    if (c == ':') result += ' ';
    if (c == ',' || (opens && json[i + 1] != '}' && json[i + 1] != ']')) new_line();
  }
  return result;
}

}  // namespace

std::string json_schema() {
  json::object models;
  for (const auto* model : drive_models()) models[model->model] = if_model(*model);
  json::object all{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                   {"title", "axisd configuration"}};
  for (auto& [key, value] : section(schema())) all[key] = value;
  all["$defs"] = std::move(models);
  return indented(json::serialize(all));
}

}  // namespace axisd::config
