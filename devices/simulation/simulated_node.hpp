// A simulated drive: pure, in the time that it is given, true to the drive's manual. It knows no driver code.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/can/port.hpp"
#include "buses/clock.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "devices/simulation/encoder.hpp"

namespace axisd::canopen {
struct Eds;
}

namespace axisd::simulation {

/// The points that the manuals leave open ("not said", "likely" in facts); every test must pass either way.
/// Each simulator documents which names it understands and their default. Set before the first frame.
using Switches = std::map<std::string, bool, std::less<>>;

/// Serial settings of one side of a line. What is sent with other settings than the receiver's is garbage to
/// it.
struct Serial {
  int baud = 115200;  ///< bit/s
  modbus_rtu::Format format{};
  bool parity_hidden = false;  ///< nobody can tell its parity (a pty drops it): any parity fits
  [[nodiscard]] bool fits(const Serial& other) const {
    return baud == other.baud && format.stop_bits == other.format.stop_bits &&
           (parity_hidden || other.parity_hidden || format.parity == other.format.parity);
  }
};

/// A simulated drive, whatever wire it is on. Not thread-safe: owned by its wire.
class SimulatedNode {
 public:
  virtual ~SimulatedNode() = default;
  /// Modbus unit or CANopen node-ID, as it is now.
  [[nodiscard]] virtual std::uint8_t address() const = 0;
  /// Lets time pass until `now` (motor, timers, alarms). Calls never go backwards.
  virtual void advance(TimePoint now) = 0;

  /// The power supply: off clears RAM, position and the power stage; on boots for the model's boot time
  /// (silent).
  virtual void set_power(bool on) = 0;
  /// Drives the level of an input terminal ("X3") from outside (true: high), over any virtual switch on it;
  /// nothing gives it back to the switch. Unknown terminals are ignored: see has_input().
  virtual void set_input(std::string_view terminal, std::optional<bool> active) = 0;
  [[nodiscard]] virtual bool has_input(std::string_view) const { return true; }
  /// Raises alarm `code` (0: the cause goes away).
  virtual void raise_alarm(int code) = 0;
  /// Alarm codes that the model has.
  [[nodiscard]] virtual std::span<const int> alarms() const { return {}; }
  /// Holds the shaft (a collision), or lets it go.
  virtual void block_shaft(bool /*blocked*/) {}
  /// Its motor runs `factor` times as fast as it is told, from the next motion on. False: it has no such
  /// switch.
  virtual bool run_at(double /*factor*/) { return false; }
  /// The load turns the shaft by so many pulses. False: it does not give way (energised or blocked).
  virtual bool push_shaft(std::int64_t /*pulses*/) { return false; }
  /// A hand presses on the energised shaft: it bends by so many counts of its encoder, until it is told 0.
  /// False: it does not give way so far, or has no encoder.
  virtual bool lean_on_shaft(int /*counts*/) { return false; }
  /// Its encoder, to be changed while it runs; nullptr: it has none.
  [[nodiscard]] virtual Encoder* encoder() { return nullptr; }
  /// Position of the virtual machine in pulses, independent of the drive's counter: where the load really is.
  [[nodiscard]] virtual std::int64_t shaft_pulses() const = 0;
  [[nodiscard]] virtual bool shaft_moving() const = 0;
  /// How many times a start of motion (start command, homing, terminal) was executed since creation.
  [[nodiscard]] virtual int starts() const = 0;
  /// A register, or an object (index << 8 | sub-index), without access rules; the bits of a signed value.
  [[nodiscard]] virtual std::uint32_t peek(std::uint32_t address) const = 0;
  virtual void poke(std::uint32_t address, std::uint32_t value) = 0;
  /// Registers or objects written to EEPROM since creation.
  [[nodiscard]] virtual std::uint64_t eeprom_writes() const { return 0; }
};

/// One node on an RS-485 line.
class SimulatedRtuNode : public SimulatedNode {
 public:
  /// What it listens with since its last power-up; nothing: with whatever the line has.
  [[nodiscard]] virtual std::optional<Serial> serial() const { return std::nullopt; }
  /// It is put on a line with these settings: what its own settings leave open becomes like them, as if
  /// somebody had set its switches and registers for this line.
  virtual void join(const Serial& /*line*/) {}
  /// A complete frame on the wire, for any node, ending at the time of the last advance(). The reply, or
  /// nothing.
  virtual std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) = 0;
};

