#include "daemon/store/journal_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

namespace axisd::store {

JournalModel::Entry& JournalModel::entry_of(const Command& command) {
  if (const auto found = by_id_.find(command.id); found != by_id_.end()) {
    found->second->touched = time_;
    return *found->second;
  }
  entries_.push_back({.command = {.command = {.id = command.id, .axis = command.axis, .kind = command.kind}},
                      .touched = time_});
  by_id_.emplace(command.id, std::prev(entries_.end()));
  return entries_.back();
}

void JournalModel::apply(const JournalLine& line) {
  std::visit([&](const auto& l) { apply_line(l); }, line);
}

void JournalModel::apply_line(const AcceptedLine& line) {
  auto& entry = entry_of(line.command);
  entry.command.command = line.command;
  entry.command.digest = line.digest;
}

void JournalModel::apply_line(const AttachedLine& line) {
  const auto found = by_id_.find(line.command);
  if (found == by_id_.end()) return;  // the line before it was damaged, which is known
  found->second->command.attached.push_back(line.request);
  found->second->touched = time_;
}

void JournalModel::apply_line(const SendingLine& line) {
  auto& entry = entry_of(line.command);
  entry.command.command.granted = line.command.granted;
  entry.command.sent = true;
  entry.command.note = line.note;
}

void JournalModel::apply_line(const EndedLine& line) {
  auto& entry = entry_of(line.command);
  auto& command = entry.command.command;
  command.granted = line.command.granted;
  command.state = line.command.state;
  command.cause = line.command.cause;
  command.started_at = line.command.started_at;
  command.ended_at = line.command.ended_at;
  // As while the daemon runs: what moves nothing leaves no ErrorStop.
  const bool moves = command.kind != CommandKind::enable && command.kind != CommandKind::disable &&
                     command.kind != CommandKind::reset && command.kind != CommandKind::set_position;
  if (command.state == CommandState::unknown && line.awaits_reset && moves)
    unknown_outcomes_[command.axis] = command.id;
  if (command.state == CommandState::done && command.kind == CommandKind::reset)
    unknown_outcomes_.erase(command.axis);
}

void JournalModel::apply_line(const DoubtLine& line) {
  if (!doubt_ || doubt_->until < line.until) doubt_ = line;
}

void JournalModel::apply_line(const TimeLine& line) {
  time_ = line.at;
  latest_ = std::max(latest_, time_);
  if (!line.boot.empty()) mark_ = line;
}

void JournalModel::apply_line(const HeardLine& line) {
  const bool known = by_id_.contains(line.command.id);
  auto& journalled = entry_of(line.command).command;
  if (!known) {
    journalled.command = line.command;
    journalled.command.client = line.request.client;
    journalled.command.request_id = line.request.request_id;
    journalled.digest = line.request.digest;
  } else if (journalled.command.request_id != line.request.request_id &&
             std::ranges::find(journalled.attached, line.request) == journalled.attached.end()) {
    journalled.attached.push_back(line.request);
  }
}

void JournalModel::apply_line(const IdsLine& line) {
  if (const auto same = std::ranges::find(id_files_, line.file, &IdsLine::file); same != id_files_.end())
    *same = line;
  else
    id_files_.push_back(line);
}

TimeLine JournalModel::time_after(const std::string& boot, Duration uptime) const {
  auto at = latest_;
  if (mark_ && mark_->boot == boot) at = std::max(at, mark_->at + uptime - mark_->uptime);
  return {.at = at, .boot = boot, .uptime = uptime};
}

bool JournalModel::awaits_reset(const Command& command) const {
  const auto found = unknown_outcomes_.find(command.axis);
  return found != unknown_outcomes_.end() && found->second == command.id;
}

void JournalModel::forget_before(Duration then) {
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const auto& command = entry->command.command;
    if (ended(command.state) && entry->touched < then && !awaits_reset(command)) {
      by_id_.erase(command.id);
      entry = entries_.erase(entry);
    } else {
      ++entry;
    }
  }
}

