#include "buses/limited_log.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

#include "buses/line_limit.hpp"

namespace axisd {
namespace {

/// As the logger that it belongs to, one for the process.
struct Shared {
  std::mutex mutex;
  LineLimit limit;
};

/// Never destroyed: gRPC's threads may log until the process has ended.
Shared& shared() {
  static auto& one = *new Shared;  // NOLINT(cppcoreguidelines-owning-memory)
  return one;
}

}  // namespace

void log_limited(spdlog::level::level_enum level, std::string_view who, std::string_view kind,
                 std::string_view text, LogKind about, const LogSubject& subject) {
  if (!spdlog::should_log(level)) return;
  {
    auto& [mutex, limit] = shared();
    const auto origin = fmt::format("{}: {}", who, kind);
    const std::lock_guard lock(mutex);
    if (!limit.admit(origin, monotonic_now())) return;
  }
  log_about(level, about, subject, fmt::format("{}: {}", who, text));
}

TimePoint tell_left_out(TimePoint now) {
  auto& [mutex, limit] = shared();
  std::vector<LineLimit::LeftOut> told;
  TimePoint next;
  {
    const std::lock_guard lock(mutex);
    told = limit.take_left_out(now);
    next = limit.next_due();
  }
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limit.period()).count();
  for (const auto& each : told)
    log_about(spdlog::level::warn, LogKind::lines_left_out, {},
              fmt::format("{}: {} more like this in the last {} s", each.origin, each.lines, seconds));
  return now < TimePoint::max() - limit.period() ? std::min(next, now + limit.period()) : next;
}

}  // namespace axisd
