// The contract between an axis and the model-specific code that speaks to one node.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "buses/error.hpp"
#include "buses/gate.hpp"
#include "buses/task.hpp"
#include "buses/transaction.hpp"
#include "devices/axis/settings.hpp"

namespace axisd {

struct DriveDescriptor;
struct SerialChange;

/// What the drive itself says it is doing.
enum class DriveMode : std::uint8_t { positioning, homing, multi_position, multi_velocity };
enum class PositionSource : std::uint8_t { unspecified, commanded, encoder };

/// One coherent reading of a drive. Pulses and directions are the drive's.
struct DriveSample {
  TimePoint asked_at;     ///< first byte of the request: everything below is at least this fresh
  TimePoint measured_at;  ///< last byte of the reply
  DriveMode mode = DriveMode::positioning;
  bool moving = false;
  bool in_position = false;
  bool homed = false;
  bool enabled = false;
  std::uint16_t alarm_code = 0;  ///< 0: none
  std::int32_t position_pulses = 0;
  /// Where the drive wants the shaft now, if position_pulses is measured and the drive tells this, too.
  std::optional<std::int32_t> commanded_pulses{};
  std::int32_t velocity_rpm = 0;  ///< signed as the drive reports it
  bool negative_direction = false;
  std::uint32_t inputs = 0;  ///< bit per terminal, in the descriptor's order; 1 active
  std::uint32_t outputs = 0;
  bool operator==(const DriveSample&) const = default;
};

/// Requests that made a drive save to its EEPROM, and the registers that they saved. Rather too many than too
/// few.
struct EepromWrites {
  std::uint64_t saves = 0;
  std::uint64_t registers = 0;
};

struct DriveIdentity {
  std::uint32_t model_code = 0;
  std::string version;
};

/// A positioning move, in drive units.
struct MoveProfile {
  std::int32_t target_pulses = 0;  ///< counter value
  int velocity_rpm = 0;            ///< > 0
  int start_rpm = 5;
  Duration acceleration_time{}, deceleration_time{};
};

struct VelocityProfile {
  int velocity_rpm = 0;  ///< signed
  int start_rpm = 5;
  Duration acceleration_time{}, deceleration_time{};
};

struct HomingProfile {
  HomingMethod method = HomingMethod::home_positive;  ///< drive direction
  int velocity_rpm = 0;
  int search_velocity_rpm = 0;
  Duration acceleration_time{};
  std::int32_t offset_pulses = 0;
  std::optional<std::int8_t> number{};  ///< in place of `method`: the drive's own; drive direction
};

/// The drive's segment table in drive units and direction; index 0 is segment 1, unset ones are 0. As many
/// rows as the model has (Capabilities::maximum_segments), or more that only the drive itself can select.
struct DriveSegments {
  struct Row {
    std::int32_t pulses = 0;
    int velocity_rpm = 0;  ///< of the position segment
    Duration acceleration_time{};
    int pv_velocity_rpm = 0;
    bool operator==(const Row&) const = default;
  };
  bool absolute = false;
  std::vector<Row> rows{};
  bool operator==(const DriveSegments&) const = default;
};

/// What the axis wants the drive to be, in drive direction (already mirrored for inverted axes, M18).
struct DriveSetup {
  std::int64_t pulses_per_revolution = 0;
  std::vector<TerminalSettings> inputs, outputs;
  std::optional<HomingProfile> homing;
  PersistSettings persist{};
  Duration reboot_guard{};
  std::map<std::string, SettingValue> model_settings;
  std::shared_ptr<const DriveDescriptor> own_descriptor{};  ///< AxisSettings has it, too
  std::optional<DriveSegments> segments{};
};

/// A parameter by its address: Modbus register, or CANopen index << 8 | sub-index.
struct ParameterValue {
  std::uint32_t address = 0;
  std::int64_t value = 0;
  bool operator==(const ParameterValue&) const = default;
};

/// What the drive no longer holds as it was configured.
struct Drift {
  std::string text;             ///< names what differs; empty: nothing
  bool scale_changed = false;   ///< positions mean something else now
  bool limits_changed = false;  ///< a limit or stop terminal, or what the drive does at one
};

/// Contents of drive memory that no power-up leaves behind: finding them proves that the drive kept its
/// memory, and with it its position and configuration (M6, M7, M20). The model chooses what it is, and how
/// long, up to `longest_mark`. Empty: none. Never zeros alone, nor restart_mark().
using ContinuityMark = std::vector<std::uint16_t>;
inline constexpr std::size_t longest_mark = 16;

/// A positioning move of which all but the trigger stands in the drive, verified (M6, M22). Nothing of it
/// waits there: dropping it leaves nothing behind. It does not outlive its drive. Thread: core.
class PreparedMove {
 public:
  /// When its start may go out.
  struct StartWindow {
    TimePoint not_before{};
    TimePoint not_after = TimePoint::max();
  };
  virtual ~PreparedMove() = default;
  /// Starts this one and `others`, prepared by other drives on the same bus, in the same instant: the time of
  /// it. All of them or none. Errors: superseded where one was stopped, or told something else, since; as of
  /// start_move(); invalid_argument. With an outcome other than `unknown` none has moved nor will; with
  /// `unknown` each may have started, and was told to stop: the caller confirms it. Once only; all stay alive
  /// meanwhile. It is not sent outside of `window` (after it: expired); before it they are looked at and
  /// armed.
  virtual Task<Result<TimePoint>> start_with(std::vector<PreparedMove*> others, StartWindow window) = 0;
};

/// A positioning move of which all but the trigger stands in the drive, for a trigger of its own (M6, M22).
/// Nothing of it waits there: dropping it leaves nothing behind. It does not outlive its drive. Thread: core.
class LoadedMove {
 public:
  virtual ~LoadedMove() = default;
  /// Reads that all of it stands there still, and that the drive kept its memory. Errors: rebooted;
  /// superseded where something else was told meanwhile; as of start_move(), never `unknown`.
  virtual Task<Result<void>> verify() = 0;
  /// Sends the trigger, once: when the start frame had gone out, or was acknowledged where the bus does not
  /// say. verify() is repeated where it has grown too old for that (M6). It is not sent after `not_after`:
  /// what the caller knows of the shaft has grown too old then, and it may ask again. Errors: as of
  /// start_move(); expired.
  virtual Task<Result<TimePoint>> trigger(TimePoint not_after) = 0;
  /// What the drive still has to be told once the motion has begun; guarded, and of no consequence to it.
  virtual Task<> follow_up() { co_return; }
};

/// What becomes of a state that is read again and again. All of it is called on the core thread and must not
/// block.
struct StateWatch {
  Duration period{};  ///< from one reading to the next
  /// This one tells nothing new, and nobody waits for another.
  std::function<bool(const DriveSample&)> goes_on;
  /// When Drive::check_continuity() is to be asked for, where the next reading is asked for at `next` and the
  /// last request waited for so long until it was sent. Not before that reading: later than `next`.
  std::function<TimePoint(TimePoint next, Duration waited)> proof_due;
  /// It succeeded; it was sent then.
  std::function<void(TimePoint)> proven;
};

/// One drive. All sequences are coroutines of the core thread. Errors carry bus, node, register and native
/// code; `outcome` says what is known about the execution. Thread: core.
class Drive {
 public:
  virtual ~Drive() = default;

