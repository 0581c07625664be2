#include "daemon/journal_sink.hpp"

#define SD_JOURNAL_SUPPRESS_LOCATION  // it would be this file for all lines
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "buses/log_about.hpp"

namespace axisd {

namespace {

/// sd_journal_sendv() calls it a success where there is no such file.
constexpr const char* journal_socket = "/run/systemd/journal/socket";

bool send_to_journal(std::vector<std::string>& fields) {
  if (access(journal_socket, F_OK) != 0) return false;
  std::vector<iovec> parts;
  parts.reserve(fields.size());
  for (auto& field : fields) parts.push_back({.iov_base = field.data(), .iov_len = field.size()});
  return sd_journal_sendv(parts.data(), static_cast<int>(parts.size())) >= 0;
}

}  // namespace

void JournalSink::sink_it_(const spdlog::details::log_msg& line) {
  const std::string_view payload(line.payload.data(), line.payload.size());
  auto fields = journal_fields(line.level, line.source.line, payload);
  if (send_to_journal(fields)) return;
  const auto text = journal_text(line.level, line.source.line, payload) + '\n';
  (void)std::fwrite(text.data(), 1, text.size(), stderr);
}

}  // namespace axisd
