#include "api/axisctl/format.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/time_util.h>

#include <cctype>
#include <cmath>
#include <optional>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

using google::protobuf::util::TimeUtil;

std::string_view without_prefix(std::string_view name, std::string_view prefix) {
  if (name.starts_with(prefix)) name.remove_prefix(prefix.size());
  return name;
}

/// Collects "NAME VALUE (asked VALUE)" for what the drive's resolution changed.
class Differences {
 public:
  void add(std::string_view name, std::optional<double> asked, std::optional<double> granted, auto&& text) {
    if (!granted || !asked) return;
    const std::string granted_value = text(*granted);
    const std::string asked_value = text(*asked);
    // Compared as shown: a difference that nobody can see in the text is none.
    if (granted_value == asked_value) return;
    text_ += fmt::format("{}{} {} (asked {})", text_.empty() ? "" : ", ", name, granted_value, asked_value);
  }
  [[nodiscard]] std::string text() && { return text_.empty() ? "" : "granted " + text_; }

 private:
  std::string text_;
};

#define AXISD_VALUE(message, field) \
  ((message).has_##field() ? std::optional((message).field()) : std::nullopt)
#define AXISD_TIME(message, field) \
  ((message).has_##field() ? std::optional(seconds((message).field())) : std::nullopt)

}  // namespace

std::string number(double value) {
  if (!std::isfinite(value)) return fmt::format("{}", value);
  if (value != 0 && std::abs(value) < 0.001) return fmt::format("{:.3g}", value);
  std::string text = fmt::format("{:.4f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string with_unit(double value, std::string_view unit) {
  return unit.empty() || unit.starts_with('/') ? number(value) + std::string(unit)
                                               : fmt::format("{} {}", number(value), unit);
}

std::string duration_text(double value) {
  if (value < 1) return fmt::format("{} ms", number(std::round(value * 1e4) / 10));
  if (value < 60) return fmt::format("{} s", number(std::round(value * 1e3) / 1e3));
  const auto whole = static_cast<long>(std::round(value));
  return fmt::format("{} min {} s", whole / 60, whole % 60);
}

double seconds(const google::protobuf::Duration& duration) {
  return static_cast<double>(duration.seconds()) + static_cast<double>(duration.nanos()) * 1e-9;
}

std::string camel_word(std::string_view name, std::string_view prefix) {
  std::string text;
  bool upper = true;
  for (const char c : without_prefix(name, prefix)) {
    if (c != '_') text += upper ? c : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    upper = c == '_';
  }
  return text;
}

std::string lower_word(std::string_view name, std::string_view prefix) {
  std::string text;
  for (const char c : without_prefix(name, prefix))
    text += c == '_' ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string state_text(const v1::AxisState& state) {
  if (state.link() == v1::LINK_STATE_OFFLINE) return "Offline";
  return camel_word(v1::State_Name(state.state()), "STATE_");
}

std::string command_kind(const v1::Command& command) {
  return camel_word(v1::CommandKind_Name(command.kind()), "COMMAND_KIND_");
}

std::string command_state(const v1::Command& command) {
  return camel_word(v1::CommandState_Name(command.state()), "COMMAND_STATE_");
}

bool ended(const v1::Command& command) { return command.state() >= v1::COMMAND_STATE_DONE; }

std::string granted_text(const v1::Command& command, std::string_view unit) {
  const auto& asked = command.asked();
  const auto& granted = command.granted();
  const std::string per_second = fmt::format("{}/s", unit);
  const auto length = [&](double value) { return with_unit(value, unit); };
  const auto speed = [&](double value) { return with_unit(value, per_second); };
  Differences differences;
  differences.add("position", AXISD_VALUE(asked, position), AXISD_VALUE(granted, position), length);
  differences.add("distance", AXISD_VALUE(asked, distance), AXISD_VALUE(granted, distance), length);
  differences.add("velocity", AXISD_VALUE(asked, velocity), AXISD_VALUE(granted, velocity), speed);
  differences.add("search velocity", AXISD_VALUE(asked, search_velocity),
                  AXISD_VALUE(granted, search_velocity), speed);
  differences.add("acceleration time", AXISD_TIME(asked, acceleration_time),
                  AXISD_TIME(granted, acceleration_time), duration_text);
  differences.add("deceleration time", AXISD_TIME(asked, deceleration_time),
                  AXISD_TIME(granted, deceleration_time), duration_text);
  differences.add("hold", AXISD_TIME(asked, hold), AXISD_TIME(granted, hold), duration_text);
  return std::move(differences).text();
}

std::string command_line(const v1::Command& command, std::string_view unit) {
  std::string text = fmt::format("{}  {}  {}  {}", command.id(), command.axis(), command_kind(command),
                                 command_state(command));
  if (command.has_ended_at() && command.has_accepted_at())
    text += fmt::format(" after {}", duration_text(seconds(command.ended_at() - command.accepted_at())));
  if (command.has_cause()) text += ": " + describe(command.cause(), command.axis());
  if (const std::string granted = granted_text(command, unit); !granted.empty()) text += "  " + granted;
  return text;
}

std::string address_text(std::uint32_t address) {
  if (address <= 0xFFFF) return fmt::format("0x{:04X}", address);
  return fmt::format("{:04X}h:{:02X}", address >> 8U, address & 0xFFU);
}

std::string alarm_text(std::uint32_t code) {
  constexpr std::uint32_t own_list = 0xFF, without_code = 0xFFFF;
  if (code == without_code) return "without a code";
  return code > own_list ? fmt::format("{:04X}h", code) : std::to_string(code);
}

std::string json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok())
    throw Failure(ExitCode::refused, "the answer cannot be printed as JSON: " + status.ToString());
  return text;
}

}  // namespace axisd::axisctl
