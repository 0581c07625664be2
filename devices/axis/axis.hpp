// One axis: the vendor-free motion object (PLCopen Motion Control part 1). Its states: snapshot.hpp.
// A state is visible as soon as a command is accepted. Beside the state stands the link to the drive
// (offline, configuring, online). Every change that forbids motion raises the epoch of the gate first; what
// was prepared before is then never sent, and the sequence that prepared it ends by itself at its next step
// (superseded, not cancelled).
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/gate.hpp"
#include "buses/signal.hpp"
#include "buses/task.hpp"
#include "devices/axis/activity.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/axis_life.hpp"
#include "devices/axis/command_buffer.hpp"
#include "devices/axis/continuity.hpp"
#include "devices/axis/drift_watch.hpp"
#include "devices/axis/earlier_run.hpp"
#include "devices/axis/eeprom_budget.hpp"
#include "devices/axis/homing_machine.hpp"
#include "devices/axis/link_machine.hpp"
#include "devices/axis/observed_times.hpp"
#include "devices/axis/obstacles.hpp"
#include "devices/axis/poll_pace.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/speed_watch.hpp"
#include "devices/axis/standstill.hpp"
#include "devices/axis/stop_machine.hpp"
#include "devices/axis/unknown_outcomes.hpp"

namespace axisd {

/// Thread: core, except gate() and snapshot().
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
  [[nodiscard]] bool closed() const { return life_.ends() && sequences_ == 0; }

  // axis_reload.cpp: for another axis of the same name, or none, to take its place
  /// Why that cannot be now, all reasons, each with what to do; empty: nothing stands against it. Leases are
  /// not looked at. `energised`: may be, as what has changed is the daemon's alone.
  [[nodiscard]] std::vector<Error> check_exchange(bool energised) const;
  /// Refuses everything from now on (`reloading`) and ends as close() does: nothing of it is sent any more
  /// but what is on its way. `position_holds`: for what comes, too; else it has to be homed again.
  /// Precondition: check_exchange() found nothing.
  void retire(bool position_holds);
  /// From then on.
  [[nodiscard]] bool retired() const { return life_.retired(); }
  /// `on_lease_loss: disable` was not done yet.
  [[nodiscard]] bool owes_release() const { return power_.owes_release(); }
  /// Its drive answered when it was retired.
  [[nodiscard]] bool answered() const { return life_.answered(); }
  /// Keeps the axis from being exchanged while it lives. Errors: reloading.
  Result<std::shared_ptr<void>> use();
  /// A stop that was accepted for the axis before this one, and not executed.
  void take_stop(const StopRequest& request, const CommandOptions& options, CommandPtr command);

  /// The axis as a member of a group (member.hpp).
  class Member;
  /// What its part of a group move would be; nothing is begun yet. Errors: as of submit(); moving, busy (a
  /// member has to rest).
  Result<Plan> plan_member(const GroupMemberRequest& request, const CommandOptions& options);
  [[nodiscard]] const Planner& planner() const { return context_.planner; }
  /// Pulses from where it stands to the plan's target.
  [[nodiscard]] std::int64_t way_of(const Plan& plan) const {
    return plan.target.value().counter - shaft_.tracker().counter();
  }

  /// Accepts or refuses a request. What becomes of an accepted one is in its command.
  Result<CommandPtr> submit(const Action& action, const CommandOptions& options);
  /// Nobody holds it in Stopping.
  [[nodiscard]] bool unheld() const { return !stop_.held(); }
  /// The newest stop; nullptr: there was none.
  [[nodiscard]] const CommandPtr& last_stop() const { return stop_.last(); }
  /// Everything that stands in the way of a request now: submit() would refuse it with the first that blocks
  /// (a repeat of an accepted request is never refused, though). Nothing: of motion in general. Only looks.
  [[nodiscard]] std::vector<Obstacle> explain(const std::optional<Action>& action,
                                              const CommandOptions& options) const;
  /// Halts the axis if `command` is being executed.
  Result<CommandPtr> cancel(const CommandPtr& command, TimePoint arrived = {});
  /// The lease under which the axis was commanded is over, and the gate knows it: does what the
  /// configuration says (M16). Motion that has not started by then never does.
  void lease_lost(const Error& cause);
  /// What is being executed, if it was given without a lease and needs one where there is one; else nullptr.
  [[nodiscard]] const Command* commanded_without_lease() const;
  /// Errors: lease_required, lease_lost.
  [[nodiscard]] Result<void> check_lease(const Requester& requester) const;
  /// A flag outside changed (inhibit, lease): publish again.
  void refresh() { publish(); }
  /// The bus could not send for a while, however short, or a stop was not acknowledged: what the axis was
  /// doing ends, and a drive that may move gets a stop first (M4, M26).
  void bus_lost(Error cause);

