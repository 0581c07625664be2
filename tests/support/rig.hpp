// A whole machine with one simulated RS-485 drive in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/core/machine_core.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/borrowed_node.hpp"
#include "tests/support/fake_journal.hpp"
#include "tests/support/fake_persistence.hpp"
#include "tests/support/virtual_line.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

struct RigOptions {
  bool invert = false;
  std::string model = "ykd2405pr";  ///< any on RS-485
  simulation::Switches switches{};
  std::function<void(AxisSettings&)> adjust{};
  std::function<void(simulation::SimulatedNodeSettings&)> adjust_drive{};
  bool limits = true;
  bool connect = true;       ///< wait until the axis is online
  bool persistence = false;  ///< keep state between restarts in Rig::store
  bool journal = false;      ///< and commands in Rig::journal
  /// Called between the drive's power-up and the start of the daemon.
  std::function<void(simulation::SimulatedRtuNode&, VirtualWorld&)> before_start{};
};

/// The axis "feeder": 1000 pulses/rev, 10 mm/rev (100 pulses per mm), 0..400 mm, 100 mm/s; home switch at -50
/// mm, limit switches at -60 mm and 460 mm, all in axis direction and relative to the power-up position.
/// Position 0 is declared where the drive powers up.
class Rig {
 public:
  explicit Rig(RigOptions options = {});
  ~Rig();

  VirtualWorld world;
  FakePersistence store;
  FakeJournal journal;
  config::Configuration configuration;
  std::unique_ptr<simulation::SimulatedRtuNode> drive;
  VirtualLine* line = nullptr;
  bool unplugged = false;  ///< when a daemon is started: its port is not there
  std::unique_ptr<core::MachineCore> machine;

  /// Ends the daemon; the drive goes on.
  void stop_daemon();
  /// Starts the daemon (again). The wire log is that of the newest daemon.
  void start_daemon(bool connect = true);
  /// Ends the daemon as a kill does: what it has not yet kept by now is lost. The drive goes on.
  void kill_daemon();
  /// Lets the drive alone pass time while there is no daemon.
  void idle(Duration duration);

  [[nodiscard]] Axis& axis() { return *machine->find("feeder"); }
  [[nodiscard]] AxisSnapshotPtr state() { return axis().snapshot(); }
  void run(Duration duration) { world.run_for(duration); }
  /// Runs until the axis is online; fails the test after `limit`.
  void reconnect(Duration limit = std::chrono::seconds(10));
  simulation::FaultPlan& faults() { return line->network().faults(); }
  void fault(simulation::Fault fault) { faults().add(std::move(fault)); }
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
  /// Index of the first write of `address` on the wire, or -1.
  [[nodiscard]] int first_write(std::uint16_t address) const;
  /// Lets something else write a register of the drive, off the wire: another master, an earlier daemon.
  void write_behind(std::uint16_t address, std::uint16_t value);
  void set_input(std::string_view terminal, bool high) {
    drive->advance(world.now());
    drive->set_input(terminal, high);
  }
  /// Switches the drive off for a while; returns when it is on again (and boots).
  void cycle_power(Duration off = std::chrono::milliseconds(1));
  /// Position of the load in axis direction, mm from where it powered up: what really happened.
  [[nodiscard]] double load_mm() const;

 private:
  RigOptions options_;
  int starts_ = 0;
};

/// Writes one register as a frame of the wire would.
void write_register(simulation::SimulatedRtuNode& drive, std::uint16_t address, std::uint16_t value);

/// "error: line-a node 1 ...": state and cause, for failure messages.
std::string describe(const Command& command);

/// Runs `test` with the drive's open points as they are by default, and with each of them the other way; each
/// with the axis plain and inverted. The options are copied from `base`.
void for_each_switch(const RigOptions& base, const std::function<void(const RigOptions&)>& test);
/// Runs `test` with the axis plain and inverted.
void both_directions(const RigOptions& base, const std::function<void(const RigOptions&)>& test);

}  // namespace axisd::test
