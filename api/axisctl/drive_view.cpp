#include "api/axisctl/drive_view.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/quantity.hpp"
#include "config/quantity.hpp"

namespace axisd::axisctl {
namespace {

std::string line(std::string_view name, std::string_view value) {
  return value.empty() ? "" : fmt::format("{:<14}{}\n", fmt::format("{}:", name), value);
}

/// What a data sheet leaves out is as much as its type holds: no limit of the drive's.
std::string speed_limits(const v1::GetDriveResponse& drive) {
  constexpr auto most = static_cast<std::uint32_t>(std::numeric_limits<std::int32_t>::max());
  std::string text;
  if (drive.maximum_rpm() < most) text = fmt::format("{} r/min", drive.maximum_rpm());
  if (drive.maximum_pulse_rate_hz() < most)
    text += fmt::format("{}{} pulses/s", text.empty() ? "" : ", ", drive.maximum_pulse_rate_hz());
  return text.empty() ? "none in its file" : text;
}

std::string names_of(const google::protobuf::RepeatedPtrField<v1::TerminalCapability>& terminals) {
  std::string text;
  for (const auto& terminal : terminals) text += (text.empty() ? "" : " ") + terminal.name();
  return text;
}

/// "X0 X1 X2: none, home, ..."; where terminals have functions of their own, one after the other.
std::string terminals(const google::protobuf::RepeatedPtrField<v1::TerminalCapability>& all) {
  if (all.empty()) return "";
  const auto functions = [](const auto& terminal) {
    return fmt::format("{}", fmt::join(terminal.functions(), ", "));
  };
  const auto first = functions(all[0]);
  if (std::ranges::all_of(all, [&](const auto& one) { return functions(one) == first; }))
    return fmt::format("{}: {}", names_of(all), first);
  std::string text;
  for (const auto& one : all)
    text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", one.name(), functions(one));
  return text;
}

/// "home_positive, positive_limit, -128 to -1, 1 to 37": numbers come in order, and may be many.
std::string homing_methods(const google::protobuf::RepeatedPtrField<std::string>& methods) {
  const auto follows = [&](int i) {
    if (i >= methods.size()) return false;
    const auto before = config::parse_decimal(methods[i - 1]), number = config::parse_decimal(methods[i]);
    return before && number && number->numerator == before->numerator + 1;
  };
  std::string text;
  for (int first = 0; first < methods.size();) {
    int last = first;
    while (follows(last + 1)) ++last;
    text += (text.empty() ? "" : ", ") + methods[first];
    if (last > first) text += " to " + methods[last];
    first = last + 1;
  }
  return text;
}

std::string remedy_of(v1::AlarmReset reset) {
  switch (reset) {
    case v1::ALARM_RESET_POWER_CYCLE:
      return "power cycle";
    case v1::ALARM_RESET_BY_ITSELF:
      return "clears itself, then reset";
    case v1::ALARM_RESET_BY_COMMAND:
      return "reset";
    default:
      return "";
  }
}

const char* access_text(v1::ParameterAccess access) {
  switch (access) {
    case v1::PARAMETER_ACCESS_READ_ONLY:
      return "read";
    case v1::PARAMETER_ACCESS_READ_WRITE:
      return "read/write";
    case v1::PARAMETER_ACCESS_READ_WRITE_SAVED:
      return "saved";
    case v1::PARAMETER_ACCESS_WRITE_ONLY:
      return "trigger";
    default:
      return "";
  }
}

const v1::ParameterValue* find(const google::protobuf::RepeatedPtrField<v1::ParameterValue>& values,
                               const std::string& name) {
  for (const auto& value : values)
    if (value.name() == name) return &value;
  return nullptr;
}

/// Who decides it: the configuration's key, or the RPC of a trigger.
std::string owner(const v1::Parameter& parameter) {
  if (!parameter.configured_by().empty()) return parameter.configured_by();
  return parameter.instead().empty() ? "" : "use " + parameter.instead();
}

}  // namespace

std::string drive_details(const v1::GetDriveResponse& drive) {
  std::string text;
  text += line("axis", drive.axis());
  text += line("model", fmt::format("{} ({})", drive.model(), drive.title()));
  if (drive.has_model_code())
    text += line("reported", fmt::format("code 0x{:04X}, version {}", drive.model_code(), drive.version()));
  text += line("loop", drive.closed_loop() ? "closed" : "open");
  text += line("position", drive.position_source() == v1::POSITION_SOURCE_ENCODER     ? "encoder"
                           : drive.position_source() == v1::POSITION_SOURCE_COMMANDED ? "counted pulses"
                                                                                      : "");
  text += line("watchdog", drive.communication_watchdog() ? "of the communication"
                                                          : "none: the drive does not notice a cut cable");
  text += line("limits", speed_limits(drive));
  text += line("pulses/rev", fmt::format("{}", fmt::join(drive.pulses_per_revolution(), ", ")));
  text += line("homing", homing_methods(drive.homing_methods()));
  text += line("segments", std::to_string(drive.maximum_segments()));
  text += line("inputs", terminals(drive.inputs()));
  text += line("outputs", terminals(drive.outputs()));
  text += line("bauds", fmt::format("{}", fmt::join(drive.bauds(), ", ")));
  text += line("EEPROM", fmt::format("{} register{} saved from here{}", drive.eeprom_writes(),
                                     drive.eeprom_writes() == 1 ? "" : "s",
                                     drive.persist() ? "; the configuration says persist" : ""));
  for (const auto& alarm : drive.alarms())
    text += line(fmt::format("alarm {}", alarm_text(alarm.code())),
                 fmt::format("{} ({}){}{}", alarm.name(), remedy_of(alarm.reset()),
                             alarm.remedy().empty() ? "" : ": ", alarm.remedy()));
  return text;
}

bool fits(const std::string& name, const std::string& pattern) {
  if (pattern.find_first_of("*?[") == std::string::npos) return name.contains(pattern);
  return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

Table parameter_table(const v1::ListParametersResponse& catalogue,
                      const google::protobuf::RepeatedPtrField<v1::ParameterValue>& values,
                      ParameterColumns columns) {
  std::vector<std::string> header{"NAME", "ADDRESS"};
  std::vector<std::size_t> right;
  if (columns.values) {
    right = {2, 4};
    header.emplace_back("VALUE");
  } else {
    right = {3};
  }
  for (const auto* name : {"RANGE", "DEFAULT", "ACCESS", "UNIT", "OWNER"}) header.emplace_back(name);
  if (columns.descriptions) header.emplace_back("DESCRIPTION");
  Table table(std::move(header), std::move(right));
  for (const auto& parameter : catalogue.parameters()) {
    std::vector<Cell> row{parameter.name(), address_text(parameter.address())};
    if (columns.values) {
      const auto* value = find(values, parameter.name());
      const bool differs =
          value != nullptr && parameter.has_default_value() && value->value() != parameter.default_value();
      row.emplace_back(value != nullptr ? std::to_string(value->value()) : "",
                       differs ? Colour::bold : Colour::none);
    }
    row.emplace_back(fmt::format("{}..{}", parameter.minimum(), parameter.maximum()));
    row.emplace_back(parameter.has_default_value() ? std::to_string(parameter.default_value()) : "");
    row.emplace_back(access_text(parameter.access()));
    row.emplace_back(parameter.unit());
    row.emplace_back(owner(parameter), Colour::dim);
    if (columns.descriptions) row.emplace_back(parameter.description());
    table.add(std::move(row));
  }
  return table;
}

Table value_table(const v1::ListParametersResponse& catalogue,
                  const google::protobuf::RepeatedPtrField<v1::ParameterValue>& values) {
  Table table({"NAME", "ADDRESS", "VALUE", "UNIT"}, {2});
  for (const auto& value : values) {
    std::string unit;
    for (const auto& parameter : catalogue.parameters())
      if (parameter.name() == value.name()) unit = parameter.unit();
    table.add({value.name(), address_text(value.address()), std::to_string(value.value()), unit});
  }
  return table;
}

std::optional<std::uint32_t> parse_address(std::string_view text) {
  // No name of a parameter begins with a digit or has a colon.
  if (text.find("h:") == std::string_view::npos && !text.starts_with("0x")) return std::nullopt;
  const auto address = config::parse_object_address(text);
  if (!address)
    throw Failure(ExitCode::usage,
                  fmt::format("{}; {}", address.error().message, address.error().suggestion));
  return *address;
}

v1::ParameterValue parse_assignment(std::string_view text) {
  const auto at = text.find('=');
  if (at == std::string_view::npos || at == 0)
    throw Failure(ExitCode::usage, fmt::format("'{}' is not NAME=VALUE", text));
  v1::ParameterValue value;
  value.set_name(std::string(text.substr(0, at)));
  value.set_value(parse_integer(text.substr(at + 1), value.name()));
  return value;
}

}  // namespace axisd::axisctl
