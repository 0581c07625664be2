#include "daemon/store/journal_model.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace axisd::store {

JournalModel::Entry& JournalModel::entry_of(const Command& command, TimePoint now) {
  if (const auto found = by_id_.find(command.id); found != by_id_.end()) return *found->second;
  entries_.push_back({.command = {.command = {.id = command.id, .axis = command.axis, .kind = command.kind}},
                      .touched = now});
  by_id_.emplace(command.id, std::prev(entries_.end()));
  return entries_.back();
}

void JournalModel::apply(const JournalLine& line, TimePoint now) {
  std::visit([&](const auto& l) { apply_line(l, now); }, line);
}

void JournalModel::apply_line(const AcceptedLine& line, TimePoint now) {
  auto& entry = entry_of(line.command, now);
  entry.command.command = line.command;
  entry.command.digest = line.digest;
  entry.touched = now;
}

void JournalModel::apply_line(const AttachedLine& line, TimePoint now) {
  const auto found = by_id_.find(line.command);
  if (found == by_id_.end()) return;  // the line before it was damaged, which is known
  found->second->command.attached.push_back(line.request);
  found->second->touched = now;
}

void JournalModel::apply_line(const SendingLine& line, TimePoint now) {
  auto& entry = entry_of(line.command, now);
  entry.command.command.granted = line.command.granted;
  entry.command.sent = true;
  entry.command.note = line.note;
  entry.touched = now;
}

void JournalModel::apply_line(const EndedLine& line, TimePoint now) {
  auto& entry = entry_of(line.command, now);
  auto& command = entry.command.command;
  command.granted = line.command.granted;
  command.state = line.command.state;
  command.cause = line.command.cause;
  command.started_at = line.command.started_at;
  command.ended_at = line.command.ended_at;
  entry.touched = now;
  // As while the daemon runs: what moves nothing leaves no ErrorStop.
  const bool moves = command.kind != CommandKind::enable && command.kind != CommandKind::disable &&
                     command.kind != CommandKind::reset && command.kind != CommandKind::set_position;
  if (command.state == CommandState::unknown && line.awaits_reset && moves)
    unknown_outcomes_[command.axis] = command.id;
  if (command.state == CommandState::done && command.kind == CommandKind::reset)
    unknown_outcomes_.erase(command.axis);
}

void JournalModel::apply_line(const DoubtLine& line, TimePoint) {
  if (!doubt_ || doubt_->until < line.until) doubt_ = line;
}

bool JournalModel::awaits_reset(const Command& command) const {
  const auto found = unknown_outcomes_.find(command.axis);
  return found != unknown_outcomes_.end() && found->second == command.id;
}

void JournalModel::forget_before(TimePoint then) {
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

std::vector<JournalLine> JournalModel::lines() const {
  std::vector<JournalLine> lines;
  if (doubt_) lines.emplace_back(*doubt_);
  for (const auto& [journalled, touched] : entries_) {
    const auto& command = journalled.command;
    if (!journalled.digest.empty())
      lines.emplace_back(AcceptedLine{.command = command, .digest = journalled.digest});
    for (const auto& request : journalled.attached)
      lines.emplace_back(AttachedLine{.command = command.id, .request = request});
    if (journalled.sent) lines.emplace_back(SendingLine{.command = command, .note = journalled.note});
    if (ended(command.state))
      lines.emplace_back(EndedLine{.command = command, .awaits_reset = awaits_reset(command)});
  }
  return lines;
}

JournalContent JournalModel::content() const {
  JournalContent content;
  for (const auto& entry : entries_) {
    const auto& command = entry.command.command;
    content.commands.push_back(entry.command);
    if (awaits_reset(command))
      content.unknown_outcomes.emplace(command.axis, std::pair(command.id, command.cause.value_or(Error{})));
  }
  if (doubt_) {
    content.doubtful_until = doubt_->until;
    content.damage = doubt_->damage;
  }
  return content;
}

JournalLoad load_journal(std::string_view text, TimePoint now) {
  JournalLoad load;
  if (!text.starts_with(journal_header)) {
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
    load.model.apply(line->line, now);
  }
  return load;
}

}  // namespace axisd::store
