#include "api/cell/clock_watch.hpp"

#include <algorithm>
#include <utility>

#include "api/cell/roster.hpp"

namespace axisd::cell {
namespace {

constexpr Duration tick_period = std::chrono::milliseconds(100);
/// Each is asked once in so many, at least: within 2 s clocks drift apart by 0.4 ms.
constexpr int least_ticks_of_a_round = 20;
/// More machines take longer, so that a large cell does not spend its time on this.
constexpr int most_in_a_tick = 2;
/// Shorter than the time between two questions.
constexpr Duration patience = std::chrono::milliseconds(800);

}  // namespace

/// Not all at once: the core has other things to do.
void ClockWatch::tick() {
  timer_ = clock_.call_at(clock_.now() + tick_period, [this] { tick(); });
  const auto& entries = machines_.roster().entries();
  const int machines = static_cast<int>(entries.size());
  const int ticks_of_a_round =
      std::max(least_ticks_of_a_round, (machines + most_in_a_tick - 1) / most_in_a_tick);
  ticks_ = (ticks_ + 1) % ticks_of_a_round;
  int index = 0;
  for (const auto& [name, entry] : entries)
    if (index++ % ticks_of_a_round == ticks_) ask(name);
  if (ticks_ == 0) clocks_.forget_if([&entries](const std::string& name) { return !entries.contains(name); });
}

void ClockWatch::ask(const std::string& machine) {
  auto* const link = machines_.link(machine);
  if (link == nullptr || link->addresses().cell.empty()) return clocks_.failed(machine);
  link->read_clock(patience, [this, machine, sent = clock_.now()](const grpc::Status& status,
                                                                  const v1::GetClockResponse& response) {
    // Its address may lead to another entrance.
    if (!status.ok() || response.machine() != machine) return clocks_.failed(machine);
    clocks_.answered(machine, {.instance_id = response.instance_id(),
                               .sent = sent,
                               .received = clock_.now(),
                               .clock = duration_of(response.clock())});
  });
}

}  // namespace axisd::cell
