// The steps of a commissioning, carried out with the operator.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "api/axisctl/commission/axis_access.hpp"
#include "api/axisctl/commission/event_feed.hpp"
#include "api/axisctl/commission/operator.hpp"
#include "api/axisctl/commission/plan.hpp"
#include "api/axisctl/commission/verdict.hpp"

namespace axisd::axisctl::commission {

struct Wishes {
  std::optional<double> velocity, distance;                      ///< user units; nothing: default_motion()
  std::chrono::milliseconds patience = std::chrono::minutes(1);  ///< for a hand at a switch
};

/// Ends a step, with this verdict.
class StepEnd : public std::runtime_error {
 public:
  explicit StepEnd(Judgement judgement)
      : std::runtime_error(judgement.reason), judgement_(std::move(judgement)) {}
  StepEnd(Verdict verdict, std::string reason, std::string remedy = {})
      : StepEnd(Judgement{.verdict = verdict, .reason = std::move(reason), .remedy = std::move(remedy)}) {}
  [[nodiscard]] const Judgement& judgement() const { return judgement_; }

 private:
  Judgement judgement_;
};

/// Moves nothing that the operator has not permitted just before. Each motion is a relative move: it ends
/// where it was said, whatever becomes of this program, the daemon or the cable. Thread: one.
class Procedure {
 public:
  /// `keep` is called after each step, with the record as it is.
  Procedure(AxisAccess& axis, Operator& person, Record& record, Wishes wishes, std::function<void()> keep)
      : axis_(axis),
        person_(person),
        dialogue_(person),
        record_(record),
        wishes_(wishes),
        keep_(std::move(keep)) {}

  /// Every step. Throws Ended, Failure (the daemon cannot be reached).
  void run();

 private:
  /// What a motion was, until it ended.
  struct Run {
    v1::Command command;                 ///< as it ended, or as it was when `watch` had seen enough
    std::vector<v1::AxisState> samples;  ///< positions are unwrapped
  };

  void read_settings();
  void carry_out(const StepPlan& plan, Step& step);
  /// One attempt; a step that was ended, or refused by the daemon, is judged, too.
  Judgement judged_attempt(const StepPlan& plan, Step& step);
  Judgement attempt(const StepPlan& plan, Step& step);

  Judgement identity(Step& step);
  void show_identity(const v1::AxisState& state, const v1::GetInfoResponse& info,
                     const v1::GetDriveResponse& drive);
  void plan_motion();

  // Hands at the machine, the power stage is off.
  Judgement release(Step& step);
  Judgement actuate(const StepPlan& plan, Step& step);

  // The power stage is on.
  Judgement enable(Step& step);
  Judgement jog(const StepPlan& plan, Step& step);
  /// By the time of a move from `start`: before it, nothing faster than that is done.
  Judgement prove_speed(const v1::AxisState& start, const Run& run, double distance, Step& step);
  [[nodiscard]] Judgement one_frame() const;
  Judgement limit(const StepPlan& plan, Step& step);
  /// Stops a move on which another limit switch became active.
  void end_by_stop(Step& step, LimitObservation& seen);
  void leave_limit(const StepPlan& plan, Step& step, LimitObservation& seen);
  Judgement stop(Step& step);
  Judgement home(Step& step);
  Judgement soft_limits();
  Judgement disable(Step& step);

  /// Throws StepEnd (skipped) unless the operator says yes.
  void permit(const std::string& question, Step& step);
  /// Throws Ended if the lease is over: somebody else may move the axis from now on.
  void check_lease() const;
  /// Throws StepEnd if the daemon would refuse the move.
  void check_move(double distance, double velocity);
  /// "It moves +10 mm at 5 mm/s (2.2 s), from 0 mm to 10 mm".
  std::string move_text(double distance, double velocity, const v1::AxisState& from) const;
  /// Follows a command until it has ended or `watch` returns false. A line of the operator stops the axis and
  /// ends the step (StepEnd).
  Run follow(v1::Command command, Step& step, const std::function<bool(const v1::AxisState&)>& watch = {});
  /// The axis's state once it neither moves nor stops; after some seconds as it is.
  v1::AxisState settled();
  /// Waits for the operator's hand. False: it did not come in time. Throws StepEnd if the operator skips.
  bool wait_until(const std::function<bool()>& condition, Step& step);
  [[nodiscard]] bool is_active(const std::string& terminal);
  /// Until what moved together with the first terminal has been read, too: a hand's other contacts.
  void wait_for_company(Step& step);
  [[nodiscard]] ExpectedInput expected(const StepPlan& plan) const;
  [[nodiscard]] std::string with_sign(double value, const std::string& unit) const;

  AxisAccess& axis_;
  Operator& person_;
  Dialogue dialogue_;
  Record& record_;
  Wishes wishes_;
  std::function<void()> keep_;
  std::optional<Settings> settings_;
  std::vector<StepPlan> steps_;
  VelocityRange velocities_;
  Motion motion_;
};

}  // namespace axisd::axisctl::commission
