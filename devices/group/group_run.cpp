#include "devices/group/group_run.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <utility>

#include "devices/group/arrival.hpp"

namespace axisd {

namespace {

/// A member that was started is left alone so long, at most, while others start.
constexpr auto longest_unseen = std::chrono::milliseconds(100);

/// All members are started within this from the acceptance, or none is. A slow line takes some 150 ms each.
constexpr auto assembly_limit = std::chrono::seconds(10);
/// Beyond what a start may wait for alone (M31), for each further member.
constexpr auto assembly_of_one = std::chrono::milliseconds(200);

Error because_of(const Error& cause, const std::string& axis) {
  return {.reason = Reason::superseded,
          .message = "the group move ended: " + named(cause, axis).message,
          .remedy = cause.remedy,
          .outcome = Outcome::not_executed,
          .where = cause.where};
}

/// Of a common start that failed at another one: what became of this one's is not known, either.
Error unknown_with(const Error& cause, const AxisSettings& axis) {
  return {.reason = Reason::not_confirmed,
          .message = fmt::format("{}: whether the common start was executed is not known: {}", axis.name,
                                 cause.message),
          .remedy = "look at the machine; then reset the axis",
          .outcome = Outcome::unknown,
          .where = {.bus = axis.bus, .node = axis.node}};
}

std::string_view axis_of(const CommandPtr& command) { return command->value().axis; }

}  // namespace

GroupRun::GroupRun(Parts parts, std::vector<std::unique_ptr<Axis::Member>> members)
    : parts_(std::move(parts)),
      members_(std::move(members)),
      by_sync_(members_.size()),
      news_(parts_.executor, *parts_.clock) {
  if (parts_.request.start == GroupStart::when_told) preparation_.emplace();
  for (const auto& member : members_) {
    member->wait_for_others(assembly_of_one * (members_.size() - 1));
    commands_.push_back(member->command());
  }
  tie(parts_.clock->now() + assembly_limit);
}

GroupRun::GroupRun(Parts parts, std::vector<CommandPtr> commands)
    : parts_(std::move(parts)), commands_(std::move(commands)), news_(parts_.executor, *parts_.clock) {}

/// Whatever forbids one of them to start, as it stands now, forbids it to all.
void GroupRun::tie(TimePoint not_after) {
  auto guards = std::make_shared<std::vector<MotionGuard>>();
  for (const auto& member : members_) guards->push_back(member->guard());
  for (const auto& member : members_) member->tie(guards, not_after);
}

void GroupRun::watch_members() {
  for (std::size_t i = 0; i < commands_.size(); ++i)
    commands_[i]->observe(weak_from_this(), [this, i](const Command&) {
      // Later: whatever ends a member queues its own stop first.
      post(parts_.executor, [self = weak_from_this(), i] {
        if (const auto alive = self.lock()) alive->on_change(i);
      });
    });
}

void GroupRun::on_change(std::size_t member) {
  const auto& command = commands_[member]->value();
  if (ended(command.state) && command.state != CommandState::done && !members_.empty())
    give_up({.member = member,
             .cause = command.cause.value_or(
                 Error{.reason = Reason::superseded, .message = fmt::format("{}: ended", command.axis)})});
  tell();
}

bool GroupRun::moves(std::string_view axis) const {
  return std::ranges::any_of(commands_, [&](const auto& command) { return axis_of(command) == axis; });
}

void GroupRun::let_go() {
  machine_.give_up();  // there is nothing to give up any more
  for (const auto& member : members_) member->let_go();
}

Task<> GroupRun::run() {
  const auto self = shared_from_this();
  running_ = true;
  auto failure = co_await prepare();
  if (!failure && preparation_) failure = co_await await_moment();
  if (!preparation_) machine_.begin();
  if (!failure && !given_up()) failure = co_await start();
  hold_.reset();
  // On several lines it waited for one while it had the turn on another, or it waited for its moment.
  if (!failure && turns_.size() == 1 && !preparation_) turns_.front().done();
  turns_.clear();
  if (failure) give_up(*failure);
  machine_.all_started();
  if (!given_up())
    for (const auto& member : members_) member->follow();
  tell();
  for (const auto& member : members_)
    if (!given_up()) co_await member->follow_up();
  running_ = false;
}

/// A member that something else has ended meanwhile, or is about to end.
GroupRun::MaybeFailure GroupRun::unready() const {
  for (std::size_t i = 0; i < members_.size(); ++i)
    if (!members_[i]->ready())
      return Failure{.member = i,
                     .cause = members_[i]->command()->value().cause.value_or(Error{
                         .reason = Reason::superseded,
                         .message = fmt::format("{}: it was stopped, or lost, before all members of the "
                                                "group had started",
                                                axis_of(commands_[i])),
                         .remedy = "repeat the move"})};
  return std::nullopt;
}

/// What was not sent at one member may have been forbidden by another, or by what ended the member itself.
GroupRun::Failure GroupRun::attributed(std::size_t member, Error cause) const {
  const bool not_sent = cause.outcome == Outcome::not_sent &&
                        (cause.reason == Reason::superseded || cause.reason == Reason::lease_lost ||
                         cause.reason == Reason::expired);
  if (not_sent && members_[member]->ready()) {
    if (auto other = unready()) return *std::move(other);
  } else if (not_sent) {
    cause = commands_[member]->value().cause.value_or(std::move(cause));
  }
  return {.member = member, .cause = std::move(cause)};
}

Task<GroupRun::MaybeFailure> GroupRun::prepare() {
  if (auto failure = co_await each(&Axis::Member::note); failure || given_up()) co_return failure;
  const auto wait = [this](bool waits) {
    for (const auto& member : members_)
      if (member->start_turns() != nullptr) member->waits_for_turn(waits);
  };
  wait(true);
  co_await take_turns();
  if (given_up()) co_return std::nullopt;
  wait(false);
  co_return co_await examine();
}

Task<GroupRun::MaybeFailure> GroupRun::examine() {
  const auto began = parts_.clock->now();
  for (const Step step : {&Axis::Member::load, &Axis::Member::look})
    if (auto failure = co_await each(step); failure || given_up()) co_return failure;
  const auto read = parts_.clock->now();
  if (auto failure = co_await each(&Axis::Member::verify); failure || given_up()) co_return failure;
  const auto now = parts_.clock->now();
  if (preparation_) note_times(now - began, now - read);
  co_return check_arrival();
}

Task<GroupRun::MaybeFailure> GroupRun::each(Step step) {
  for (std::size_t i = 0; i < members_.size(); ++i) {
    if (const auto done = co_await ((*members_[i]).*step)(); !done) co_return attributed(i, done.error());
    if (given_up()) co_return std::nullopt;
  }
  co_return unready();
}

/// Those of all lines at which members start, in the order of the lines' names: no two groups hold what the
/// other waits for.
Task<> GroupRun::take_turns() {
  struct Line {
    StartTurns* turns;
    int members = 0;
  };
  std::map<std::string, Line> lines;
  for (const auto& member : members_) {
    auto* turns = member->start_turns();
    if (turns == nullptr) continue;
    ++lines.try_emplace(member->axis().settings().bus, turns).first->second.members;
  }
  // Its places on all lines at once: nobody who asks later passes it while it waits for another line.
  for (const auto& [name, line] : lines) turns_.push_back(line.turns->announce(line.members));
  auto turn = turns_.begin();
  for (const auto& [name, line] : lines) {
    co_await line.turns->take(*turn++);
    if (given_up()) co_return;
  }
}

/// Once more: where the members really stand decides.
GroupRun::MaybeFailure GroupRun::check_arrival() const {
  const auto allowed = parts_.request.max_arrival_error;
  if (!parts_.request.arrive_together || !allowed) return std::nullopt;
  std::vector<Duration> durations;
  durations.reserve(members_.size());
  for (const auto& member : members_) durations.push_back(member->predicted());
  if (arrival_error(durations) <= *allowed) return std::nullopt;
  return Failure{.member = 0,
                 .cause = {.reason = Reason::out_of_range,
                           .message = "the members would not arrive together any more: one has moved",
                           .remedy = "repeat the move"}};
}

std::vector<std::vector<std::size_t>> GroupRun::common_starts() const {
  std::vector<std::vector<std::size_t>> sets;
  const auto bus_of = [this](std::size_t i) { return members_[i]->axis().settings().bus; };
  for (std::size_t i = 0; i < members_.size(); ++i) {
    if (members_[i]->prepared() == nullptr || members_[i]->there()) continue;
    const auto same =
        std::ranges::find_if(sets, [&](const auto& set) { return bus_of(set.front()) == bus_of(i); });
    if (same == sets.end())
      sets.push_back({i});
    else
      same->push_back(i);
  }
  return sets;
}

Task<GroupRun::MaybeFailure> GroupRun::start() {
  // Of the first one: the others follow as fast as their buses are.
  PreparedMove::StartWindow window;
  if (preparation_)
    window = {.not_before = *preparation_->starts_at, .not_after = *preparation_->starts_at + latest_start};
  for (auto& together : common_starts())
    if (auto failure = co_await start_by_sync(std::move(together), std::exchange(window, {}));
        failure || given_up())
      co_return failure;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    auto& member = *members_[i];
    if (member.there() || member.prepared() != nullptr) continue;
    if (window.not_before != TimePoint{})
      if (auto failure = co_await approach(i); failure || given_up()) co_return failure;
    if (auto lost = unready()) co_return lost;
    member.about_to_start();
    const auto at = co_await member.trigger(std::exchange(window, {}).not_after);
    hold_.reset();
    if (!at && at.error().outcome != Outcome::unknown) member.not_started();
    if (given_up()) co_return std::nullopt;  // it got its stop then
    if (!at) co_return attributed(i, at.error());
    member.started(*at);
    if (auto failure = co_await look_after_the_started(); failure || given_up()) co_return failure;
  }
  co_return std::nullopt;
}

