#include "config/value.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <regex>

#include "config/quantity.hpp"
#include "config/text.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

using Parsed = std::expected<Value, ValueError>;

std::unexpected<ValueError> wrong(const Node& node, std::string message, std::string suggestion = {}) {
  return std::unexpected(ValueError{node.mark, std::move(message), std::move(suggestion)});
}
std::unexpected<ValueError> wrong(const KeySpec& spec, const Node& node, QuantityError error) {
  return wrong(node, fmt::format("'{}': {}", spec.key, error.message), std::move(error.suggestion));
}

/// "between 1 and 127", "above 0": as far as the key has bounds.
std::string bounds(const KeySpec& spec, std::string_view unit) {
  const auto suffix = unit.empty() ? "" : fmt::format(" {}", unit);
  if (spec.maximum) {
    return fmt::format("between {} and {}{}", format_number(*spec.minimum), format_number(*spec.maximum),
                       suffix);
  }
  return fmt::format("{} {}{}", spec.above_minimum ? "above" : "at least", format_number(*spec.minimum),
                     suffix);
}

std::expected<void, ValueError> check_bounds(const KeySpec& spec, const Node& node, double value,
                                             std::string_view unit) {
  const bool below = spec.minimum && (spec.above_minimum ? value <= *spec.minimum : value < *spec.minimum);
  if (below || (spec.maximum && value > *spec.maximum)) {
    return wrong(node, fmt::format("'{}' is out of range: {}", spec.key, quoted(node.text)),
                 "write a value " + bounds(spec, unit));
  }
  return {};
}

Parsed parse_text(const KeySpec& spec, const Node& node) {
  if (!matches(node.text, spec.pattern)) {
    return wrong(node, fmt::format("'{}' cannot be {}", spec.key, quoted(node.text)),
                 std::string(spec.pattern_hint));
  }
  return Value{.text = node.text};
}

Parsed parse_model(const KeySpec&, const Node& node) {
  if (find_drive_model(node.text) == nullptr) {
    const auto models = names_of(drive_models(), [](const DriveDescriptor* d) { return d->model; });
    const auto near = nearest(node.text, models);
    return wrong(node, fmt::format("model {} is not supported by this release", quoted(node.text)),
                 near.empty() ? "supported: " + alternatives(models) : suggest(node.text, models));
  }
  return Value{.text = node.text};
}

Parsed parse_integer(const KeySpec& spec, const Node& node) {
  if (!node.plain || !matches(node.text, "-?(0|[1-9][0-9]{0,17})")) {
    return wrong(node, fmt::format("'{}' must be a whole number, not {}", spec.key, quoted(node.text)),
                 fmt::format("write it in decimal and without quotes, such as {}", spec.example));
  }
  const auto number = parse_decimal(node.text);
  if (!number) return wrong(spec, node, number.error());
  if (auto ok = check_bounds(spec, node, number->value, ""); !ok) return std::unexpected(ok.error());
  return Value{.integer = number->numerator};
}

Parsed parse_choice(const KeySpec& spec, const Node& node) {
  if (std::ranges::find(spec.choices, node.text) != spec.choices.end())
    return Value{.text = node.text,
                 .integer = static_cast<std::int64_t>(choice_index(spec.choices, node.text))};
  if (spec.maximum && node.plain && matches(node.text, "-?[0-9]+")) return parse_integer(spec, node);
  return wrong(node, fmt::format("'{}' cannot be {}", spec.key, quoted(node.text)),
               suggest(node.text, spec.choices));
}

/// What YAML 1.1 and 1.2 both read as the same number: no leading zeros, lower-case 0x.
Parsed parse_register_address(const KeySpec& spec, const Node& node) {
  const bool hexadecimal = node.text.starts_with("0x");
  if (!node.plain || !matches(node.text, "0x[0-9A-Fa-f]{1,8}|-?(0|[1-9][0-9]{0,9})")) {
    return wrong(node, fmt::format("'{}' must be a register address, not {}", spec.key, quoted(node.text)),
                 "write it in decimal or hexadecimal and without quotes, such as 256 or 0x0100");
  }
  const auto address =
      std::stoll(hexadecimal ? node.text.substr(2) : node.text, nullptr, hexadecimal ? 16 : 10);
  if (auto ok = check_bounds(spec, node, static_cast<double>(address), ""); !ok)
    return std::unexpected(ok.error());
  return Value{.integer = address};
}

