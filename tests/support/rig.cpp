#include "tests/support/rig.hpp"

#include <algorithm>
#include <utility>

namespace axisd::test {

namespace {

constexpr double pulses_per_mm = 100;

AxisSettings feeder(const RigOptions& options) {
  AxisSettings axis{.name = "feeder", .bus = "line-a", .node = 1, .model = "ykd2405pr"};
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

Rig::Rig(RigOptions options) : invert_(options.invert) {
  configuration.machine = "test";
  configuration.buses.push_back({.name = "line-a", .port = "sim"});
  configuration.axes.push_back({.axis = feeder(options)});
  auto parts = core::MachineParts{.executor = world.executor(),
                                  .clock = &world.clock(),
                                  .persistence = options.persistence,
                                  .instance_id = "t",
                                  .make_line = [this](const modbus_rtu::LineSettings& settings) {
                                    auto made = std::make_unique<VirtualLine>(world, settings);
                                    line = made.get();
                                    return made;
                                  }};
  machine = std::make_unique<core::MachineCore>(std::move(parts), configuration);
  drive = &line->network().add(simulation::find_simulator("ykd2405pr")->make(drive_of(options)));
  line->network().advance(world.now());
  machine->start();
  if (options.connect)
    EXPECT_TRUE(run_until([this] { return state()->link == LinkState::online; }, std::chrono::seconds(5)));
}

Rig::~Rig() {
  machine->close();
  EXPECT_TRUE(run_until([this] { return machine->closed(); }, std::chrono::seconds(60)))
      << "sequences left over";
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

double Rig::load_mm() const {
  return static_cast<double>(drive->shaft_pulses()) / pulses_per_mm * (invert_ ? -1 : 1);
}

}  // namespace axisd::test
