#include "daemon/supervise.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <string>
#include <vector>

#include "buses/log_about.hpp"
#include "buses/supervision.hpp"

namespace axisd {

namespace {

void reload_at_a_signal(ConfigurationService& served) {
  served.reload("SIGHUP", false, [](const Result<ConfigurationReload>& result) {
    if (!result)
      spdlog::warn("SIGHUP: not reloaded: {}", to_string(result.error()));
    else if (!result->applied)
      spdlog::warn(
          "SIGHUP: not reloaded, and nothing was changed; axisctl config reload --dry-run tells why");
  });
}

/// Zero: nobody watches.
Duration watchdog_interval() {
  std::uint64_t interval_us = 0;
  return sd_watchdog_enabled(0, &interval_us) > 0 ? Duration(std::chrono::microseconds(interval_us))
                                                  : Duration::zero();
}

/// With their last progress.
std::vector<Supervision::Part> threads_of(const Supervised& parts) {
  std::vector<Supervision::Part> threads{{.name = "core", .last = parts.loop.last_progress()},
                                         {.name = "stop lane", .last = parts.stop_lane.last_progress()},
                                         {.name = "accept loop", .last = parts.server.last_progress()}};
  for (const auto* bus : parts.machine.buses())
    threads.push_back({.name = "worker of " + std::string(bus->name()), .last = bus->last_progress()});
  return threads;
}

/// `state`: for systemd. Nobody may read what nobody asked for, and a full socket blocks.
void tell(bool watched, const char* state) {
  if (watched) sd_notify(0, state);
}

/// Until the next look.
Duration look(Supervision& supervision, const Supervised& parts, bool watched) {
  using Sign = Supervision::Sign;
  parts.doors.ask();
  const auto now = monotonic_now();
  const auto owed_since = supervision.doors_owe_since(now);
  auto silent = parts.doors.silent_since(owed_since);
  if (parts.server.last_hand_over() <= owed_since) silent.emplace_back("handing connections over");
  const auto found = supervision.look(now, threads_of(parts), silent.empty());
  switch (found.sign) {
    case Sign::alive:
      tell(watched, "WATCHDOG=1");
      break;
    case Sign::silent:
      log_about(spdlog::level::critical, LogKind::no_progress, {},
                fmt::format("no answer for clients: {}", fmt::join(silent, ", ")));
      break;
    case Sign::dead:
      tell(watched, "WATCHDOG=trigger");  // first: the log may be what stands still
      log_about(spdlog::level::critical, LogKind::no_progress, {},
                fmt::format("no progress: {}", fmt::join(found.dead, ", ")));
      break;
    case Sign::unsure:
      break;
  }
  return found.next;
}

}  // namespace

sigset_t ending_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&set, number);
  return set;
}

int supervise(const Supervised& parts) {
  const auto signals = ending_signals();
  const auto interval = watchdog_interval();
  Supervision supervision(interval);
  for (auto next = monotonic_now() + supervision.period();;) {
    const auto left = std::max(next - monotonic_now(), Duration::zero()).count();
    const timespec pause{.tv_sec = left / 1'000'000'000, .tv_nsec = left % 1'000'000'000};
    const int number = sigtimedwait(&signals, nullptr, &pause);
    if (number == SIGTERM || number == SIGINT) return number;
    if (number == SIGHUP) reload_at_a_signal(parts.served);
    if (monotonic_now() < next) continue;
    next = monotonic_now() + look(supervision, parts, interval > Duration::zero());
  }
}

}  // namespace axisd
