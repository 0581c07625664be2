#include "devices/simulation/axis_control.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <system_error>
#include <vector>

#include "devices/descriptor.hpp"
#include "devices/simulation/text.hpp"
#include "devices/units/scale.hpp"

namespace axisd::simulation {

namespace {

using Words = std::span<const std::string_view>;

std::unexpected<Error> use(std::string_view how) {
  return fail(Reason::invalid_argument, "that is no command for a simulated drive",
              fmt::format("use: {}", how));
}

Result<std::string> input(const AxisSettings& axis, Words words) {
  constexpr auto how = "input TERMINAL on|off|auto";
  if (words.size() != 2) return use(how);
  const auto* drive = descriptor_of(axis);
  if (drive != nullptr && !drive->inputs.empty() &&
      std::ranges::find(drive->inputs, words[0], &TerminalSpec::name) == drive->inputs.end()) {
    std::vector<std::string_view> names;
    for (const auto& terminal : drive->inputs) names.push_back(terminal.name);
    return fail(Reason::invalid_argument, fmt::format("there is no input {}", words[0]),
                fmt::format("it has {}", fmt::join(names, ", ")));
  }
  if (words[1] == "auto") return fmt::format("input {} {} auto", axis.node, words[0]);
  const auto active = parse_on_off(words[1]);
  if (!active) return use(how);
  const auto known = std::ranges::find(axis.inputs, words[0], &TerminalSettings::terminal);
  const bool high = *active != (known != axis.inputs.end() && known->active_low);
  return fmt::format("input {} {} {}", axis.node, words[0], high ? "on" : "off");
}

Result<std::string> push(const AxisSettings& axis, Words words) {
  double distance = 0;
  if (words.size() != 1) return use("push DISTANCE");
  const auto [end, error] = std::from_chars(words[0].begin(), words[0].end(), distance);
  if (error != std::errc{} || end != words[0].end()) return use("push DISTANCE");
  const auto pulses = Scale(axis.scale).checked_pulses(distance);
  if (!pulses || std::abs(*pulses) > std::numeric_limits<std::int32_t>::max())
    return fail(Reason::out_of_range, "the push is too long", "push by less");
  return fmt::format("push {} {}", axis.node, *pulses);
}

Result<std::string> lose(const AxisSettings& axis, Words words) {
  const auto count = words.size() == 1 ? parse_number<int>(words[0]) : std::nullopt;
  if (!count || *count < 1) return use("lose COUNT, of the replies that follow");
  return fmt::format("fault drop_reply node={} count={}", axis.node, *count);
}

Result<std::string> on_off(const AxisSettings& axis, std::string_view command, Words words) {
  if (words.size() != 1 || !parse_on_off(words[0])) return use(fmt::format("{} on|off", command));
  return fmt::format("{} {} {}", command, axis.node, words[0]);
}

/// The number behind "KEY=" in the reply.
std::optional<std::int64_t> value_in(Words words, std::string_view key) {
  for (const auto word : words)
    if (const auto [name, value] = key_value(word); name == key) return parse_number<std::int64_t>(value);
  return std::nullopt;
}

}  // namespace

Result<std::string> axis_command(const AxisSettings& axis, std::string_view text) {
  const auto all = split(text, ' ');
  const auto command = all.empty() ? std::string_view() : all.front();
  const auto words = Words(all).subspan(all.empty() ? 0 : 1);
  if (command == "power" || command == "block") return on_off(axis, command, words);
  if (command == "input") return input(axis, words);
  if (command == "push") return push(axis, words);
  if (command == "lose") return lose(axis, words);
  if (command == "show" && words.empty()) return fmt::format("shaft {}", axis.node);
  if (command == "alarm" && words.size() == 1 && parse_number<int>(words[0]))
    return fmt::format("alarm {} {}", axis.node, words[0]);
  return use("power, input, alarm CODE, block, push, lose, show");
}

std::string axis_reply(const AxisSettings& axis, double start_position, std::string_view reply) {
  const auto words = split(reply, ' ');
  const auto pulses = value_in(words, "position"), moving = value_in(words, "moving"),
             starts = value_in(words, "starts");
  if (!reply.starts_with("ok ") || !pulses || !moving || !starts) return std::string(reply);
  return fmt::format("ok the load is at {:.6g} {}, {}, {} starts",
                     start_position + Scale(axis.scale).to_units(*pulses), axis.scale.unit,
                     *moving != 0 ? "moving" : "at rest", *starts);
}

}  // namespace axisd::simulation
