// An axis as a member of a group.
#include "devices/axis/member.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace axisd {

namespace {

constexpr int attempts = 3;

}  // namespace

Axis::Member::Member(Axis& axis, const GroupMemberRequest& request, const CommandOptions& options, Plan plan)
    : axis_(&axis),
      activity_(axis.acceptance_.begin(request, options, AxisState::synchronized_motion, std::move(plan))) {}

Axis::Member::~Member() = default;

void Axis::Member::let_go() {
  chain_.reset();
  prepared_.reset();
  loaded_.reset();
}

bool Axis::Member::ready() const {
  return current() && axis_->connection_.link().online() && !axis_->connection_.link().bus_loss() &&
         axis_->context_.env.bus->port().open && !axis_->execution_.fault() &&
         !axis_->context_.drive->in_trouble() &&
         may_send_alone(guard(), axis_->context_.env.clock->now()) == Verdict::send;
}

void Axis::Member::wait_for_others(Duration more) {
  const auto latest = std::min(activity_->start_by + more, activity_->options.call_deadline);
  axis_->starts_.start_by(activity_, activity_->waits_since, latest);
}

void Axis::Member::waits_for_turn(bool waits) {
  waits ? activity_->start.queue() : activity_->start.has_turn();
  if (!waits) axis_->starts_.note_turn();
}

void Axis::Member::tie(std::shared_ptr<const std::vector<MotionGuard>> all, TimePoint not_after) {
  all_ = std::move(all);
  not_after_ = not_after;
}

MotionGuard Axis::Member::tied() const {
  auto guard = this->guard();
  guard.not_after = std::min(guard.not_after, not_after_);
  guard.with = all_;
  return guard;
}

/// What ended it, if it was not this. Its command says why.
Error Axis::Member::gone() const {
  const auto& command = activity_->command->value();
  if (command.cause) return *command.cause;
  const auto verdict = may_send_alone(guard(), axis_->context_.env.clock->now());
  if (verdict == Verdict::lease_lost)
    return axis_->context_.error(Reason::lease_lost, "the lease is over", "acquire a lease again");
  if (verdict == Verdict::expired && axis_->context_.env.clock->now() > activity_->start_by)
    return axis_->starts_.late(*activity_, {});
  if (verdict == Verdict::expired)
    return axis_->context_.error(Reason::expired, "the request's validity has passed", "repeat it");
  if (axis_->connection_.link().bus_loss()) return *axis_->connection_.link().bus_loss();
  if (!axis_->context_.env.bus->port().open)
    return axis_->context_.error(Reason::bus_down, "the port was lost before the start", "check the adapter");
  return axis_->context_.error(Reason::superseded, "a stop came before the start");
}

/// Waits for the disk; the axis is looked after meanwhile.
Task<Result<void>> Axis::Member::note() {
  auto& axis = *axis_;
  if (!ready()) co_return axisd::fail(gone());
  if (auto seen = co_await axis.reader_.look(axis.context_.settings.reboot_guard); !seen) co_return seen;
  if (!ready()) co_return axisd::fail(gone());
  if (auto aimed = axis.motion_.aim().aim(*activity_); !aimed) co_return aimed;
  if (auto room = co_await axis.motion_.aim().make_room(activity_); !room) co_return room;
  if (!ready()) co_return axisd::fail(gone());
  const auto profile = profile_of(activity_->plan);
  if (!co_await axis.starts_.noted(
          activity_, axis.starts_.note_of(*activity_, axis.context_.drive->marks_until(profile))))
    co_return axisd::fail(gone());
  co_return Result<void>{};
}

Task<Result<void>> Axis::Member::load() {
  auto& axis = *axis_;
  if (!ready()) co_return axisd::fail(gone());
  chain_ = std::make_unique<StateReader::Chain>(axis.reader_);
  aim();
  if (there_) co_return Result<void>{};
  const auto profile = profile_of(activity_->plan);
  auto prepared = co_await axis.context_.drive->prepare_move(profile, tied());
  if (prepared) {
    prepared_ = std::move(*prepared);
    co_return Result<void>{};
  }
  if (prepared.error().reason != Reason::not_supported) co_return axisd::fail(prepared.error());
  start_note_ = axis.context_.drive->no_common_start();
  auto loaded = co_await axis.context_.drive->load_move(profile, tied());
  if (!loaded) co_return axisd::fail(loaded.error());
  loaded_ = std::move(*loaded);
  co_return Result<void>{};
}

