#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "config/quantity.hpp"
#include "config/reader.hpp"
#include "config/schema.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

constexpr std::string_view number = "[+-]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?";

std::string json_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

/// Members of a JSON object, in order.
class Object {
 public:
  Object& raw(std::string_view key, const std::string& json) {
    members_ += fmt::format("{}{}:{}", members_.empty() ? "" : ",", json_string(key), json);
    return *this;
  }
  Object& text(std::string_view key, std::string_view value) { return raw(key, json_string(value)); }
  [[nodiscard]] std::string json() const { return "{" + members_ + "}"; }

 private:
  std::string members_;
};

std::string array(const std::vector<std::string>& items) {
  return fmt::format("[{}]", fmt::join(items, ","));
}

std::string strings(std::span<const std::string_view> items) {
  std::vector<std::string> result;
  for (const auto item : items) result.push_back(json_string(item));
  return array(result);
}

/// Permitted texts; one that YAML reads as a number, such as 1000, also as that.
std::string choices_of(const KeySpec& spec) {
  std::vector<std::string> result;
  for (const auto choice : spec.choices) {
    result.push_back(json_string(choice));
    if (std::ranges::all_of(choice, [](char c) { return c >= '0' && c <= '9'; })) result.emplace_back(choice);
  }
  return array(result);
}

/// "[terminals, segments]" as JSON.
std::string parts(std::string_view list) {
  std::vector<std::string> items;
  for (list = list.substr(1, list.size() - 2); !list.empty();) {
    const auto end = std::min(list.find(", "), list.size());
    items.push_back(json_string(list.substr(0, end)));
    list.remove_prefix(std::min(end + 2, list.size()));
  }
  return array(items);
}

/// "{ anna: operator }" as JSON.
std::string one_role(std::string_view section) {
  const auto entry = section.substr(2, section.size() - 4);
  const auto colon = entry.rfind(": ");
  return Object().text(entry.substr(0, colon), entry.substr(colon + 2)).json();
}

/// What YAML makes of it: numbers and booleans as such, lists as they are written, the rest as text.
std::string as_written(const KeySpec& spec, std::string_view text) {
  if (spec.kind == Kind::register_address) return std::to_string(std::stol(std::string(text), nullptr, 0));
  if (spec.kind == Kind::roles) return one_role(text);
  if ((spec.kind == Kind::parts || spec.kind == Kind::names) && text.starts_with('[')) return parts(text);
  const bool bare = spec.kind == Kind::integer || spec.kind == Kind::number || spec.kind == Kind::boolean ||
                    spec.kind == Kind::parts || spec.kind == Kind::position_range ||
                    (spec.kind == Kind::position && parse_decimal(text));
  return bare ? std::string(text) : json_string(text);
}

std::string whole(std::string_view pattern) { return fmt::format("^(?:{})$", pattern); }

void add_bounds(Object& object, const KeySpec& spec) {
  if (spec.minimum)
    object.raw(spec.above_minimum ? "exclusiveMinimum" : "minimum", format_number(*spec.minimum));
  if (spec.maximum) object.raw("maximum", format_number(*spec.maximum));
}

std::string type_of_position(const KeySpec& spec) {
  Object bare, with_unit;
  bare.text("type", "number");
  add_bounds(bare, spec);
  with_unit.text("type", "string").text("pattern", whole(fmt::format("{} *([A-Za-z]{{1,16}})?", number)));
  return array({bare.json(), with_unit.json()});
}

Object section(std::span<const KeySpec> keys);

Object quantity(std::string_view pattern) {
  Object result;
  result.text("type", "string").text("pattern", whole(fmt::format("{} *{}", number, pattern)));
  return result;
}

Object named_sections(const KeySpec& spec) {
  Object names, result;
  names.text("pattern", whole(name_pattern)).raw("maxLength", std::to_string(longest_name));
  if (spec.may_be_empty) {
    result.raw("type", R"(["object","null"])");
  } else {
    result.text("type", "object").raw("minProperties", "1");
  }
  auto each = section(spec.children);
  if (spec.one_of) each.raw("minProperties", "1").raw("maxProperties", "1");
  result.raw("propertyNames", names.json());
  result.raw("additionalProperties", each.json());
  return result;
}

/// What a key may be that stands for a number, from 1 on: JSON's keys are strings.
std::string numbers_to(int last) {
  std::vector<std::string> keys;
  for (int i = 1; i <= last; ++i) keys.push_back(fmt::format("\"{}\"", i));
  return Object().raw("enum", array(keys)).json();
}

Object numbered_sections(const KeySpec& spec) {
  Object result;
  result.text("type", "object").raw("minProperties", "1");
  result.raw("propertyNames", numbers_to(static_cast<int>(*spec.maximum)));
  result.raw("additionalProperties", section(spec.children).json());
  return result;
}

