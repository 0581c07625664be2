// The way to the drive: connecting, verifying, and what follows when it is gone or was restarted.
#include "devices/axis/drive_connection.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "devices/axis/axis_log.hpp"
#include "devices/axis/drift_check.hpp"
#include "devices/axis/drive_work.hpp"
#include "devices/axis/earlier_commands.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/restart_mark.hpp"
#include "devices/axis/saved_position.hpp"
#include "devices/axis/sequences.hpp"
#include "devices/axis/state_reader.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

namespace {

constexpr auto first_backoff = milliseconds(100);
constexpr auto longest_backoff = milliseconds(1000);

}  // namespace

Task<> DriveConnection::run() {
  while (!sequences_.life().ends()) {
    co_await connect();
    co_await reader_.poll();
  }
  publisher_.note_eeprom_writes();  // of a configuration that was under way
}

Task<> DriveConnection::connect() {
  Duration backoff = first_backoff;
  bool again = false;
  while (!sequences_.life().ends() && !link_.online()) {
    co_await wait_for_port();
    // Both would write to the drive's memory.
    while (!sequences_.life().ends() && work_.under_way())
      co_await reader_.woken().wait_until(context_.env.clock->now() + first_backoff);
    if (sequences_.life().ends()) co_return;
    // The bus sees to it that repeated silence does not cost the neighbours much.
    const auto failed_stops = stopper_.machine().failures();
    const auto connected = co_await try_connect(TransactionClass::idle_state, std::exchange(again, true));
    if (sequences_.life().ends()) co_return;
    if (!connected && failed_stops != stopper_.machine().failures()) continue;  // with that stop, at once
    if (connected && !link_.is_configured()) continue;  // it was told to begin again meanwhile
    if (connected) {
      link_.connected();
      shaft_.watch().see();
      reader_.watch_continuity();
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
    earlier_.give_up_if_overdue();
    publisher_.publish();
    // What the bus holds back goes out as soon as anything of the node is heard: it should be there by then.
    const auto pause =
        context_.env.bus->holds_back(context_.settings.node) ? Duration(first_backoff) : backoff;
    co_await reader_.woken().wait_until(context_.env.clock->now() + pause);
    backoff = std::min<Duration>(backoff * 2, longest_backoff);
  }
  publisher_.publish();
  shaft_.sampled().notify_all();
}

Task<> DriveConnection::wait_for_port() {
  while (!sequences_.life().ends() && !context_.env.bus->port().open) {
    link_.port_closed(context_.env.bus->port().error.value_or(
        context_.error(Reason::bus_down, "the port is being opened", "it is opened as soon as it exists")));
    earlier_.give_up_if_overdue();
    publisher_.publish();
    co_await context_.env.bus->port_changed().wait_until(context_.env.clock->now() + longest_backoff);
  }
}

Task<Result<void>> DriveConnection::try_connect(TransactionClass contact, bool again) {
  // A stop that fails from here on is not the one that is sent here: this attempt is given up for it.
  const auto failed_stops = stopper_.machine().failures();
  const auto stop_failed = [&]() -> Result<void> {
    if (failed_stops == stopper_.machine().failures()) return {};
    return fail(context_.error(Reason::no_reply, "a stop failed while the drive was being connected",
                               "it is sent before anything else"));
  };
  if (stopper_.machine().owed()) {
    // Whatever the drive is doing now, the first frame it gets is a stop (M4).
    const auto stopped =
        co_await (again ? context_.drive->repeat_stop() : context_.drive->stop(StopKind::stop));
    if (!stopped) co_return stopped;
  }
  auto identity = co_await context_.drive->identify(contact);
  if (!identity) co_return fail(identity.error());
  if (sequences_.life().ends()) co_return fail(context_.ending());
  if (link_.answers()) publisher_.publish();
  identity_ = std::move(*identity);
  const auto sample = co_await context_.drive->read_state(TransactionClass::idle_state);
  if (!sample) co_return fail(sample.error());
  readings_.on_sample(*sample);
  if (may_have_been_stopped_abruptly()) readings_.lose_trust();
  if (auto failed = stop_failed(); !failed) co_return failed;
  if (const auto settled = co_await settle_found_motion(); !settled) co_return settled;
  if (sequences_.life().ends()) co_return fail(context_.ending());
  if (const auto ready = co_await prove_or_configure(); !ready) co_return ready;
  co_return stop_failed();
}

/// Open loop: what moved while nobody saw it may have run onto a limit, where it stops without a ramp and
/// loses steps (M20). Not so where it rests at its target, or has not left, or still runs as it did.
bool DriveConnection::may_have_been_stopped_abruptly() const {
  // A drive that shows no inputs may have limits all the same.
  const bool by_terminal = context_.descriptor->inputs.empty() || context_.terminals.has("positive_limit") ||
                           context_.terminals.has("negative_limit") || context_.terminals.has("quick_stop");
  if (context_.drive->closed_loop() || shaft_.watch().undisturbed_at(shaft_.tracker().counter()) ||
      !by_terminal)
    return false;
  const bool runs_on = shaft_.sample()->moving && shaft_.sample()->mode == DriveMode::positioning &&
                       !context_.may_move_by_itself() && stopper_.machine().owed();
  return !runs_on;
}

/// Where the drive may be found at rest, if nothing stops it on its way.
std::vector<std::int64_t> DriveConnection::unseen_ends() const {
  std::vector<std::int64_t> ends;
  if (shaft_.sample() && !shaft_.sample()->moving) ends.push_back(shaft_.tracker().counter());
  if (execution_.activity() && execution_.activity()->start.may_run() && execution_.activity()->plan.target)
    ends.push_back(execution_.activity()->plan.target->counter);
  return ends;
}

bool DriveConnection::found_by_terminal() const {
  return !stopper_.machine().owed() &&
         (shaft_.sample()->mode >= DriveMode::multi_position || context_.drive->moves_by_itself() ||
          (shaft_.sample()->mode == DriveMode::homing && shaft_.input_active("homing_start")));
}

/// M4: a drive found moving without a live command is stopped, unless a terminal started it.
Task<Result<void>> DriveConnection::settle_found_motion() {
  auto& stop = stopper_.machine();
  std::string_view found = stop.owed() ? "the stop that was owed to it was sent, and it came to rest" : "";
  const bool may_move = shaft_.found_in_motion() || (stop.unseen_start().may_begin() && stop.left_running());
  if (may_move && !found_by_terminal()) {
    // Else it may rest between the phases of homing, or for good.
    if (!stop.owed() && shaft_.sample()->moving) {
      log_about_axis(spdlog::level::warn, LogKind::moving_without_command, context_.settings,
                     fmt::format("{}: found moving; stopping it", context_.settings.name));
      found = "it was found moving, was stopped, and came to rest";
    }
    stop.owe();
    if (const auto stopped = co_await stop_found_motion(); !stopped) co_return stopped;
  }
  stop.pay();
  if (!found.empty()) {
    spdlog::info("{}: {}", context_.settings.name, found);
    if (context_.env.event)
      context_.env.event(context_.settings.name,
                         LinkChange{.to = link_.shown(), .detail = std::string(found)});
  }
  co_return Result<void>{};
}

/// With a quick stop where a stop does not bring it to rest.
Task<Result<void>> DriveConnection::stop_found_motion() {
  const auto& stop = stopper_.machine();
  bool rests = false, began = false;
  for (auto kind = StopKind::stop;; kind = began ? kind : StopKind::quick_stop) {
    const auto begun = stop.unseen_start().begun();
    const auto sent = co_await context_.drive->stop(kind);
    const bool may_have_come = sent || sent.error().outcome == Outcome::unknown;
    if (kind == StopKind::quick_stop && may_have_come && !context_.drive->closed_loop())
      readings_.lose_trust();
    if (!sent) co_return sent;
    const auto braking = std::max(stop.deceleration(), stopper_.braking_time(kind));
    const auto deadline = context_.env.clock->now() + braking + context_.settings.stop_margin;
    rests = co_await stopper_.standstill_unpolled(deadline, false);
    // Once for each start: that stop may have been ignored.
    began = stop.unseen_start().begun() != begun;
    if (!rests && !began && shaft_.sample()->asked_at < deadline)  // silent: it begins anew, with a stop
      co_return fail(context_.error(Reason::no_reply, "the drive fell silent while it was being stopped",
                                    "check power and wiring"));
    if (rests || sequences_.life().ends() || (kind == StopKind::quick_stop && !began)) break;
  }
  if (rests) co_return Result<void>{};
  if (context_.settings.stop_escalation_release && !sequences_.life().ends())
    co_await context_.drive->disable({});
  co_return fail(context_.error(Reason::not_confirmed, "found moving, and it does not stop",
                                "look at the machine; cut its power if it moves"));
}

Task<Result<void>> DriveConnection::prove_or_configure() {
  if (const auto settled = co_await earlier_.settle_earlier(); !settled) co_return settled;
  auto restorable = restorable_position();
  if (link_.is_configured() || restorable) {
    const auto proof = co_await reader_.prove_continuity(TransactionClass::parameters);
    if (!proof && proof.error().reason != Reason::rebooted) co_return proof;
    if (!proof && link_.is_configured()) on_reboot(proof.error());
    // Also where an earlier run of the daemon knew the drive (M1). If that does not count from 0, that run
    // has died before it kept what it wrote last. A driver that knows no canary yet would never say so:
    // here only the counter is asked.
    const bool counts_on = context_.drive->counts_on(*shaft_.sample()) && !context_.may_move_by_itself();
    if (!proof && !counts_on) power_.restarted();
    if (restorable && !proof) void_saved_position();
    if (restorable && (!proof || restorable->trust == PositionTrust::unknown)) {
      // What is left of it is the canary: it is kept until the drive is configured, and has another (M1).
      own_canary();
      restorable.reset();
    }
    if (sequences_.life().ends()) co_return fail(context_.ending());
  }
  if (!link_.is_configured()) {
    if (const auto configured = co_await configure(restorable); !configured) co_return configured;
  } else if (const auto checked =
                 co_await drift_.check_for_drift({.transaction_class = TransactionClass::idle_state});
             !checked) {
    co_return checked;  // somebody may have changed it while it was out of reach
  }
  const auto sample = co_await context_.drive->read_state(TransactionClass::idle_state);
  if (!sample) co_return fail(sample.error());
  // Where replies are lost all this may have taken long, and the drive may have been restarted meanwhile.
  if (reader_.continuity().forgotten(sample->asked_at)) {
    const auto proof = co_await reader_.prove_continuity(TransactionClass::parameters);
    if (!proof && proof.error().reason == Reason::rebooted) on_reboot(proof.error());
    if (!proof) co_return proof;
  }
  readings_.on_sample(*sample);
  earlier_.settle_positions_set();
  co_return Result<void>{};
}

/// What an earlier run of the daemon saved, if the drive can prove by it that it kept its memory since. The
/// position holds then; its trust is unknown where it does not in any case, and is voided.
std::optional<OffsetRecord> DriveConnection::restorable_position() {
  using Position = EarlierRun::Position;
  if (link_.is_configured() || earlier_.run().position() == Position::tried ||
      context_.env.persistence == nullptr)
    return std::nullopt;
  const auto& axes = context_.env.persistence->current().axes;
  const auto found = axes.find(context_.settings.name);
  auto record = found == axes.end() ? std::nullopt : found->second.offset;
  if (!record) return std::nullopt;
  if (record->canary == restart_mark()) {  // kept until somebody enables it (M1)
    power_.restarted();
    own_canary();
    return std::nullopt;
  }
  // By the journal it has proven it already, and holds what was written for a motion since.
  const auto found_there = context_.drive->continuity_mark();
  if (record->canary.empty()) {
    void_saved_position();
    return std::nullopt;
  }
  if (found_there && *found_there != record->canary) {
    record->canary = *found_there;
    record->trust = PositionTrust::unknown;
    context_.env.persistence->save_offset(context_.settings.name, *record, {});
    own_canary();
    return std::nullopt;
  }
  const bool restorable = earlier_.run().position() == Position::saved &&
                          !context_.terminal_may_void_position() && record->trust != PositionTrust::unknown &&
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
void DriveConnection::void_saved_position() {
  own_canary();
  saved_.void_saved_position();
}

/// Nothing of an earlier run is taken over any more.
void DriveConnection::own_canary() {
  earlier_.run().tried();
  saved_.own_canary();
}

/// `restorable`: takes that position over.
Task<Result<void>> DriveConnection::configure(std::optional<OffsetRecord> restorable) {
  // A terminal's motion is not disturbed by writing parameters under it.
  if (shaft_.sample()->moving || (shaft_.found_in_motion() && found_by_terminal()))
    co_return fail(context_.error(Reason::moving, "a terminal moves the drive; it is configured at rest"));
  if (!restorable) own_canary();
  const auto configured = co_await context_.drive->configure();
  if (!configured && configured.error().reason == Reason::rebooted) on_reboot(configured.error());
  if (!configured) co_return configured;
  if (sequences_.life().ends()) co_return fail(context_.ending());
  link_.configured();
  reader_.continuity().proven(context_.env.clock->now());
  own_canary();
  drift_.applied();
  if (restorable) {
    shaft_.tracker().restore(restorable->offset_pulses);
    saved_.remember_position();
  }
  saved_.drop_canary();
  co_return Result<void>{};
}

void DriveConnection::reconfigure(const std::string& why, bool position_lost) {
  spdlog::info("{}: applying the configuration again: {}", context_.settings.name, why);
  link_.reconfigure(
      context_.error(Reason::configuring, "the configuration is applied again: " + why, "wait"));
  drift_.give_up_comparison();
  if (position_lost) {
    readings_.lose_trust();
    shaft_.tracker().forget_base();
  }
  publisher_.publish();
  shaft_.sampled().notify_all();
  reader_.wake();
}

void DriveConnection::bus_lost(Error cause) {
  if (!link_.bus_lost(std::move(cause))) return;
  // The others of its group look at its gate.
  if (execution_.activity() && execution_.activity()->state == AxisState::synchronized_motion)
    context_.gate->raise();
  reader_.wake();
}

void DriveConnection::go_offline(const Error& cause) {
  link_.forget_bus_loss();
  if (context_.terminal_may_void_position()) readings_.lose_trust();
  log_about_axis(spdlog::level::warn, LogKind::axis_offline, context_.settings,
                 fmt::format("{}: offline: {}", context_.settings.name, to_string(cause)));
  link_.lost(cause);
  execution_.revoke_motion();
  context_.env.bus->give_up_readings(context_.settings.node);
  drift_.give_up_comparison();
  const bool moved = (execution_.activity() && execution_.activity()->state != AxisState::standstill) ||
                     stopper_.machine().under_way() || shaft_.terminal_motion().moves() ||
                     (shaft_.sample() && shaft_.sample()->moving);
  // Nobody can say whether the drive goes on: it has no communication watchdog. It is owed a stop (M4).
  if (moved) stopper_.machine().owe();
  shaft_.watch().lose_sight(unseen_ends());
  if (auto activity = execution_.take_activity()) {
    auto unknown =
        context_.error(Reason::offline, "the drive stopped answering while the command was being executed",
                       "check power and wiring; then reset the axis");
    unknown.outcome = Outcome::unknown;
    if (activity->state != AxisState::standstill) execution_.note_fault(unknown);
    execution_.leave_running(*activity);
    activity->command->unknown(unknown);
    execution_.drop_buffer(unknown);
  }
  shaft_.tracker().forget_base();  // nobody sees whether somebody turns it
  shaft_.terminal_motion().lost();
  publisher_.publish();
  shaft_.sampled().notify_all();
  reader_.wake();
}

void DriveConnection::on_reboot(const Error& cause) {
  log_about_axis(spdlog::level::warn, LogKind::axis_rebooted, context_.settings,
                 fmt::format("{}: {}", context_.settings.name, to_string(cause)));
  link_.restarted(cause);
  drift_.give_up_comparison();
  power_.restarted();
  auto told = cause;
  if (execution_.activity() && execution_.activity()->start.may_run())
    told.outcome = Outcome::unknown;  // it may have started before
  execution_.supersede(told);
  stopper_.machine().restarted();
  stopper_.machine().unseen_start().restarted();
  readings_.lose_trust();
  saved_.void_saved_position();
  shaft_.tracker().restart(shaft_.sample() ? shaft_.sample()->position_pulses : 0);
  publisher_.publish();
  shaft_.sampled().notify_all();
  reader_.wake();
}

}  // namespace axisd
