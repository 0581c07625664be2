// What the command book remembers of whom, and what it forgets (M32).
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "devices/axis/command_book.hpp"

namespace axisd {

namespace {

/// Commands with a request_id that are remembered in all details, of all clients; beyond these ended ones are
/// remembered by their ids.
constexpr std::size_t most_detailed = 4'096;
/// So many of these lose their details together.
constexpr int shortened_at_once = 512;
/// Whose are looked at for it.
constexpr std::ptrdiff_t shortened_clients = 4;
/// Ids of one client that may be remembered in all details; of commands that have not ended, all are.
constexpr std::size_t most_live = 16'384;
/// Ended commands without an id of their client's beyond this are forgotten earlier than others.
constexpr std::size_t history = 10'000;
/// So many are looked at whenever a command is entered: the core has other things to do.
constexpr int looked_at_once = 16;

}  // namespace

std::size_t CommandBook::ids_of(const std::string& client) const {
  const auto found = clients_.find(client);
  return found == clients_.end() ? 0 : found->second.size();
}

bool CommandBook::has_room(const std::string& client) const {
  const auto own = ids_of(client);
  return own < limits_.share(ids_ - own);
}

/// A client that has as many ids as it may loses its oldest ones, as far as they are old enough; then those
/// that have more than it lose theirs.
Result<void> CommandBook::make_room(const std::string& client) {
  const auto then = clock_->now() - remembered_at_least;
  if (const auto own = clients_.find(client);
      own != clients_.end() && own->second.detailed.size() >= most_live)
    return fail(Reason::busy,
                fmt::format("{} has {} request ids of commands that have not ended", client,
                            own->second.detailed.size()),
                "renew a jog with the request_id that it was begun with, or end it and begin another");
  if (const auto own = clients_.find(client); own != clients_.end())
    while (!has_room(client) && forget_some(own->second, then) > 0) {
    }
  while (!has_room(client)) {
    const auto own = ids_of(client);
    const bool forgotten = std::ranges::any_of(clients_, [&](auto& other) {
      return other.second.size() > own && forget_some(other.second, then) > 0;
    });
    if (!forgotten) return fail(no_room(client));
  }
  return {};
}

Error CommandBook::no_room(const std::string& client) const {
  std::optional<TimePoint> next;
  const auto found = clients_.find(client);
  if (found != clients_.end()) next = next_free(found->second);
  for (const auto& [name, ids] : clients_)
    if (const auto free = next_free(ids); ids_of(client) == 0 && free)
      next = std::min(next.value_or(*free), *free);
  const auto wait =
      next
          ? fmt::format(
                "the next is free in {} s",
                std::chrono::ceil<std::chrono::seconds>(std::max(*next - clock_->now(), Duration(1))).count())
          : std::string("the next is free some time after one of its commands has ended");
  return {
      .reason = Reason::busy,
      .message = fmt::format("{} has {} request ids remembered, the most that it may have while {} of {} are "
                             "in use",
                             client, ids_of(client), ids_, limits_.total),
      .remedy = fmt::format("{}; send fewer commands, or raise server.limits.request_ids in the "
                            "configuration; stops need none, and a jog is renewed with the request_id that "
                            "it was begun with",
                            wait)};
}

/// When the client's oldest id may be forgotten for a new one; nothing: none has ended.
std::optional<TimePoint> CommandBook::next_free(const ClientIds& ids) const {
  auto oldest = ids.known.oldest();
  int looked = 0;
  for (const auto& entry : ids.detailed) {
    if (++looked > looked_at_once) break;
    if (!entry->command->has_ended()) continue;
    const auto heard_of = last_heard_of(*entry);
    oldest = std::min(oldest.value_or(heard_of), heard_of);
  }
  if (oldest) *oldest += remembered_at_least;
  return oldest;
}

/// Some of what has ended, and was last heard of before `then`; how many. What is still needed goes to the
/// end of its queue, so that it holds up nothing: a queue is in the order in which they were last heard of,
/// as far as they have ended.
std::size_t CommandBook::forget_some(ClientIds& ids, TimePoint then) {
  auto forgotten = ids.known.forget_one(then);
  ids_ -= forgotten;
  const auto most = std::min<std::size_t>(looked_at_once, ids.detailed.size());
  for (std::size_t looked = 0; forgotten == 0 && looked < most; ++looked) {
    auto entry = std::move(ids.detailed.front());
    ids.detailed.pop_front();
    const bool ended = entry->command->has_ended();
    if (ended && last_heard_of(*entry) < then) {
      --detailed_;
      --ids_;
      ++forgotten;
      forget(entry);
    } else if (ended && entry->queued >= last_heard_of(*entry)) {
      ids.detailed.push_front(std::move(entry));  // those behind it are younger still
      break;
    } else {
      entry->queued = clock_->now();
      ids.detailed.push_back(std::move(entry));
    }
  }
  return forgotten;
}

/// Its details. It was taken out of its queue.
void CommandBook::forget(const EntryPtr& entry) {
  const auto erase = [&](auto& from, const std::string& key) {
    if (const auto same = from.find(key); same != from.end() && same->second == entry) from.erase(same);
  };
  erase(by_id_, entry->command->value().id);
  if (!entry->request.request_id.empty())
    erase(clients_[entry->request.client].by_request, entry->request.request_id);
}

/// A few at a time, of one client after the other.
void CommandBook::forget_old() {
  const auto now = clock_->now();
  if (!clients_.empty()) {
    auto next = clients_.upper_bound(looked_at_);
    if (next == clients_.end()) next = clients_.begin();
    looked_at_ = next->first;
    for (int looked = 0; looked < looked_at_once && forget_some(next->second, now - remembered) > 0;
         ++looked) {
    }
    if (next->second.size() == 0) clients_.erase(next);
  }
  forget_unnamed(now);
}

void CommandBook::forget_unnamed(TimePoint now) {
  const auto is_due = [&](const Entry& entry) {
    return unnamed_.size() > history || entry.queued + remembered < now;
  };
  for (int looked = 0; looked < looked_at_once && !unnamed_.empty() && is_due(*unnamed_.front()); ++looked) {
    auto entry = std::move(unnamed_.front());
    unnamed_.pop_front();
    const bool over = entry->command->has_ended() &&
                      (last_heard_of(*entry) + remembered < now || unnamed_.size() >= history);
    if (over) {
      forget(entry);
    } else {
      entry->queued = now;
      unnamed_.push_back(std::move(entry));
    }
  }
}

/// Remembers ended commands of those who have most of them by their ids only.
void CommandBook::shorten() {
  if (detailed_ <= most_detailed) return;
  std::vector<ClientIds*> all;
  all.reserve(clients_.size());
  for (auto& [name, ids] : clients_) all.push_back(&ids);
  const auto most = all.begin() + std::min<std::ptrdiff_t>(shortened_clients, std::ssize(all));
  std::ranges::partial_sort(all, most, std::greater(), [](const auto* ids) { return ids->detailed.size(); });
  for (auto each = all.begin(); each != most; ++each)
    if (shorten(**each)) return;
}

/// False: of what was looked at, nothing has ended.
bool CommandBook::shorten(ClientIds& ids) {
  const auto most = std::min<std::size_t>(shortened_at_once, (ids.detailed.size() + 1) / 2);
  std::vector<EntryPtr> ended;
  ended.reserve(most);
  for (std::size_t looked = 0; looked < most; ++looked) {
    auto entry = std::move(ids.detailed.front());
    ids.detailed.pop_front();
    if (entry->command->has_ended())
      ended.push_back(std::move(entry));
    else
      ids.detailed.push_back(std::move(entry));
  }
  std::vector<EndedId> short_of;
  short_of.reserve(ended.size());
  for (const auto& entry : ended)
    short_of.push_back({.request_id = entry->request.request_id,
                        .digest = entry->request.digest,
                        .command = &entry->command->value(),
                        .heard_of = last_heard_of(*entry)});
  for (auto& run : runs_of(std::move(short_of))) ids.known.add(std::move(run));
  for (const auto& entry : ended) forget(entry);
  detailed_ -= ended.size();
  return !ended.empty();
}

}  // namespace axisd
