#include "devices/axis/command_book.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace axisd {

namespace {

/// Ended commands without an id of their client's beyond this are forgotten earlier than others.
constexpr std::size_t history = 10'000;
/// Ids that are remembered at the same time; then new ones are refused.
constexpr std::size_t most_named = 100'000;
/// So many are looked at whenever a command is entered: the core has other things to do.
constexpr int looked_at_once = 16;

/// Nothing is sent for it before CommandBook::sending() was answered: without that nothing was.
bool noted_before_start(CommandKind kind) {
  switch (kind) {
    case CommandKind::enable:
    case CommandKind::home:
    case CommandKind::move_absolute:
    case CommandKind::move_relative:
    case CommandKind::move_velocity:
    case CommandKind::move_group:
    case CommandKind::jog:
    case CommandKind::set_position:
      return true;
    default:
      return false;
  }
}

std::string key_of(const std::string& client, const std::string& request_id) {
  return client + "\n" + request_id;
}

std::string text_of(const std::optional<double>& value) { return value ? fmt::format("{:a}", *value) : "-"; }
std::string text_of(const std::optional<Duration>& value) {
  return value ? fmt::format("{}", value->count()) : "-";
}
std::string text_of(const MotionValues& values) {
  return fmt::format("{} {} {}", text_of(values.velocity), text_of(values.acceleration_time),
                     text_of(values.deceleration_time));
}

struct DigestOf {
  std::string operator()(const EnableRequest&) const { return "enable"; }
  std::string operator()(const DisableRequest&) const { return "disable"; }
  std::string operator()(const HomeRequest&) const { return "home"; }
  std::string operator()(const ResetRequest&) const { return "reset"; }
  std::string operator()(const MoveAbsoluteRequest& r) const {
    return fmt::format("absolute {:a} {}", r.position, text_of(r.with));
  }
  std::string operator()(const MoveRelativeRequest& r) const {
    return fmt::format("relative {:a} {}", r.distance, text_of(r.with));
  }
  std::string operator()(const MoveVelocityRequest& r) const {
    return fmt::format("velocity {:a} {} {}", r.velocity, text_of(r.hold), text_of(r.with));
  }
  std::string operator()(const JogRequest& r) const {
    return fmt::format("jog {:a} {} {}", r.velocity, r.hold.count(), text_of(r.with));
  }
  std::string operator()(const StopRequest& r) const {
    return fmt::format("stop {} {}", std::to_underlying(r.kind), r.hold);
  }
  std::string operator()(const SetPositionRequest& r) const { return fmt::format("set {:a}", r.position); }
  std::string operator()(const GroupMemberRequest& r) const {
    return fmt::format("group {} {} {} of {}", text_of(r.position), text_of(r.distance), text_of(r.with),
                       r.whole);
  }
};

struct AskedOf {
  static MotionValues with(MotionValues values, std::optional<double> position,
                           std::optional<double> distance) {
    values.position = position;
    values.distance = distance;
    return values;
  }
  MotionValues operator()(const MoveAbsoluteRequest& r) const { return with(r.with, r.position, {}); }
  MotionValues operator()(const MoveRelativeRequest& r) const { return with(r.with, {}, r.distance); }
  MotionValues operator()(const MoveVelocityRequest& r) const {
    auto values = r.with;
    values.velocity = r.velocity;
    values.hold = r.hold;
    return values;
  }
  MotionValues operator()(const JogRequest& r) const {
    auto values = r.with;
    values.velocity = r.velocity;
    values.hold = r.hold;
    return values;
  }
  MotionValues operator()(const SetPositionRequest& r) const { return {.position = r.position}; }
  MotionValues operator()(const GroupMemberRequest& r) const { return with(r.with, r.position, r.distance); }
  template <class Other>
  MotionValues operator()(const Other&) const {
    return {};
  }
};

}  // namespace

std::string digest(const std::string& axis, const Action& action) {
  return axis + " " + std::visit(DigestOf{}, action);
}

void CommandRecord::activate() {
  if (command_.state != CommandState::accepted) return;
  command_.state = CommandState::active;
  command_.started_at = clock_->wall(clock_->now());
  tell();
}

void CommandRecord::end(CommandState state, std::optional<Error> cause) {
  if (has_ended()) return;
  // What has begun was sent, whoever ended it.
  if (command_.state == CommandState::active && cause && cause->outcome == Outcome::not_sent)
    cause->outcome = Outcome::unknown;
  command_.state = state;
  command_.cause = std::move(cause);
  ended_when_ = clock_->now();
  command_.ended_at = clock_->wall(ended_when_);
  // Whoever sent it may not have waited for its end.
  if (state == CommandState::error || state == CommandState::unknown)
    spdlog::warn("{}: {} ended as {} ({}){}", command_.axis, to_string(command_.kind), to_string(state),
                 command_.id, command_.cause ? ": " + to_string(*command_.cause) : "");
  tell();
  observers_.clear();
}

