#pragma once

#include <atomic>
#include <boost/smart_ptr/shared_ptr.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "devices/axis/command.hpp"
#include "devices/axis/stop_holds.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// PLCopen Motion Control part 1, state diagram. `offline` is not a state but stands beside (LinkState).
///
///                      Enable                      Home            +--------+
///        Disabled ---------------> Standstill ------------------->| Homing |--+
///           ^                       |  ^   ^  \                    +--------+  | done
///           |        Disable        |  |   |   \ MoveAbsolute, MoveRelative    |
///           +-----------------------+  |   |    +--> DiscreteMotion -----------+--> Standstill
///                                      |   |  MoveVelocity, Jog
///                            confirmed |   +-------> ContinuousMotion -- Halt --> Standstill
///                                      |
///     any ---- Stop, QuickStop ---> Stopping
///     any ---- fault -------------> ErrorStop ---- Reset ---> Standstill or Disabled
enum class AxisState : std::uint8_t {
  disabled,
  standstill,
  homing,
  discrete_motion,
  continuous_motion,
  synchronized_motion,
  stopping,
  error_stop
};
std::string_view to_string(AxisState state);

/// What is known about the way to the drive.
enum class LinkState : std::uint8_t { offline, configuring, online };
std::string_view to_string(LinkState state);

enum class PositionTrust : std::uint8_t { unknown, set, homed, restored };
std::string_view to_string(PositionTrust trust);

/// Who set the axis in motion.
enum class MotionCause : std::uint8_t {
  none,      ///< it does not move
  command,   ///< a command of a client
  terminal,  ///< the drive by itself: a terminal started it (segments, JOG, start functions)
  unknown,   ///< nobody that is known: it is being stopped
};
std::string_view to_string(MotionCause cause);

struct TerminalState {
  std::string name;      ///< "X0"
  std::string function;  ///< as configured; empty without one
  bool active = false;
};

/// When the drive's values of a snapshot were read. While they stay the same it is only these that go on.
/// Set by one thread, read by any.
class SampleTimes {
 public:
  SampleTimes() = default;
  SampleTimes(const SampleTimes& other) { set(other.after(), other.before(), other.measured_at()); }
  SampleTimes& operator=(const SampleTimes& other) {
    set(other.after(), other.before(), other.measured_at());
    return *this;
  }
  ~SampleTimes() = default;

  /// The values are from between `after` and `before`; `measured_at` is `before` as wall-clock time.
  void set(TimePoint after, TimePoint before, WallTime measured_at) {
    // Whoever reads after() first and before() last takes the span for longer at most, never for shorter.
    before_.store(before, std::memory_order_release);
    measured_at_.store(measured_at, std::memory_order_release);
    after_.store(after, std::memory_order_release);
  }
  /// False: there are none yet.
  [[nodiscard]] bool known() const { return before() != TimePoint{}; }
  [[nodiscard]] TimePoint after() const { return after_.load(std::memory_order_acquire); }
  [[nodiscard]] TimePoint before() const { return before_.load(std::memory_order_acquire); }
  [[nodiscard]] WallTime measured_at() const { return measured_at_.load(std::memory_order_acquire); }

 private:
  std::atomic<TimePoint> after_{TimePoint{}}, before_{TimePoint{}};
  std::atomic<WallTime> measured_at_{WallTime{}};
};

/// Everything known about an axis at one moment. Immutable once published, but for the times of its values;
/// user units, axis direction.
struct AxisSnapshot {
  std::string name;
  std::string bus;
  std::uint8_t node = 0;
  std::string model;
  std::shared_ptr<const DriveDescriptor> own_descriptor{};  ///< as in AxisSettings
  std::string unit;
  bool simulated = false;

  AxisState state = AxisState::disabled;
  LinkState link = LinkState::offline;
  std::optional<Error> link_error{};  ///< why it is not online
  std::string link_note{};            ///< what is not as it should be about the way the state comes
  std::string start_note{};           ///< Drive::no_common_start()
  std::optional<Error> fault{};       ///< why it is in ErrorStop
  std::string drift{};                ///< what the drive no longer holds as configured; empty: nothing
  bool enabled = false;               ///< the drive's power stage
  bool enabled_by_us = false;         ///< false with enabled: found energised
  bool inhibited = false;             ///< StopAll holds the machine

  double position = 0;
  /// Where the drive tells it beside a measured position: where it wants the shaft.
  std::optional<double> commanded_position{};
  std::optional<double> following_error{};  ///< commanded_position less position; not by modulo
  double velocity = 0;
  std::optional<double> target{};  ///< of the current motion
  bool moving = false;
  MotionCause motion_cause = MotionCause::none;
  bool positive_direction = true;  ///< of the last motion
  bool in_position = false;
  bool homed = false;  ///< the drive's homing bit
  PositionTrust trust = PositionTrust::unknown;
  PositionSource position_source = PositionSource::unspecified;
  std::uint16_t alarm_code = 0;
  std::string alarm_name{};
  std::vector<TerminalState> inputs{}, outputs{};
  std::optional<DriveIdentity> identity{};
  int reboots = 0;  ///< seen since the daemon started
  std::uint64_t eeprom_writes =
      0;  ///< registers saved in the drive, since the axis is known on this computer

  SampleTimes sampled{};
  std::string command_id{};       ///< current command, if any
  std::string lease_holder{};     ///< who leases the axis; empty: nobody
  std::vector<StopHold> holds{};  ///< who keeps it in Stopping until ReleaseStop; none: nobody
  std::uint64_t revision = 0;     ///< rises with every publication
};
/// boost's pointer: libstdc++ 12's atomic shared_ptr is a data race to ThreadSanitizer.
using AxisSnapshotPtr = boost::shared_ptr<const AxisSnapshot>;

}  // namespace axisd