Parsed parse_number(const KeySpec& spec, const Node& node) {
  if (!node.plain || !matches(node.text, "-?(0|[1-9][0-9]{0,17})(\\.[0-9]{1,18})?")) {
    return wrong(node, fmt::format("'{}' must be a number, not {}", spec.key, quoted(node.text)),
                 fmt::format("write it in decimal and without unit or quotes, such as {}", spec.example));
  }
  const auto number = parse_decimal(node.text);
  if (!number) return wrong(spec, node, number.error());
  if (number->numerator == 0) return wrong(node, fmt::format("'{}' must not be 0", spec.key));
  return Value{.number = number->value};
}

Parsed parse_boolean(const KeySpec& spec, const Node& node) {
  if (!node.plain || (node.text != "true" && node.text != "false")) {
    return wrong(node, fmt::format("'{}' must be true or false, not {}", spec.key, quoted(node.text)));
  }
  return Value{.boolean = node.text == "true"};
}

Parsed parse_duration_value(const KeySpec& spec, const Node& node) {
  const auto duration = parse_duration(node.text);
  if (!duration) return wrong(spec, node, duration.error());
  const double ms = std::chrono::duration<double, std::milli>(*duration).count();
  if (auto ok = check_bounds(spec, node, ms, "ms"); !ok) return std::unexpected(ok.error());
  return Value{.duration = *duration};
}

/// "5 r/min", "10000 pulses/rev": whole numbers above 0.
Parsed parse_whole(const KeySpec& spec, const Node& node, std::string_view unit) {
  const auto number = parse_in_unit(node.text, unit);
  if (!number) return wrong(spec, node, number.error());
  if (number->denominator != 1 || number->numerator <= 0 || number->numerator > 1'000'000'000) {
    return wrong(node,
                 fmt::format("'{}' must be a whole number above 0, not {}", spec.key, quoted(node.text)),
                 fmt::format("for example {}", spec.example));
  }
  return Value{.integer = number->numerator};
}

Parsed parse_fraction(const KeySpec& spec, const Node& node, const QuantityResult<Decimal>& fraction) {
  if (!fraction) return wrong(spec, node, fraction.error());
  return Value{.numerator = fraction->numerator, .denominator = fraction->denominator};
}

Parsed parse_travel(const KeySpec& spec, const Node& node, std::string_view unit) {
  if (unit.empty())
    return Value{.numerator = 1, .denominator = 1};  // not to be judged; the unit was reported
  return parse_fraction(spec, node, parse_ratio_in_unit(node.text, fmt::format("{}/rev", unit)));
}

/// With whatever unit: the axis's own is not known.
QuantityResult<Decimal> parse_number_of_quantity(std::string_view text) {
  const auto quantity = parse_quantity(text);
  if (!quantity) return std::unexpected(quantity.error());
  return quantity->number;
}

Parsed parse_in_axis_unit(const KeySpec& spec, const Node& node, std::string_view unit) {
  const bool velocity = spec.kind == Kind::velocity;
  const auto wanted = velocity ? fmt::format("{}/s", unit) : std::string(unit);
  const auto number =
      unit.empty() ? parse_number_of_quantity(node.text)
                   : parse_in_unit(node.text, wanted, velocity ? UnitRule::required : UnitRule::optional);
  if (!number) return wrong(spec, node, number.error());
  if (velocity && number->value <= 0) {
    return wrong(node, fmt::format("'{}' must be above 0, not {}", spec.key, quoted(node.text)));
  }
  if (auto ok = check_bounds(spec, node, number->value, wanted); !ok) return std::unexpected(ok.error());
  return Value{.number = number->value};
}

