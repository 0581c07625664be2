// Preconditions of requests: each is looked at in one place, for refusals and for explanations. Nothing here
// waits or touches the wire.
#include "devices/axis/preconditions.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>

#include "buses/seconds.hpp"
#include "devices/axis/drift_check.hpp"
#include "devices/axis/drive_work.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/power_wait.hpp"
#include "devices/axis/start_wait.hpp"

namespace axisd {

namespace {

/// A drive that takes no enable, or does not start or ends what it started, while one of these is active.
constexpr std::string_view holding_functions[] = {"stop", "quick_stop", "motor_free"};

/// What went wrong, without where it was and what to do: both stand beside it.
std::string bare_text(const Error& why, const std::string& axis) {
  auto text = why.message.empty() ? std::string(to_string(why.reason)) : why.message;
  if (const auto lead = axis + ": "; text.starts_with(lead)) text.erase(0, lead.size());
  return why.where.object ? fmt::format("{}: {}", object_text(*why.where.object), text) : text;
}

}  // namespace

std::vector<Obstacle> Preconditions::explain(const std::optional<Action>& action,
                                             const CommandOptions& options) const {
  Obstacles found;
  const bool never_waits = action && std::holds_alternative<DisableRequest>(*action);
  const bool has_id = !action || !options.request_id.empty();
  const auto doubt = never_waits || !has_id ? std::nullopt : context_.env.book->doubt(context_.settings.name);
  const bool told_behind = context_.env.state_unaccepted != nullptr && *context_.env.state_unaccepted;
  if (doubt && !told_behind) found.block(*doubt);
  const bool for_power =
      action && execution_.buffer().empty() && waits_for_power(execution_.activity(), *action);
  if (action && (options.buffer_mode == BufferMode::buffered || for_power) && !never_waits) {
    look_at_buffered(*action, options, found);
  } else if (action) {
    std::visit([&](const auto& request) { look_at(request, options, found); }, *action);
  } else {
    look_at_motion(options, found);
    look_at_what_forbids_some(found);
  }
  if (doubt && told_behind) found.block(*doubt);
  return std::move(found).all();
}

void Preconditions::look_at_options(const CommandOptions& options, Obstacles& found) const {
  if (options.not_after <= context_.env.clock->now())
    found.block(context_.error(Reason::expired, "the request's validity has passed",
                               "repeat it with a later not_after"));
  if (too_late(options))
    found.block(context_.error(
        Reason::expired,
        fmt::format("accepted too late: it may start within {} ms of its arrival, and no later "
                    "than the deadline of its call",
                    std::chrono::duration_cast<milliseconds>(context_.settings.start_within).count()),
        "repeat it, if it is still wanted"));
  found.block_on(check_lease({.client = options.client, .lease_token = options.lease_token}));
}

/// Everybody's stop counts: each who holds has to let go (M14).
void Preconditions::look_at_holds(const CommandOptions& options, Obstacles& found) const {
  if (!stop_.held()) return;
  const auto& holds = context_.env.holds->all();
  found.block(context_.error(Reason::stopping, "a stop is held by " + text_of(holds),
                             how_to_release(holds, context_.settings.name, options.client)));
}

void Preconditions::look_at_link(Obstacles& found) const {
  if (life_.retired()) return found.block(context_.reloading());
  if (!link_.online() && !link_.offline()) {
    auto cause = context_.error(Reason::configuring, "the drive is being identified and configured", "wait");
    if (link_.error()) {
      cause = *link_.error();
      cause.message = fmt::format("{}: not configured: {}", context_.settings.name, link_.error()->message);
      const bool lasting = cause.reason == Reason::wrong_model || cause.reason == Reason::misconfigured ||
                           cause.reason == Reason::eeprom_budget;
      // What it asks for would only be refused for the same reason.
      if (cause.reason == Reason::rebooted)
        cause.remedy = fmt::format(
            "wait until it is configured again, mostly within a second; then {}, and {}",
            context_.shell("enable"), context_.settings.homing ? context_.shell("home") : "set its position");
      if (!lasting) cause.reason = Reason::configuring;
      cause.outcome = Outcome::not_sent;
    }
    found.block(std::move(cause));
  }
  if (!link_.offline()) return;
  auto silent = context_.error(Reason::offline, "offline", "check power and wiring");
  if (const auto& why = link_.error()) {
    silent.message += ": " + bare_text(*why, context_.settings.name);
    // Whoever saw it knows best what to do: one remedy, not two.
    if (!why->remedy.empty()) silent.remedy = why->remedy;
  }
  // A port that is not open says so itself.
  if (context_.env.bus->port().open) silent.remedy += "; it is retried by itself";
  found.block(std::move(silent));
  if (const auto& port = context_.env.bus->port(); !port.open) {
    auto cause = port.error.value_or(Error{.reason = Reason::bus_down,
                                           .message = "the port is not open",
                                           .where = {.bus = context_.settings.bus}});
    if (cause.remedy.empty()) cause.remedy = "it is opened as soon as it can be";
    found.block(std::move(cause));
  }
  if (const auto held = context_.env.bus->quarantined(context_.settings.node)) {
    const auto now = context_.env.clock->now();
    found.block(context_.error(
        Reason::no_reply,
        fmt::format(
            "node {} is in quarantine for {:.1f} s, {} requests in vain; it is asked again in {:.1f} s",
            context_.settings.node, in_seconds(now - held->since), held->probes,
            in_seconds(std::max(held->next - now, Duration::zero()))),
        fmt::format("check its power, address and serial settings; look who answers: axisctl bus scan {}",
                    context_.settings.bus)));
  }
  if (stop_.owed())
    found.note(
        context_.error(Reason::stopping, "a stop is owed to the drive, which was not seen at rest",
                       "look at the machine; the stop is the first that the drive gets when it answers"));
}

Result<void> Preconditions::check_online() const {
  Obstacles found;
  look_at_link(found);
  return found.verdict();
}

void Preconditions::look_at_fault(Obstacles& found) const {
  if (!execution_.fault()) return;
  auto cause = *execution_.fault();
  cause.message = fmt::format("{}: in ErrorStop: {}", context_.settings.name, execution_.fault()->message);
  cause.reason = execution_.fault()->reason == Reason::alarm ? Reason::alarm : Reason::fault;
  if (execution_.fault()->outcome == Outcome::unknown)
    cause.message += "; what the drive did of it is unknown";
  const auto reset = execution_.fault()->outcome == Outcome::unknown
                         ? context_.shell("reset") + ", which reads the drive back"
                         : context_.shell("reset");
  const bool said = cause.remedy.find("reset the axis") != cause.remedy.npos;
  if (said)
    cause.remedy += fmt::format(" ({})", reset);
  else
    cause.remedy += fmt::format("{}reset the axis: {}", cause.remedy.empty() ? "" : "; then ", reset);
  cause.outcome = Outcome::not_sent;
  found.block(std::move(cause));
}

void Preconditions::look_at_maintenance(Obstacles& found) const {
  if (work_.under_way())
    found.block(
        context_.error(Reason::busy, "the drive's parameters or memory are being written", "wait for it"));
}

void Preconditions::look_at_readiness(const CommandOptions& options, Obstacles& found) const {
  if (life_.retired()) return found.block(context_.reloading());
  look_at_options(options, found);
  // Stops overtake what waits for the core: their order is that in which they arrived (M14).
  if (stop_.overtook(options.arrived))
    found.block(context_.error(Reason::superseded, "a stop that arrived later was served first",
                               "send a new request"));
  // A stop that the core has not seen yet comes before everything that is accepted now.
  look_at_holds(options, found);
  if (!stop_.held() && stop_.forbids_motion())
    found.block(context_.error(Reason::stopping, "the axis is stopping", "wait for standstill"));
  look_at_fault(found);
  look_at_maintenance(found);
  if (power_.owes_release())
    found.block(
        context_.error(Reason::busy, "the drive is being released, because a lease ended", "wait for it"));
  found.block_on(check_journal());
  if (drift_.drifted())
    found.block(context_.error(Reason::misconfigured,
                               "the drive no longer holds its configuration: " + drift_.text(),
                               fmt::format("disable the axis ({}): the configuration is then applied again",
                                           context_.shell("disable"))));
  look_at_link(found);
}

void Preconditions::look_at_motion(const CommandOptions& options, Obstacles& found) const {
  if (context_.env.inhibited != nullptr && *context_.env.inhibited)
    found.block(context_.error(Reason::inhibited, "StopAll holds the machine",
                               "release it: axisctl release-stop --all"));
  if (context_.env.state_unaccepted != nullptr && *context_.env.state_unaccepted)
    found.block(**context_.env.state_unaccepted);
  look_at_readiness(options, found);
  const auto executed =
      execution_.activity() ? std::optional(execution_.activity()->command->value().kind) : std::nullopt;
  if (executed == CommandKind::enable && options.buffer_mode == BufferMode::buffered)
    found.note(context_.error(Reason::disabled, "the axis is being enabled", "the start waits for that"));
  else if (executed == CommandKind::enable)
    found.block(context_.error(Reason::disabled, "the axis is being enabled", "wait for the command to end"));
  else if (executed == CommandKind::disable)
    found.block(context_.error(Reason::disabled, "the axis is being disabled",
                               "enable it afterwards: " + context_.shell("enable")));
  else if (!shaft_.sample())
    found.block(context_.error(Reason::disabled, "the power stage is not known to be on",
                               "enable the axis once the drive answers: " + context_.shell("enable")));
  else if (!shaft_.sample()->enabled)
    found.block(context_.error(Reason::disabled, "the power stage is off",
                               "enable the axis first: " + context_.shell("enable")));
  else if (power_.state() == PowerMachine::State::restarted)
    // Whoever switched it off may have done so to reach into the machine (M1).
    found.block(context_.error(
        Reason::disabled, "the drive was switched off and on, and nobody has enabled the axis since",
        "see that the machine is clear, then enable the axis: " + context_.shell("enable")));
  if (shaft_.terminal_motion().moves())
    found.block(context_.error(Reason::terminal, "a terminal of the drive moves it",
                               fmt::format("wait, or stop it: {}", context_.shell("stop"))));
  look_at_holding_terminals(holding_functions, found);
}

/// The drive decides what an active terminal does to a start: worth knowing, but not refused for.
void Preconditions::look_at_holding_terminals(std::span<const std::string_view> functions,
                                              Obstacles& found) const {
  if (!shaft_.sample() || !link_.online()) return;
  for (const auto& input : context_.settings.inputs)
    if (std::ranges::find(functions, input.function) != functions.end() &&
        context_.terminals.active(*shaft_.sample(), input))
      found.note(
          context_.error(Reason::terminal,
                         fmt::format("terminal {} ({}) is active: the drive may not start, or stop at once",
                                     input.terminal, input.function),
                         "release the terminal, or check its active level in the YAML"));
}

/// What forbids some motions and permits others.
void Preconditions::look_at_what_forbids_some(Obstacles& found) const {
  if (shaft_.tracker().trust() == PositionTrust::unknown &&
      (context_.settings.require_trust || context_.settings.limits.position_minimum))
    found.note(context_.not_trusted(
        context_.settings.require_trust
            ? "the position is unknown: absolute moves are refused, and limits cannot be kept"
            : "the position is unknown: absolute moves and limits go by what the drive "
              "counts, wherever the load is"));
  for (const bool positive : {true, false})
    if (shaft_.limit_active(positive)) found.note(context_.direction_blocked(positive));
  if (auto possible = context_.check_velocity_mode(); !possible) found.note(possible.error());
}

void Preconditions::look_at_direction(bool positive, Obstacles& found) const {
  if (shaft_.limit_active(positive)) found.block(context_.direction_blocked(positive));
}

/// M9: a start that is accepted waits for the end of what moves.
void Preconditions::look_at_present_motion(Obstacles& found) const {
  if (found.blocked()) return;
  const bool moves = (execution_.activity() && execution_.activity()->state != AxisState::standstill) ||
                     stop_.under_way() ||
                     (shaft_.sample() && shaft_.sample()->moving && !shaft_.terminal_motion().moves());
  const auto executed = execution_.activity()
                            ? fmt::format("{} {}", to_string(execution_.activity()->command->value().kind),
                                          execution_.activity()->command->value().id)
                            : std::string();
  if (moves)
    found.note(context_.error(
        Reason::moving, execution_.activity() ? "the axis moves: " + executed : "the axis moves",
        execution_.activity() ? "that is halted and ends Aborted; the start waits for standstill"
                              : "the start waits for standstill"));
  else if (execution_.activity())
    found.note(
        context_.error(Reason::busy, "another command is being executed: " + executed, "it ends Aborted"));
}

/// Its start waits for those of others on its line: one that could not be in time is told so at once (M31).
/// Who started lately leaves the last third of that time to the others. What was buffered was accepted
/// before.
void Preconditions::look_at_line(Obstacles& found) const {
  const auto* turns = context_.env.bus->start_turns();
  if (turns == nullptr || execution_.buffer().starts() || found.blocked()) return;
  const auto wait = turns->expected_wait();
  const bool lately = context_.env.clock->now() - starts_.had_turn() < context_.settings.start_within;
  const auto most = lately ? context_.settings.start_within / 2 : context_.settings.start_within * 3 / 4;
  const auto in_ms = std::chrono::round<std::chrono::milliseconds>(wait).count();
  if (wait > most)
    found.block(context_.error(
        Reason::busy,
        fmt::format("the line is full: starts of {} axes wait already, for {} ms", turns->waiting(), in_ms),
        "repeat it later; fewer axes on the line, a higher baud rate or a longer "
        "start_within permit more starts"));
  else if (turns->waiting() > 0)
    found.note(context_.error(Reason::busy,
                              fmt::format("starts of {} axes on the line come before it", turns->waiting()),
                              fmt::format("it waits for about {} ms", in_ms)));
}

void Preconditions::look_at_target(const PositionTracker::Target& target, Obstacles& found) const {
  context_.planner.check_move(target, shaft_.tracker(), found);
  if (target.counter != shaft_.tracker().counter())
    look_at_direction(context_.planner.positive(target, shaft_.tracker()), found);
}

Result<void> Preconditions::check_journal() const {
  const auto trouble = context_.env.book->trouble();
  if (!trouble) return {};
  auto cause =
      context_.error(Reason::storage, "nothing new is started: " + trouble->message, trouble->remedy);
  cause.where.native_code = trouble->where.native_code;
  return fail(std::move(cause));
}

Result<void> Preconditions::check_lease(const Requester& requester) const {
  const auto allowed =
      context_.env.leases->check(context_.settings.name, requester, context_.env.clock->now());
  if (allowed) return {};
  return fail(context_.error(allowed.error().reason, allowed.error().message, allowed.error().remedy));
}

/// It arrived longer ago than it may wait, or its caller has given up. What is buffered may wait.
bool Preconditions::too_late(const CommandOptions& options) const {
  if (options.buffer_mode == BufferMode::buffered && (execution_.buffer().starts() || execution_.activity()))
    return false;
  const auto now = context_.env.clock->now();
  return now > options.call_deadline ||
         (options.arrived != TimePoint{} && now > options.arrived + context_.settings.start_within);
}

}  // namespace axisd
