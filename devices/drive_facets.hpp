// Parts of a drive that a model may lack. Each is a small interface; a drive names those that it has.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/error.hpp"
#include "buses/gate.hpp"
#include "buses/task.hpp"
#include "buses/transaction.hpp"
#include "devices/drive_values.hpp"

namespace axisd {

struct SerialChange;

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

/// Parameters by their addresses. Thread of all facets: core.
class ParametersFacet {
 public:
  /// The key of the configuration that decides this parameter ("inputs.X0", "drive.current"), or empty.
  [[nodiscard]] virtual std::string configured_by(std::uint32_t address) const = 0;
  /// Reads parameters in as few block reads as the model permits, never across a hole. Results in the order
  /// asked. Precondition: all are readable.
  virtual Task<Result<std::vector<ParameterValue>>> read_parameters(std::vector<std::uint32_t> addresses) = 0;
  /// Writes in the order given, then reads all back. Errors: misconfigured (differs), refused, no_reply.
  virtual Task<Result<std::vector<ParameterValue>>> write_parameters(std::vector<ParameterValue> values) = 0;

 protected:
  ~ParametersFacet() = default;
};

/// A table of motions that terminals select and start.
class SegmentsFacet {
 public:
  virtual Task<Result<DriveSegments>> read_segments() = 0;
  /// Writes what differs and verifies. Only while released with their inputs inactive (M3).
  virtual Task<Result<void>> write_segments(DriveSegments segments) = 0;

 protected:
  ~SegmentsFacet() = default;
};

/// A memory that outlives the supply.
class MemoryFacet {
 public:
  /// Neutral motion parameters first, then saves all RW registers, then another canary (M7, M27).
  virtual Task<Result<void>> save_parameters() = 0;
  /// Restores the factory settings; afterwards configure() is needed. The text says which address and serial
  /// settings apply after the next power-up; refused (misconfigured) if that address is one of `taken`.
  virtual Task<Result<std::string>> restore_factory(std::vector<std::uint8_t> taken) = 0;

 protected:
  ~MemoryFacet() = default;
};

/// An address and serial settings that can be set over the bus.
class SerialFacet {
 public:
  /// Saves another address or other serial settings in the EEPROM and reads them back; the text says from
  /// when they count, and how the drive's switches must stand for that. Errors: out_of_range, not_supported.
  virtual Task<Result<std::string>> change_serial(SerialChange change) = 0;

 protected:
  ~SerialFacet() = default;
};

/// A move can be loaded first and triggered later.
class LoadingFacet {
 public:
  /// Drive::start_move() up to the trigger. Errors: as of that, never `unknown`.
  virtual Task<Result<std::unique_ptr<LoadedMove>>> load_move(MoveProfile profile, MotionGuard guard) = 0;

 protected:
  ~LoadingFacet() = default;
};

/// Starts in the same instant as others on its bus.
class CommonStartFacet {
 public:
  /// Why this drive cannot; empty: it can, which was proven in this power cycle (M24). Valid until the drive
  /// is asked for anything else.
  [[nodiscard]] virtual std::string_view no_common_start() const = 0;
  /// Drive::start_move() up to the trigger. Errors: as of that, never `unknown`; not_supported:
  /// no_common_start().
  virtual Task<Result<std::unique_ptr<PreparedMove>>> prepare_move(MoveProfile profile,
                                                                   MotionGuard guard) = 0;

 protected:
  ~CommonStartFacet() = default;
};

/// What the configuration owns of it can be read again.
class DriftFacet {
 public:
  /// Among terminals and scale. `options`: of each request. Error `superseded`: the gate of their guard was
  /// raised.
  virtual Task<Result<Drift>> check_drift(TransactionOptions options) = 0;

 protected:
  ~DriftFacet() = default;
};

/// Its bus can repeat the reading of the state by itself.
class RepeatedWatchFacet {
 public:
  /// Drive::read_state(), in class idle_state, again and again for as long as `watch` says of a reading that
  /// it tells nothing new. Ends with the first that does; nothing: Bus::end_repetition() came between two, or
  /// continuity could not be proven.
  virtual Task<Result<std::optional<DriveSample>>> watch_state(StateWatch watch) = 0;

 protected:
  ~RepeatedWatchFacet() = default;
};

/// Its canary can be kept on the disk, so that a restart of the daemon proves continuity.
class MarksFacet {
 public:
  /// What the drive's memory holds now, if that is known.
  [[nodiscard]] virtual std::optional<ContinuityMark> continuity_mark() const = 0;
  /// After a restart of the daemon: it should hold one of these. Those that no drive of this model can hold
  /// count as not found.
  virtual void expect_marks(const std::vector<ContinuityMark>& marks) = 0;
  /// What it may hold at any time from now until such a start was sent. Empty: not known.
  [[nodiscard]] virtual std::vector<ContinuityMark> marks_until(const MoveProfile& start) const = 0;
  [[nodiscard]] virtual std::vector<ContinuityMark> marks_until(const VelocityProfile& start) const = 0;

 protected:
  ~MarksFacet() = default;
};

/// It keeps count of what proves that it was not restarted, beside the canary.
class ProofFacet {
 public:
  /// As Drive::counts_on(), as far as that proves it of this drive.
  [[nodiscard]] virtual bool rules_out_restart(const DriveSample& sample) const = 0;
  /// When that was asked for which proved last that the drive was not restarted (M7).
  [[nodiscard]] virtual std::optional<TimePoint> proven_at() const = 0;

 protected:
  ~ProofFacet() = default;
};

/// It tells things without being asked.
class NewsFacet {
 public:
  /// What is not as it should be about the way the state comes ("state by SDO polling: ..."); empty: nothing.
  [[nodiscard]] virtual std::string link_note() const = 0;
  /// Called on the core thread when the drive has something to tell that should not wait for the next poll:
  /// it booted, fell silent, or reported an alarm. read_state() then tells what.
  virtual void on_attention(const std::function<void()>& handler) = 0;
  /// It has told by itself of an alarm or a restart, which the next reading will show.
  [[nodiscard]] virtual bool in_trouble() const = 0;

 protected:
  ~NewsFacet() = default;
};

/// More is known of its stops than that they were acknowledged.
class StopsFacet {
 public:
  /// When the last stop frame that is known to have gone out had done so: its last byte or bit.
  [[nodiscard]] virtual std::optional<TimePoint> stop_sent_at() const = 0;
  /// Repeats a stop that is owed to a node which did not answer the last one: where waiting for it costs
  /// others time, not more often than silent nodes are probed, and at once when anything of it is heard.
  virtual Task<Result<void>> repeat_stop() = 0;
  /// How long a quick stop brakes from so many r/min, by what the drive showed when it was asked last;
  /// nothing: as long as a stop.
  [[nodiscard]] virtual std::optional<Duration> quick_stop_time(int rpm) const = 0;

 protected:
  ~StopsFacet() = default;
};

/// Those that a drive has; nullptr: its model has none. They live as long as the drive.
struct DriveFacets {
  ParametersFacet* parameters = nullptr;
  SegmentsFacet* segments = nullptr;
  MemoryFacet* memory = nullptr;
  SerialFacet* serial = nullptr;
  LoadingFacet* loading = nullptr;
  CommonStartFacet* common_start = nullptr;
  DriftFacet* drift = nullptr;
  RepeatedWatchFacet* repeated_watch = nullptr;
  MarksFacet* marks = nullptr;
  ProofFacet* proof = nullptr;
  NewsFacet* news = nullptr;
  StopsFacet* stops = nullptr;
};

}  // namespace axisd
