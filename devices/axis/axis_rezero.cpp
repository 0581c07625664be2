// The drive's counter is zeroed before a target could leave it.
#include <cstdlib>

#include "devices/axis/axis.hpp"
#include "devices/axis/chain.hpp"

namespace axisd {

namespace {

/// A counter that was told to become zero shows it within this.
constexpr auto zeroing_window = milliseconds(200);
constexpr auto zeroing_poll = milliseconds(5);

}  // namespace

/// Zeroes the drive's counter before a target could leave its 32 bit, or what the drive takes (M19).
Task<Result<void>> Axis::make_room(ActivityPtr activity) {
  if (context_.planner.reachable(activity->plan.target->counter)) co_return Result<void>{};
  // After it the saved record speaks of another zero, and would fit again where the counter comes by (M20).
  activity->start.save();
  if (auto forgotten = co_await forget_saved_position(); !forgotten) co_return forgotten;
  if (!current(*activity)) co_return fail(context_.error(Reason::superseded, "superseded"));
  activity->start.saved();
  // Not before: who waits for the disk is looked after meanwhile.
  const Chain chain(*this);
  // A sample that was asked for meanwhile may show either counter: none is taken for a motion.
  shaft_.watch().begin_rezeroing();
  auto cleared = co_await context_.drive->clear_position(guard(*activity));
  // Without a reply it may have been cleared: the counter tells, and clearing it twice changes nothing.
  if (!cleared && cleared.error().outcome != Outcome::unknown) {
    shaft_.watch().end_rezeroing();
    co_return cleared;
  }
  const bool zero = co_await counter_shows_zero();
  shaft_.watch().end_rezeroing();
  if (zero) {
    shaft_.tracker().rezero(0);
    activity->plan.target = shaft_.tracker().again(*activity->plan.target);
    co_return Result<void>{};
  }
  // It may become zero at any time, which would look like a motion.
  lose_trust();
  shaft_.tracker().forget_base();
  auto cause = context_.error(Reason::not_confirmed, "the drive's position counter could not be zeroed",
                              "repeat the move");
  cause.outcome = Outcome::not_executed;
  co_return fail(std::move(cause));
}

/// When an acknowledged zeroing shows is not said. The poll rests meanwhile, so what these samples tell is
/// heard here. Goes on when superseded: what the counter means has to be known all the same.
Task<bool> Axis::counter_shows_zero() {
  const auto latest = context_.env.clock->now() + zeroing_window;
  for (;;) {
    const auto sample = co_await context_.drive->read_state(TransactionClass::motion);
    if (sample) {
      on_sample(*sample);
      if (sample->moving) co_return false;
      if (std::abs(std::int64_t{sample->position_pulses}) <= context_.drive->position_window())
        co_return true;
    }
    if (context_.env.clock->now() >= latest) co_return false;
    co_await sleep_until(context_.env.executor, *context_.env.clock,
                         context_.env.clock->now() + zeroing_poll);
  }
}

}  // namespace axisd
