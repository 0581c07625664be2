// One axis: the vendor-free motion object (PLCopen Motion Control part 1). Its states: snapshot.hpp.
// A state is visible as soon as a command is accepted. Beside the state stands the link to the drive
// (offline, configuring, online). Every change that forbids motion raises the epoch of the gate first; what
// was prepared before is then never sent, and the sequence that prepared it ends by itself at its next step
// (superseded, not cancelled).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "devices/axis/acceptance.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/drift_check.hpp"
#include "devices/axis/drive_connection.hpp"
#include "devices/axis/drive_work.hpp"
#include "devices/axis/earlier_commands.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/homing_sequence.hpp"
#include "devices/axis/lease_duty.hpp"
#include "devices/axis/motion_sequence.hpp"
#include "devices/axis/power_sequence.hpp"
#include "devices/axis/preconditions.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/saved_position.hpp"
#include "devices/axis/sequences.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/start_wait.hpp"
#include "devices/axis/state_reader.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

/// Composes the parts of an axis: each has a header of its own name. Thread: core, except gate() and
/// snapshot().
class Axis {
 public:
  Axis(AxisEnvironment environment, AxisSettings settings, const DriveDescriptor& descriptor,
       std::unique_ptr<Drive> drive, AxisFacePtr face, bool simulated);
  ~Axis();
  Axis(const Axis&) = delete;

  /// Connects to the drive, now and whenever it was lost. Never moves or enables anything (M1). `answered`:
  /// the drive did a moment ago, so silence is no more than a lost frame at first.
  void start(bool answered = false);
  /// Ends all sequences; they run out on the core thread until closed(). The drive is left as it is.
  void close();
  [[nodiscard]] bool closed() const { return sequences_.life().ends() && sequences_.none(); }

  // axis_reload.cpp: for another axis of the same name, or none, to take its place
  /// Why that cannot be now, all reasons, each with what to do; empty: nothing stands against it. Leases are
  /// not looked at. `energised`: may be, as what has changed is the daemon's alone.
  [[nodiscard]] std::vector<Error> check_exchange(bool energised) const;
  /// Refuses everything from now on (`reloading`) and ends as close() does: nothing of it is sent any more
  /// but what is on its way. `position_holds`: for what comes, too; else it has to be homed again.
  /// Precondition: check_exchange() found nothing.
  void retire(bool position_holds);
  [[nodiscard]] bool retired() const { return sequences_.life().retired(); }
  /// `on_lease_loss: disable` was not done yet.
  [[nodiscard]] bool owes_release() const { return power_.machine().owes_release(); }
  /// Its drive answered when it was retired.
  [[nodiscard]] bool answered() const { return sequences_.life().answered(); }
  /// Keeps the axis from being exchanged while it lives. Errors: reloading.
  Result<std::shared_ptr<void>> use();
  void take_stop(const StopRequest& request, const CommandOptions& options, CommandPtr command);

  /// The axis as a member of a group (member.hpp).
  class Member;
  /// What its part of a group move would be; nothing is begun yet. Errors: as of submit(); moving, busy (a
  /// member has to rest).
  Result<Plan> plan_member(const GroupMemberRequest& request, const CommandOptions& options);
  [[nodiscard]] const Planner& planner() const { return context_.planner; }
  /// Pulses from where it stands to the plan's target.
  [[nodiscard]] std::int64_t way_of(const Plan& plan) const;

  Result<CommandPtr> submit(const Action& action, const CommandOptions& options);
  /// The newest stop; nullptr: there was none.
  [[nodiscard]] const CommandPtr& last_stop() const { return stopper_.machine().last(); }
  /// Everything that stands in the way of a request now: submit() would refuse it with the first that blocks
  /// (a repeat of an accepted request is never refused, though). Nothing: of motion in general. Only looks.
  [[nodiscard]] std::vector<Obstacle> explain(const std::optional<Action>& action,
                                              const CommandOptions& options) const;
  /// Halts the axis if `command` is being executed.
  Result<CommandPtr> cancel(const CommandPtr& command, TimePoint arrived = {});
  void lease_lost(const Error& cause) { lease_.lease_lost(cause); }
  [[nodiscard]] const Command* commanded_without_lease() const { return lease_.commanded_without_lease(); }
  [[nodiscard]] Result<void> check_lease(const Requester& requester) const;
  /// A flag outside changed (inhibit, lease): publish again.
  void refresh() { publisher_.publish(); }
  void bus_lost(Error cause) { connection_.bus_lost(std::move(cause)); }

  // For work on the drive beside motion: parameters, segments, memory (drive_operations.hpp).
  Result<std::shared_ptr<void>> begin_maintenance() { return work_.begin_maintenance(); }
  void set_absolute_segments(bool absolute) { work_.set_absolute_segments(absolute); }
  void reconfigure(const std::string& why, bool position_lost) {
    connection_.reconfigure(why, position_lost);
  }
  [[nodiscard]] const std::optional<DriveIdentity>& identity() const { return connection_.identity(); }
  [[nodiscard]] Drive& drive() { return *context_.drive; }
  [[nodiscard]] const DriveDescriptor& descriptor() const { return *context_.descriptor; }
  [[nodiscard]] const Scale& scale() const { return context_.scale; }
  [[nodiscard]] const AxisSettings& settings() const { return context_.settings; }
  [[nodiscard]] std::uint64_t eeprom_writes() const { return publisher_.eeprom_writes(); }
  [[nodiscard]] const UnknownOutcomes& unknown_starts() const { return motion_.follower().unknown_starts(); }
  [[nodiscard]] Result<void> check_online() const { return preconditions_.check_online(); }
  /// The drive's canary is another one: what is kept for a restart of the daemon has to know it.
  void memory_marked() { saved_.remember_position(); }
  /// The position is the drive's counter and the configured position at home, nothing else.
  [[nodiscard]] bool position_is_from_home() const;
  [[nodiscard]] bool at_rest() const { return execution_.at_rest(); }
  /// From a stop's request to its frame, by the bus budget; what takes longer is told once.
  void expect_stop_within(Duration bound) { stopper_.observed().expect_stop_within(bound); }
  /// Longest times seen, beside those of the bus budget.
  [[nodiscard]] const ObservedAxis& observed() const { return stopper_.observed().values(); }
  /// Thread: any.
  [[nodiscard]] const std::shared_ptr<AxisGate>& gate() const { return context_.gate; }
  /// Thread: any.
  [[nodiscard]] AxisSnapshotPtr snapshot() const { return context_.face->snapshot.load(); }
  /// What is left of it when it is gone. Thread: any.
  [[nodiscard]] const AxisFacePtr& face() const { return context_.face; }

 private:
  // A part may ask another for its state machine as soon as that stands above it here.
  AxisContext context_;
  Sequences sequences_;
  Shaft shaft_;
  PowerSequence power_;
  DriveConnection connection_;
  Stopper stopper_;
  SavedPosition saved_;
  DriftCheck drift_;
  Publisher publisher_;
  Execution execution_;
  Readings readings_;
  StateReader reader_;
  DriveWork work_;
  EarlierCommands earlier_;
  StartWait starts_;
  Preconditions preconditions_;
  MotionSequence motion_;
  HomingSequence homing_;
  Acceptance acceptance_;
  LeaseDuty lease_;
};

}  // namespace axisd
