// One axis's part of a group move (M22): everything is prepared and looked at before the first start frame.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "devices/axis/axis.hpp"

namespace axisd {

/// Its command is entered when this is made, and ends exactly once, whatever becomes of this. The group calls
/// the steps in the order in which they stand here; each fails where the axis was told something else
/// meanwhile. Does not outlive its axis. Thread: core.
class Axis::Member {
 public:
  /// `plan`: of plan_member(), in the same handler.
  Member(Axis& axis, const GroupMemberRequest& request, const CommandOptions& options, Plan plan);
  ~Member();
  Member(const Member&) = delete;

  [[nodiscard]] Axis& axis() const { return *axis_; }
  [[nodiscard]] const CommandPtr& command() const { return activity_->command; }
  [[nodiscard]] const Plan& plan() const { return activity_->plan; }
  /// What decides at each bind whether the axis may still move, without those of the others.
  [[nodiscard]] MotionGuard guard() const { return axis_->execution_.guard(*activity_); }
  /// Nothing forbids its start, as far as is known without asking the drive.
  [[nodiscard]] bool ready() const;

  /// The members before it are loaded and looked at first: its start may come so much later (M31).
  void wait_for_others(Duration more);
  /// Nothing goes out any more where one of `all` forbids it, nor after `not_after`.
  void tie(std::shared_ptr<const std::vector<MotionGuard>> all, TimePoint not_after);
  /// Where its start has to wait for its turn; nullptr: nowhere.
  [[nodiscard]] StartTurns* start_turns() const { return axis_->context_.env.bus->start_turns(); }
  /// Whether it waits there now.
  void waits_for_turn(bool waits);
  /// Makes room at the drive, and the move known to a restart of the daemon, before anything of it is sent.
  Task<Result<void>> note();
  /// Writes all but the trigger. The axis is not polled from here on until follow() or the end.
  Task<Result<void>> load();
  /// Reads the drive's state, now, and judges it.
  Task<Result<void>> look();
  /// The target is where the axis stands: it needs no start.
  [[nodiscard]] bool there() const { return there_; }
  /// How long the move takes from its start, by the position that look() found.
  [[nodiscard]] Duration predicted() const { return there_ ? Duration{} : activity_->plan.predicted; }
  /// Waits for a SYNC, together with the others of its network; nullptr: it has a trigger of its own.
  [[nodiscard]] PreparedMove* prepared() const { return prepared_.get(); }
  /// Why it does not start by a SYNC; empty: it does, or it needs no start.
  [[nodiscard]] const std::string& start_note() const { return start_note_; }
  Task<Result<void>> verify();
  /// Gives the drive back until take_up(): it is read as any other, and nothing of the move stands in it that
  /// a start could use. Not taken up by `expires`, it ends.
  void set_down(TimePoint expires);
  /// Its moment is near: it is loaded, looked at and verified once more, and starts by `latest`.
  void take_up(TimePoint latest);
  /// As Bus::hold().
  [[nodiscard]] std::shared_ptr<void> hold_bus() const { return axis_->context_.env.bus->hold(); }
  /// From now on its start may have been sent.
  void about_to_start();
  /// It is known that it was not.
  void not_started();
  /// Starts that by SYNC are bound until then: shortly after a reading, where something else could have
  /// turned the shaft; max() elsewhere. Errors: of look().
  Task<Result<TimePoint>> look_again();
  /// Not sent after `not_after`: expired.
  Task<Result<TimePoint>> trigger(TimePoint not_after);
  /// The start was executed.
  void started(TimePoint at);
  /// How long ago its motion was last seen, or begun; 0 where it is none of these.
  [[nodiscard]] Duration unseen_for() const;
  /// Reads the drive while others are still being started: a fault then ends the command, as it does later.
  Task<Result<void>> look_after();
  /// All members were started: watches the motion until it ends.
  void follow();
  /// What the drive has to be told after its start.
  Task<> follow_up();

  [[nodiscard]] bool may_run() const { return activity_->start.may_run(); }
  [[nodiscard]] const std::optional<TimePoint>& started_at() const { return started_at_; }
  /// When it was first seen at rest at its target.
  [[nodiscard]] const std::optional<TimePoint>& arrived_at() const { return *arrived_; }
  /// Ends the command by an error of its own; a drive that may run gets a stop. Nothing where it has ended.
  void end_failed(Error cause);
  /// What it holds of its drive is given up: the axis is going away. Precondition: its command has ended.
  void let_go();
  /// Ends it because another member failed, the same way.
  void end_aborted(Error cause);

 private:
  [[nodiscard]] bool current() const { return axis_->execution_.current(*activity_); }
  [[nodiscard]] Error gone() const;
  [[nodiscard]] MotionGuard tied() const;
  Task<Result<DriveSample>> read_state();
  [[nodiscard]] Result<void> judge(const DriveSample& sample) const;
  void aim();
  void end(Error cause, bool aborted);

  Axis* axis_;
  ActivityPtr activity_;
  std::shared_ptr<const std::vector<MotionGuard>> all_;
  TimePoint not_after_ = TimePoint::max();
  std::unique_ptr<StateReader::Chain> chain_;
  std::unique_ptr<PreparedMove> prepared_;
  std::unique_ptr<LoadedMove> loaded_;
  std::string start_note_;
  std::int64_t base_ = 0;
  bool there_ = false;
  std::optional<TimePoint> started_at_;
  std::shared_ptr<std::optional<TimePoint>> arrived_ = std::make_shared<std::optional<TimePoint>>();
};

}  // namespace axisd
