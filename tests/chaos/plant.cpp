#include "tests/chaos/plant.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "devices/simulation/simulator.hpp"

namespace axisd::chaos {

using simulation::FaultKind;
using namespace std::chrono_literals;

namespace {

constexpr std::array<const char*, Plant::axes_per_line> models{"ykd2405pr", "ssd2608pr", "ess42-r"};

struct Likely {
  FaultKind kind;
  int weight;
  Duration longest_delay;
};
/// A doubled reply comes within the silence: one that is later and as long as the reply that is waited for
/// then cannot be told from it by anybody, as it carries neither a number nor a register.
constexpr std::array likely_faults{
    Likely{FaultKind::drop_request, 30, {}},      Likely{FaultKind::drop_reply, 30, {}},
    Likely{FaultKind::delay_reply, 40, 120ms},    Likely{FaultKind::delay_reply, 6, 1200ms},
    Likely{FaultKind::corrupt_request, 15, {}},   Likely{FaultKind::corrupt_reply, 15, {}},
    Likely{FaultKind::truncate_reply, 10, {}},    Likely{FaultKind::drip, 5, 4ms},
    Likely{FaultKind::duplicate_request, 15, {}}, Likely{FaultKind::duplicate_reply, 15, 1ms},
    Likely{FaultKind::foreign_frame, 10, {}},     Likely{FaultKind::reboot_before, 1, 300ms},
    Likely{FaultKind::reboot_after, 1, 300ms}};

/// The closed loop models cannot home an inverted axis.
bool inverted(const std::string& line, std::uint8_t node) {
  return line == Plant::line_names.back() && node == 1;
}

AxisSettings axis_settings(const std::string& line, std::uint8_t node, const char* model, bool limited) {
  AxisSettings axis{.name = line.back() + std::string("-") + std::to_string(node),
                    .bus = line,
                    .node = node,
                    .model = model};
  axis.scale = {
      .pulses_per_revolution = 1000, .travel_numerator = 10, .invert = inverted(line, node), .unit = "mm"};
  if (limited) {
    axis.limits.position_minimum = 0;
    axis.limits.position_maximum = 400;
  }
  axis.limits.velocity = 100;
  axis.homing = HomingSettings{.method = HomingMethod::home_negative,
                               .velocity = 20,
                               .search_velocity = 2,
                               .position = 0,
                               .backoff = 5,
                               .timeout = 30s};
  axis.inputs = {{.terminal = "X0", .function = "home"}};
  axis.jog_travel = 10;
  return axis;
}

}  // namespace

std::uint16_t Plant::mark(std::uint8_t node, int offset) {
  return static_cast<std::uint16_t>(0x4000 + node * 0x100 + offset);
}

Plant::Plant(std::uint64_t seed) : dice_(seed) {
  constexpr std::array shares{0.02, 0.08, 0.2, 0.35, 0.5};
  share_ = shares.at(static_cast<std::size_t>(dice_.pick(shares.size())));
  config::Configuration configuration;
  configuration.machine = "chaos";
  for (const auto* line : line_names) {
    configuration.lines.push_back({.name = line, .port = "sim", .baud = dice_.chance(0.8) ? 115200 : 19200});
    for (std::uint8_t node = 1; node <= axes_per_line; ++node) add_axis(configuration, line, node);
  }
  machine = std::make_unique<core::MachineCore>(
      core::MachineParts{.executor = world.executor(),
                         .clock = &world.clock(),
                         .instance_id = "chaos",
                         .make_line =
                             [this](const modbus_rtu::LineSettings& settings) {
                               auto made = std::make_unique<test::VirtualLine>(world, settings);
                               made->network().advance(world.now());
                               made->set_on_bind([this, name = settings.name](const test::WireEntry& entry) {
                                 bound(name, entry);
                               });
                               lines_[settings.name] = made.get();
                               return made;
                             }},
      configuration);
  for (std::size_t i = 0; i < stations.size(); ++i) {
    stations[i].axis = machine->find(stations[i].name);
    add_drive(stations[i], configuration.axes[i].axis.model);
  }
  machine->start();
}

Plant::~Plant() {
  set_faulty(false);
  machine->close();
  EXPECT_TRUE(world.run_until([this] { return machine->closed(); }, 60s)) << "sequences left over";
  world.run_for(2s);  // what the lines still have to deliver
}

void Plant::add_axis(config::Configuration& configuration, const std::string& line, std::uint8_t node) {
  const bool limited = node != axes_per_line;
  configuration.axes.push_back({.axis = axis_settings(line, node, models.at(node - 1U), limited)});
  stations.push_back(
      {.name = configuration.axes.back().axis.name, .line = line, .node = node, .limited = limited});
}

void Plant::add_drive(Station& station, const std::string& model) {
  simulation::SimulatedNodeSettings settings{.address = station.node,
                                             .boot_time = 101ms + dice_.up_to(300ms)};
  settings.switches["crc_error_answered"] = dice_.chance(0.3);
  const auto at = [&](double mm) { return static_cast<std::int64_t>(mm * pulses_per_mm); };
  const bool invert = inverted(station.line, station.node);
  settings.mechanics.home_switch_from = at(invert ? 50 : -52);
  settings.mechanics.home_switch_to = at(invert ? 52 : -50);
  for (int i = 0; i < marked_count; ++i) settings.eeprom[marked_registers + i] = mark(station.node, i);
  auto watched = std::make_unique<Witness>(simulation::find_simulator(model)->make(settings));
  station.drive = watched.get();
  watched->on_executed = [this, &station](const Executed& executed) {
    if (executed.frame[0] == station.node && on_executed) on_executed(station, executed);
  };
  line_of(station.line).network().add(std::move(watched));
}

Station* Plant::find(const std::string& axis) {
  const auto found = std::ranges::find(stations, axis, &Station::name);
  return found == stations.end() ? nullptr : &*found;
}

void Plant::set_faulty(bool faulty) {
  faulty_ = faulty;
  for (const auto& [name, line] : lines_) line->network().faults().clear();
  for (auto& station : stations) station.silent_until = {};
  if (!faulty)
    for (const auto& [name, line] : lines_) line->set_open(true);
}

void Plant::bound(const std::string& line, const test::WireEntry& entry) {
  const auto station = std::ranges::find_if(
      stations, [&](const Station& one) { return one.line == line && one.node == entry.node(); });
  if (station == stations.end()) return;
  ++transactions_;
  if (on_bind) on_bind(*station, entry);
  auto& virtual_line = line_of(line);
  virtual_line.network().faults().clear();
  if (faulty_ && strike(*station, virtual_line)) ++faulted_;
  if (virtual_line.wire().size() > 1000) virtual_line.forget_wire();  // `entry` was in it
}

/// Decides what happens to the request that is about to go out.
bool Plant::strike(Station& station, test::VirtualLine& line) {
  auto& faults = line.network().faults();
  if (world.now() < station.silent_until) {
    faults.add({.kind = FaultKind::drop_request});
    return true;
  }
  if (dice_.chance(0.0005)) station.silent_until = world.now() + dice_.up_to(6s);
  if (dice_.chance(0.0001)) {
    faults.add({.kind = FaultKind::hang_up});
    replugs_.push_back(
        world.clock().call_at(world.now() + dice_.up_to(2s), [&line] { line.set_open(true); }));
    return true;
  }
  if (!dice_.chance(share_)) return false;
  int all = 0;
  for (const auto& one : likely_faults) all += one.weight;
  auto left = dice_.pick(all);
  const auto chosen =
      std::ranges::find_if(likely_faults, [&](const Likely& one) { return (left -= one.weight) < 0; });
  faults.add({.kind = chosen->kind, .delay = dice_.up_to(chosen->longest_delay)});
  return true;
}

}  // namespace axisd::chaos
