// Sequences that move nothing: power, reset, and what the position means.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>

#include "devices/axis/axis.hpp"
#include "devices/axis/chain.hpp"

namespace axisd {

namespace {

/// A sample that was asked for is expected within this, or the link is lost anyway.
constexpr auto sample_patience = std::chrono::seconds(5);

}  // namespace

/// M1, M23: power, or the end of a halt, never moves. Whatever this is, it ends here.
void Axis::on_turned_by_power(const Error& cause) {
  enter_error_stop(cause);
  stop_.leave_running();
  begin_stop(StopKind::stop, nullptr);
  publish();
}

Task<> Axis::run_enable(ActivityPtr activity) {
  if (!co_await noted(activity, {})) co_return;
  Result<void> result;
  {
    const Chain chain(*this);
    result = co_await look(Duration{});  // the shaft may have been turned since it was read
    if (!current(*activity)) co_return;
    if (result) result = co_await context_.drive->enable(guard(*activity));
  }
  if (!current(*activity)) co_return;
  if (!result && result.error().reason == Reason::rebooted) {
    on_reboot(result.error());
    co_return;
  }
  if (!result && result.error().reason == Reason::terminal) {
    on_turned_by_power(result.error());
    co_return;
  }
  // Whether an enable without a reply was executed shows in the next samples.
  const bool uncertain = !result && result.error().outcome == Outcome::unknown;
  if (!result && !uncertain) {
    end_unsent(*activity, result.error());
    co_return;
  }
  activity->command->activate();
  EnableMachine enable(context_.env.clock->now(), context_.settings.brake.release_time);
  const auto before = shaft_.tracker().counter();
  while (enable.goes_on()) {
    const auto sample = co_await sample_after(context_.env.clock->now(), sample_patience);
    if (!current(*activity)) co_return;
    if (sample)
      enable.look(*sample, shaft_.moved_from(before), context_.env.clock->now());
    else
      enable.silent();
  }
  end_enable(*activity, enable.state(), uncertain ? std::optional(result.error()) : std::nullopt);
}

/// `unanswered`: what became of its frame, where that got no reply.
void Axis::end_enable(Activity& activity, EnableMachine::State state, std::optional<Error> unanswered) {
  if (state == EnableMachine::State::turned)
    return on_turned_by_power(context_.error(Reason::terminal, "the drive moved when it was enabled",
                                             "check terminals that start motion; then reset the axis"));
  if (state == EnableMachine::State::on) {
    const bool restarted = power_.state() == PowerMachine::State::restarted;
    power_.enabled();
    if (restarted) correct_saved_position();  // a later run of the daemon need not know of it any more
    return finish(activity, [](CommandRecord& command) { command.done(); });
  }
  auto cause = context_.error(Reason::not_confirmed, "the drive does not report its power stage as on",
                              "check terminals with the function motor_free, and alarms");
  if (unanswered) {
    unanswered->message = cause.message + ", and the frame that enables it got no reply";
    unanswered->remedy = "enable it again; if that is of no use: " + unanswered->remedy;
    if (!context_.terminals.has("motor_free")) unanswered->outcome = Outcome::not_executed;
    cause = *std::move(unanswered);
  }
  finish(activity, [&](CommandRecord& command) { command.error(std::move(cause)); });
}

Task<> Axis::run_disable(ActivityPtr activity) {
  activity->command->activate();
  // A fault does not stand in the way of releasing: only the motion has to have ended.
  while (stop_.under_way() && current(*activity)) co_await stopped_.wait();
  if (!current(*activity)) co_return;
  if (stop_.owed()) {
    finish(*activity, [&](CommandRecord& command) {
      command.error(context_.error(Reason::not_confirmed, "not released: standstill was not confirmed",
                                   "look at the machine; cut its power if it moves"));
    });
    co_return;
  }
  const auto result = co_await context_.drive->disable(guard(*activity));
  if (!current(*activity)) co_return;
  const auto sample =
      result ? co_await sample_after(context_.env.clock->now(), sample_patience) : fail(result.error());
  if (!current(*activity)) co_return;
  if (sample && !sample->enabled && context_.settings.brake.engage_time > Duration{}) {
    co_await sleep_until(context_.env.executor, *context_.env.clock,
                         context_.env.clock->now() + context_.settings.brake.engage_time);
    if (!current(*activity)) co_return;
  }
  if (sample && !sample->enabled) {
    finish(*activity, [](CommandRecord& command) { command.done(); });
    release_as_owed();  // this was it
    co_return;
  }
  const auto cause = sample ? context_.error(Reason::not_confirmed,
                                             "the drive still reports its power stage as on", "try again")
                            : sample.error();
  give_up_release(cause);
  end_unsent(*activity, cause);
}

Task<> Axis::run_reset(ActivityPtr activity) {
  activity->command->activate();
  if (shaft_.sample() && shaft_.sample()->alarm_code != 0) {
    const auto cleared = co_await context_.drive->clear_alarm(guard(*activity));
    if (!current(*activity)) co_return;
    if (!cleared) {
      end_unsent(*activity, cleared.error());
      co_return;
    }
  }
  // A successful read-back is part of it: after an unknown outcome nothing may start before that.
  const auto sample = co_await sample_after(context_.env.clock->now(), sample_patience);
  if (!current(*activity)) co_return;
  const bool clean = sample && sample->alarm_code == 0 && !sample->moving;
  if (clean) fault_.reset();
  finish(*activity, [&](CommandRecord& command) {
    if (clean)
      command.done();
    else if (!sample)
      command.error(sample.error());
    else if (sample->alarm_code != 0)
      command.error(context_.alarm_error(sample->alarm_code, "the drive still reports"));
    else
      command.error(context_.error(Reason::moving, "the axis moves", "stop it, then reset it"));
  });
}

Task<Result<void>> Axis::journal_offset(std::int64_t offset, PositionTrust trust) {
  if (context_.env.persistence == nullptr) co_return Result<void>{};
  // Shared: the answer may come after this sequence was left.
  auto answer = std::make_shared<Promise<Result<void>>>(context_.env.executor, *context_.env.clock);
  context_.env.persistence->save_offset(context_.settings.name, offset_record(offset, trust),
                                        [answer](Result<void> result) { answer->set(std::move(result)); });
  co_return co_await answer->get();
}

Task<> Axis::run_set_position(ActivityPtr activity) {
  activity->command->activate();
  const auto position = *activity->command->value().asked.position;
  const auto sample = co_await sample_after(context_.env.clock->now(), sample_patience);
  if (!current(*activity)) co_return;
  if (!sample || sample->moving) {
    finish(*activity, [&](CommandRecord& command) {
      command.error(sample ? context_.error(Reason::moving, "the axis moves", "wait for standstill")
                           : sample.error());
    });
    co_return;
  }
  if (!co_await noted(activity, {})) co_return;
  // Journalled before it is used (M20): a restart must never meet a newer position with an older offset.
  const auto counter = shaft_.tracker().counter();
  const auto offset = shaft_.tracker().offset_for(position);
  activity->start.save();
  const auto saved = co_await journal_offset(offset, PositionTrust::set);
  if (!current(*activity)) co_return correct_saved_position();
  activity->start.saved();
  if (!saved || shaft_.moved_from(counter)) {
    finish(*activity, [&](CommandRecord& command) {
      command.error(
          saved ? context_.error(Reason::moving, "the axis moved meanwhile", "repeat it at standstill")
                : saved.error());
    });
    lose_trust();
    correct_saved_position();
    co_return;
  }
  shaft_.tracker().declare(offset, PositionTrust::set);
  finish(*activity, [](CommandRecord& command) { command.done(); });
}

}  // namespace axisd
