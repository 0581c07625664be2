// Commands over restarts of the daemon: what has to be known before something is sent, and what became of
// what an earlier run may have sent.
#include "devices/axis/earlier_commands.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "devices/axis/axis_log.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/restart_mark.hpp"
#include "devices/axis/settlement.hpp"

namespace axisd {

namespace {

/// A drive that cannot be read for so long does not tell any more what became of a command.
constexpr auto settling_limit = std::chrono::seconds(15);

bool moves(CommandKind kind) {
  return kind != CommandKind::enable && kind != CommandKind::reset && kind != CommandKind::set_position;
}

}  // namespace

void EarlierCommands::take_over() {
  run_.take_over(context_.env.book->take_unsettled(context_.settings.name),
                 context_.env.clock->now() + settling_limit);
  for (const auto& earlier : run_.commands()) {
    const auto& command = earlier.command->value();
    log_about_axis(spdlog::level::warn, LogKind::unknown_outcome, context_.settings,
                   fmt::format("{}: the daemon ended while {} {} was being executed; asking the drive",
                               context_.settings.name, to_string(command.kind), command.id),
                   command.id);
    if (moves(command.kind)) owe_stop_of_motion();
    if (command.kind == CommandKind::home) run_.doubt();
  }
  if (auto cause = context_.env.book->take_unknown_outcome(context_.settings.name)) {
    log_about_axis(spdlog::level::err, LogKind::unknown_outcome, context_.settings, to_string(*cause));
    execution_.set_fault(*std::move(cause));
    owe_stop_of_motion();
  }
  publisher_.publish();
}

/// What runs was begun by a command that has ended.
void EarlierCommands::owe_stop_of_motion() {
  stop_.owe();
  stop_.leave_running();
}

/// Asks a drive that rests what became of what may have been sent to it, before anything in it is changed.
Task<Result<void>> EarlierCommands::settle_earlier() {
  if (!run_.open()) co_return Result<void>{};
  bool continuous = false;
  if (const auto& marks = run_.commands().back().note.marks; !marks.empty()) {
    context_.drive->expect_marks(marks);
    const auto proof = co_await context_.drive->check_continuity(TransactionClass::parameters);
    if (!proof && proof.error().reason != Reason::rebooted) co_return proof;
    continuous = proof.has_value();
    if (!continuous) power_.restarted();
    if (!continuous && context_.env.persistence != nullptr)
      forget_position(*context_.env.persistence, context_.settings.name, true);
  }
  // The last frame of the run before may have gone out just now.
  co_await sleep_until(context_.env.executor, *context_.env.clock, context_.env.clock->now() + start_window);
  const auto sample = co_await context_.drive->read_state(TransactionClass::idle_state);
  if (!sample) co_return fail(sample.error());
  readings_.on_sample(*sample);
  if (life_.ends()) co_return fail(context_.error(Reason::cancelled, "the daemon ends"));
  if (shaft_.found_in_motion()) {
    owe_stop_of_motion();
    co_return fail(context_.error(Reason::moving, "it began to move; stopping it", "wait"));
  }
  for (const auto& earlier : run_.commands()) settle_as(earlier, continuous);
  run_.drop_ended();
  co_return Result<void>{};
}

Error EarlierCommands::earlier_error(const Unsettled& earlier, std::string_view what, Outcome outcome) const {
  const auto& command = earlier.command->value();
  auto cause = context_.error(
      Reason::cancelled,
      fmt::format("the daemon was restarted while {} was being executed: {}", to_string(command.kind), what),
      outcome == Outcome::not_executed ? "send a new request" : "look at the machine");
  cause.outcome = outcome;
  return cause;
}

void EarlierCommands::settle_as_unknown(const Unsettled& earlier, std::string_view why) {
  auto cause = earlier_error(earlier, why, Outcome::unknown);
  cause.remedy = "look at the machine; then reset the axis";
  execution_.note_fault(cause);
  earlier.command->unknown(std::move(cause));
}

void EarlierCommands::settle_as(const Unsettled& earlier, bool continuous) {
  auto& command = *earlier.command;
  const auto kind = command.value().kind;
  if (kind == CommandKind::set_position) return;  // once it is known what the counter means
  if (kind == CommandKind::reset)
    return command.abort(earlier_error(earlier, "it moves nothing, so reset again", Outcome::unknown));
  if (kind == CommandKind::enable) {
    if (earlier.tellable && shaft_.sample()->enabled) return command.done();
    return command.abort(
        earlier_error(earlier, shaft_.sample()->enabled ? "the power stage is on" : "the power stage is off",
                      Outcome::unknown));
  }
  if (!earlier.tellable)
    return settle_as_unknown(earlier,
                             "the command journal was damaged, and does not tell what came after it");
  const auto at = shaft_.tracker().counter();
  switch (settle(kind, earlier.note, shaft_.sample()->position_pulses, continuous,
                 context_.drive->position_window())) {
    case Settlement::done:
      return command.done();
    case Settlement::not_executed:
      return command.abort(earlier_error(earlier, "the drive did not move for it", Outcome::not_executed));
    case Settlement::in_part:
      return command.abort(earlier_error(
          earlier, fmt::format("executed in part: the drive rests at its count {}", at), Outcome::unknown));
    case Settlement::unknown:
      return settle_as_unknown(
          earlier, continuous ? "where the drive rests does not tell whether it has moved"
                              : "the drive lost its memory since, or it does not tell whether it has moved");
  }
}

/// Setting a position sends nothing: it was done if it is what the restart found saved.
void EarlierCommands::settle_positions_set() {
  for (const auto& earlier : run_.take_all()) {
    const auto position = earlier.command->value().asked.position.value_or(0);
    const bool kept = shaft_.tracker().trust() == PositionTrust::restored;
    if (kept && earlier.tellable && shaft_.tracker().offset_for(position) == shaft_.tracker().offset())
      earlier.command->done();
    else
      earlier.command->abort(
          earlier_error(earlier, kept ? "another position was kept" : "no position was kept",
                        kept && earlier.tellable ? Outcome::not_executed : Outcome::unknown));
  }
}

void EarlierCommands::give_up_if_overdue() {
  if (run_.overdue(context_.env.clock->now())) give_up_settling();
}

void EarlierCommands::give_up_settling() {
  for (const auto& earlier : run_.take_all()) settle_as_unknown(earlier, "the drive could not be read since");
}

}  // namespace axisd