/// From where it stands; a member that was there when it was loaded stays so.
void Axis::Member::aim() {
  auto& plan = activity_->plan;
  base_ = axis_->shaft_.tracker().counter();
  const auto distance = plan.target->counter - base_;
  there_ = axis_->shaft_.tracker().rests_at(*plan.target) ||
           (there_ && std::abs(distance) <= axis_->context_.drive->position_window());
  plan.positive = (distance >= 0) != axis_->context_.settings.scale.invert;
  plan.predicted = axis_->context_.planner.duration(plan, distance);
}

Task<Result<DriveSample>> Axis::Member::read_state() {
  for (int attempt = 1;; ++attempt) {
    auto sample = co_await axis_->context_.drive->read_state(TransactionClass::motion);
    if (sample || sample.error().reason != Reason::no_reply || attempt == attempts) {
      if (!sample) sample.error().outcome = Outcome::not_executed;  // only read
      co_return sample;
    }
  }
}

Task<Result<void>> Axis::Member::look() {
  const auto sample = co_await read_state();
  if (!sample) co_return axisd::fail(sample.error());
  axis_->readings_.on_sample(*sample);
  if (!ready()) co_return axisd::fail(gone());
  const bool was_there = there_;
  aim();
  if (was_there && !there_)
    co_return axisd::fail(axis_->context_.error(Reason::moving, "the axis left its position before the start",
                                                "repeat the move"));
  if (auto way = axis_->motion_.aim().check_way(*activity_); !way) co_return way;
  co_return judge(*sample);
}

Result<void> Axis::Member::judge(const DriveSample& sample) const {
  const auto& axis = *axis_;
  if (!sample.enabled)
    return axisd::fail(
        axis.context_.error(Reason::disabled, "the power stage is off", "enable the axis first"));
  if (sample.moving || sample.mode != DriveMode::positioning || axis.shaft_.terminal_motion().moves())
    return axisd::fail(
        axis.context_.error(Reason::moving, "the drive moves by itself", "check its terminals"));
  if (axis.context_.terminals.start_active(sample))
    return axisd::fail(axis.context_.error(Reason::moving, "a terminal that starts motion is active",
                                           "check the terminals"));
  if (activity_->plan.trusted && axis.shaft_.tracker().trust() == PositionTrust::unknown)
    return axisd::fail(axis.context_.error(Reason::not_trusted,
                                           "the position was lost before the move could start",
                                           "home the axis, or set its position"));
  if (!there_ && axis.shaft_.limit_active(activity_->plan.positive))
    return axisd::fail(axis.context_.direction_blocked(activity_->plan.positive));
  return {};
}

Task<Result<void>> Axis::Member::verify() {
  if (!loaded_ || there_) co_return Result<void>{};
  auto verified = co_await loaded_->verify();
  if (verified) axis_->reader_.continuity().proven(axis_->context_.env.clock->now());
  co_return verified;
}

void Axis::Member::set_down(TimePoint expires) {
  prepared_.reset();
  loaded_.reset();
  chain_.reset();
  activity_->start.set_down();
  axis_->starts_.start_by(activity_, axis_->context_.env.clock->now(), expires);
}

void Axis::Member::take_up(TimePoint latest) {
  activity_->start.take_up();
  axis_->starts_.start_by(activity_, axis_->context_.env.clock->now(), latest);
}

/// Where something else could have turned the shaft meanwhile: looks once more, right before the trigger.
Task<Result<TimePoint>> Axis::Member::look_again() {
  if (!axis_->context_.may_move_by_itself()) co_return TimePoint::max();
  if (auto seen = co_await look(); !seen) co_return axisd::fail(seen.error());
  if (there_)
    co_return axisd::fail(
        axis_->context_.error(Reason::moving, "the shaft was moved before the start", "repeat the move"));
  // The SYNC comes up to a period later.
  const auto guard = axis_->context_.settings.reboot_guard;
  co_return axis_->shaft_.sample()->asked_at + (prepared_ ? guard / 2 : guard);
}

Task<Result<TimePoint>> Axis::Member::trigger(TimePoint not_after) {
  for (int attempt = 1;; ++attempt) {
    const auto seen_until = co_await look_again();
    if (!seen_until) co_return seen_until;
    activity_->number =
        axis_->stopper_.machine().unseen_start().sending(base_, axis_->context_.env.clock->now());
    auto triggered = co_await loaded_->trigger(std::min(*seen_until, not_after));
    const bool grown_old = !triggered && triggered.error().reason == Reason::expired &&
                           axis_->context_.env.clock->now() < std::min(tied().not_after, not_after);
    if (!grown_old || attempt == attempts) co_return triggered;
  }
}