Object parts_of(std::span<const std::string_view> names) {
  const auto list = Object()
                        .text("type", "array")
                        .raw("items", Object().raw("enum", strings(names)).json())
                        .raw("minItems", "1")
                        .raw("uniqueItems", "true");
  return Object().raw("anyOf", array({Object().text("type", "boolean").json(), list.json()}));
}

std::vector<std::string_view> model_names() {
  std::vector<std::string_view> names;
  for (const auto* model : drive_models()) names.push_back(model->model);
  return names;
}

Object type_of_objects(const KeySpec& spec) {
  return Object()
      .text("type", "object")
      .raw("minProperties", "1")
      .raw("propertyNames", Object().text("pattern", whole(spec.pattern)).json())
      .raw("additionalProperties", section(spec.children).json());
}

Object type_of_choice(const KeySpec& spec) {
  if (!spec.maximum) return Object().raw("enum", choices_of(spec));
  Object named, numbered;
  named.raw("enum", choices_of(spec));
  numbered.text("type", "integer");
  add_bounds(numbered, spec);
  return Object().raw("anyOf", array({named.json(), numbered.json()}));
}

Object type_of_names(const KeySpec& spec) {
  return Object()
      .text("type", "array")
      .raw("items", Object().text("type", "string").text("pattern", whole(spec.pattern)).json())
      .raw("minItems", "2")
      .raw("uniqueItems", "true");
}

Object type_of_roles(const KeySpec& spec) {
  return Object()
      .text("type", "object")
      .raw("propertyNames", Object().text("pattern", whole(spec.pattern)).json())
      .raw("additionalProperties", Object().raw("enum", strings(spec.choices)).json());
}

Object type_of(const KeySpec& spec) {
  Object result;
  switch (spec.kind) {
    case Kind::section:
      return section(spec.children);
    case Kind::named_sections:
      return named_sections(spec);
    case Kind::numbered_sections:
      return numbered_sections(spec);
    case Kind::terminals:
    case Kind::model_settings:
      return result.text("type", "object");  // refined per model
    case Kind::model_objects:
      return type_of_objects(spec);
    case Kind::text:
      return result.text("type", "string")
          .text("pattern", whole(spec.pattern))
          .raw("maxLength", std::to_string(longest_text_value));
    case Kind::model:
      return result.raw("enum", strings(model_names()));
    case Kind::integer:
    case Kind::register_address:
      result.text("type", "integer");
      break;
    case Kind::number:
      return result.text("type", "number").raw("not", Object().raw("const", "0").json());
    case Kind::boolean:
      return result.text("type", "boolean");
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
      return result.text("type", "string").text("pattern", whole(fmt::format("{0} */ *{0}", number)));
    case Kind::travel:
      return quantity(fmt::format("(/ *{} *)?[A-Za-z]{{1,16}} */ *rev", number));
    case Kind::velocity:
      return quantity("[A-Za-z]{1,16} */ *s");
    case Kind::position:
      return result.raw("anyOf", type_of_position(spec));
    case Kind::position_range:
      return result.text("type", "array")
          .raw("items", Object().raw("anyOf", type_of_position(spec)).json())
          .raw("minItems", "2")
          .raw("maxItems", "2");
  }
  add_bounds(result, spec);
  return result;
}

Object documented(const KeySpec& spec) {
  auto result = type_of(spec);
  result.text("description", spec.description);
  if (!spec.example.empty()) result.raw("examples", array({as_written(spec, spec.example)}));
  if (!spec.default_value.empty()) result.raw("default", as_written(spec, spec.default_value));
  return result;
}

Object closed(const Object& properties) {
  Object result;
  result.text("type", "object").raw("additionalProperties", "false").raw("properties", properties.json());
  return result;
}

/// A device of this model has the one kind of values and not the other.
std::string device_of(std::string_view model, std::string_view values, std::string_view others) {
  const auto properties =
      Object().raw("model", Object().text("const", model).json()).raw(others, "false").json();
  return Object()
      .raw("properties", properties)
      .raw("required", strings(std::vector<std::string_view>{values}))
      .json();
}

Object section(std::span<const KeySpec> keys) {
  Object properties;
  std::vector<std::string_view> required;
  for (const auto& spec : keys) {
    properties.raw(spec.key, documented(spec).json());
    if (spec.required) required.push_back(spec.key);
  }
  auto result = closed(properties);
  if (!required.empty()) result.raw("required", strings(required));
  if (keys.data() == device_schema().data())
    result.raw("oneOf", array({device_of("modbus-generic", "registers", "objects"),
                               device_of("canopen-generic", "objects", "registers")}));
  if (keys.data() == axis_schema().data()) {  // what the model adds
    std::vector<std::string> models;
    for (const auto* model : drive_models())
      models.push_back(fmt::format("{{\"$ref\":\"#/$defs/{}\"}}", model->model));
    result.raw("allOf", array(models));
  }
  return result;
}

