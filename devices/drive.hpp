// The contract between an axis and the model-specific code that speaks to one node.
#pragma once

#include <cstdint>
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
#include "devices/drive_facets.hpp"
#include "devices/drive_values.hpp"

namespace axisd {

/// One drive: what each model has to do, and by its facets what only some can. All sequences are coroutines
/// of the core thread. Errors carry bus, node, register and native code; `outcome` says what is known about
/// the execution. Thread: core.
class Drive {
 public:
  virtual ~Drive() = default;

  /// Reads and verifies the identity. Errors: wrong_model, no_reply, bus_down, refused.
  virtual Task<Result<DriveIdentity>> identify(TransactionClass transaction_class) = 0;

  /// Brings the drive's configuration to its DriveSetup: compares, writes what differs, verifies all of it,
  /// and marks this power cycle with a canary (M3, M6). Never touches the power stage or starts anything.
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

  /// Reads the canary (M7). Error `rebooted` if the drive lost its memory since configure(), or holds none of
  /// the marks that were expected.
  virtual Task<Result<void>> check_continuity(TransactionClass transaction_class) = 0;

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

  /// Sends one stop frame of the kind (halt and stop decelerate, quick_stop as QuickStopRamp says) in class
  /// `stop`.
  virtual Task<Result<void>> stop(StopKind kind) = 0;

  /// Resets an alarm whose cause is gone; one that stays shows in the next sample. Never changes the power
  /// stage of a drive that is in no alarm any more.
  virtual Task<Result<void>> clear_alarm(MotionGuard guard) = 0;
  /// Sets the drive's position counter to zero; only at standstill. Verified by the caller's next sample.
  virtual Task<Result<void>> clear_position(MotionGuard guard) = 0;

  /// The drive follows its position by an encoder, as it is configured.
  [[nodiscard]] virtual bool closed_loop() const { return false; }
  /// Pulses by which a measured position may differ from where the drive holds the shaft, though nobody moved
  /// it: the drive's in-position window (M10, M30). 0: the position is counted, and exact.
  [[nodiscard]] virtual std::int64_t position_window() const { return 0; }
  /// The drive takes its motion from elsewhere, as it is configured (pulse inputs): axisd watches it.
  [[nodiscard]] virtual bool moves_by_itself() const { return false; }

  [[nodiscard]] const DriveFacets& facets() const { return facets_; }

  // As of the facet of that name; where the model has none, what stands in for it.

  /// Else one reading.
  Task<Result<std::optional<DriveSample>>> watch_state(StateWatch watch);
  /// Else none is found.
  Task<Result<Drift>> check_drift(TransactionOptions options);
  /// Else not_supported.
  Task<Result<std::unique_ptr<LoadedMove>>> load_move(MoveProfile profile, MotionGuard guard);
  Task<Result<std::unique_ptr<PreparedMove>>> prepare_move(MoveProfile profile, MotionGuard guard);
  [[nodiscard]] std::string_view no_common_start() const;
  /// Else nothing is known: a restart of the daemon restores no position, and no restart of the drive is
  /// noticed behind it (M1).
  [[nodiscard]] std::optional<ContinuityMark> continuity_mark() const;
  void expect_marks(const std::vector<ContinuityMark>& marks);
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const MoveProfile& start) const;
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const VelocityProfile& start) const;
  /// Else counts_on().
  [[nodiscard]] bool rules_out_restart(const DriveSample& sample) const;
  [[nodiscard]] std::optional<TimePoint> proven_at() const;
  /// Else it has no news.
  [[nodiscard]] std::string link_note() const;
  void on_attention(const std::function<void()>& handler);
  [[nodiscard]] bool in_trouble() const;
  /// Else nothing is known of the frame, a stop is repeated as any other, and a quick stop brakes at once.
  [[nodiscard]] std::optional<TimePoint> stop_sent_at() const;
  Task<Result<void>> repeat_stop();
  [[nodiscard]] std::optional<Duration> quick_stop_time(int rpm) const;

  /// No drive that was restarted shows this reading: such a one counts from 0. At rest, under power, and
  /// further from 0 than its position may waver (M6, M10). False: it proves nothing.
  [[nodiscard]] bool counts_on(const DriveSample& sample) const;

  /// What stands between several notes.
  static constexpr std::string_view between_notes = "; ";

  /// What configure() and others saved to EEPROM since the last call.
  [[nodiscard]] EepromWrites take_eeprom_writes() { return std::exchange(eeprom_writes_, {}); }
  /// `permit` is asked before each request that makes the drive save to its EEPROM, for how many of them
  /// follow. What it refuses is not sent, and its error is that of whatever needed it. Only what ends saving
  /// is not asked for, as it spares the EEPROM.
  void ask_before_saving(std::function<Result<void>(std::uint64_t saves)> permit) {
    save_permit_ = std::move(permit);
  }

 protected:
  explicit Drive(const DriveFacets& facets) : facets_(facets) {}
  [[nodiscard]] Result<void> permit_saves(std::uint64_t saves) const {
    return save_permit_ ? save_permit_(saves) : Result<void>{};
  }
  /// One request that made the drive save was sent.
  void count_save(std::uint64_t registers) {
    ++eeprom_writes_.saves;
    eeprom_writes_.registers += registers;
  }

 private:
  DriveFacets facets_;
  EepromWrites eeprom_writes_;
  std::function<Result<void>(std::uint64_t saves)> save_permit_;
};

}  // namespace axisd