  /// Reads and verifies the identity. Errors: wrong_model, no_reply, bus_down, refused.
  virtual Task<Result<DriveIdentity>> identify(TransactionClass transaction_class) = 0;

  /// Brings the drive's configuration to `setup`: compares, writes what differs, verifies all of it, and
  /// marks this power cycle with a canary (M3, M6). Never touches the power stage or starts anything.
  /// Functions that can start motion are written only while the drive is released. Errors: misconfigured,
  /// refused, no_reply, moving, ...
  virtual Task<Result<void>> configure() = 0;

  /// The whole state, coherent as far as the bus allows. Error `rebooted`: as of check_continuity(), where
  /// the node itself said so.
  /// `awaited_from`: as in TransactionOptions.
  virtual Task<Result<DriveSample>> read_state(TransactionClass transaction_class,
                                               TimePoint awaited_from) = 0;
  Task<Result<DriveSample>> read_state(TransactionClass transaction_class) {
    return read_state(transaction_class, TimePoint::max());
  }

  /// The same, in class idle_state, again and again for as long as `watch` says of a reading that it tells
  /// nothing new. Ends with the first that does; nothing: Bus::end_repetition() came between two, or
  /// continuity could not be proven.
  virtual Task<Result<std::optional<DriveSample>>> watch_state(StateWatch /*watch*/) {
    co_return co_await read_state(TransactionClass::idle_state);
  }