/// It has one function, or on an inverted axis the mirrored one, and one level.
std::string fixed_terminal(const TerminalSpec& terminal, std::span<const TerminalFunctionSpec> functions) {
  std::vector<std::string_view> names{terminal.function};
  if (const auto* function = find_function(functions, terminal.function); !function->mirror.empty())
    names.push_back(function->mirror);
  const auto function = Object().raw("enum", strings(names));
  Object properties;
  properties.raw("function", function.json());
  properties.raw("active", Object().text("const", "high").json());
  const auto long_form =
      closed(properties).raw("required", strings(std::vector<std::string_view>{"function"}));
  return Object().raw("anyOf", array({function.json(), long_form.json()})).json();
}

/// The short form (a function) or the long one ({function, active}).
std::string terminals(std::span<const TerminalSpec> list, std::span<const TerminalFunctionSpec> functions) {
  std::vector<std::string_view> names;
  for (const auto& function : functions)
    if (function.unusable.empty()) names.push_back(function.name);
  const auto function = Object().raw("enum", strings(names));
  Object properties;
  for (const auto& spec : terminal_schema()) {
    properties.raw(spec.key, spec.key == "function" ? function.json() : documented(spec).json());
  }
  const auto long_form =
      closed(properties).raw("required", strings(std::vector<std::string_view>{"function"}));
  Object all;
  for (const auto& terminal : list) {
    all.raw(terminal.name, terminal.function.empty()
                               ? Object().raw("anyOf", array({function.json(), long_form.json()})).json()
                               : fixed_terminal(terminal, functions));
  }
  return closed(all).json();
}

/// Tables of segments whose numbers the model's inputs can select.
std::string segments_to(int last) {
  Object tables;
  for (const auto& spec : segment_schema()) {
    if (spec.kind != Kind::numbered_sections) continue;
    tables.raw(spec.key, Object().raw("propertyNames", numbers_to(last)).json());
  }
  return tables.json();
}

std::string if_model(const DriveDescriptor& model) {
  Object settings;
  std::vector<std::string_view> required;
  for (const auto& setting : model.settings) {
    settings.raw(setting.key, documented(setting_schema(setting)).json());
    if (setting.required) required.push_back(setting.key);
  }
  std::vector<std::string> microsteps;
  for (const auto value : model.capabilities.pulses_per_revolution) {
    microsteps.push_back(std::to_string(value));
  }
  Object scale, node, then;
  if (!microsteps.empty())
    scale.raw(
        "microstep",
        Object().text("pattern", fmt::format("^(?:{}) *pulses */ *rev$", fmt::join(microsteps, "|"))).json());
  node.raw("minimum", std::to_string(model.minimum_node)).raw("maximum", std::to_string(model.maximum_node));
  then.raw("node", node.json());
  then.raw("scale", Object().raw("properties", scale.json()).json());
  then.raw("inputs", terminals(model.inputs, model.input_functions));
  then.raw("outputs", terminals(model.outputs, model.output_functions));
  auto drive = closed(settings);
  if (!required.empty()) drive.raw("required", strings(required));
  then.raw("drive", drive.json());
  if (model.capabilities.maximum_start_rpm == 0)
    then.raw("limits", Object().raw("properties", Object().raw("start_speed", "false").json()).json());
  const int last_segment_of_model = model.capabilities.maximum_segments;
  then.raw("segments", last_segment_of_model == 0
                           ? "false"
                           : Object().raw("properties", segments_to(last_segment_of_model)).json());
  if (find_function(model.output_functions, "brake") == nullptr) then.raw("brake", "false");

  Object consequence;
  consequence.raw("properties", then.json());
  if (!required.empty()) consequence.raw("required", strings(std::vector<std::string_view>{"drive"}));
  Object is_model, condition, result;
  is_model.raw("model", Object().text("const", model.model).json());
  condition.raw("properties", is_model.json())
      .raw("required", strings(std::vector<std::string_view>{"model"}));
  return result.raw("if", condition.json()).raw("then", consequence.json()).json();
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
  Object models;
  for (const auto* model : drive_models()) models.raw(model->model, if_model(*model));
  Object head;
  head.text("$schema", "https://json-schema.org/draft/2020-12/schema").text("title", "axisd configuration");
  const auto body = section(schema()).raw("$defs", models.json()).json();
  const auto start = head.json();
  return indented(start.substr(0, start.size() - 1) + "," + body.substr(1));
}

}  // namespace axisd::config