/// Between two starts, the one that nobody has looked at for longest, if that is long: on a slow line many
/// starts take seconds. Each look puts the starts behind it off, and the first look at all that have started.
Task<GroupRun::MaybeFailure> GroupRun::look_after_the_started() {
  std::size_t member = 0;
  for (std::size_t i = 1; i < members_.size(); ++i)
    if (members_[i]->unseen_for() > members_[member]->unseen_for()) member = i;
  auto& oldest = *members_[member];
  if (oldest.unseen_for() <= std::max<Duration>(oldest.axis().settings().poll_moving, longest_unseen))
    co_return std::nullopt;
  const auto seen = co_await oldest.look_after();
  if (seen || given_up()) co_return std::nullopt;
  co_return attributed(member, seen.error());
}

Task<GroupRun::MaybeFailure> GroupRun::start_by_sync(std::vector<std::size_t> together,
                                                     PreparedMove::StartWindow window) {
  if (window.not_before != TimePoint{}) co_await pause_until(window.not_before - sync_approach());
  if (auto lost = unready()) co_return lost;
  for (const auto i : together) {
    const auto until = co_await members_[i]->look_again();
    if (given_up()) co_return std::nullopt;
    if (!until) co_return attributed(i, until.error());
    window.not_after = std::min(window.not_after, *until);
  }
  if (auto lost = unready()) co_return lost;
  std::vector<PreparedMove*> others;
  for (const auto i : together) {
    members_[i]->about_to_start();
    if (i != together.front()) others.push_back(members_[i]->prepared());
  }
  const auto at = co_await members_[together.front()]->prepared()->start_with(std::move(others), window);
  if (!at && at.error().outcome != Outcome::unknown)
    for (const auto i : together) members_[i]->not_started();
  if (given_up()) co_return std::nullopt;
  if (at) {
    for (const auto i : together) {
      by_sync_[i] = true;
      members_[i]->started(*at);
    }
    co_return std::nullopt;
  }
  const auto culprit = member_at(at.error().where, together);
  if (at.error().outcome == Outcome::unknown)
    for (const auto i : together)  // of none of them is it known
      if (i != culprit) members_[i]->end_failed(unknown_with(at.error(), members_[i]->axis().settings()));
  co_return attributed(culprit, at.error());
}