  /// Reads the canary (M7). Error `rebooted` if the drive lost its memory since configure().
  virtual Task<Result<void>> check_continuity(TransactionClass transaction_class) = 0;

  /// What stands between several notes.
  static constexpr std::string_view between_notes = "; ";
  /// What is not as it should be about the way the state comes ("state by SDO polling: ..."); empty: nothing.
  [[nodiscard]] virtual std::string link_note() const { return {}; }
  /// No drive that was restarted shows this reading: such a one counts from 0. At rest, under power, and
  /// further from 0 than its position may waver (M6, M10). False: it proves nothing.
  [[nodiscard]] virtual bool rules_out_restart(const DriveSample& sample) const {
    return !sample.moving && sample.enabled &&
           std::abs(std::int64_t{sample.position_pulses}) > 2 * position_window();
  }
  /// When that was asked for which proved last that the drive was not restarted, where it keeps count (M7).
  [[nodiscard]] virtual std::optional<TimePoint> proven_at() const { return std::nullopt; }
  /// Called on the core thread when the drive has something to tell that should not wait for the next poll:
  /// it booted, fell silent, or reported an alarm. read_state() then tells what.
  virtual void on_attention(const std::function<void()>& /*handler*/) {}

  /// The drive follows its position by an encoder, as it is configured.
  [[nodiscard]] virtual bool closed_loop() const = 0;
  /// Pulses by which a measured position may differ from where the drive holds the shaft, though nobody moved
  /// it: the drive's in-position window (M10, M30). 0: the position is counted, and exact.
  [[nodiscard]] virtual std::int64_t position_window() const { return 0; }
  /// It has told by itself of an alarm or a restart, which the next reading will show.
  [[nodiscard]] virtual bool in_trouble() const { return false; }

  /// What the drive's memory holds now, if that is known; and, after a restart of the daemon, what it should
  /// hold: one of these.
  [[nodiscard]] virtual std::optional<ContinuityMark> continuity_mark() const = 0;
  virtual void expect_marks(const std::vector<ContinuityMark>& marks) = 0;
  /// What it may hold at any time from now until such a start was sent. Empty: not known.
  [[nodiscard]] virtual std::vector<ContinuityMark> marks_until(const MoveProfile& start) const = 0;
  [[nodiscard]] virtual std::vector<ContinuityMark> marks_until(const VelocityProfile& start) const = 0;

  /// Power stage. enable() includes a canary check. Errors as above; here and in the starts `terminal` means
  /// that the shaft turned though nothing was started (M23): ErrorStop.
  virtual Task<Result<void>> enable(MotionGuard guard) = 0;
  /// An empty guard for the escalation of a stop: that one is always sent.
  virtual Task<Result<void>> disable(MotionGuard guard) = 0;

  /// Canary, fresh block, trigger (M6): returns once the trigger was acknowledged. `rebooted`: nothing was
  /// sent. outcome `unknown`: the trigger was sent without a reply; the caller must read back before anything
  /// else (M8).
  virtual Task<Result<void>> start_move(MoveProfile profile, MotionGuard guard) = 0;
  virtual Task<Result<void>> start_velocity(VelocityProfile profile, MotionGuard guard) = 0;
  virtual Task<Result<void>> start_homing(HomingProfile profile, MotionGuard guard) = 0;

  /// start_move() up to the trigger. Errors: as of that, never `unknown`.
  virtual Task<Result<std::unique_ptr<LoadedMove>>> load_move(MoveProfile profile, MotionGuard guard) = 0;
  /// Why this drive cannot start in the same instant as others on its bus; empty: it can, which was proven in
  /// this power cycle (M24). Valid until the drive is asked for anything else.
  [[nodiscard]] virtual std::string_view no_common_start() const { return "its bus has no common trigger"; }
  /// start_move() up to the trigger. Errors: as of that, never `unknown`; not_supported: no_common_start().
  virtual Task<Result<std::unique_ptr<PreparedMove>>> prepare_move(MoveProfile /*profile*/,
                                                                   MotionGuard /*guard*/) {
    co_return fail(Reason::not_supported, std::string(no_common_start()), "start it by itself");
  }

