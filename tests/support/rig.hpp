// A whole machine with one simulated YKD2405PR in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>

#include "daemon/core/machine_core.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/virtual_line.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

struct RigOptions {
  bool invert = false;
  simulation::Switches switches{};
  std::function<void(AxisSettings&)> adjust{};
  std::function<void(simulation::SimulatedNodeSettings&)> adjust_drive{};
  bool limits = true;
  bool connect = true;  ///< wait until the axis is online
  Persistence* persistence = nullptr;
};

/// The axis "feeder": 1000 pulses/rev, 10 mm/rev (100 pulses per mm), 0..400 mm, 100 mm/s; home switch at -50
/// mm, limit switches at -60 mm and 460 mm, all in axis direction and relative to the power-up position.
/// Position 0 is declared where the drive powers up.
class Rig {
 public:
  explicit Rig(RigOptions options = {});
  ~Rig();

  VirtualWorld world;
  config::Configuration configuration;
  VirtualLine* line = nullptr;
  std::unique_ptr<core::MachineCore> machine;
  simulation::SimulatedRtuNode* drive = nullptr;

  [[nodiscard]] Axis& axis() { return *machine->find("feeder"); }
  [[nodiscard]] AxisSnapshotPtr state() { return axis().snapshot(); }
  void run(Duration duration) { world.run_for(duration); }
  bool run_until(const std::function<bool()>& done, Duration limit) { return world.run_until(done, limit); }

  /// Submits and fails the test if it is refused.
  CommandPtr submit(const Action& action, CommandOptions options = {});
  Result<CommandPtr> try_submit(const Action& action, CommandOptions options = {});
  /// Submits and runs until the command has ended.
  Command complete(const Action& action, Duration limit = std::chrono::seconds(60));
  void enable();
  /// Enables and declares the position 0.
  void ready();

  /// Requests on the wire that write `address`, since the last forget_wire().
  [[nodiscard]] int writes_of(std::uint16_t address) const;
  [[nodiscard]] int triggers() const { return writes_of(0x0027) + writes_of(0x0030); }
  /// Position of the load in axis direction, mm from where it powered up: what really happened.
  [[nodiscard]] double load_mm() const;

 private:
  bool invert_;
};

}  // namespace axisd::test
