// Group moves that start at a moment that is told once they are prepared: with those of other machines. The
// moment is that of the first start; it is missed by `latest_start` at most, or nothing starts (M31).
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/seconds.hpp"
#include "devices/group/group_run.hpp"

namespace axisd {

namespace {

/// Beyond what the look at all members takes: readings of other axes get in its way.
constexpr auto examination_reserve = std::chrono::milliseconds(30);
/// Before a start of its own its bus is held, and then its member is verified: what is under way on the bus
/// ends in between.
constexpr auto hold_reserve = std::chrono::milliseconds(20),
               verification_reserve = std::chrono::milliseconds(5);
/// Others at rest are not read meanwhile: on a slow line the verification begins before the hold.
constexpr Duration longest_hold = std::chrono::milliseconds(80);
/// Some answers to SDOs of each member, side by side.
constexpr Duration longest_sync_approach = std::chrono::milliseconds(20);
/// Of a start that follows another one.
constexpr auto longest_later_start = std::chrono::milliseconds(200);
/// It asks for its turns on the lines so long before the last look: until then others may start.
constexpr auto turn_reserve = std::chrono::milliseconds(250);
/// Whoever prepares several machines needs so long to choose a moment, at least.
constexpr auto least_choice = std::chrono::milliseconds(500);

}  // namespace

/// What the look at all members took, and of that to verify them, tells what the last look will take.
void GroupRun::note_times(Duration examination, Duration verification) {
  const auto alone =
      std::ranges::count_if(members_, [](const auto& m) { return !m->there() && m->prepared() == nullptr; });
  if (alone > 0) verifying_ = verification / alone;
  if (machine_.state() != GroupMachine::State::preparing) return;
  preparation_->notice = examination * 3 / 2 + examination_reserve;
  const auto starts = alone + static_cast<std::ptrdiff_t>(common_starts().size());
  preparation_->predicted_skew = verifying_ * std::max<std::ptrdiff_t>(starts - 1, 0);
}

/// So long before the moment of a SYNC what it starts is looked at for the last time.
Duration GroupRun::sync_approach() const {
  Duration guard = Duration::max();
  for (const auto& member : members_) guard = std::min(guard, member->axis().settings().reboot_guard);
  return std::min<Duration>(longest_sync_approach, guard / 2);
}

/// Until it is to be awaited no longer, or `when`.
Task<> GroupRun::pause_until(TimePoint when) {
  while (!given_up() && parts_.clock->now() < when) co_await news_.wait_until(when);
}

Task<GroupRun::MaybeFailure> GroupRun::await_moment() {
  if (given_up()) co_return std::nullopt;
  if (preparation_->notice + least_choice > longest_preparation) {
    give_up(
        {.reason = Reason::not_supported,
         .message = fmt::format("a last look at all members takes {:.3f} s: too long for a start at a moment",
                                in_seconds(preparation_->notice)),
         .remedy = "name fewer axes, or use a faster line"});
    co_return std::nullopt;
  }
  turns_.clear();  // others may start meanwhile
  const auto expires = parts_.clock->now() + longest_preparation;
  preparation_->expires = expires;
  for (const auto& member : members_) member->set_down(expires);
  machine_.prepared();
  tell();
  while (machine_.state() == GroupMachine::State::prepared) co_await news_.wait();
  if (given_up()) co_return std::nullopt;
  const auto at = *preparation_->starts_at;
  co_await pause_until(at - preparation_->notice - turn_reserve);
  if (given_up()) co_return std::nullopt;
  co_await take_turns();
  co_await pause_until(at - preparation_->notice);
  if (given_up()) co_return std::nullopt;
  if (machine_.state() == GroupMachine::State::told) {
    // One machine alone starts nothing.
    give_up({.reason = Reason::expired,
             .message = "its moment is near, and nobody has said that its other machines were told, too",
             .remedy = "look at the coordinator; then move again"});
    co_return std::nullopt;
  }
  machine_.begin();
  const auto latest = at + latest_start + longest_later_start * (members_.size() - 1);
  for (const auto& member : members_) member->take_up(latest);
  tie(latest);
  co_return co_await examine();
}

/// Its bus is free at the moment, and what its start rests on is fresh then.
Task<GroupRun::MaybeFailure> GroupRun::approach(std::size_t first) {
  const auto at = *preparation_->starts_at;
  const auto held_from = at - std::min(2 * verifying_, longest_hold) - hold_reserve;
  const auto hold = parts_.clock->call_at(held_from, [this, first] {
    if (!given_up()) hold_ = members_[first]->hold_bus();
  });
  co_await pause_until(at - verifying_ * 5 / 4 - verification_reserve);
  if (given_up()) co_return std::nullopt;
  if (const auto verified = co_await members_[first]->verify(); !verified)
    co_return attributed(first, verified.error());
  co_await pause_until(at);
  co_return std::nullopt;
}

Result<void> GroupRun::start_at(TimePoint at) {
  using State = GroupMachine::State;
  const auto now = parts_.clock->now();
  if (!preparation_)
    return fail(Reason::invalid_argument,
                "this move was not prepared to be started, or not since the daemon started",
                "prepare a move");
  const auto& told = preparation_->starts_at;
  if (told && *told != at)
    return fail(Reason::request_id_conflict, "it was told to start at another moment", "ask how it stands");
  if (told) return {};
  if (given_up() || ended(state())) return fail(cause().value_or(Error{}));
  if (machine_.state() == State::preparing)
    return fail(Reason::busy, "it is not prepared yet", "wait for the answer to PrepareMove");
  const auto in = [now](TimePoint moment) { return in_seconds(moment - now); };
  if (at < now + preparation_->notice)
    return fail(Reason::expired,
                fmt::format("its moment is in {:.3f} s; it has to be told {:.3f} s before", in(at),
                            in_seconds(preparation_->notice)),
                "prepare it again, and choose a later moment");
  if (at > *preparation_->expires)
    return fail(
        Error{.reason = Reason::out_of_range,
              .message = fmt::format("its moment is in {:.3f} s, and it is prepared for {:.3f} s more",
                                     in(at), in(*preparation_->expires)),
              .remedy = "choose a nearer moment",
              .permitted = Range{.minimum = in_seconds(preparation_->notice),
                                 .maximum = in(*preparation_->expires),
                                 .unit = "s"}});
  preparation_->starts_at = at;
  machine_.told();
  renew(GroupRenewal::waits);
  news_.notify_all();
  return {};
}

void GroupRun::renew(GroupRenewal renewal) {
  if (!machine_.runs() || ended(state())) return;
  if (renewal == GroupRenewal::all_told) machine_.all_told();
  unrenewed_ = parts_.clock->call_at(parts_.clock->now() + renewal_limit, [this] {
    if (ended(state())) return;
    give_up(Error{.reason = Reason::expired,
                  .message = fmt::format("whoever coordinates the move has not renewed it for {:.1f} s",
                                         in_seconds(renewal_limit)),
                  .remedy = "look at the coordinator; then move again"});
  });
}

}  // namespace axisd
