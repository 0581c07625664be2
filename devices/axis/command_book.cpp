#include "devices/axis/command_book.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace axisd {

namespace {

/// That an ended command was asked for again is told to the journal so often at most.
constexpr auto heard_again = std::chrono::minutes(1);

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

Error used_before(const std::string& request_id, const std::string& command) {
  return {
      .reason = Reason::request_id_conflict,
      .message = fmt::format("request_id '{}' was used before for another request ({})", request_id, command),
      .remedy = "use a new request_id for each new request"};
}

}  // namespace

CommandBook::CommandBook(Clock& clock, std::string instance_id, CommandJournal* journal, IdLimits limits)
    : clock_(&clock), instance_id_(std::move(instance_id)), journal_(journal), limits_(limits) {
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
  // The journal's times go on where they were: a restart makes nothing younger, and nothing older.
  const auto later = clock_->now() - content.now;
  for (auto& [client, run] : content.ids) {
    run.begin += later;
    run.newest += later;
    ids_ += run.records.size();
    clients_[client].known.add(std::move(run));
  }
  std::map<std::string, const JournalledCommand*> last_sent;
  for (const auto& journalled : content.commands)
    if (journalled.sent) last_sent[journalled.command.axis] = &journalled;
  for (const auto& journalled : content.commands) {
    const auto& value = journalled.command;
    const auto record = std::make_shared<CommandRecord>(value, *clock_);
    const auto heard_of = journalled.heard_of + later;
    const auto entry =
        enter(record, {.client = value.client, .request_id = value.request_id, .digest = journalled.digest},
              heard_of);
    entry->sending = journalled.sent;
    for (const auto& request : journalled.attached) enter(record, request, heard_of);
    if (record->has_ended()) continue;
    follow(entry);
    interrupted_.push_back(record);
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
  // As they were queued before: a repeat had moved them.
  for (auto& [client, ids] : clients_)
    std::ranges::sort(ids.detailed, {}, [](const EntryPtr& entry) { return last_heard_of(*entry); });
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
  if (const auto client = clients_.find(options.client); client != clients_.end()) {
    auto& ids = client->second;
    if (const auto found = ids.by_request.find(options.request_id); found != ids.by_request.end()) {
      auto& entry = *found->second;
      heard(entry);
      if (entry.request.digest == digest(axis, action)) return entry.command;
      return fail(used_before(options.request_id, entry.command->value().id));
    }
    if (auto found = ids.known.find(options.request_id, digest(axis, action)))
      return known_repeat(*std::move(found), axis, action, options);
  }
  if (auto refused = doubt(axis)) return fail(*std::move(refused));
  forget_old();
  if (auto room = make_room(options.client); !room) return fail(room.error());
  return nullptr;
}

std::optional<Error> CommandBook::doubt(const std::string& axis) const {
  const auto now = clock_->now();
  if (now >= doubtful_until_) return std::nullopt;
  const auto left = std::chrono::ceil<std::chrono::seconds>(doubtful_until_ - now).count();
  return Error{.reason = Reason::storage,
               .message = fmt::format("{}{}requests are refused for another {} s, as they may have been "
                                      "executed before: the command journal was damaged ({})",
                                      axis, axis.empty() ? "" : ": ", left, damage_),
               .remedy = fmt::format("look at the machine; ask again in {} s", left),
               .outcome = Outcome::unknown};
}

/// A repeat of what ended long ago.
Result<CommandPtr> CommandBook::known_repeat(KnownIds::Found found, const std::string& axis,
                                             const Action& action, const CommandOptions& options) {
  if (!found.same_content) return fail(used_before(options.request_id, found.command.id));
  auto command = std::move(found.command);
  command.axis = axis;
  command.request_id = options.request_id;
  command.client = options.client;
  command.kind = kind_of(action);
  command.asked = asked_by(action);
  command.accepted_at = clock_->wall(found.heard_of);
  command.ended_at = command.accepted_at;
  auto record = std::make_shared<CommandRecord>(std::move(command), *clock_);
  // Asking for it makes it younger, unless that would be a way to have more ids than others leave room for.
  if (has_room(options.client))
    heard(*enter(record,
                 {.client = options.client, .request_id = options.request_id, .digest = digest(axis, action)},
                 found.heard_of));
  return record;
}

CommandPtr CommandBook::open(const std::string& axis, const Action& action, const CommandOptions& options) {
  forget_old();
  const auto now = clock_->now();
  Command command{.id = fmt::format("{}-{}", instance_id_, ++last_),
                  .axis = axis,
                  .request_id = options.request_id,
                  .client = options.client,
                  .lease_token = options.lease_token,
                  .kind = kind_of(action),
                  .asked = asked_by(action),
                  .accepted_at = clock_->wall(options.arrived == TimePoint{} ? now : options.arrived),
                  .origin = options.origin};
  const auto entry = enter(
      std::make_shared<CommandRecord>(std::move(command), *clock_),
      {.client = options.client, .request_id = options.request_id, .digest = digest(axis, action)}, now);
  follow(entry);
  if (journal_ != nullptr && !options.request_id.empty())
    journal_->accepted(entry->command->value(), entry->request.digest);
  if (opened_) opened_(entry->command);
  return entry->command;
}

CommandBook::EntryPtr CommandBook::enter(CommandPtr command, RequestKey request, TimePoint heard_of) {
  auto entry = std::make_shared<Entry>(Entry{.command = std::move(command),
                                             .request = std::move(request),
                                             .heard_of = heard_of,
                                             .queued = clock_->now()});
  by_id_.emplace(entry->command->value().id, entry);  // the first one is the command's own
  if (entry->request.request_id.empty()) {
    unnamed_.push_back(entry);
    return entry;
  }
  auto& ids = clients_[entry->request.client];
  ids.by_request.insert_or_assign(entry->request.request_id, entry);
  ids.detailed.push_back(entry);
  ++detailed_;
  ++ids_;
  shorten();
  return entry;
}

void CommandBook::attach(const CommandPtr& command, const std::string& axis, const Action& action,
                         const CommandOptions& options, CommandJournal::Callback known) {
  if (!options.request_id.empty()) {
    const auto entry = enter(
        command, {.client = options.client, .request_id = options.request_id, .digest = digest(axis, action)},
        clock_->now());
    if (journal_ != nullptr) return journal_->attached(command->value().id, entry->request, std::move(known));
  }
  known({});
}

TimePoint CommandBook::last_heard_of(const Entry& entry) {
  return std::max(entry.heard_of, entry.command->ended_when());
}

/// It was asked for again.
void CommandBook::heard(Entry& entry) {
  const auto now = clock_->now();
  const bool tell =
      journal_ != nullptr && entry.command->has_ended() && now - last_heard_of(entry) >= heard_again;
  entry.heard_of = now;
  if (tell) journal_->heard(entry.command->value(), entry.request);
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

}  // namespace axisd