JournalModel::Settled JournalModel::settled(std::size_t kept) const {
  std::vector<const Entry*> over;
  over.reserve(entries_.size());
  // Axes with a start of which nobody knows yet what became: what was sent after it tells.
  std::set<std::string_view> open;
  for (const auto& entry : entries_) {
    const auto& command = entry.command.command;
    const bool sent = entry.command.sent;
    if (!ended(command.state) && sent)
      open.insert(command.axis);
    else if (ended(command.state) && !awaits_reset(command) && !(sent && open.contains(command.axis)))
      over.push_back(&entry);
  }
  over.resize(over.size() - std::min(kept, over.size()));
  Settled settled;
  settled.commands.reserve(over.size());
  std::map<std::string_view, std::vector<EndedId>> by_client;
  for (const auto* entry : over) {
    const auto& [command, digest, sent, note, attached, heard_of] = entry->command;
    settled.commands.push_back(command.id);
    const auto add = [&](std::string_view client, std::string_view request_id, std::string_view content) {
      if (!request_id.empty())
        by_client[client].push_back({.request_id = request_id,
                                     .digest = content,
                                     .command = &command,
                                     .heard_of = TimePoint(entry->touched)});
    };
    add(command.client, command.request_id, digest);
    for (const auto& request : attached) add(request.client, request.request_id, request.digest);
  }
  for (auto& [client, ids] : by_client)
    for (auto& run : runs_of(std::move(ids)))
      settled.runs.push_back({.client = std::string(client), .run = std::move(run)});
  return settled;
}

void JournalModel::drop(const std::vector<std::string>& commands) {
  for (const auto& id : commands)
    if (auto found = by_id_.extract(id)) entries_.erase(found.mapped());
}

std::vector<JournalLine> JournalModel::lines() const {
  std::vector<JournalLine> lines;
  lines.reserve(3 * entries_.size() + id_files_.size() + 3);
  if (state_) lines.emplace_back(*state_);
  if (doubt_) lines.emplace_back(*doubt_);
  for (const auto& file : id_files_) lines.emplace_back(file);
  Duration time{};
  for (const auto& [journalled, touched] : entries_) {
    const auto& command = journalled.command;
    if (std::exchange(time, touched) != touched) lines.emplace_back(TimeLine{.at = touched});
    if (!journalled.digest.empty())
      lines.emplace_back(AcceptedLine{.command = command, .digest = journalled.digest});
    for (const auto& request : journalled.attached)
      lines.emplace_back(AttachedLine{.command = command.id, .request = request});
    if (journalled.sent) lines.emplace_back(SendingLine{.command = command, .note = journalled.note});
    if (ended(command.state))
      lines.emplace_back(EndedLine{.command = command, .awaits_reset = awaits_reset(command)});
  }
  auto now = mark_.value_or(TimeLine{});
  if (mark_ && latest_ > now.at) now.uptime += latest_ - std::exchange(now.at, latest_);
  if (mark_ || latest_ != time) lines.emplace_back(now.boot.empty() ? TimeLine{.at = latest_} : now);
  return lines;
}

JournalContent JournalModel::content() const {
  JournalContent content;
  content.now = TimePoint(latest_);
  content.commands.reserve(entries_.size());
  for (const auto& entry : entries_) {
    const auto& command = entry.command.command;
    content.commands.push_back(entry.command);
    content.commands.back().heard_of = TimePoint(entry.touched);
    if (awaits_reset(command))
      content.unknown_outcomes.emplace(command.axis, std::pair(command.id, command.cause.value_or(Error{})));
  }
  if (doubt_) {
    content.doubtful_until = doubt_->until;
    content.damage = doubt_->damage;
  }
  return content;
}

JournalLoad load_journal(std::string_view text) {
  JournalLoad load;
  if (!text.starts_with(journal_header) && !text.starts_with(journal_header_2) &&
      !text.starts_with(journal_header_1)) {
    load.newer_format = text.starts_with(journal_header_any) && text.find('\n') != std::string_view::npos;
    if (!load.newer_format) load.damage = "the first line is not that of a journal";
    if (load.newer_format) return load;
  } else {
    text.remove_prefix(journal_header.size());
  }
  std::uint64_t last = 0;
  std::size_t at = 1;  // the number of the line in the file
  const auto damaged = [&](std::string_view what) {
    if (load.damage.empty()) load.damage = fmt::format("line {}: {}", at, what);
  };
  while (!text.empty()) {
    ++at;
    const auto end = text.find('\n');
    const auto line = decode_line(text.substr(0, end));
    // A line is made durable with its end only: what has none is left of a write that a crash cut short.
    if (end == std::string_view::npos && !line) load.torn = text.size();
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (load.torn > 0) break;
    if (!line) {
      damaged("checksum or content is wrong");
      continue;
    }
    if (last != 0 && line->number != last + 1)
      damaged(fmt::format("number {} follows {}", line->number, last));
    last = line->number;
    load.last_number = std::max(load.last_number, last);
    load.model.apply(line->line);
  }
  return load;
}

}  // namespace axisd::store
