#include "tests/support/rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace axisd::test {

namespace {

constexpr double pulses_per_mm = 100;

AxisSettings feeder(const RigOptions& options) {
  AxisSettings axis{.name = "feeder", .bus = "line-a", .node = 1, .model = options.model};
  axis.scale = {
      .pulses_per_revolution = 1000, .travel_numerator = 10, .invert = options.invert, .unit = "mm"};
  if (options.limits) {
    axis.limits.position_minimum = 0;
    axis.limits.position_maximum = 400;
  }
  axis.limits.velocity = 100;
  axis.homing = HomingSettings{.method = HomingMethod::home_negative,
                               .velocity = 20,
                               .search_velocity = 2,
                               .position = 0,
                               .backoff = 5,
                               .timeout = std::chrono::seconds(30)};
  axis.inputs = {{.terminal = "X0", .function = "home"},
                 {.terminal = "X1", .function = "positive_limit"},
                 {.terminal = "X2", .function = "negative_limit"}};
  axis.jog_travel = 10;
  if (options.adjust) options.adjust(axis);
  return axis;
}

simulation::SimulatedNodeSettings drive_of(const RigOptions& options) {
  simulation::SimulatedNodeSettings node{.address = 1, .switches = options.switches};
  const auto pulses = [&](double mm) { return static_cast<std::int64_t>(mm * pulses_per_mm); };
  if (!options.invert) {
    node.mechanics = {.home_switch_from = pulses(-52),
                      .home_switch_to = pulses(-50),
                      .positive_limit_from = pulses(460),
                      .negative_limit_from = pulses(-60)};
  } else {
    node.mechanics = {.home_switch_from = pulses(50),
                      .home_switch_to = pulses(52),
                      .positive_limit_from = pulses(60),
                      .negative_limit_from = pulses(-460)};
  }
  if (options.adjust_drive) options.adjust_drive(node);
  return node;
}

}  // namespace

Rig::Rig(RigOptions options)
    : store(world.executor()), journal(world.executor(), &world.clock()), options_(std::move(options)) {
  configuration.machine = "test";
  configuration.lines.push_back({.name = "line-a", .port = "sim"});
  configuration.axes.push_back({.axis = feeder(options_)});
  drive = simulation::find_simulator(options_.model)->make(drive_of(options_));
  drive->advance(world.now());
  if (options_.before_start) options_.before_start(*drive, world);
  start_daemon(options_.connect);
}

void Rig::start_daemon(bool connect) {
  store.restart();
  journal.restart(world.clock().wall(world.now()));
  auto parts = core::MachineParts{.executor = world.executor(),
                                  .clock = &world.clock(),
                                  .persistence = options_.persistence ? &store : nullptr,
                                  .journal = options_.journal ? &journal : nullptr,
                                  .instance_id = fmt::format("t{}", ++starts_),
                                  .make_line = [this](const modbus_rtu::LineSettings& settings) {
                                    auto made = std::make_unique<VirtualLine>(world, settings);
                                    line = made.get();
                                    return made;
                                  }};
  machine = std::make_unique<core::MachineCore>(std::move(parts), configuration);
  line->set_open(!unplugged);
  line->network().advance(world.now());
  line->network().add(std::make_unique<BorrowedNode>(*drive));
  machine->start();
  if (connect) reconnect(std::chrono::seconds(5));
}

void Rig::stop_daemon() {
  machine->close();
  EXPECT_TRUE(run_until([this] { return machine->closed(); }, std::chrono::seconds(60)))
      << "sequences left over";
  run(std::chrono::milliseconds(100));  // what the line still had to deliver
  machine.reset();
  line = nullptr;
}

void Rig::kill_daemon() {
  store.frozen = true;
  journal.frozen = true;
  stop_daemon();
  store.frozen = false;
  journal.frozen = false;
}

Rig::~Rig() {
  if (machine) stop_daemon();
}

void Rig::idle(Duration duration) {
  run(duration);
  drive->advance(world.now());
}

void Rig::reconnect(Duration limit) {
  EXPECT_TRUE(run_until([this] { return state()->link == LinkState::online; }, limit))
      << "not online: " << (state()->link_error ? to_string(*state()->link_error) : "");
}

Result<CommandPtr> Rig::try_submit(const Action& action, CommandOptions options) {
  return machine->submit("feeder", action, options);
}

CommandPtr Rig::submit(const Action& action, CommandOptions options) {
  auto command = try_submit(action, std::move(options));
  if (!command) {
    ADD_FAILURE() << to_string(command.error());
    throw std::runtime_error(command.error().message);
  }
  return *command;
}

Command Rig::complete(const Action& action, Duration limit) {
  const auto command = submit(action);
  EXPECT_TRUE(run_until([&] { return command->has_ended(); }, limit))
      << to_string(kind_of(action)) << " did not end";
  return command->value();
}

void Rig::enable() { EXPECT_EQ(complete(EnableRequest{}).state, CommandState::done); }

void Rig::ready() {
  enable();
  EXPECT_EQ(complete(SetPositionRequest{.position = 0}).state, CommandState::done);
}

int Rig::writes_of(std::uint16_t address) const {
  return static_cast<int>(std::ranges::count_if(line->wire(), [&](const WireEntry& entry) {
    return entry.function() != 0x03 && entry.address() == address;
  }));
}

int Rig::first_write(std::uint16_t address) const {
  const auto& wire = line->wire();
  const auto found = std::ranges::find_if(
      wire, [&](const WireEntry& entry) { return entry.is_write() && entry.address() == address; });
  return found == wire.end() ? -1 : static_cast<int>(found - wire.begin());
}

double Rig::load_mm() const {
  return static_cast<double>(drive->shaft_pulses()) / pulses_per_mm * (options_.invert ? -1 : 1);
}

void write_register(simulation::SimulatedRtuNode& drive, std::uint16_t address, std::uint16_t value) {
  modbus_rtu::Request request{
      .node = drive.address(), .function = modbus_rtu::Function::write_single_register, .address = address};
  request.values.push_back(value);
  drive.on_frame(modbus_rtu::encode(request)->bytes());
}

void Rig::write_behind(std::uint16_t address, std::uint16_t value) {
  drive->advance(world.now());
  write_register(*drive, address, value);
}

void Rig::cycle_power(Duration off) {
  drive->advance(world.now());
  drive->set_power(false);
  run(off);
  drive->advance(world.now());
  drive->set_power(true);
}

std::string describe(const Command& command) {
  return std::string(to_string(command.state)) + (command.cause ? ": " + to_string(*command.cause) : "");
}

void both_directions(const RigOptions& base, const std::function<void(const RigOptions&)>& test) {
  for (const bool invert : {false, true}) {
    SCOPED_TRACE(invert ? "inverted" : "plain");
    auto options = base;
    options.invert = invert;
    test(options);
  }
}

void for_each_switch(const RigOptions& base, const std::function<void(const RigOptions&)>& test) {
  both_directions(base, test);
  for (const auto& spec : simulation::find_simulator(base.model)->switches) {
    SCOPED_TRACE(std::string(spec.name) + (spec.default_value ? " off" : " on"));
    auto options = base;
    options.switches[std::string(spec.name)] = !spec.default_value;
    both_directions(options, test);
  }
}

}  // namespace axisd::test