  // For work on the drive beside motion: parameters, segments, memory (drive_operations.hpp).
  [[nodiscard]] Drive& drive() { return *context_.drive; }
  [[nodiscard]] const DriveDescriptor& descriptor() const { return *context_.descriptor; }
  [[nodiscard]] const Scale& scale() const { return context_.scale; }
  [[nodiscard]] const std::optional<DriveIdentity>& identity() const { return identity_; }
  [[nodiscard]] std::uint64_t eeprom_writes() const { return eeprom_writes_; }
  /// Since start.
  [[nodiscard]] const UnknownOutcomes& unknown_starts() const { return unknown_starts_; }
  /// Errors: offline, configuring.
  [[nodiscard]] Result<void> check_online() const;
  /// Keeps commands other than stops away from the drive while it lives. Errors: moving, fault (the power
  /// stage is on), busy, and those of check_online().
  Result<std::shared_ptr<void>> begin_maintenance();
  /// The drive's canary is another one: what is kept for a restart of the daemon has to know it.
  void memory_marked() { remember_position(); }
  /// The drive's segment table holds targets that count from its own zero.
  void set_absolute_segments(bool absolute) { absolute_segments_ = absolute; }
  /// The position is the drive's counter and the configured position at home, nothing else.
  [[nodiscard]] bool position_is_from_home() const {
    return context_.is_from_home(shaft_.tracker().offset());
  }
  /// The drive's memory is no longer what configure() made it: applied again. `position_lost`: the counter or
  /// its meaning, too.
  void reconfigure(const std::string& why, bool position_lost);
  [[nodiscard]] const AxisSettings& settings() const { return context_.settings; }
  /// Nothing moves, as far as is known, and no stop is under way.
  [[nodiscard]] bool at_rest() const;
  /// From a stop's request to its frame, by the bus budget; what takes longer is told once.
  void expect_stop_within(Duration bound) { observed_.expect_stop_within(bound); }
  /// Longest times seen, beside those of the bus budget.
  [[nodiscard]] const ObservedAxis& observed() const { return observed_.values(); }
  /// Thread: any.
  [[nodiscard]] const std::shared_ptr<AxisGate>& gate() const { return context_.gate; }
  /// Thread: any.
  [[nodiscard]] AxisSnapshotPtr snapshot() const { return context_.face->snapshot.load(); }
  /// What is left of it when it is gone. Thread: any.
  [[nodiscard]] const AxisFacePtr& face() const { return context_.face; }

 private:
  class Chain;  ///< chain.hpp

  /// Runs a sequence and counts it while it lives.
  void launch(Task<> sequence, const char* name);

  // axis_link.cpp: the way to the drive
  Task<> run();
  Task<> connect();
  /// `again`: the attempt before was in vain.
  Task<Result<void>> try_connect(TransactionClass contact, bool again);
  Task<Result<void>> settle_found_motion();
  [[nodiscard]] bool may_have_been_stopped_abruptly() const;
  [[nodiscard]] std::vector<std::int64_t> unseen_ends() const;
  [[nodiscard]] bool found_by_terminal() const;
  Task<Result<void>> prove_or_configure();
  [[nodiscard]] std::optional<OffsetRecord> restorable_position();
  void void_saved_position();
  Task<Result<void>> configure(std::optional<OffsetRecord> restorable);
  Task<> wait_for_port();
  void go_offline(const Error& cause);
  void on_reboot(const Error& cause);

  // axis_poll.cpp: its state, again and again
  struct Polling {
    int failures = 0;    ///< in a row
    bool woken = false;  ///< in place of a sample
    /// Continuity was to be proven then beside a sample, and was not yet.
    TimePoint proof_due = TimePoint::max();
    bool repeated = false;  ///< the sample was asked for later than by the poll loop
  };
  Task<> poll();
  [[nodiscard]] TimePoint next_poll(const Polling& polling, TimePoint began) const;
  Task<bool> poll_once(Polling& polling);
  [[nodiscard]] Error not_heard() const;
  Task<Result<std::optional<DriveSample>>> next_sample(Polling& polling);
  bool seen_again(const DriveSample& sample);
  [[nodiscard]] bool only_watches() const;
  void wake();
  void watch_continuity();
  Task<Result<void>> prove_continuity(TransactionClass priority);
  /// Polls as fast as the bus can, while the axis is busy, from `from` on and for `longest` at most.
  void poll_fast(TimePoint from, Duration longest);
  void poll_for_end(TimePoint from, Duration longest);
  void keep_quiet(TimePoint until);
  [[nodiscard]] bool keeps_quiet() const;

