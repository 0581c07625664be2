#include "tests/chaos/plant.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "devices/simulation/simulator.hpp"

namespace axisd::chaos {

using namespace std::chrono_literals;

namespace {

constexpr std::uint32_t bitrate = 1'000'000;
constexpr std::array<const char*, 3> serial_models{"ykd2405pr", "ssd2608pr", "ess42-r"};
constexpr std::string_view standard = "config/examples/standard-drive.eds";
constexpr std::string_view two_of_each[] = {"", "", standard, standard};
constexpr std::string_view makes[] = {"", standard, "tests/data/eds/trinamic-tmcm-1636.eds",
                                      "tests/data/eds/ros2-canopen-fake-slave.eds",
                                      "tests/data/eds/trinamic-tmcm-1636.eds"};

}  // namespace

Plant::Plant(PlantKind kind, std::uint64_t seed) : dice_(seed) {
  share_ = kind == PlantKind::lines ? dice_.pick(std::array{0.02, 0.08, 0.2, 0.35, 0.5})
                                    : dice_.pick(std::array{0.01, 0.03, 0.08, 0.15, 0.3});
  config::Configuration configuration;
  configuration.machine = "chaos";
  switch (kind) {
    case PlantKind::lines:
      add_line(configuration, "line-a", {1, 2, 3});
      add_line(configuration, "line-b", {1, 2, 3});
      break;
    case PlantKind::network:
      add_network(configuration, two_of_each);
      add_line(configuration, "line-a", {1, 3});
      break;
    case PlantKind::full_line:
      add_line(configuration, "line-a", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16});
      break;
    case PlantKind::generic:
      add_network(configuration, makes);
      add_line(configuration, "line-a", {2});
      break;
  }
  core::MachineParts parts{.executor = world.executor(), .clock = &world.clock(), .instance_id = "chaos"};
  parts.make_line = [this](const modbus_rtu::LineSettings& settings) { return make_line(settings); };
  parts.make_port = [this](const canopen::NetworkSettings& settings) { return make_port(settings); };
  parts.link_helper.cycle = [this](const std::string&, std::function<void(Result<void>)> done) {
    mendings_.push_back(world.clock().call_at(world.now() + dice_.up_to(50ms), [this, done] {
      port_->cycle();
      done({});
    }));
  };
  machine = std::make_unique<core::MachineCore>(std::move(parts), configuration);
  for (auto& station : stations) {
    station.axis = machine->find(station.name);
    add_drive(station);
  }
  machine->start();
}

Plant::~Plant() {
  set_faulty(false);
  machine->close();
  EXPECT_TRUE(world.run_until([this] { return machine->closed(); }, 60s)) << "sequences left over";
  world.run_for(2s);  // what the wires still have to deliver
  machine.reset();
}

void Plant::add_line(config::Configuration& configuration, const std::string& name,
                     const std::vector<std::uint8_t>& nodes) {
  configuration.lines.push_back({.name = name, .port = "sim", .baud = dice_.chance(0.8) ? 115200 : 19200});
  for (const auto node : nodes)
    add_axis(configuration, {.name = name.back() + std::string("-") + std::to_string(node),
                             .bus = name,
                             .node = node,
                             .model = serial_models.at((node - 1U) % serial_models.size()),
                             .invert = node == 4 || (name == "line-b" && node == 1),
                             .limited = node % 3 != 0});
}

void Plant::add_network(config::Configuration& configuration, std::span<const std::string_view> sheets) {
  network_ = std::make_unique<can::Network>(world.clock(), bitrate);
  nodes_ = std::make_unique<simulation::NetworkNodes>(world.clock(), *network_);
  nodes_->nodes().set_observer([this](TimePoint, bool received, const can::Frame& frame) {
    if (!received) answered(frame);
  });
  configuration.networks.push_back({.name = "can0", .interface = "sim", .sync_period = 10ms});
  for (std::uint8_t node = 1; const auto sheet : sheets) {
    add_axis(configuration, {.name = "c-" + std::to_string(node),
                             .bus = "can0",
                             .node = node,
                             .model = sheet.empty() ? "yss-c" : "cia402",
                             .sheet = std::string(sheet),
                             .habits = sheets.size() == std::size(makes) && !sheet.empty(),
                             .invert = node % 2 == 0,
                             .limited = node != 2});
    ++node;
  }
}

void Plant::add_axis(config::Configuration& configuration, Station station) {
  configuration.axes.push_back({.axis = make_axis(station, dice_)});
  stations.push_back(std::move(station));
}

void Plant::add_drive(Station& station) {
  const auto settings = make_drive(station, dice_);
  const auto& simulator = *simulation::find_simulator(station.model);
  const auto watch = [&](Witness& drive) {
    station.drive = &drive;
    drive.on_executed = [this, &station](const Executed& executed) {
      if (on_executed) on_executed(station, executed);
    };
    drive.on_own_start = [this, &station] {
      if (on_own_start) on_own_start(station);
    };
  };
  if (station.on_can()) {
    auto drive = std::make_unique<CanWitness>(simulator.make_can(settings));
    watch(*drive);
    nodes_->nodes().add(std::move(drive));
  } else {
    auto drive = std::make_unique<RtuWitness>(simulator.make(settings));
    watch(*drive);
    lines_.at(station.bus)->network().add(std::move(drive));
  }
}

std::unique_ptr<modbus_rtu::Line> Plant::make_line(const modbus_rtu::LineSettings& settings) {
  auto made = std::make_unique<test::VirtualLine>(world, settings);
  made->network().advance(world.now());
  made->set_on_bind([this, name = settings.name](const test::WireEntry& entry) { bound(name, entry); });
  lines_[settings.name] = made.get();
  return made;
}

std::unique_ptr<can::Port> Plant::make_port(const canopen::NetworkSettings& settings) {
  auto made = std::make_unique<WatchedPort>(
      world.clock(),
      can::PortSettings{.bus = settings.name, .interface = settings.interface, .bitrate = settings.bitrate},
      *network_, [this](const can::Frame& frame) { handed_over(frame); });
  port_ = made.get();
  return made;
}

void Plant::settle() {
  for (const auto& [name, line] : lines_) line->network().advance(world.now());
  if (nodes_) nodes_->nodes().advance();
}

Station* Plant::find(const std::string& axis) {
  const auto found = std::ranges::find(stations, axis, &Station::name);
  return found == stations.end() ? nullptr : &*found;
}

}  // namespace axisd::chaos
