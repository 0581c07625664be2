#include "buses/log_about.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <string>
#include <utility>

namespace axisd {

namespace {

/// Behind the text, and between fields: no text has them.
constexpr char fields_begin = '\x1e';
constexpr char next_field = '\x1f';

// Each id was made once, by chance. Whoever searches the journal for one relies on it: it never changes, and
// a kind that is gone leaves its id unused.
constexpr std::array kinds{
    LogKindEntry{LogKind::daemon_serves, "daemon_serves", "4c0a72dd97d14beb8f2bac8e6254e44e"},
    LogKindEntry{LogKind::daemon_ends, "daemon_ends", "d1f21b71448f4af384ad83921440c71e"},
    LogKindEntry{LogKind::no_progress, "no_progress", "7f1b899d3d3d4f82bc98bfb94ba4f562"},
    LogKindEntry{LogKind::command_accepted, "command_accepted", "d3b0ddb0425040c6abc1a3201ec0f1e0"},
    LogKindEntry{LogKind::command_refused, "command_refused", "1ccd690d7d1d4cb1b2032223cc0ba494"},
    LogKindEntry{LogKind::command_failed, "command_failed", "56f5e51b422e450099612a804ca29322"},
    LogKindEntry{LogKind::call_denied, "call_denied", "96abbfa987344495b8a1706a0743f02e"},
    LogKindEntry{LogKind::stop_called, "stop_called", "a2bea0e9e0f940abade60dc75db7d1be"},
    LogKindEntry{LogKind::stop_late, "stop_late", "33ac2bb6d5af43dbb0b659a15952d937"},
    LogKindEntry{LogKind::stop_escalated, "stop_escalated", "5d78ca094bca4a1b8769cb23ee2795df"},
    LogKindEntry{LogKind::stop_unconfirmed, "stop_unconfirmed", "644411de58424269b61152364712408a"},
    LogKindEntry{LogKind::stop_all, "stop_all", "de54b45bb7834772a0f6bf9ccf8489e8"},
    LogKindEntry{LogKind::stop_all_released, "stop_all_released", "dfc97597461e420390492b0127d2e220"},
    LogKindEntry{LogKind::axis_online, "axis_online", "b5be4a8dee184b08b3f874d7a6b96f6e"},
    LogKindEntry{LogKind::axis_offline, "axis_offline", "044e9eb2505f47de89667ca5395fd66a"},
    LogKindEntry{LogKind::axis_trouble, "axis_trouble", "b512548419884b5597300308ac40e243"},
    LogKindEntry{LogKind::axis_rebooted, "axis_rebooted", "2b2cf67424bf4760a55fc033e10ce513"},
    LogKindEntry{LogKind::axis_fault, "axis_fault", "61943171cb584bdfb1c660d9b953721d"},
    LogKindEntry{LogKind::moving_without_command, "moving_without_command",
                 "0d6f4b2431a94e479607a05d0564620f"},
    LogKindEntry{LogKind::unknown_outcome, "unknown_outcome", "df4a4e7ce25e47e49dc12491087611a2"},
    LogKindEntry{LogKind::configuration_drifted, "configuration_drifted", "b1072ab5a7174625b52122cba34a92c8"},
    LogKindEntry{LogKind::bus_up, "bus_up", "ce24e58248324ff2b2cdc14559685947"},
    LogKindEntry{LogKind::bus_down, "bus_down", "6caf0aaf2ff44d11b823cf647c900b62"},
    LogKindEntry{LogKind::link_cycled, "link_cycled", "e7bc5d4d1bba47d1822259972a2795a8"},
    LogKindEntry{LogKind::lease_changed, "lease_changed", "c0cc41c856aa4acc9a4d0ad9003ba703"},
    LogKindEntry{LogKind::hold_changed, "hold_changed", "47582d0f5ee943c8b6f55c315afb40d3"},
    LogKindEntry{LogKind::drive_changed, "drive_changed", "0b6b419b7da747ca910a557fd3ac1812"},
    LogKindEntry{LogKind::state_convicted, "state_convicted", "34caecda8f92413caf042e3af2d39816"},
    LogKindEntry{LogKind::state_accepted, "state_accepted", "4e3d9b4a34a1426f90f6a4423674bfbf"},
    LogKindEntry{LogKind::storage_failed, "storage_failed", "0d20415eee624a348f9208e443a246aa"},
    LogKindEntry{LogKind::storage_works, "storage_works", "f4f9f714e6ae4a3a8e109b37cf335396"},
    LogKindEntry{LogKind::configuration_served, "configuration_served", "42833f052e284b4b8e8572d385854554"},
    LogKindEntry{LogKind::configuration_refused, "configuration_refused", "7a60d0a15c2a44f580365c572c87108b"},
    LogKindEntry{LogKind::log_level_changed, "log_level_changed", "fc55041c1a40406d8d603b68b6da10d3"},
    LogKindEntry{LogKind::lines_left_out, "lines_left_out", "06073526c8b94842b999473e73b52f8d"}};

std::atomic<bool> with_fields{false};

/// Control characters would end a field, or begin one.
std::string harmless(std::string_view text) {
  std::string result(text);
  std::ranges::replace_if(result, [](char c) { return c == fields_begin || c == next_field; }, '?');
  return result;
}

int priority_of(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::critical:
      return 2;
    case spdlog::level::err:
      return 3;
    case spdlog::level::warn:
      return 4;
    case spdlog::level::info:
      return 6;
    default:
      return 7;
  }
}

/// Where the fields begin; npos: the line has none.
std::size_t end_of_text(int source_line, std::string_view payload) {
  return source_line > 0 ? payload.rfind(fields_begin) : std::string_view::npos;
}

}  // namespace