  // axis_drift.cpp
  [[nodiscard]] bool drift_is_next() const;
  void look_for_drift();
  Task<> compare();
  void give_up_comparison();
  Task<Result<void>> check_for_drift(TransactionOptions options);
  void set_drift(const std::string& text);

  // axis_journal.cpp: commands over restarts of the daemon
  void take_over();
  void owe_stop_of_motion();
  Task<Result<void>> settle_earlier();
  void settle_positions_set();
  void settle_as(const Unsettled& earlier, bool continuous);
  void settle_as_unknown(const Unsettled& earlier, std::string_view why);
  void give_up_settling();
  [[nodiscard]] Error earlier_error(const Unsettled& earlier, std::string_view what, Outcome outcome) const;
  [[nodiscard]] SendingNote note_of(const Activity& activity, std::vector<ContinuityMark> marks) const;
  Task<bool> noted(ActivityPtr activity, SendingNote note);
  [[nodiscard]] Result<void> check_journal() const;
  Task<Result<void>> forget_saved_position();
  void correct_saved_position();

  // axis.cpp: what the samples mean
  void on_sample(const DriveSample& sample);
  void on_alarm(const DriveSample& sample);
  void on_released(const DriveSample& sample, bool enabled_before);
  void on_unexplained_motion(const DriveSample& sample, const std::optional<DriveSample>& before);
  void publish();
  void show_position(AxisSnapshot& shown) const;
  void show_sample(AxisSnapshot& shown) const;
  bool note_eeprom_writes();
  [[nodiscard]] Result<void> permit_saves(std::uint64_t saves);
  void tell_edges(const DriveSample& before, const DriveSample& now);
  void tell_changes(const AxisSnapshot& before, const AxisSnapshot& now);
  [[nodiscard]] AxisState state() const;
  [[nodiscard]] MotionCause motion_cause() const;
  [[nodiscard]] bool busy() const;
  /// Busy, and not only because its start bides its time.
  [[nodiscard]] bool works() const;
  /// Its start waits for those of others, or for its moment: its drive rests until then.
  [[nodiscard]] bool bides() const;
  [[nodiscard]] ShaftWatch::Facts shaft_facts() const;
  void lose_trust();
  void remember_position();

  // axis_requests.cpp: acceptance
  [[nodiscard]] TimePoint held_until(const CommandOptions& options, Duration hold) const;
  [[nodiscard]] bool holds() const;
  void renew_hold(const CommandPtr& command, const CommandOptions& options);
  template <class Request>
  [[nodiscard]] Result<void> permit(const Request& request, const CommandOptions& options) const;
  Result<CommandPtr> accept(const EnableRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const DisableRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const HomeRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const MoveAbsoluteRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const MoveRelativeRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const MoveVelocityRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const JogRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const StopRequest& request, const CommandOptions& options);
  void execute_stop(const StopRequest& request, const CommandOptions& options, CommandPtr command);
  Result<CommandPtr> accept(const ResetRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const SetPositionRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const GroupMemberRequest& request, const CommandOptions& options) const;
  [[nodiscard]] Result<Plan> plan_move(const PositionTracker::Target& target, const MotionValues& with) const;
  [[nodiscard]] Result<Plan> plan_velocity(double velocity, const MotionValues& with, bool jog) const;
  /// Where a motion at a velocity ends if nobody ends it; nullopt: nowhere. Errors: soft_limit, not_trusted.
  [[nodiscard]] Result<std::optional<PositionTracker::Target>> end_of_velocity(bool positive, bool jog) const;
  [[nodiscard]] bool renews(const Action& action, const CommandOptions& options) const;
  CommandPtr renew(const Action& action, const CommandOptions& options, Duration hold);
  ActivityPtr begin(const Action& action, const CommandOptions& options, AxisState state, Plan plan);

  // axis_buffer.cpp: commands that wait for the one before them
  Result<CommandPtr> accept_buffered(const Action& action, const CommandOptions& options);
  [[nodiscard]] std::optional<PositionTracker> expected_end() const;
  [[nodiscard]] Result<Plan> plan_behind(const Action& action, const PositionTracker& from) const;
  void start_next();
  void drop_buffer(const Error& cause);
  void end_waiting(const std::deque<Buffered>& commands, const Error& cause);
  bool cancel_buffered(const CommandPtr& command);

