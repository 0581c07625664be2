// A whole machine with one simulated drive of any model in virtual time, on whichever wire the model has.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/can/network.hpp"
#include "config/configuration.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/fake_journal.hpp"
#include "tests/support/fake_persistence.hpp"
#include "tests/support/virtual_line.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

struct ModelRigOptions {
  std::string model;
  bool invert = false;
  simulation::Switches switches{};
  int noise = 1;             ///< counts of the encoder, where there is one; it follows and settles, too
  bool free_input = true;    ///< motor_free at terminal X3, where the model has such a function
  bool shows_inputs = true;  ///< of cia402: 60FDh is there
  bool limits = true;        ///< of the position; without them endless motion is in the drive's velocity mode
  std::string homing_keys{};  ///< further keys under homing:, "offset: 2 mm"
  std::string drive_keys{};   ///< further keys under drive:, "a: b, c: d"
};

/// The axis "axis": 1000 pulses/rev, 10 mm/rev, -58..408 mm, 100 mm/s. In axis direction and from where it
/// powered up: home switch from -52 to -50 mm, limit switches at -60 and 410 mm. It homes on the home switch,
/// inverted on the negative limit switch, whose last approach can always be mirrored (M18).
class ModelRig {
 public:
  static constexpr double home_edge = -50, negative_limit_edge = -60, positive_limit_edge = 410;

  explicit ModelRig(ModelRigOptions options);
  ~ModelRig();
  ModelRig(const ModelRig&) = delete;
  ModelRig& operator=(const ModelRig&) = delete;

  VirtualWorld world;
  FakePersistence store{world.executor()};
  FakeJournal journal{world.executor()};
  simulation::SimulatedNode* drive = nullptr;
  std::unique_ptr<core::MachineCore> machine;

  void start_daemon();
  void stop_daemon();
  /// Until the axis is online; fails the test after 10 s.
  void reconnect();
  void run(Duration duration) { world.run_for(duration); }
  bool run_until(const std::function<bool()>& done, Duration limit) { return world.run_until(done, limit); }

  [[nodiscard]] AxisSnapshotPtr state() { return machine->find("axis")->snapshot(); }
  Result<CommandPtr> try_submit(const Action& action) { return machine->submit("axis", action, {}); }
  /// Submits and runs until it has ended. A refusal is a Command in state error, with its cause.
  Command complete(const Action& action);

  /// Does something to the drive or its surroundings, now.
  void touch(const std::function<void(simulation::SimulatedNode&)>& how);
  /// The load is turned by hand, mm in axis direction. False: the shaft is held.
  bool turn(double mm);
  [[nodiscard]] bool on_can() const { return can_drives_ != nullptr; }
  /// What another master writes, past the wire: a register of 16 bit, or an object (index << 8 | sub-index)
  /// of so many bytes.
  void write_behind(std::uint32_t address, std::uint32_t value, int bytes = 2);
  /// On CAN: no frame passes any more, until it is mended.
  void cut(bool cut);
  void set_input(std::string_view function, bool active);
  void free_input(std::string_view function);
  [[nodiscard]] bool has_terminal(std::string_view function) const;
  /// Where the load really is: mm in axis direction from where it powered up.
  [[nodiscard]] double load_mm();
  [[nodiscard]] bool moving();

  /// Everything that has passed the wire so far, in one number: equal for equal frames at equal times.
  [[nodiscard]] std::uint64_t wire_hash() const { return wire_hash_; }

 private:
  void hash(TimePoint at, std::span<const std::uint8_t> bytes);

  ModelRigOptions options_;
  config::Configuration configuration_;
  std::unique_ptr<simulation::SimulatedRtuNode> serial_drive_;
  VirtualLine* line_ = nullptr;
  std::unique_ptr<can::Network> network_;
  std::unique_ptr<simulation::NetworkNodes> can_drives_;
  std::uint64_t wire_hash_ = 14695981039346656037U;  // FNV-1a
  int starts_ = 0;
};

/// The simulated models.
std::vector<std::string> simulated_models();

}  // namespace axisd::test