Parsed parse_position_range(const KeySpec& spec, const Node& node, std::string_view unit) {
  if (node.kind != Node::Kind::list || node.items.size() != 2) {
    return wrong(node, fmt::format("'{}' must be a list of minimum and maximum", spec.key),
                 "for example [0, 400]");
  }
  Value result;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& item = *node.items[i];
    if (item.kind != Node::Kind::scalar) {
      return wrong(item,
                   fmt::format("'{}' must be a list of two numbers, not of {}", spec.key, kind_name(item)),
                   "for example [0, 400]");
    }
    const auto value = parse_in_axis_unit(spec, item, unit);
    if (!value) return value;
    (i == 0 ? result.number : result.second) = value->number;
  }
  if (result.number == result.second)
    return wrong(node,
                 fmt::format("'{}' has no range: both ends are {}", spec.key, format_number(result.number)),
                 "write [minimum, maximum]");
  if (result.number > result.second) {
    return wrong(node,
                 fmt::format("'{}' is reversed: {} is not below {}", spec.key, format_number(result.number),
                             format_number(result.second)),
                 "write [minimum, maximum]");
  }
  return result;
}

Parsed parse_names(const KeySpec& spec, const Node& node) {
  const auto how = fmt::format("write a list of two or more, such as {}", spec.example);
  if (node.kind != Node::Kind::list)
    return wrong(node, fmt::format("'{}' must be a list, not {}", spec.key, kind_name(node)), how);
  if (node.items.size() < 2)
    return wrong(node,
                 fmt::format("'{}' has {} in it", spec.key, node.items.empty() ? "nothing" : "only one name"),
                 how);
  Value result;
  for (const auto& item : node.items) {
    if (item->kind != Node::Kind::scalar || !matches(item->text, spec.pattern))
      return wrong(*item,
                   item->kind == Node::Kind::scalar
                       ? fmt::format("'{}' cannot contain {}", spec.key, quoted(item->text))
                       : fmt::format("'{}' must be a list of names, not of {}", spec.key, kind_name(*item)),
                   how);
    if (std::ranges::find(result.items, item->text) != result.items.end())
      return wrong(*item, fmt::format("'{}' names {} twice", spec.key, quoted(item->text)), "once is enough");
    result.items.push_back(item->text);
  }
  return result;
}

Parsed parse_roles(const KeySpec& spec, const Node& node) {
  const auto how = fmt::format("write names and roles, such as {}", spec.example);
  if (node.kind != Node::Kind::section)
    return wrong(node, fmt::format("'{}' must be a section of names, not {}", spec.key, kind_name(node)),
                 how);
  Value result;
  for (const auto& [name, role] : node.entries) {
    if (!matches(name->text, spec.pattern))
      return wrong(*name, fmt::format("{} is no name of a client", quoted(name->text)),
                   std::string(spec.pattern_hint));
    const auto known =
        role->kind == Node::Kind::scalar && std::ranges::find(spec.choices, role->text) != spec.choices.end();
    if (!known)
      return wrong(
          *role,
          fmt::format("{} is no role",
                      role->kind == Node::Kind::scalar ? quoted(role->text) : std::string(kind_name(*role))),
          suggest(role->text, spec.choices));
    const auto level = static_cast<Role>(choice_index(spec.choices, role->text) + 1);  // below them is none
    if (!result.roles.emplace(name->text, level).second)
      return wrong(*name, fmt::format("'{}' names {} twice", spec.key, quoted(name->text)), "once is enough");
  }
  return result;
}