std::size_t GroupRun::member_at(const Address& where, const std::vector<std::size_t>& among) const {
  for (const auto i : among)
    if (where.node && members_[i]->axis().settings().node == *where.node) return i;
  return among.front();
}

/// Those that may move first, and at once: all of these stops are queued before anything else happens.
void GroupRun::give_up(const Failure& failure) {
  if (given_up()) return;
  const std::string axis(axis_of(commands_[failure.member]));
  begin_to_give_up(named(failure.cause, axis));
  const auto others = because_of(failure.cause, axis);
  const bool culprit_may_run = members_[failure.member]->may_run();
  if (culprit_may_run) members_[failure.member]->end_failed(failure.cause);
  for (const bool moving : {true, false})
    for (const auto& member : members_)
      if (member != members_[failure.member] && member->may_run() == moving) member->end_aborted(others);
  if (!culprit_may_run) members_[failure.member]->end_failed(failure.cause);
}

/// Nobody's fault among them.
void GroupRun::give_up(const Error& common) {
  if (given_up()) return;
  begin_to_give_up(common);
  for (const bool moving : {true, false})
    for (const auto& member : members_)
      if (member->may_run() == moving) member->end_aborted(common);
}

void GroupRun::begin_to_give_up(Error cause) {
  machine_.give_up();
  turns_.clear();
  hold_.reset();
  unrenewed_.reset();
  news_.notify_all();
  if (std::ranges::any_of(commands_, [](const auto& command) { return !command->has_ended(); }))
    spdlog::warn("group move {} ends: {}", parts_.id, to_string(cause));
  cause_ = std::move(cause);
}

void GroupRun::observe(Observer observer) {
  if (!observer(*this)) observers_.push_back(std::move(observer));
}

void GroupRun::tell() {
  auto observers = std::exchange(observers_, {});
  std::erase_if(observers, [this](const Observer& observer) { return observer(*this); });
  observers_.insert(observers_.begin(), observers.begin(), observers.end());
}

}  // namespace axisd
