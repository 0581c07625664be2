#include "buses/limited_log.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "buses/ration.hpp"

namespace axisd {
namespace {

/// As the logger that it belongs to, one for the process.
struct Shared {
  std::mutex mutex;
  Ration ration{{.most = 50, .period = std::chrono::seconds(10), .origins = 256}};  ///< lines
};

/// Never destroyed: gRPC's threads may log until the process has ended.
Shared& shared() {
  static auto& one = *new Shared;  // NOLINT(cppcoreguidelines-owning-memory)
  return one;
}

void tell(const Ration::LeftOut& left_out) {
  if (left_out.count == 0) return;
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(shared().ration.period()).count();
  log_about(spdlog::level::warn, LogKind::lines_left_out, {},
            fmt::format("{}: {} more like this in the last {} s", left_out.origin, left_out.count, seconds));
}

}  // namespace

void log_limited(spdlog::level::level_enum level, std::string_view who, std::string_view kind,
                 std::string_view text, LogKind about, const LogSubject& subject) {
  if (!spdlog::should_log(level)) return;
  const auto origin = fmt::format("{}: {}", who, kind);
  std::optional<std::uint64_t> left_out;
  {
    auto& [mutex, ration] = shared();
    const std::lock_guard lock(mutex);
    left_out = ration.take(origin, monotonic_now());
  }
  if (!left_out) return;
  tell({.origin = origin, .count = *left_out});
  log_about(level, about, subject, fmt::format("{}: {}", who, text));
}

TimePoint tell_left_out(TimePoint now) {
  auto& [mutex, ration] = shared();
  std::vector<Ration::LeftOut> told;
  TimePoint next;
  {
    const std::lock_guard lock(mutex);
    told = ration.take_left_out(now);
    next = ration.next_due();
  }
  for (const auto& each : told) tell(each);
  return now < TimePoint::max() - ration.period() ? std::min(next, now + ration.period()) : next;
}

}  // namespace axisd
