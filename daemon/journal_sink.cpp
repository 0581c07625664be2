#include "daemon/journal_sink.hpp"

#define SD_JOURNAL_SUPPRESS_LOCATION  // it would be this file for all lines
#include <systemd/sd-journal.h>

#include <string>
#include <string_view>
#include <vector>

#include "buses/log_about.hpp"

namespace axisd {

/// A journal that takes nothing costs the line: there is no other place for it.
void JournalSink::sink_it_(const spdlog::details::log_msg& line) {
  auto fields = journal_fields(line.level, line.source.line,
                               std::string_view(line.payload.data(), line.payload.size()));
  std::vector<iovec> parts;
  parts.reserve(fields.size());
  for (auto& field : fields) parts.push_back({.iov_base = field.data(), .iov_len = field.size()});
  (void)sd_journal_sendv(parts.data(), static_cast<int>(parts.size()));
}

}  // namespace axisd