  /// Sends one stop frame of the kind (halt and stop decelerate, quick_stop as QuickStopRamp says) in class
  /// `stop`.
  virtual Task<Result<void>> stop(StopKind kind) = 0;
  /// How long a quick stop brakes from so many r/min, by what the drive showed when it was asked last;
  /// nothing: as long as a stop.
  [[nodiscard]] virtual std::optional<Duration> quick_stop_time(int /*rpm*/) const { return Duration{}; }
  /// Repeats a stop that is owed to a node which did not answer the last one: where waiting for it costs
  /// others time, not more often than silent nodes are probed, and at once when anything of it is heard.
  virtual Task<Result<void>> repeat_stop() { return stop(StopKind::stop); }

  /// When the last stop frame that is known to have gone out had done so: its last byte or bit.
  [[nodiscard]] virtual std::optional<TimePoint> stop_sent_at() const { return std::nullopt; }

  /// Reads back what the configuration owns among terminals and scale. `options`: of each request. Error
  /// `superseded`: the gate of their guard was raised.
  virtual Task<Result<Drift>> check_drift(TransactionOptions options) = 0;
  /// The drive takes its motion from elsewhere, as it is configured (pulse inputs): axisd watches it.
  [[nodiscard]] virtual bool moves_by_itself() const = 0;
  /// What configure() and others saved to EEPROM since the last call.
  [[nodiscard]] EepromWrites take_eeprom_writes() { return std::exchange(eeprom_writes_, {}); }
  /// `permit` is asked before each request that makes the drive save to its EEPROM, for how many of them
  /// follow. What it refuses is not sent, and its error is that of whatever needed it. Only what ends saving
  /// is not asked for, as it spares the EEPROM.
  void ask_before_saving(std::function<Result<void>(std::uint64_t saves)> permit) {
    save_permit_ = std::move(permit);
  }
  /// The key of the configuration that decides this parameter ("inputs.X0", "drive.current"), or empty.
  [[nodiscard]] virtual std::string configured_by(std::uint32_t address) const = 0;

  /// Reads parameters in as few block reads as the model permits, never across a hole. Results in the order
  /// asked. Precondition: all are readable.
  virtual Task<Result<std::vector<ParameterValue>>> read_parameters(std::vector<std::uint32_t> addresses) = 0;
  /// Writes in the order given, then reads all back. Errors: misconfigured (differs), refused, no_reply.
  virtual Task<Result<std::vector<ParameterValue>>> write_parameters(std::vector<ParameterValue> values) = 0;
  virtual Task<Result<DriveSegments>> read_segments() = 0;
  /// Writes what differs and verifies. Only while released with their inputs inactive (M3).
  virtual Task<Result<void>> write_segments(DriveSegments segments) = 0;
  /// Neutral motion parameters first, then saves all RW registers, then another canary (M7, M27).
  virtual Task<Result<void>> save_parameters() = 0;
  /// Restores the factory settings; afterwards configure() is needed. The text says which address and serial
  /// settings apply after the next power-up; refused (misconfigured) if that address is one of `taken`.
  virtual Task<Result<std::string>> restore_factory(std::vector<std::uint8_t> taken) = 0;
  /// Saves another address or other serial settings in the EEPROM and reads them back; the text says from
  /// when they count, and how the drive's switches must stand for that. Errors: out_of_range, not_supported.
  virtual Task<Result<std::string>> change_serial(SerialChange change) = 0;

  /// Resets an alarm whose cause is gone; one that stays shows in the next sample. Never changes the power
  /// stage of a drive that is in no alarm any more.
  virtual Task<Result<void>> clear_alarm(MotionGuard guard) = 0;
  /// Sets the drive's position counter to zero; only at standstill. Verified by the caller's next sample.
  virtual Task<Result<void>> clear_position(MotionGuard guard) = 0;

 protected:
  [[nodiscard]] Result<void> permit_saves(std::uint64_t saves) const {
    return save_permit_ ? save_permit_(saves) : Result<void>{};
  }
  /// One request that made the drive save was sent.
  void count_save(std::uint64_t registers) {
    ++eeprom_writes_.saves;
    eeprom_writes_.registers += registers;
  }

 private:
  EepromWrites eeprom_writes_;
  std::function<Result<void>(std::uint64_t saves)> save_permit_;
};

}  // namespace axisd