  // axis_preconditions.cpp: what does not hold of what each request needs, in the order of refusals
  void look_at(const EnableRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const DisableRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const HomeRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const MoveAbsoluteRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const MoveRelativeRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const MoveVelocityRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const JogRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const StopRequest&, const CommandOptions&, Obstacles&) const {}  ///< never refused
  void look_at(const ResetRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const SetPositionRequest& request, const CommandOptions& options, Obstacles& found) const;
  /// axis_buffer.cpp: of a request that may have to wait for others.
  void look_at_buffered(const Action& action, CommandOptions options, Obstacles& found) const;
  void look_at(const GroupMemberRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at_options(const CommandOptions& options, Obstacles& found) const;
  void look_at_holds(const CommandOptions& options, Obstacles& found) const;
  void look_at_link(Obstacles& found) const;
  void look_at_fault(Obstacles& found) const;
  void look_at_maintenance(Obstacles& found) const;
  /// Of everything but stops and Reset; StopAll does not forbid what moves nothing.
  void look_at_readiness(const CommandOptions& options, Obstacles& found) const;
  /// Of every motion.
  void look_at_motion(const CommandOptions& options, Obstacles& found) const;
  void look_at_direction(bool positive, Obstacles& found) const;
  void look_at_target(const PositionTracker::Target& target, Obstacles& found) const;
  void look_at_velocity(double velocity, const MotionValues& with, bool jog, Obstacles& found) const;
  void look_at_holding_terminals(std::span<const std::string_view> functions, Obstacles& found) const;
  void look_at_present_motion(Obstacles& found) const;
  void look_at_line(Obstacles& found) const;
  void look_at_what_forbids_some(Obstacles& found) const;

  // axis_motion.cpp: sequences; axis_rezero.cpp: make_room()
  [[nodiscard]] bool current(const Activity& activity) const;
  [[nodiscard]] MotionGuard guard(const Activity& activity) const;
  Task<bool> reach_standstill(ActivityPtr activity);
  Task<> run_move(ActivityPtr activity);
  Task<> run_velocity(ActivityPtr activity);
  Task<Result<void>> make_room(ActivityPtr activity);
  Task<bool> counter_shows_zero();
  Task<bool> positioned(ActivityPtr activity);
  bool may_start(Activity& activity);
  Task<bool> take_turn(ActivityPtr activity);

  // axis_aim.cpp: where a motion starts from, and where it goes (M19)
  Task<Result<void>> look(Duration oldest);
  Result<void> aim(Activity& activity);
  [[nodiscard]] Result<void> check_direction(const Activity& activity,
                                             const PositionTracker::Target& target) const;
  [[nodiscard]] Result<void> check_way(const Activity& activity) const;
  Task<std::optional<Result<void>>> start_unmoved(ActivityPtr activity);

  // axis_lateness.cpp: nothing starts late (M31)
  void bound_start(const ActivityPtr& activity, bool waited, bool halting);
  void start_by(const ActivityPtr& activity, TimePoint since, TimePoint latest);
  [[nodiscard]] Error late(const Activity& activity, Error cause) const;
  void end_late(Activity& activity);
  [[nodiscard]] bool too_late(const CommandOptions& options) const;

  void end_unsent(Activity& activity, Error cause);
  Task<bool> started(ActivityPtr activity, Result<void> result, std::int64_t base, TimePoint since);

  // axis_follow.cpp: from the start to the end
  Task<bool> read_back(ActivityPtr activity, Error cause, std::int64_t base, TimePoint since);
  [[nodiscard]] std::optional<StartReadback::Reading> readback_of(std::int64_t base) const;
  void expect_end(const Plan& plan, std::int64_t base, TimePoint since);
  [[nodiscard]] MotionMachine followed(const Plan& plan, std::int64_t base, TimePoint since) const;
  [[nodiscard]] MotionMachine::Reading reading_of(const Plan& plan, std::int64_t base) const;
  Task<bool> follow(ActivityPtr activity, std::int64_t base, TimePoint since);
  void end_hold(Activity& activity);
  void end_motion(Activity& activity, MotionMachine::State state);
  void end_at_rest(Activity& activity);
  [[nodiscard]] bool shows(const Plan& plan, std::int64_t base) const;
  [[nodiscard]] bool held_back(const Plan& plan) const;
  [[nodiscard]] bool is_astray(const Plan& plan, std::int64_t base) const;
  Task<std::optional<TimePoint>> arrived(ActivityPtr activity, std::int64_t base, TimePoint since);
  Task<bool> is_no_reboot(ActivityPtr activity);
  Task<bool> still_there(ActivityPtr activity);
  Task<bool> proven_continuous(ActivityPtr activity);

  Task<Result<DriveSample>> sample_after(TimePoint since, Duration patience);
  Task<Result<void>> journal_offset(std::int64_t offset, PositionTrust trust);
  [[nodiscard]] OffsetRecord offset_record(std::int64_t offset, PositionTrust trust) const;
  ActivityPtr take_activity();
  void finish(Activity& activity, const std::function<void(CommandRecord&)>& how);
  void fail_with_stop(Activity& activity, Error cause);
  void abort_at_rest(Activity& activity, Error cause);
  void enter_error_stop(const Error& cause);

  // axis_speed.cpp: ends what is under way as a fault where it is far faster than told. True: it has.
  bool watch_speed(SpeedWatch::Event event);

  // axis_group.cpp
  Task<> run_member(ActivityPtr activity, std::int64_t base, TimePoint since, bool there,
                    std::shared_ptr<std::optional<TimePoint>> arrival);

  // axis_power.cpp: sequences that move nothing
  void on_turned_by_power(const Error& cause);
  Task<> run_enable(ActivityPtr activity);
  void end_enable(Activity& activity, EnableMachine::State state, std::optional<Error> unanswered);
  Task<> run_disable(ActivityPtr activity);
  Task<> run_reset(ActivityPtr activity);
  Task<> run_set_position(ActivityPtr activity);

  // axis_homing.cpp
  Task<> run_home(ActivityPtr activity);
  Task<> declare_home(ActivityPtr activity);
  Task<bool> back_off(ActivityPtr activity);
  [[nodiscard]] HomingMachine followed_homing(TimePoint since, bool homed_before) const;
  Task<bool> follow_homing(ActivityPtr activity, TimePoint since, bool homed_before);
  [[nodiscard]] Error not_homed(HomingMachine::State state) const;
  [[nodiscard]] Error reached_switch() const;
  [[nodiscard]] std::int64_t counter_at_home() const;

  // axis_lease.cpp: lease_lost() and what stands beside it
  void release_as_owed();
  void give_up_release(const Error& cause);

  // axis_stop.cpp
  /// Nothing of motion that was prepared so far is sent any more.
  void revoke_motion();
  void supersede(const Error& cause);
  /// Before the activity ends: the stop that follows shows what it ends.
  void note_motion_to_stop();
  void begin_stop(StopKind kind, CommandPtr command);
  Task<> run_stop();
  void note_stop_sent(TimePoint end, bool answered);
  Task<Result<void>> stop_and_confirm();
  [[nodiscard]] Error not_stopped(StopMachine::Step step, const Result<void>& sent) const;
  Task<RestVerdict> rests_in_time(bool acknowledged, TimePoint since);
  [[nodiscard]] Duration braking_time(StopKind kind) const;
  Task<RestVerdict> standstill_by(bool acknowledged, TimePoint deadline);
  Task<bool> standstill_unpolled(TimePoint deadline, bool of_stop);
  void leave_running(const Activity& activity);

  AxisContext context_;
  Shaft shaft_;

  LinkMachine link_;
  std::optional<DriveIdentity> identity_;
  Continuity continuity_;
  Clock::Timer continuity_watch_;
  TimePoint had_turn_{};  ///< the last time that it was its turn to start
  EarlierRun earlier_;
  DriftWatch drift_;
  std::shared_ptr<AxisGate> comparison_gate_ = std::make_shared<AxisGate>();  ///< of what compare() reads
  PollPace pace_;
  std::weak_ptr<void> maintenance_;                       ///< of begin_maintenance()
  std::shared_ptr<int> users_ = std::make_shared<int>();  ///< of use()
  std::uint64_t eeprom_writes_ = 0;                       ///< registers
  EepromBudget eeprom_budget_;
  UnknownOutcomes unknown_starts_;
  bool absolute_segments_ = false;

  AxisLife life_;
  StopMachine stop_;
  PowerMachine power_;

  Signal wake_;     ///< the poll loop has something to look at
  Signal stopped_;  ///< the stop sequence ended
  int chains_ = 0;
  int sequences_ = 0;               ///< coroutines that still run
  std::uint64_t accept_epoch_ = 0;  ///< of the request being accepted: a stop raised meanwhile makes it old

  ActivityPtr activity_;
  CommandBuffer buffer_;
  ObservedTimes observed_;
  SpeedWatch speed_watch_;
  std::optional<Error> fault_;
  boost::shared_ptr<AxisSnapshot> shown_;  ///< the last snapshot
  std::uint64_t revision_ = 0;
  std::uint64_t sampled_revision_ = 0;  ///< of the snapshot after the last sample
};

}  // namespace axisd