void CommandRecord::observe(std::weak_ptr<void> alive, Observer observer) {
  if (!has_ended()) observers_.emplace_back(std::move(alive), std::move(observer));
}

void CommandRecord::tell() {
  std::erase_if(observers_, [](const auto& entry) { return entry.first.expired(); });
  // Observers may add others while they run.
  const auto current = observers_;
  for (const auto& [alive, observer] : current)
    if (!alive.expired()) observer(command_);
}

CommandBook::CommandBook(Clock& clock, std::string instance_id, CommandJournal* journal)
    : clock_(&clock), instance_id_(std::move(instance_id)), journal_(journal) {
  if (journal_ != nullptr) restore(journal_->take_loaded());
}

void CommandBook::restore(JournalContent content) {
  if (content.doubtful_until) {
    const auto left =
        std::chrono::duration_cast<Duration>(*content.doubtful_until - clock_->wall(clock_->now()));
    doubtful_until_ = clock_->now() + std::clamp(left, Duration{0}, longest_validity);
    damage_ = content.damage;
    spdlog::error(
        "the command journal was damaged ({}): requests that it does not know are refused for {} s, as they "
        "may have been executed before",
        damage_, std::chrono::duration_cast<std::chrono::seconds>(doubtful_until_ - clock_->now()).count());
  }
  std::map<std::string, const JournalledCommand*> last_sent;
  for (const auto& journalled : content.commands)
    if (journalled.sent) last_sent[journalled.command.axis] = &journalled;
  for (const auto& journalled : content.commands) {
    const auto& value = journalled.command;
    const auto record = std::make_shared<CommandRecord>(value, *clock_);
    const auto entry = enter(record, journalled.digest, key_of(value.client, value.request_id));
    entry->sending = journalled.sent;
    for (const auto& request : journalled.attached)
      enter(record, request.digest, key_of(request.client, request.request_id));
    if (record->has_ended()) continue;
    follow(entry);
    if (journalled.sent || !noted_before_start(value.kind)) {
      const bool last = last_sent[value.axis] == &journalled && !content.doubtful_until;
      unsettled_[value.axis].push_back({.command = record, .note = journalled.note, .tellable = last});
    } else {
      record->abort({.reason = Reason::cancelled,
                     .message = fmt::format("{}: the daemon ended before anything was sent", value.axis),
                     .remedy = "send a new request",
                     .outcome = Outcome::not_executed});
    }
  }
  for (auto& [axis, outcome] : content.unknown_outcomes) {
    auto& [id, cause] = outcome;
    cause.message =
        fmt::format("before the daemon was restarted, {} ended as unknown: {}", id, cause.message);
    unknown_outcomes_.emplace(axis, std::move(cause));
  }
}

Result<CommandPtr> CommandBook::find_repeat(const std::string& axis, const Action& action,
                                            const CommandOptions& options) {
  if (options.request_id.empty()) return nullptr;
  const auto now = clock_->now();
  if (const auto found = by_request_.find(key_of(options.client, options.request_id));
      found != by_request_.end()) {
    found->second->heard_of = now;
    if (found->second->digest == digest(axis, action)) return found->second->command;
    return fail(Reason::request_id_conflict,
                fmt::format("request_id '{}' was used before for another request ({})", options.request_id,
                            found->second->command->value().id),
                "use a new request_id for each new request");
  }
  if (now < doubtful_until_)
    return fail(
        {.reason = Reason::storage,
         .message =
             fmt::format("{}: whether this request was executed before is not known: the command journal was "
                         "damaged ({})",
                         axis, damage_),
         .remedy = fmt::format("read the axis; what is asked for in {} s or later is new",
                               std::chrono::ceil<std::chrono::seconds>(doubtful_until_ - now).count()),
         .outcome = Outcome::unknown});
  forget_old();
  if (named_.size() >= most_named)
    return fail(Reason::busy, fmt::format("{} request ids are remembered already", named_.size()),
                "send fewer requests; each id is remembered for 30 minutes");
  return nullptr;
}

CommandPtr CommandBook::open(const std::string& axis, const Action& action, const CommandOptions& options) {
  forget_old();
  const auto now = clock_->now();
  Command command{.id = fmt::format("{}-{}", instance_id_, ++last_),
                  .axis = axis,
                  .request_id = options.request_id,
                  .client = options.client,
                  .kind = kind_of(action),
                  .asked = std::visit(AskedOf{}, action),
                  .accepted_at = clock_->wall(options.arrived == TimePoint{} ? now : options.arrived)};
  const auto entry = enter(std::make_shared<CommandRecord>(std::move(command), *clock_), digest(axis, action),
                           key_of(options.client, options.request_id));
  follow(entry);
  if (journal_ != nullptr && !options.request_id.empty())
    journal_->accepted(entry->command->value(), entry->digest);
  if (opened_) opened_(entry->command);
  return entry->command;
}

