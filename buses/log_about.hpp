// Lines of the log that say what they are about, for programs that read the journal.
#pragma once

#include <spdlog/common.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace axisd {

/// What a line tells of. deploy/axisd.catalog says of each what to do about it.
enum class LogKind : std::uint8_t {
  none,  ///< nothing in particular
  daemon_serves,
  daemon_ends,
  no_progress,
  command_accepted,
  command_refused,
  command_failed,
  call_denied,
  stop_called,
  stop_late,
  stop_escalated,
  stop_unconfirmed,
  stop_all,
  stop_all_released,
  axis_online,
  axis_offline,
  axis_trouble,
  axis_rebooted,
  axis_fault,
  moving_without_command,
  unknown_outcome,
  configuration_drifted,
  bus_up,
  bus_down,
  link_cycled,
  lease_changed,
  hold_changed,
  drive_changed,
  state_convicted,
  state_accepted,
  storage_failed,
  storage_works,
  configuration_served,
  configuration_refused,
  log_level_changed,
  lines_left_out,
};

/// A kind as the journal knows it: its name, and the MESSAGE_ID that it has for good.
struct LogKindEntry {
  LogKind kind = LogKind::none;
  std::string_view name, id;
};

/// All but `none`, in the order of LogKind.
[[nodiscard]] std::span<const LogKindEntry> log_kinds();

/// What it concerns, as far as that is known.
struct LogSubject {
  std::string_view bus{}, axis{}, client{}, command{};
  std::optional<std::uint8_t> node{};
};

/// Writes `text`. Where the log is the journal, the line gets MESSAGE_ID and the fields AXISD_EVENT,
/// AXISD_BUS, AXISD_NODE, AXISD_AXIS, AXISD_CLIENT and AXISD_COMMAND; else it is a line of text like any
/// other. Never waits for the log. Thread: any.
void log_about(spdlog::level::level_enum level, LogKind kind, const LogSubject& subject,
               std::string_view text);

/// Whether the log takes fields; else they are not even made. Before anything is logged.
void set_log_fields(bool taken);

/// What the journal gets of a line, "KEY=value" each. `source_line`: that of the line's source location, by
/// which lines of log_about() are told from others, whatever is in their text.
[[nodiscard]] std::vector<std::string> journal_fields(spdlog::level::level_enum level, int source_line,
                                                      std::string_view payload);
/// The same line as text for stderr of a service: its priority as sd-daemon(3) has it, and what it says.
[[nodiscard]] std::string journal_text(spdlog::level::level_enum level, int source_line,
                                       std::string_view payload);

/// A line's source location, and its text with the fields behind it, as log_about() hands them to the log.
[[nodiscard]] int log_source_line(LogKind kind);
[[nodiscard]] std::string log_payload(const LogSubject& subject, std::string_view text);

}  // namespace axisd
