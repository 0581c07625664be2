#include "devices/axis/command_book.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

namespace axisd {

namespace {

/// Longer than any request's validity (at most 10 minutes), so that a late repeat never starts a second
/// motion.
constexpr auto remembered = std::chrono::minutes(30);
/// Ended commands beyond this are forgotten even earlier than that only if their id was never given by a
/// client.
constexpr std::size_t history = 10'000;

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
  command_.state = state;
  command_.cause = std::move(cause);
  command_.ended_at = clock_->wall(clock_->now());
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

CommandBook::CommandBook(Clock& clock, std::string instance_id)
    : clock_(&clock), instance_id_(std::move(instance_id)) {}

Result<CommandPtr> CommandBook::find_repeat(const std::string& axis, const Action& action,
                                            const CommandOptions& options) const {
  if (options.request_id.empty()) return nullptr;
  const auto found = by_request_.find(options.client + "\n" + options.request_id);
  if (found == by_request_.end()) return nullptr;
  if (found->second->digest == digest(axis, action)) return found->second->command;
  return fail(Reason::request_id_conflict,
              fmt::format("request_id '{}' was used before for another request ({})", options.request_id,
                          found->second->command->value().id),
              "use a new request_id for each new request");
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
  auto entry =
      std::make_shared<Entry>(Entry{.command = std::make_shared<CommandRecord>(std::move(command), *clock_),
                                    .digest = digest(axis, action),
                                    .request_key = options.client + "\n" + options.request_id,
                                    .entered = now});
  by_id_.emplace(entry->command->value().id, entry);
  if (!options.request_id.empty()) by_request_.insert_or_assign(entry->request_key, entry);
  order_.push_back(entry);
  return entry->command;
}

void CommandBook::attach(const CommandPtr& command, const std::string& axis, const Action& action,
                         const CommandOptions& options) {
  if (options.request_id.empty()) return;
  auto entry = std::make_shared<Entry>(Entry{.command = command,
                                             .digest = digest(axis, action),
                                             .request_key = options.client + "\n" + options.request_id,
                                             .entered = clock_->now()});
  by_request_.insert_or_assign(entry->request_key, entry);
  order_.push_back(entry);
}

CommandPtr CommandBook::find(const std::string& id) const {
  const auto found = by_id_.find(id);
  return found == by_id_.end() ? nullptr : found->second->command;
}

void CommandBook::forget_old() {
  while (!order_.empty()) {
    const auto& oldest = order_.front();
    const bool old = oldest->entered + remembered < clock_->now();
    const bool surplus = order_.size() > history && oldest->command->value().request_id.empty();
    if (!(old || surplus) || !oldest->command->has_ended()) return;
    by_id_.erase(oldest->command->value().id);
    if (const auto same = by_request_.find(oldest->request_key);
        same != by_request_.end() && same->second == oldest)
      by_request_.erase(same);
    order_.pop_front();
  }
}

}  // namespace axisd