void Axis::Member::about_to_start() {
  activity_->start.about_to_start();
  activity_->number =
      axis_->stopper_.machine().unseen_start().sending(base_, axis_->context_.env.clock->now());
}

void Axis::Member::not_started() {
  activity_->start.not_started();
  axis_->stopper_.machine().unseen_start().not_sent(activity_->number);
}

void Axis::Member::started(TimePoint at) {
  axis_->stopper_.machine().unseen_start().sent(activity_->number, axis_->context_.env.clock->now());
  started_at_ = at;
  activity_->start.begun();
  axis_->readings_.watch_speed(SpeedWatch::Event::begun);
  axis_->reader_.continuity().proven(axis_->context_.env.clock->now());  // the canary was part of its start
  axis_->shaft_.tracker().forget_base();
  activity_->command->activate();
  axis_->publisher_.publish();
}

Duration Axis::Member::unseen_for() const {
  if (!started_at_ || !current()) return {};
  const auto seen =
      axis_->shaft_.sample() ? std::max(*started_at_, axis_->shaft_.sample()->measured_at) : *started_at_;
  return axis_->context_.env.clock->now() - seen;
}

Task<Result<void>> Axis::Member::look_after() {
  // As often as polling would.
  if (axis_->reader_.continuity().state(axis_->context_.env.clock->now()) >= Continuity::State::due) {
    const auto proof = co_await axis_->reader_.prove_continuity(TransactionClass::motion);
    if (!proof && proof.error().reason == Reason::rebooted && axis_->connection_.link().online())
      axis_->connection_.on_reboot(proof.error());
    if (!current()) co_return axisd::fail(gone());
  }
  const auto sample = co_await read_state();
  if (!current()) co_return axisd::fail(gone());
  if (sample)
    axis_->readings_.on_sample(*sample);
  else if (axis_->connection_.link().online())
    axis_->connection_.go_offline(sample.error());
  if (!ready()) co_return axisd::fail(gone());
  co_return Result<void>{};
}

void Axis::Member::follow() {
  auto& axis = *axis_;
  chain_.reset();
  if (!current()) return;
  if (there_) activity_->command->activate();
  const auto since = started_at_.value_or(axis.context_.env.clock->now());
  axis.sequences_.launch(axis.motion_.run_member(activity_, base_, since, there_, arrived_), "group move");
}

Task<> Axis::Member::follow_up() {
  // Not into what the axis was told after it.
  const bool others = axis_->execution_.activity() && axis_->execution_.activity() != activity_;
  if (loaded_ && started_at_ && !others) co_await loaded_->follow_up();
}

void Axis::Member::end_failed(Error cause) {
  const bool aborted = cause.reason == Reason::expired || cause.reason == Reason::lease_lost ||
                       cause.reason == Reason::superseded || cause.reason == Reason::cancelled;
  end(std::move(cause), aborted);
}

void Axis::Member::end_aborted(Error cause) { end(std::move(cause), true); }

void Axis::Member::end(Error cause, bool aborted) {
  auto& axis = *axis_;
  chain_.reset();
  if (axis.execution_.activity() != activity_) return;  // something else ended it, with what that needs
  const bool own =
      cause.where.bus == axis.context_.settings.bus && cause.where.node == axis.context_.settings.node;
  if (own && cause.reason == Reason::expired && axis.context_.env.clock->now() > activity_->start_by)
    cause = axis.starts_.late(*activity_, cause);
  if (!aborted && own && cause.reason == Reason::rebooted) return axis.connection_.on_reboot(cause);
  if (!aborted && own && cause.reason == Reason::terminal) return axis.power_.on_turned_by_power(cause);
  const bool unknown = !aborted && cause.outcome == Outcome::unknown && activity_->start.may_run();
  axis.execution_.revoke_motion();
  if (activity_->start.may_run()) {
    // The stop of one that may move goes out whatever is known of its start.
    axis.shaft_.tracker().forget_base();
    axis.execution_.leave_running(*activity_);
    axis.execution_.note_motion_to_stop();
    if (unknown) {
      axis.motion_.follower().count_unresolved();
      axis.execution_.note_fault(cause);
    }
    axis.stopper_.begin_stop(StopKind::stop, nullptr);
    tell_part(*activity_, cause);
    cause.outcome = Outcome::unknown;  // also where nobody has heard yet whether it had started
  }
  axis.execution_.finish(*activity_, [&](CommandRecord& command) {
    if (unknown)
      command.unknown(std::move(cause));
    else
      aborted ? command.abort(std::move(cause)) : command.error(std::move(cause));
  });
}

}  // namespace axisd