std::span<const LogKindEntry> log_kinds() { return kinds; }

void set_log_fields(bool taken) { with_fields.store(taken, std::memory_order_relaxed); }

int log_source_line(LogKind kind) { return std::to_underlying(kind) + 1; }

std::string log_payload(const LogSubject& subject, std::string_view text) {
  auto payload = harmless(text) + fields_begin;
  const auto add = [&payload](std::string_view key, std::string_view value) {
    if (!value.empty()) payload += fmt::format("AXISD_{}={}{}", key, harmless(value), next_field);
  };
  add("BUS", subject.bus);
  add("NODE", subject.node ? std::to_string(int{*subject.node}) : std::string());
  add("AXIS", subject.axis);
  add("CLIENT", subject.client);
  add("COMMAND", subject.command);
  return payload;
}

void log_about(spdlog::level::level_enum level, LogKind kind, const LogSubject& subject,
               std::string_view text) {
  if (!spdlog::should_log(level)) return;
  if (!with_fields.load(std::memory_order_relaxed)) return spdlog::log(level, "{}", text);
  spdlog::log(spdlog::source_loc{"", log_source_line(kind), ""}, level, "{}", log_payload(subject, text));
}

std::vector<std::string> journal_fields(spdlog::level::level_enum level, int source_line,
                                        std::string_view payload) {
  std::vector<std::string> fields{fmt::format("PRIORITY={}", priority_of(level)), "SYSLOG_IDENTIFIER=axisd"};
  const auto end = end_of_text(source_line, payload);
  fields.push_back(fmt::format("MESSAGE={}", payload.substr(0, end)));
  if (end == std::string_view::npos) return fields;
  const auto* entry = std::ranges::find(kinds, source_line,
                                        [](const LogKindEntry& each) { return log_source_line(each.kind); });
  if (entry != kinds.end()) {
    fields.push_back(fmt::format("MESSAGE_ID={}", entry->id));
    fields.push_back(fmt::format("AXISD_EVENT={}", entry->name));
  }
  for (auto left = payload.substr(end + 1); !left.empty();) {
    const auto size = left.find(next_field);
    fields.emplace_back(left.substr(0, size));
    left = size == std::string_view::npos ? std::string_view() : left.substr(size + 1);
  }
  return fields;
}

std::string journal_text(spdlog::level::level_enum level, int source_line, std::string_view payload) {
  return fmt::format("<{}>{}", priority_of(level), payload.substr(0, end_of_text(source_line, payload)));
}

}  // namespace axisd
