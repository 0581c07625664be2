#include "tests/rules/model_rig.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

#include "tests/support/borrowed_node.hpp"
#include "tests/support/rig.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::test {

namespace {

using namespace std::chrono_literals;

constexpr double pulses_per_mm = 100;

/// Where a manual contradicts itself, the other reading is one key of the configuration (drive:).
struct Reading {
  std::string_view switch_name;  ///< not in its default position
  std::string_view key, value;
};
constexpr Reading other_readings[] = {
    {"input_functions_at_0043", "terminal_registers", "wiring"},
    {"homing_mode_1_final_approach_same", "home_approach", "as_searched"},
    {"homing_29_ends_backwards", "home_approach", "as_searched"},
    {"states_are_levels", "terminal_states", "level"},
    {"bit13_not_enabled", "status_bit_13", "homing_error"},
};

/// Terminals by function; those of the standard drive have their names.
struct Terminal {
  std::string_view function, terminal, of_standard_drive;
};
constexpr Terminal terminals[] = {{"home", "X0", "HOME"},
                                  {"positive_limit", "X1", "POS"},
                                  {"negative_limit", "X2", "NEG"},
                                  {"motor_free", "X3", ""}};

bool is_standard_drive(std::string_view model) { return model == "cia402"; }

/// Empty: this model has none with that function.
std::string_view terminal_of(const ModelRigOptions& options, std::string_view function) {
  if (!options.shows_inputs || (function == "motor_free" && !options.free_input)) return {};
  const auto* found = std::ranges::find(terminals, function, &Terminal::function);
  if (found == std::end(terminals)) return {};
  if (!is_standard_drive(options.model)) return found->terminal;
  // The functions of its terminals are the drive's own: of an inverted axis the other one.
  if (options.invert && function == "positive_limit") return "NEG";
  if (options.invert && function == "negative_limit") return "POS";
  return found->of_standard_drive;
}

std::string yaml_of(const ModelRigOptions& options, bool on_can) {
  std::string inputs, keys = options.drive_keys;
  for (const auto& [function, terminal, other] : terminals)
    if (const auto name = terminal_of(options, function); !name.empty())
      inputs += fmt::format("      {}: {{ function: {} }}\n", name, function);
  const auto add = [&keys](std::string_view key, std::string_view value) {
    keys += fmt::format("{}{}: {}", keys.empty() ? "" : ", ", key, value);
  };
  if (is_standard_drive(options.model)) {
    add("eds", in_source_tree("config/examples/standard-drive.eds"));
    add("velocity_unit", "pulses_per_second");
  }
  if (!options.shows_inputs) add("objects", "{ 60FDh: { access: none } }");
  for (const auto& one : other_readings)
    if (const auto found = options.switches.find(one.switch_name);
        found != options.switches.end() && found->second)
      add(one.key, one.value);
  return fmt::format(
      "machine: test\nbuses:\n  line: {{ {} }}\naxes:\n  axis:\n    bus: line\n    node: 5\n    model: {}\n"
      "    unit: mm\n    scale: {{ microstep: 1000 pulses/rev, travel: 10 mm/rev, invert: {} }}\n"
      "    limits: {{ {}velocity: 100 mm/s }}\n{}"
      "    homing: {{ method: {}, velocity: 40 mm/s, search_velocity: 5 mm/s, position: 3, {}"
      "timeout: 40 s{}{} }}\n{}{}{}",
      on_can ? "canopen: { interface: sim, bitrate: 1000000, sync_period: 20 ms }"
             : "modbus_rtu: { port: sim, baud: 115200 }",
      options.model, options.invert, options.limits ? "position: [-58, 408], " : "",
      options.limits ? "    jog_travel: 10 mm\n" : "", options.invert ? "negative_limit" : "home_negative",
      options.shows_inputs ? "backoff: 5 mm, " : "", options.homing_keys.empty() ? "" : ", ",
      options.homing_keys, inputs.empty() ? "" : "    inputs:\n", inputs,
      keys.empty() ? "" : fmt::format("    drive: {{ {} }}\n", keys));
}

simulation::SimulatedNodeSettings drive_of(const ModelRigOptions& options) {
  const auto pulses = [](double mm) { return static_cast<std::int64_t>(std::lround(mm * pulses_per_mm)); };
  simulation::SimulatedNodeSettings node{.address = 5, .switches = options.switches};
  node.encoder = {.noise = options.noise, .following = 8ms, .quantised = options.noise > 0};
  using Rig = ModelRig;
  node.mechanics = {.home_switch_from = pulses(-52),
                    .home_switch_to = pulses(Rig::home_edge),
                    .positive_limit_from = pulses(Rig::positive_limit_edge),
                    .negative_limit_from = pulses(Rig::negative_limit_edge)};
  if (options.invert)
    node.mechanics = {.home_switch_from = pulses(-Rig::home_edge),
                      .home_switch_to = pulses(52),
                      .positive_limit_from = pulses(-Rig::negative_limit_edge),
                      .negative_limit_from = pulses(-Rig::positive_limit_edge)};
  return node;
}

config::Configuration load(const std::string& yaml) {
  auto loaded = config::load_text(yaml, "test.yaml");
  if (loaded.configuration) return std::move(*loaded.configuration);
  std::string findings;
  for (const auto& finding : loaded.diagnostics) findings += to_string(finding) + "\n";
  throw std::invalid_argument(findings + yaml);
}

/// Tells of each request that reaches the drive, and of its reply.
class WatchedNode final : public BorrowedNode {
 public:
  using Watch = std::function<void(std::span<const std::uint8_t>)>;
  WatchedNode(simulation::SimulatedRtuNode& node, Watch watch)
      : BorrowedNode(node), watch_(std::move(watch)) {}
  std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) override {
    watch_(frame);
    auto reply = BorrowedNode::on_frame(frame);
    if (reply) watch_(*reply);
    return reply;
  }

