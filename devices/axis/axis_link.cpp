// The way to the drive: connecting, verifying, and what follows when it is gone or was restarted.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "devices/axis/axis.hpp"
#include "devices/axis/axis_log.hpp"
#include "devices/axis/restart_mark.hpp"

namespace axisd {

namespace {

constexpr auto first_backoff = milliseconds(100);
constexpr auto longest_backoff = milliseconds(1000);

}  // namespace

Task<> Axis::run() {
  while (!life_.ends()) {
    co_await connect();
    co_await poll();
  }
  note_eeprom_writes();  // of a configuration that was under way
}

Task<> Axis::connect() {
  Duration backoff = first_backoff;
  bool again = false;
  while (!life_.ends() && !link_.online()) {
    co_await wait_for_port();
    // Both would write to the drive's memory.
    while (!life_.ends() && !maintenance_.expired())
      co_await wake_.wait_until(context_.env.clock->now() + first_backoff);
    if (life_.ends()) co_return;
    // The bus sees to it that repeated silence does not cost the neighbours much.
    const auto failed_stops = stop_.failures();
    const auto connected = co_await try_connect(TransactionClass::idle_state, std::exchange(again, true));
    if (life_.ends()) co_return;
    if (!connected && failed_stops != stop_.failures()) continue;  // with that stop, at once
    if (connected && !link_.is_configured()) continue;             // it was told to begin again meanwhile
    if (connected) {
      link_.connected();
      shaft_.watch().see();
      watch_continuity();
      log_about_axis(spdlog::level::info, LogKind::axis_online, context_.settings,
                     fmt::format("{}: online ({} {})", context_.settings.name, context_.settings.model,
                                 identity_ ? identity_->version : ""));
      break;
    }
    const bool answers =
        connected.error().reason != Reason::no_reply && connected.error().reason != Reason::bus_down;
    if (link_.failed(connected.error(), answers))
      log_about_axis(spdlog::level::warn, answers ? LogKind::axis_trouble : LogKind::axis_offline,
                     context_.settings,
                     fmt::format("{}: {}", context_.settings.name, to_string(connected.error())));
    if (earlier_.overdue(context_.env.clock->now())) give_up_settling();
    publish();
    // What the bus holds back goes out as soon as anything of the node is heard: it should be there by then.
    const auto pause =
        context_.env.bus->holds_back(context_.settings.node) ? Duration(first_backoff) : backoff;
    co_await wake_.wait_until(context_.env.clock->now() + pause);
    backoff = std::min<Duration>(backoff * 2, longest_backoff);
  }
  publish();
  shaft_.sampled().notify_all();
}

Task<> Axis::wait_for_port() {
  while (!life_.ends() && !context_.env.bus->port().open) {
    link_.port_closed(context_.env.bus->port().error.value_or(
        context_.error(Reason::bus_down, "the port is being opened", "it is opened as soon as it exists")));
    if (earlier_.overdue(context_.env.clock->now())) give_up_settling();
    publish();
    co_await context_.env.bus->port_changed().wait_until(context_.env.clock->now() + longest_backoff);
  }
}

Task<Result<void>> Axis::try_connect(TransactionClass contact, bool again) {
  // A stop that fails from here on is not the one that is sent here: this attempt is given up for it.
  const auto failed_stops = stop_.failures();
  const auto stop_failed = [&]() -> Result<void> {
    if (failed_stops == stop_.failures()) return {};
    return fail(context_.error(Reason::no_reply, "a stop failed while the drive was being connected",
                               "it is sent before anything else"));
  };
  if (stop_.owed()) {
    // Whatever the drive is doing now, the first frame it gets is a stop (M4).
    const auto stopped =
        co_await (again ? context_.drive->repeat_stop() : context_.drive->stop(StopKind::stop));
    if (!stopped) co_return stopped;
  }
  auto identity = co_await context_.drive->identify(contact);
  if (!identity) co_return fail(identity.error());
  if (life_.ends()) co_return fail(context_.ending());
  if (link_.answers()) publish();
  identity_ = std::move(*identity);
  const auto sample = co_await context_.drive->read_state(TransactionClass::idle_state);
  if (!sample) co_return fail(sample.error());
  on_sample(*sample);
  if (may_have_been_stopped_abruptly()) lose_trust();
  if (auto failed = stop_failed(); !failed) co_return failed;
  if (const auto settled = co_await settle_found_motion(); !settled) co_return settled;
  if (life_.ends()) co_return fail(context_.ending());
  if (const auto ready = co_await prove_or_configure(); !ready) co_return ready;
  co_return stop_failed();
}

/// Open loop: what moved while nobody saw it may have run onto a limit, where it stops without a ramp and
/// loses steps (M20). Not so where it rests at its target, or has not left, or still runs as it did.
bool Axis::may_have_been_stopped_abruptly() const {
  // A drive that shows no inputs may have limits all the same.
  const bool by_terminal = context_.descriptor->inputs.empty() || context_.terminals.has("positive_limit") ||
                           context_.terminals.has("negative_limit") || context_.terminals.has("quick_stop");
  if (context_.drive->closed_loop() || shaft_.watch().undisturbed_at(shaft_.tracker().counter()) ||
      !by_terminal)
    return false;
  const bool runs_on = shaft_.sample()->moving && shaft_.sample()->mode == DriveMode::positioning &&
                       !context_.may_move_by_itself() && stop_.owed();
  return !runs_on;
}

/// Where the drive may be found at rest, if nothing stops it on its way.
std::vector<std::int64_t> Axis::unseen_ends() const {
  std::vector<std::int64_t> ends;
  if (shaft_.sample() && !shaft_.sample()->moving) ends.push_back(shaft_.tracker().counter());
  if (activity_ && activity_->start.may_run() && activity_->plan.target)
    ends.push_back(activity_->plan.target->counter);
  return ends;
}

bool Axis::found_by_terminal() const {
  return !stop_.owed() &&
         (shaft_.sample()->mode >= DriveMode::multi_position || context_.drive->moves_by_itself() ||
          (shaft_.sample()->mode == DriveMode::homing && shaft_.input_active("homing_start")));
}

/// M4: a drive found moving without a live command is stopped, unless a terminal started it.
Task<Result<void>> Axis::settle_found_motion() {
  std::string_view found = stop_.owed() ? "the stop that was owed to it was sent, and it came to rest" : "";
  const bool may_move =
      shaft_.found_in_motion() || (stop_.unseen_start().may_begin() && stop_.left_running());
  if (may_move && !found_by_terminal()) {
    if (!stop_.owed() &&
        shaft_.sample()->moving) {  // else it may rest between the phases of homing, or for good
      log_about_axis(spdlog::level::warn, LogKind::moving_without_command, context_.settings,
                     fmt::format("{}: found moving; stopping it", context_.settings.name));
      found = "it was found moving, was stopped, and came to rest";
    }
    stop_.owe();
    bool rests = false, began = false;
    for (auto kind = StopKind::stop;; kind = began ? kind : StopKind::quick_stop) {
      const auto begun = stop_.unseen_start().begun();
      const auto sent = co_await context_.drive->stop(kind);
      const bool may_have_come = sent || sent.error().outcome == Outcome::unknown;
      if (kind == StopKind::quick_stop && may_have_come && !context_.drive->closed_loop()) lose_trust();
      if (!sent) co_return sent;
      const auto braking = std::max(stop_.deceleration(), braking_time(kind));
      const auto deadline = context_.env.clock->now() + braking + context_.settings.stop_margin;
      rests = co_await standstill_unpolled(deadline, false);
      began = stop_.unseen_start().begun() != begun;  // once for each start: that stop may have been ignored
      if (!rests && !began && shaft_.sample()->asked_at < deadline)  // silent: it begins anew, with a stop
        co_return fail(context_.error(Reason::no_reply, "the drive fell silent while it was being stopped",
                                      "check power and wiring"));
      if (rests || life_.ends() || (kind == StopKind::quick_stop && !began)) break;
    }
    if (!rests) {
      if (context_.settings.stop_escalation_release && !life_.ends()) co_await context_.drive->disable({});
      co_return fail(context_.error(Reason::not_confirmed, "found moving, and it does not stop",
                                    "look at the machine; cut its power if it moves"));
    }
  }
  stop_.pay();
  if (!found.empty()) {
    spdlog::info("{}: {}", context_.settings.name, found);
    if (context_.env.event)
      context_.env.event(context_.settings.name,
                         LinkChange{.to = link_.shown(), .detail = std::string(found)});
  }
  co_return Result<void>{};
}

Task<Result<void>> Axis::prove_or_configure() {
  if (const auto settled = co_await settle_earlier(); !settled) co_return settled;
  auto restorable = restorable_position();
  if (link_.is_configured() || restorable) {
    const auto proof = co_await prove_continuity(TransactionClass::parameters);
    if (!proof && proof.error().reason != Reason::rebooted) co_return proof;
    if (!proof && link_.is_configured()) on_reboot(proof.error());
    // Also where an earlier run of the daemon knew the drive (M1). If that does not count from 0, that run
    // has died before it kept what it wrote last. A driver that knows no canary yet would never say so:
    // here only the counter is asked.
    const bool counts_on =
        context_.drive->Drive::rules_out_restart(*shaft_.sample()) && !context_.may_move_by_itself();
    if (!proof && !counts_on) power_.restarted();
    if (restorable && (!proof || restorable->trust == PositionTrust::unknown)) {
      void_saved_position();
      restorable.reset();
    }
    if (life_.ends()) co_return fail(context_.ending());
  }
  if (!link_.is_configured()) {
    if (const auto configured = co_await configure(restorable); !configured) co_return configured;
  } else if (const auto checked =
                 co_await check_for_drift({.transaction_class = TransactionClass::idle_state});
             !checked) {
    co_return checked;  // somebody may have changed it while it was out of reach
  }
  const auto sample = co_await context_.drive->read_state(TransactionClass::idle_state);
  if (!sample) co_return fail(sample.error());
  // Where replies are lost all this may have taken long, and the drive may have been restarted meanwhile.
  if (continuity_.forgotten(sample->asked_at)) {
    const auto proof = co_await prove_continuity(TransactionClass::parameters);
    if (!proof && proof.error().reason == Reason::rebooted) on_reboot(proof.error());
    if (!proof) co_return proof;
  }
  on_sample(*sample);
  settle_positions_set();
  co_return Result<void>{};
}

/// What an earlier run of the daemon saved, if the drive can prove by it that it kept its memory since. The
/// position holds then; its trust is unknown where it does not in any case, and is voided.
std::optional<OffsetRecord> Axis::restorable_position() {
  using Position = EarlierRun::Position;
  if (link_.is_configured() || earlier_.position() == Position::tried || context_.env.persistence == nullptr)
    return std::nullopt;
  const auto& axes = context_.env.persistence->current().axes;
  const auto found = axes.find(context_.settings.name);
  auto record = found == axes.end() ? std::nullopt : found->second.offset;
  if (!record) return std::nullopt;
  if (record->canary == restart_mark()) {  // kept until somebody enables it (M1)
    power_.restarted();
    earlier_.tried();
    return std::nullopt;
  }
  // By the journal it has proven it already, and holds what was written for a motion since.
  const auto found_there = context_.drive->continuity_mark();
  if (record->canary.empty() || (found_there && *found_there != record->canary)) {
    void_saved_position();
    return std::nullopt;
  }
  const bool restorable = earlier_.position() == Position::saved && !context_.terminal_may_void_position() &&
                          record->trust != PositionTrust::unknown &&
                          record->invert == context_.settings.scale.invert &&
                          record->pulses_per_revolution == context_.settings.scale.pulses_per_revolution &&
                          !shaft_.moved_from(shaft_.tracker().counter() - shaft_.sample()->position_pulses +
                                             record->last_position_pulses) &&
                          (shaft_.sample()->enabled || context_.counts_while_released());
  if (!restorable && record->trust != PositionTrust::unknown) {
    record->trust = PositionTrust::unknown;  // it may come true again by chance, but never by right
    context_.env.persistence->save_offset(context_.settings.name, *record, {});
  }
  context_.drive->expect_marks({record->canary});
  return record;
}

/// What it says may come true again by chance, but never by right.
void Axis::void_saved_position() {
  earlier_.tried();
  forget_position(*context_.env.persistence, context_.settings.name,
                  power_.state() == PowerMachine::State::restarted);
}

/// `restorable`: takes that position over.
Task<Result<void>> Axis::configure(std::optional<OffsetRecord> restorable) {
  // A terminal's motion is not disturbed by writing parameters under it.
  if (shaft_.sample()->moving || (shaft_.found_in_motion() && found_by_terminal()))
    co_return fail(context_.error(Reason::moving, "a terminal moves the drive; it is configured at rest"));
  const auto configured = co_await context_.drive->configure();
  if (!configured && configured.error().reason == Reason::rebooted) on_reboot(configured.error());
  if (!configured) co_return configured;
  if (life_.ends()) co_return fail(context_.ending());
  link_.configured();
  continuity_.proven(context_.env.clock->now());
  earlier_.tried();
  drift_.applied(context_.env.clock->now());
  set_drift({});
  if (restorable) {
    shaft_.tracker().restore(restorable->offset_pulses);
    remember_position();
  }
  co_return Result<void>{};
}

Result<std::shared_ptr<void>> Axis::begin_maintenance() {
  if (auto online = check_online(); !online) return fail(online.error());
  if (!maintenance_.expired() || activity_)
    return fail(context_.error(Reason::busy, "something else is being done to the drive", "wait for it"));
  if (!at_rest() || shaft_.terminal_motion().moves())
    return fail(context_.error(Reason::moving, "the axis moves", "wait for standstill"));
  if (!shaft_.sample() || shaft_.sample()->enabled)
    return fail(context_.error(Reason::moving, "the power stage is on: what is written could move the motor",
                               "disable the axis first"));
  auto token = std::make_shared<int>(0);
  maintenance_ = token;
  give_up_comparison();
  return token;
}

void Axis::reconfigure(const std::string& why, bool position_lost) {
  spdlog::info("{}: applying the configuration again: {}", context_.settings.name, why);
  link_.reconfigure(
      context_.error(Reason::configuring, "the configuration is applied again: " + why, "wait"));
  give_up_comparison();
  if (position_lost) {
    lose_trust();
    shaft_.tracker().forget_base();
  }
  publish();
  shaft_.sampled().notify_all();
  wake();
}

void Axis::bus_lost(Error cause) {
  if (!link_.bus_lost(std::move(cause))) return;
  // The others of its group look at its gate.
  if (activity_ && activity_->state == AxisState::synchronized_motion) context_.gate->raise();
  wake();
}

void Axis::go_offline(const Error& cause) {
  link_.forget_bus_loss();
  if (context_.terminal_may_void_position()) lose_trust();
  log_about_axis(spdlog::level::warn, LogKind::axis_offline, context_.settings,
                 fmt::format("{}: offline: {}", context_.settings.name, to_string(cause)));
  link_.lost(cause);
  revoke_motion();
  context_.env.bus->give_up_readings(context_.settings.node);
  give_up_comparison();
  const bool moved = (activity_ && activity_->state != AxisState::standstill) || stop_.under_way() ||
                     shaft_.terminal_motion().moves() || (shaft_.sample() && shaft_.sample()->moving);
  // Nobody can say whether the drive goes on: it has no communication watchdog. It is owed a stop (M4).
  if (moved) stop_.owe();
  shaft_.watch().lose_sight(unseen_ends());
  if (auto activity = take_activity()) {
    auto unknown =
        context_.error(Reason::offline, "the drive stopped answering while the command was being executed",
                       "check power and wiring; then reset the axis");
    unknown.outcome = Outcome::unknown;
    if (activity->state != AxisState::standstill && !fault_) fault_ = unknown;
    leave_running(*activity);
    activity->command->unknown(unknown);
    drop_buffer(unknown);
  }
  shaft_.tracker().forget_base();  // nobody sees whether somebody turns it
  shaft_.terminal_motion().lost();
  publish();
  shaft_.sampled().notify_all();
  wake();
}

void Axis::on_reboot(const Error& cause) {
  log_about_axis(spdlog::level::warn, LogKind::axis_rebooted, context_.settings,
                 fmt::format("{}: {}", context_.settings.name, to_string(cause)));
  link_.restarted(cause);
  give_up_comparison();
  power_.restarted();
  auto told = cause;
  if (activity_ && activity_->start.may_run()) told.outcome = Outcome::unknown;  // it may have started before
  supersede(told);
  stop_.restarted();
  stop_.unseen_start().restarted();
  lose_trust();
  if (context_.env.persistence != nullptr)
    forget_position(*context_.env.persistence, context_.settings.name, true);
  shaft_.tracker().restart(shaft_.sample() ? shaft_.sample()->position_pulses : 0);
  publish();
  shaft_.sampled().notify_all();
  wake();
}

}  // namespace axisd