CommandBook::EntryPtr CommandBook::enter(CommandPtr command, std::string digest, std::string request_key) {
  const auto now = clock_->now();
  auto entry = std::make_shared<Entry>(Entry{.command = std::move(command),
                                             .digest = std::move(digest),
                                             .request_key = std::move(request_key),
                                             .heard_of = now,
                                             .queued = now});
  by_id_.emplace(entry->command->value().id, entry);  // the first one is the command's own
  const bool named = !entry->request_key.ends_with('\n');
  if (named) by_request_.insert_or_assign(entry->request_key, entry);
  (named ? named_ : unnamed_).push_back(entry);
  return entry;
}

void CommandBook::attach(const CommandPtr& command, const std::string& axis, const Action& action,
                         const CommandOptions& options, CommandJournal::Callback known) {
  if (!options.request_id.empty()) {
    const auto entry = enter(command, digest(axis, action), key_of(options.client, options.request_id));
    if (journal_ != nullptr)
      return journal_->attached(
          command->value().id,
          {.client = options.client, .request_id = options.request_id, .digest = entry->digest},
          std::move(known));
  }
  known({});
}

void CommandBook::sending(const CommandPtr& command, SendingNote note, CommandJournal::Callback done) {
  const auto& value = command->value();
  if (journal_ == nullptr || value.request_id.empty()) return done({});
  if (const auto found = by_id_.find(value.id); found != by_id_.end()) found->second->sending = true;
  journal_->sending(value, std::move(note), std::move(done));
}

/// Tells the journal what becomes of a command.
void CommandBook::follow(const EntryPtr& entry) {
  if (journal_ == nullptr) return;
  entry->command->observe(alive_, [this, entry = std::weak_ptr(entry)](const Command&) {
    if (const auto changed = entry.lock()) on_change(*changed);
  });
}

void CommandBook::on_change(Entry& entry) {
  const auto& value = entry.command->value();
  const bool resets = value.kind == CommandKind::reset && value.state == CommandState::done;
  const bool kept = !value.request_id.empty() || value.state == CommandState::unknown || resets;
  if (!kept) return;
  if (ended(value.state)) return journal_->ended(value);
  // What moves nothing is not waited for.
  if (!std::exchange(entry.sending, true)) journal_->sending(value, {}, {});
}

std::optional<Error> CommandBook::trouble() const {
  return journal_ == nullptr ? std::nullopt : journal_->trouble();
}

std::vector<Unsettled> CommandBook::take_unsettled(const std::string& axis) {
  auto taken = unsettled_.extract(axis);
  return taken.empty() ? std::vector<Unsettled>() : std::move(taken.mapped());
}

std::optional<Error> CommandBook::take_unknown_outcome(const std::string& axis) {
  auto found = unknown_outcomes_.extract(axis);
  return found.empty() ? std::nullopt : std::optional(std::move(found.mapped()));
}

void CommandBook::give_up_unsettled() {
  for (const auto& [axis, all] : std::exchange(unsettled_, {}))
    for (const auto& each : all)
      each.command->unknown({.reason = Reason::unknown_axis,
                             .message = fmt::format("{}: the daemon was restarted without this axis", axis),
                             .remedy = "look at the machine",
                             .outcome = Outcome::unknown});
}

CommandPtr CommandBook::find(const std::string& id) const {
  const auto found = by_id_.find(id);
  return found == by_id_.end() ? nullptr : found->second->command;
}

bool CommandBook::forgettable(const Entry& entry, TimePoint now) {
  return entry.command->has_ended() &&
         std::max(entry.heard_of, entry.command->ended_when()) + remembered < now;
}

void CommandBook::forget(const EntryPtr& entry) {
  const auto erase = [&](auto& from, const std::string& key) {
    if (const auto same = from.find(key); same != from.end() && same->second == entry) from.erase(same);
  };
  erase(by_id_, entry->command->value().id);
  erase(by_request_, entry->request_key);
}

/// A few at a time; what is still needed goes to the end of its queue, so that it holds up nothing.
void CommandBook::forget_old() {
  const auto now = clock_->now();
  const auto look = [&](std::deque<EntryPtr>& queue, const auto& due, const auto& over) {
    for (int looked = 0; looked < looked_at_once && !queue.empty() && due(*queue.front()); ++looked) {
      auto entry = std::move(queue.front());
      queue.pop_front();
      if (over(*entry)) {
        forget(entry);
      } else {
        entry->queued = now;
        queue.push_back(std::move(entry));
      }
    }
  };
  look(
      named_, [&](const Entry& entry) { return entry.queued + remembered < now; },
      [&](const Entry& entry) { return forgettable(entry, now); });
  look(
      unnamed_,
      [&](const Entry& entry) { return unnamed_.size() > history || entry.queued + remembered < now; },
      [&](const Entry& entry) {
        return forgettable(entry, now) || (unnamed_.size() >= history && entry.command->has_ended());
      });
}

}  // namespace axisd