 private:
  Watch watch_;
};

template <class Node>
std::unique_ptr<Node> made(Result<std::unique_ptr<Node>> node) {
  if (!node) throw std::invalid_argument(to_string(node.error()));
  return std::move(*node);
}

}  // namespace

ModelRig::ModelRig(ModelRigOptions options) : options_(std::move(options)) {
  const auto* simulator = simulation::find_simulator(options_.model);
  const bool on_can = simulator->make == nullptr;
  configuration_ = load(yaml_of(options_, on_can));
  if (on_can) {
    network_ = std::make_unique<can::Network>(world.clock(), configuration_.networks.front().bitrate);
    can_drives_ = std::make_unique<simulation::NetworkNodes>(world.clock(), *network_);
    drive = &can_drives_->nodes().add(made(simulation::make_can_node(options_.model, drive_of(options_))));
    can_drives_->nodes().set_observer([this](TimePoint at, bool, const can::Frame& frame) {
      hash(at, std::array{static_cast<std::uint8_t>(frame.id), static_cast<std::uint8_t>(frame.id >> 8U)});
      hash(at, frame.data);
    });
    can_drives_->nodes().advance();
  } else {
    const auto serial = configuration_.lines.front().serial();
    serial_drive_ = made(simulation::make_node(options_.model, drive_of(options_)));
    drive = serial_drive_.get();
    serial_drive_->advance(world.now());
    serial_drive_->join({.baud = serial.baud, .format = serial.format});
  }
  run(1s);  // it boots
  start_daemon();
}

ModelRig::~ModelRig() {
  if (machine) stop_daemon();
}

void ModelRig::start_daemon() {
  store.restart();
  journal.restart(world.clock().wall(world.now()));
  core::MachineParts parts{.executor = world.executor(),
                           .clock = &world.clock(),
                           .persistence = &store,
                           .journal = &journal,
                           .instance_id = fmt::format("t{}", ++starts_)};
  parts.make_line = [this](const modbus_rtu::LineSettings& settings) {
    auto line = std::make_unique<VirtualLine>(world, settings);
    line_ = line.get();
    line_->set_on_bind([this](const WireEntry&) { line_->forget_wire(); });
    return line;
  };
  parts.make_port = [this](const canopen::NetworkSettings& settings) {
    return std::make_unique<can::NetworkPort>(
        world.clock(), can::PortSettings{.bus = settings.name, .interface = settings.interface}, *network_);
  };
  machine = std::make_unique<core::MachineCore>(std::move(parts), configuration_);
  if (line_ != nullptr) {
    line_->network().advance(world.now());
    line_->network().add(std::make_unique<WatchedNode>(
        *serial_drive_, [this](std::span<const std::uint8_t> bytes) { hash(world.now(), bytes); }));
  }
  machine->start();
  reconnect();
}