Parsed parse_parts(const KeySpec& spec, const Node& node) {
  const auto how = fmt::format("write true, false or a list, such as {}", spec.example);
  if (node.kind == Node::Kind::scalar && node.plain && node.text == "false") return Value{};
  if (node.kind == Node::Kind::scalar && node.plain && node.text == "true")
    return Value{.items = {spec.choices.begin(), spec.choices.end()}};
  if (node.kind == Node::Kind::scalar)
    return wrong(node, fmt::format("'{}' cannot be {}", spec.key, quoted(node.text)), how);
  if (node.kind != Node::Kind::list)
    return wrong(node, fmt::format("'{}' cannot be {}", spec.key, kind_name(node)), how);
  if (node.items.empty()) return wrong(node, fmt::format("'{}' is an empty list", spec.key), "write false");
  Value result;
  for (const auto& item : node.items) {
    if (item->kind != Node::Kind::scalar)
      return wrong(*item, fmt::format("'{}' must be a list of names, not of {}", spec.key, kind_name(*item)),
                   how);
    if (std::ranges::find(spec.choices, item->text) == spec.choices.end())
      return wrong(*item, fmt::format("'{}' has no part {}", spec.key, quoted(item->text)),
                   suggest(item->text, spec.choices));
    if (std::ranges::find(result.items, item->text) != result.items.end())
      return wrong(*item, fmt::format("'{}' names {} twice", spec.key, quoted(item->text)), "once is enough");
    result.items.push_back(item->text);
  }
  return result;
}

}  // namespace

std::string_view kind_name(const Node& node) {
  switch (node.kind) {
    case Node::Kind::null:
      return "nothing";
    case Node::Kind::scalar:
      return "a single value";
    case Node::Kind::list:
      return "a list";
    case Node::Kind::section:
      return "a section";
  }
  return "";
}

bool matches(std::string_view text, std::string_view pattern) {
  // std::regex recurses per character: bounded before it is asked.
  if (text.size() > longest_text_value || text.find_first_of("\r\n") != std::string_view::npos) return false;
  thread_local std::map<std::string, std::regex, std::less<>> compiled;  // of the few patterns of the schema
  auto found = compiled.find(pattern);
  if (found == compiled.end()) found = compiled.emplace(pattern, std::string(pattern)).first;
  return std::regex_match(text.begin(), text.end(), found->second);
}

std::expected<Value, ValueError> parse_value(const KeySpec& spec, const Node& node, std::string_view unit) {
  if (spec.kind == Kind::position_range) return parse_position_range(spec, node, unit);
  if (spec.kind == Kind::names) return parse_names(spec, node);
  if (spec.kind == Kind::roles) return parse_roles(spec, node);
  if (spec.kind == Kind::parts) return parse_parts(spec, node);
  if (node.kind != Node::Kind::scalar) {
    return wrong(node, fmt::format("'{}' must be a single value, not {}", spec.key, kind_name(node)),
                 spec.example.empty() ? "" : fmt::format("for example {}", spec.example));
  }
  switch (spec.kind) {
    case Kind::text:
      return parse_text(spec, node);
    case Kind::model:
      return parse_model(spec, node);
    case Kind::integer:
      return parse_integer(spec, node);
    case Kind::register_address:
      return parse_register_address(spec, node);
    case Kind::number:
      return parse_number(spec, node);
    case Kind::boolean:
      return parse_boolean(spec, node);
    case Kind::choice:
      return parse_choice(spec, node);
    case Kind::duration:
      return parse_duration_value(spec, node);
    case Kind::motor_speed:
      return parse_whole(spec, node, "r/min");
    case Kind::microstep:
      return parse_whole(spec, node, "pulses/rev");
    case Kind::ratio:
      return parse_fraction(spec, node, parse_ratio(node.text));
    case Kind::travel:
      return parse_travel(spec, node, unit);
    case Kind::position:
    case Kind::velocity:
      return parse_in_axis_unit(spec, node, unit);
    case Kind::position_range:
    case Kind::names:
    case Kind::roles:
    case Kind::parts:
    case Kind::section:
    case Kind::named_sections:
    case Kind::numbered_sections:
    case Kind::terminals:
    case Kind::model_settings:
    case Kind::model_objects:
      break;
  }
  return wrong(node, fmt::format("'{}' must be a section", spec.key));
}

}  // namespace axisd::config
