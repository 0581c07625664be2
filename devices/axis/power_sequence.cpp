// Sequences that move nothing: power, reset, and what the position means.
#include "devices/axis/power_sequence.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>

#include "devices/axis/drive_connection.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/lease_duty.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/saved_position.hpp"
#include "devices/axis/start_wait.hpp"
#include "devices/axis/state_reader.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

namespace {

/// A sample that was asked for is expected within this, or the link is lost anyway.
constexpr auto sample_patience = std::chrono::seconds(5);

}  // namespace

/// M1, M23: power, or the end of a halt, never moves. Whatever this is, it ends here.
void PowerSequence::on_turned_by_power(const Error& cause) {
  execution_.enter_error_stop(cause);
  stopper_.machine().leave_running();
  stopper_.begin_stop(StopKind::stop, nullptr);
  publisher_.publish();
}

Task<> PowerSequence::run_enable(ActivityPtr activity) {
  if (!co_await starts_.noted(activity, {})) co_return;
  Result<void> result;
  {
    const StateReader::Chain chain(reader_);
    result = co_await reader_.look(Duration{});  // the shaft may have been turned since it was read
    if (!execution_.current(*activity)) co_return;
    if (result) result = co_await context_.drive->enable(execution_.guard(*activity));
  }
  if (!execution_.current(*activity)) co_return;
  if (!result && result.error().reason == Reason::rebooted) {
    connection_.on_reboot(result.error());
    co_return;
  }
  if (!result && result.error().reason == Reason::terminal) {
    on_turned_by_power(result.error());
    co_return;
  }
  // Whether an enable without a reply was executed shows in the next samples.
  const bool uncertain = !result && result.error().outcome == Outcome::unknown;
  if (!result && !uncertain) {
    starts_.end_unsent(*activity, result.error());
    co_return;
  }
  activity->command->activate();
  EnableMachine enable(context_.env.clock->now(), context_.settings.brake.release_time);
  const auto before = shaft_.tracker().counter();
  while (enable.goes_on()) {
    const auto sample = co_await reader_.sample_after(context_.env.clock->now(), sample_patience);
    if (!execution_.current(*activity)) co_return;
    if (sample)
      enable.look(*sample, shaft_.moved_from(before), context_.env.clock->now());
    else
      enable.silent();
  }
  end_enable(*activity, enable.state(), uncertain ? std::optional(result.error()) : std::nullopt);
}

/// `unanswered`: what became of its frame, where that got no reply.
void PowerSequence::end_enable(Activity& activity, EnableMachine::State state,
                               std::optional<Error> unanswered) {
  if (state == EnableMachine::State::turned)
    return on_turned_by_power(context_.error(Reason::terminal, "the drive moved when it was enabled",
                                             "check terminals that start motion; then reset the axis"));
  if (state == EnableMachine::State::on) {
    const bool restarted = power_.state() == PowerMachine::State::restarted;
    power_.enabled();
    if (restarted) saved_.correct_saved_position();  // a later run of the daemon need not know of it any more
    return execution_.finish(activity, [](CommandRecord& command) { command.done(); });
  }
  auto cause = context_.error(Reason::not_confirmed, "the drive does not report its power stage as on",
                              "check terminals with the function motor_free, and alarms");
  if (unanswered) {
    unanswered->message = cause.message + ", and the frame that enables it got no reply";
    unanswered->remedy = "enable it again; if that is of no use: " + unanswered->remedy;
    if (!context_.terminals.has("motor_free")) unanswered->outcome = Outcome::not_executed;
    cause = *std::move(unanswered);
  }
  execution_.finish(activity, [&](CommandRecord& command) { command.error(std::move(cause)); });
}

Task<> PowerSequence::run_disable(ActivityPtr activity) {
  activity->command->activate();
  // A fault does not stand in the way of releasing: only the motion has to have ended.
  while (stopper_.machine().under_way() && execution_.current(*activity)) co_await stopper_.stopped().wait();
  if (!execution_.current(*activity)) co_return;
  if (stopper_.machine().owed()) {
    execution_.finish(*activity, [&](CommandRecord& command) {
      command.error(context_.error(Reason::not_confirmed, "not released: standstill was not confirmed",
                                   "look at the machine; cut its power if it moves"));
    });
    co_return;
  }
  const auto result = co_await context_.drive->disable(execution_.guard(*activity));
  if (!execution_.current(*activity)) co_return;
  const auto sample = result ? co_await reader_.sample_after(context_.env.clock->now(), sample_patience)
                             : fail(result.error());
  if (!execution_.current(*activity)) co_return;
  if (sample && !sample->enabled && context_.settings.brake.engage_time > Duration{}) {
    co_await sleep_until(context_.env.executor, *context_.env.clock,
                         context_.env.clock->now() + context_.settings.brake.engage_time);
    if (!execution_.current(*activity)) co_return;
  }
  if (sample && !sample->enabled) {
    execution_.finish(*activity, [](CommandRecord& command) { command.done(); });
    lease_.release_as_owed();  // this was it
    co_return;
  }
  const auto cause = sample ? context_.error(Reason::not_confirmed,
                                             "the drive still reports its power stage as on", "try again")
                            : sample.error();
  lease_.give_up_release(cause);
  starts_.end_unsent(*activity, cause);
}

Task<> PowerSequence::run_reset(ActivityPtr activity) {
  activity->command->activate();
  if (shaft_.sample() && shaft_.sample()->alarm_code != 0) {
    const auto cleared = co_await context_.drive->clear_alarm(execution_.guard(*activity));
    if (!execution_.current(*activity)) co_return;
    if (!cleared) {
      starts_.end_unsent(*activity, cleared.error());
      co_return;
    }
  }
  // A successful read-back is part of it: after an unknown outcome nothing may start before that.
  const auto sample = co_await reader_.sample_after(context_.env.clock->now(), sample_patience);
  if (!execution_.current(*activity)) co_return;
  const bool clean = sample && sample->alarm_code == 0 && !sample->moving;
  if (clean) execution_.clear_fault();
  execution_.finish(*activity, [&](CommandRecord& command) {
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

Task<> PowerSequence::run_set_position(ActivityPtr activity) {
  activity->command->activate();
  const auto position = *activity->command->value().asked.position;
  const auto sample = co_await reader_.sample_after(context_.env.clock->now(), sample_patience);
  if (!execution_.current(*activity)) co_return;
  if (!sample || sample->moving) {
    execution_.finish(*activity, [&](CommandRecord& command) {
      command.error(sample ? context_.error(Reason::moving, "the axis moves", "wait for standstill")
                           : sample.error());
    });
    co_return;
  }
  if (!co_await starts_.noted(activity, {})) co_return;
  // Journalled before it is used (M20): a restart must never meet a newer position with an older offset.
  const auto counter = shaft_.tracker().counter();
  const auto offset = shaft_.tracker().offset_for(position);
  activity->start.save();
  const auto saved = co_await saved_.journal_offset(offset, PositionTrust::set);
  if (!execution_.current(*activity)) co_return saved_.correct_saved_position();
  activity->start.saved();
  if (!saved || shaft_.moved_from(counter)) {
    execution_.finish(*activity, [&](CommandRecord& command) {
      command.error(
          saved ? context_.error(Reason::moving, "the axis moved meanwhile", "repeat it at standstill")
                : saved.error());
    });
    readings_.lose_trust();
    saved_.correct_saved_position();
    co_return;
  }
  shaft_.tracker().declare(offset, PositionTrust::set);
  execution_.finish(*activity, [](CommandRecord& command) { command.done(); });
}

}  // namespace axisd
