#include "devices/simulation/control.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "devices/simulation/text.hpp"

namespace axisd::simulation {

namespace {

using Words = std::span<const std::string_view>;

constexpr std::string_view usage =
    "power N on|off; input N TERMINAL on|off|auto; alarm N CODE; block N on|off; push N PULSES; lean N "
    "COUNTS; pace N PERCENT; shaft N; "
    "encoder N KEY=VALUE...; "
    "peek N ADDRESS; poke N ADDRESS VALUE; eeprom N; fault KIND key=value...; fault clear; cut; join; "
    "hangup; replug; help (N: an address, or @K for the K-th drive)";

std::string power(SimulatedNode& node, Words words) {
  const auto on = words.size() == 1 ? parse_on_off(words[0]) : std::nullopt;
  if (!on) return "error use: power N on|off";
  node.set_power(*on);
  return "ok";
}

std::string input(SimulatedNode& node, Words words) {
  if (words.size() != 2) return "error use: input N TERMINAL on|off|auto";
  if (!node.has_input(words[0])) return fmt::format("error no input {}", words[0]);
  const auto level = parse_on_off(words[1]);
  if (!level && words[1] != "auto") return "error use: input N TERMINAL on|off|auto";
  node.set_input(words[0], level);
  return "ok";
}

std::string alarm(SimulatedNode& node, Words words) {
  const auto code = words.size() == 1 ? parse_number<int>(words[0]) : std::nullopt;
  const auto known = node.alarms();
  if (!code || (*code != 0 && std::ranges::find(known, *code) == known.end()))
    return fmt::format("error no such alarm; it has {} (0: the cause is gone)", fmt::join(known, ", "));
  node.raise_alarm(*code);
  return "ok";
}

std::string block(SimulatedNode& node, Words words) {
  const auto on = words.size() == 1 ? parse_on_off(words[0]) : std::nullopt;
  if (!on) return "error use: block N on|off";
  node.block_shaft(*on);
  return "ok";
}

std::string push(SimulatedNode& node, Words words) {
  const auto pulses = words.size() == 1 ? parse_number<std::int32_t>(words[0]) : std::nullopt;
  if (!pulses) return "error use: push N PULSES";
  return node.push_shaft(*pulses) ? "ok" : "error the shaft is held; release the drive or switch it off";
}

std::string lean(SimulatedNode& node, Words words) {
  const auto counts = words.size() == 1 ? parse_number<int>(words[0]) : std::nullopt;
  if (!counts) return "error use: lean N COUNTS";
  return node.lean_on_shaft(*counts) ? "ok" : "error the shaft is held; see encoder N compliance=COUNTS";
}

std::string pace(SimulatedNode& node, Words words) {
  constexpr int highest = 10'000;
  const auto percent = words.size() == 1 ? parse_number<int>(words[0]) : std::nullopt;
  if (!percent || *percent < 1 || *percent > highest) return "error use: pace N PERCENT, 1 to 10000";
  return node.run_at(*percent / 100.0) ? "ok" : "error its motor has no such switch";
}

std::string encoder(SimulatedNode& node, Words words) {
  if (node.encoder() == nullptr) return "error it has no encoder";
  auto settings = node.encoder()->settings();
  for (const auto word : words) {
    const auto [key, value] = key_value(word);
    if (!set_encoder_option(settings, key, value))
      return fmt::format(
          "error \"{}\": use noise=N, following_ms=N, quantised=on|off, backlash=N, compliance=N, slip=N",
          word);
  }
  node.encoder()->set(settings);
  return "ok";
}

std::string shaft(SimulatedNode& node, Words words) {
  if (!words.empty()) return "error use: shaft N";
  return fmt::format("ok position={} moving={} starts={}", node.shaft_pulses(), node.shaft_moving() ? 1 : 0,
                     node.starts());
}

std::string peek(SimulatedNode& node, Words words) {
  const auto address = words.size() == 1 ? parse_number<std::uint32_t>(words[0]) : std::nullopt;
  if (!address) return "error use: peek N ADDRESS";
  return fmt::format("ok {}", node.peek(*address));
}

std::string poke(SimulatedNode& node, Words words) {
  const auto address = words.size() == 2 ? parse_number<std::uint32_t>(words[0]) : std::nullopt;
  const auto value = words.size() == 2 ? parse_number<std::uint32_t>(words[1]) : std::nullopt;
  const bool fits = value <= 0xFFFF || dynamic_cast<SimulatedRtuNode*>(&node) == nullptr;
  if (!address || !value || !fits) return "error use: poke N ADDRESS VALUE";  // a register has 16 bits
  node.poke(*address, *value);
  return "ok";
}

std::string eeprom(SimulatedNode& node, Words words) {
  if (!words.empty()) return "error use: eeprom N";
  return fmt::format("ok {}", node.eeprom_writes());
}

struct NodeCommand {
  std::string_view name;
  std::string (*run)(SimulatedNode& node, Words words);
};
constexpr NodeCommand node_commands[] = {{"power", &power}, {"input", &input},   {"alarm", &alarm},
                                         {"block", &block}, {"push", &push},     {"lean", &lean},
                                         {"pace", &pace},   {"shaft", &shaft},   {"peek", &peek},
                                         {"poke", &poke},   {"eeprom", &eeprom}, {"encoder", &encoder}};

/// "5": address; "@2": the second drive of the line. nullptr: there is none.
template <class Network>
SimulatedNode* find_node(Network& network, std::string_view name) {
  if (name.starts_with('@')) {
    const auto place = parse_number<std::size_t>(name.substr(1));
    const auto nodes = network.nodes();
    return place && *place >= 1 && *place <= nodes.size() ? nodes[*place - 1].get() : nullptr;
  }
  const auto address = parse_number<std::uint8_t>(name);
  return address ? network.node(*address) : nullptr;
}

template <class Network>
std::string node_command(Network& network, Words words) {
  for (const auto& command : node_commands) {
    if (command.name != words[0]) continue;
    if (words.size() < 2) return fmt::format("error {} needs a node", words[0]);
    auto* node = find_node(network, words[1]);
    return node == nullptr ? fmt::format("error no node {}", words[1]) : command.run(*node, words.subspan(2));
  }
  return fmt::format("error \"{}\" is no command; use: {}", words[0], usage);
}

/// `take_fault` gets the words after "fault".
template <class Network, class TakeFault>
std::string execute(Network& network, std::string_view command, TakeFault take_fault) {
  const auto words = split(command, ' ');
  if (words.empty()) return fmt::format("error empty; use: {}", usage);
  if (words[0] == "fault") {
    const auto rest = command.find("fault") + 5;
    const Result<void> taken =
        take_fault(command.substr(std::min(command.find_first_not_of(' ', rest), command.size())));
    return taken ? "ok" : fmt::format("error {}; {}", taken.error().message, taken.error().remedy);
  }
  if (words.size() > 1) return node_command(network, words);
  if (words[0] == "help") return fmt::format("ok {}", usage);
  if (words[0] != "cut" && words[0] != "join") return node_command(network, words);
  network.set_connected(words[0] == "join");
  return "ok";
}

}  // namespace

std::string execute_control(RtuNetwork& network, std::string_view command) {
  return execute(network, command, [&](std::string_view text) -> Result<void> {
    if (text == "clear") {
      network.faults().clear();
      return {};
    }
    auto parsed = parse_fault(text);
    if (!parsed) return fail(parsed.error());
    network.faults().add(std::move(*parsed));
    return {};
  });
}

std::string execute_control(CanNodes& nodes, std::string_view command) {
  nodes.advance();
  auto reply = execute(nodes, command, [&](std::string_view text) -> Result<void> {
    if (text == "clear") {
      nodes.clear_faults();
      return {};
    }
    const auto parsed = parse_can_fault(text);
    if (!parsed) return fail(parsed.error());
    nodes.add_fault(*parsed);
    return {};
  });
  nodes.advance();  // what the command changed may be something to send, or to wait for
  return reply;
}

std::string execute_control(PtyLine& line, std::string_view command) {
  const auto words = split(command, ' ');
  if (words.size() == 1 && words[0] == "hangup") {
    line.hang_up();
    return "ok";
  }
  if (words.size() == 1 && words[0] == "replug") {
    const auto plugged = line.replug();
    return plugged ? "ok " + line.path() : "error " + plugged.error().message;
  }
  return line.with_network([&](RtuNetwork& network) { return execute_control(network, command); });
}

}  // namespace axisd::simulation