void ModelRig::stop_daemon() {
  machine->close();
  EXPECT_TRUE(run_until([this] { return machine->closed(); }, 60s)) << "sequences left over";
  run(100ms);  // what the wire still had to deliver
  machine.reset();
  line_ = nullptr;
}

void ModelRig::reconnect() {
  EXPECT_TRUE(run_until([this] { return state()->link == LinkState::online; }, 10s))
      << "not online: " << (state()->link_error ? to_string(*state()->link_error) : "");
}

Command ModelRig::complete(const Action& action) {
  const auto command = try_submit(action);
  if (!command) {
    Command refused;
    refused.state = CommandState::error;
    refused.cause = command.error();
    return refused;
  }
  EXPECT_TRUE(run_until([&] { return (*command)->has_ended(); }, 90s))
      << to_string(kind_of(action)) << " did not end";
  return (*command)->value();
}

void ModelRig::touch(const std::function<void(simulation::SimulatedNode&)>& how) {
  if (can_drives_)
    can_drives_->nodes().advance();
  else
    drive->advance(world.now());
  how(*drive);
  if (can_drives_) can_drives_->nodes().advance();
}

bool ModelRig::turn(double mm) {
  bool turned = false;
  touch([&](auto& node) {
    turned = node.push_shaft(std::llround(mm * pulses_per_mm) * (options_.invert ? -1 : 1));
  });
  return turned;
}

void ModelRig::cut(bool cut) {
  network_->set_fault(cut ? [](const can::Frame&) { return can::Network::Fault{.drop = true}; }
                          : std::function<can::Network::Fault(const can::Frame&)>());
}

void ModelRig::write_behind(std::uint32_t address, std::uint32_t value, int bytes) {
  if (!on_can()) {
    touch([&](auto&) {
      write_register(*serial_drive_, static_cast<std::uint16_t>(address), static_cast<std::uint16_t>(value));
    });
    return;
  }
  const auto byte = [](std::uint32_t number, unsigned shift) {
    return static_cast<std::uint8_t>(number >> shift);
  };
  can::Frame frame{.id = 0x600U + drive->address(), .size = 8};
  const auto command = static_cast<std::uint8_t>(0x23U | static_cast<unsigned>(4 - bytes) << 2U);
  frame.data = {command,        byte(address, 8), byte(address, 16), byte(address, 0),
                byte(value, 0), byte(value, 8),   byte(value, 16),   byte(value, 24)};
  touch([&](auto& node) { dynamic_cast<simulation::SimulatedCanNode&>(node).on_frame(frame); });
  run(1ms);
}

bool ModelRig::has_terminal(std::string_view function) const {
  return !terminal_of(options_, function).empty();
}

void ModelRig::set_input(std::string_view function, bool active) {
  touch([&](auto& node) { node.set_input(terminal_of(options_, function), active); });
}

void ModelRig::free_input(std::string_view function) {
  touch([&](auto& node) { node.set_input(terminal_of(options_, function), std::nullopt); });
}

double ModelRig::load_mm() {
  touch([](auto&) {});
  return static_cast<double>(drive->shaft_pulses()) / pulses_per_mm * (options_.invert ? -1 : 1);
}

bool ModelRig::moving() {
  touch([](auto&) {});
  return drive->shaft_moving();
}

void ModelRig::hash(TimePoint at, std::span<const std::uint8_t> bytes) {
  const auto mix = [this](std::uint64_t value) { wire_hash_ = (wire_hash_ ^ value) * 1099511628211U; };
  mix(static_cast<std::uint64_t>(at.time_since_epoch().count()));
  for (const auto byte : bytes) mix(byte);
}

std::vector<std::string> simulated_models() {
  std::vector<std::string> names;
  for (const auto* one : simulation::simulators()) names.emplace_back(one->model);
  return names;
}

}  // namespace axisd::test