/// One node on a CAN network.
class SimulatedCanNode : public SimulatedNode {
 public:
  /// bit/s that it listens with since its last power-up; nothing: whatever the network has.
  [[nodiscard]] virtual std::optional<std::uint32_t> bitrate() const { return std::nullopt; }
  /// It is put on a network with this bit rate: what its settings leave open becomes like it.
  virtual void join(std::uint32_t /*bitrate*/) {}
  /// A frame of another participant, ending at the time of the last advance().
  virtual void on_frame(const can::Frame& frame) = 0;
  /// False: on_frame() would do nothing now. A node among many need not be woken for it.
  [[nodiscard]] virtual bool hears(const can::Frame& /*frame*/) const { return true; }
  /// What it sends, oldest first, after each advance() and on_frame().
  virtual std::optional<can::Frame> take_frame() = 0;
  /// When advance() has something to do next (boot-up, reply, heartbeat, PDO, motion that changes an event
  /// PDO); TimePoint::max() if nothing waits.
  [[nodiscard]] virtual TimePoint next_event() const = 0;
};

/// The mechanics around a simulated drive, in pulses of the shaft from its position at creation.
struct Mechanics {
  std::optional<std::int64_t> home_switch_from, home_switch_to;  ///< active between these
  std::optional<std::int64_t> positive_limit_from;               ///< active at and beyond
  std::optional<std::int64_t> negative_limit_from;               ///< active at and below
  std::optional<double> turn{};  ///< pulses after which a rotary load meets its home switch again, > 0
};

/// What one count of a velocity is in a second, or one of a ramp in a second squared.
struct RateUnit {
  double revolutions = 0;  ///< of the motor; 0: a count of the position

  bool operator==(const RateUnit&) const = default;
};
/// The units of a drive that is made by its data sheet, as far as the sheet does not tell them.
struct UnitSettings {
  double counts_per_revolution = 1000;  ///< of the encoder, per motor revolution; > 0
  RateUnit velocity{};
  std::optional<RateUnit> acceleration{};  ///< nothing: that of velocities
};

enum class SwitchKind : std::uint8_t { home, positive_limit, negative_limit };

/// A switch of the mechanics on a particular terminal. Without one, the switch is wired to whichever terminal
/// has its function, with the level that this terminal takes as active.
struct Wire {
  SwitchKind kind = SwitchKind::home;
  bool normally_closed = false;  ///< low level when the switch is active
};

struct SimulatedNodeSettings {
  /// Within the range of the address switches they are set to it, else they are all off and the custom
  /// address (0x0013) holds it.
  std::uint8_t address = 1;
  /// The address switches, if they are to stand elsewhere: 0 is all off, so that 0x0013 counts alone.
  std::optional<std::uint8_t> dip_address{};
  /// The baud rate switches: bit/s, or 0 for "custom" (0x0014 counts). Nothing: as the line that the node
  /// joins, and so are 0x0014 and 0x0015 unless `eeprom` holds them.
  std::optional<int> dip_baud{};
  Mechanics mechanics{};
  EncoderSettings encoder{};  ///< of the models that have one
  Switches switches{};
  bool powered = true;
  /// EEPROM contents that differ from the factory's (register, or object as index << 8 | sub-index -> value),
  /// as a commissioned drive would have.
  std::map<std::uint32_t, std::uint32_t> eeprom{};
  std::map<std::string, Wire, std::less<>> wires{};     ///< terminal -> switch
  Duration boot_time = std::chrono::milliseconds(300);  ///< silent after power-up; the manuals give no figure
  /// The data sheet that makes the drive, of models that are made by one; none: the simulator's own drive.
  std::shared_ptr<const canopen::Eds> sheet{};
  UnitSettings units{};
};

}  // namespace axisd::simulation
