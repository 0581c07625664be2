// A bus on a virtual line with several simulated drives, and readings of them that are repeated.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/virtual_line.hpp"

namespace axisd::modbus_rtu::test {

using namespace axisd::test;

/// What goes_on was called with, and when.
struct Told {
  std::uint8_t node;
  TimePoint sent_at, answered_at, at;
  std::vector<std::uint16_t> registers;
};

/// How a call of watch() ended.
struct WatchEnd {
  Result<std::optional<Answer>> result;
  TimePoint at;
};

/// Simulated drives 1, 2, ... on a line "a" in virtual time. Register `watched + i` of node n says n << 12 |
/// i.
struct WatchRig {
  static constexpr std::uint16_t watched = 0x0090;
  static constexpr std::uint16_t watched_count = 4;
  static constexpr std::uint16_t proof = watched + 8;
  static constexpr std::uint16_t proof_count = 3;
  static constexpr Duration period = std::chrono::milliseconds(200);

  VirtualWorld world;
  VirtualLine* line = nullptr;
  std::unique_ptr<RtuBus> bus;
  std::vector<Told> told;
  std::vector<Told> proofs;
  std::map<std::uint8_t, int> proof_every;  ///< readings, by node: those are proven
  Duration proof_before{};                  ///< the next of them
  Duration proof_period{};                  ///< if set: so long after each answer instead
  std::vector<TimePoint> noted;             ///< what the bus says that it has sent, in its order
  std::map<std::uint8_t, int> watches;      ///< begun, by node
  std::map<std::uint8_t, std::vector<WatchEnd>> ends;
  std::map<std::string, std::vector<Result<Answer>>> results;
  std::map<std::string, TimePoint> ended_at;  ///< of what has results
  int nodes;

  explicit WatchRig(int node_count = 4) : nodes(node_count) {
    auto made = std::make_unique<VirtualLine>(world, LineSettings{.name = "a", .port = "sim"});
    line = made.get();
    for (int node = 1; node <= nodes; ++node) {
      auto& drive = line->network().add(
          simulation::find_simulator("ykd2405pr")->make({.address = static_cast<std::uint8_t>(node)}));
      for (std::uint32_t i = 0; i < 16; ++i)
        drive.poke(watched + i, static_cast<std::uint32_t>(node) << 12U | i);
    }
    bus = std::make_unique<RtuBus>(world.executor(), world.clock(), LineSettings{.name = "a", .port = "sim"},
                                   std::move(made));
    bus->start([this](const Transaction&, const ExchangeResult& result) {
      if (result.status != ExchangeStatus::not_sent) noted.push_back(result.request_begin);
    });
    world.run_for(std::chrono::milliseconds(10));
  }
  ~WatchRig() {
    for (int node = 1; node <= nodes; ++node) bus->end_repetition(static_cast<std::uint8_t>(node));
    world.run_for(std::chrono::seconds(10));
  }
  WatchRig(const WatchRig&) = delete;

  [[nodiscard]] static std::uint16_t value_of(std::uint8_t node, std::uint16_t index = 0) {
    return static_cast<std::uint16_t>(node << 12U | index);
  }
  void poke(std::uint8_t node, std::uint16_t value, std::uint16_t address = watched) const {
    line->network().node(node)->poke(address, value);
  }

  /// It goes on as long as the first register says what it said at first.
  void watch(std::uint8_t node, Duration every = period, std::uint16_t count = watched_count,
             std::uint16_t address = watched) {
    ++watches[node];
    spawn(world.executor(), watching(node, {.node = node, .address = address, .count = count}, every),
          "watch");
  }
  void watch_all() {
    for (int node = 1; node <= nodes; ++node) watch(static_cast<std::uint8_t>(node));
  }
  /// All are watched and known, and rest; the next period begins at the time returned.
  TimePoint settle() {
    const auto begin = world.now();
    watch_all();
    world.run_for(5 * period / 2);
    told.clear();
    line->forget_wire();
    return begin + 3 * period;
  }
  void run_until(TimePoint when) { world.run_for(when - world.now()); }

  void transact(std::string name, Request request, TransactionOptions options = {}) {
    auto one = [](WatchRig& rig, std::string key, Request r, TransactionOptions o) -> Task<> {
      auto result = co_await rig.bus->transact(std::move(r), std::move(o));
      rig.ended_at[key] = rig.world.now();
      rig.results[std::move(key)].push_back(std::move(result));
    };
    spawn(world.executor(), one(*this, std::move(name), std::move(request), std::move(options)), "test");
  }
  void read(std::string name, std::uint8_t node, TransactionClass of, std::uint16_t address = watched,
            std::uint16_t count = watched_count) {
    transact(std::move(name), {.node = node, .address = address, .count = count}, {.transaction_class = of});
  }

  [[nodiscard]] std::vector<int> order() const {
    std::vector<int> order;
    for (const auto& entry : line->wire()) order.push_back(entry.node());
    return order;
  }
  [[nodiscard]] const WireEntry* entry(std::uint8_t node) const {
    const auto found = std::ranges::find(line->wire(), node, &WireEntry::node);
    return found == line->wire().end() ? nullptr : &*found;
  }
  /// Waits until the request to `node` has begun, at most a period.
  [[nodiscard]] bool run_until_asked(std::uint8_t node) {
    const auto until = world.now() + period;
    while (entry(node) == nullptr && world.now() < until) world.run_for(std::chrono::microseconds(50));
    return entry(node) != nullptr;
  }
  [[nodiscard]] std::vector<Told> told_of(std::uint8_t node) const {
    std::vector<Told> of;
    std::ranges::copy_if(told, std::back_inserter(of), [&](const Told& one) { return one.node == node; });
    return of;
  }
  [[nodiscard]] bool ended(std::uint8_t node) const { return ends.contains(node); }

  /// Between two frames is the silence that the line demands.
  void expect_silences() const {
    const auto& wire = line->wire();
    for (std::size_t i = 1; i < wire.size(); ++i)
      EXPECT_GE(wire[i].begin - wire[i - 1].end, silence(bus->settings().serial())) << i;
  }
  /// Every reading on the wire was told once, in the order of the wire.
  void expect_told_as_sent() const {
    std::vector<TimePoint> sent, heard;
    for (const auto& one : line->wire())
      if (one.address() == watched) sent.push_back(one.begin);
    for (const auto& one : told) heard.push_back(one.sent_at);
    EXPECT_EQ(sent, heard);
  }

 private:
  [[nodiscard]] Told told_now(std::uint8_t node, const Reading& reading) {
    return {.node = node,
            .sent_at = reading.sent_at,
            .answered_at = reading.answered_at,
            .at = world.now(),
            .registers = {reading.registers.begin(), reading.registers.end()}};
  }
  Task<> watching(std::uint8_t node, Request request, Duration every) {
    std::optional<std::uint16_t> first;
    bool over = false;
    int unproven = 0;
    Repetition repetition{.period = every};
    repetition.goes_on = [this, node, &first, &over, &unproven](const Reading& reading) {
      EXPECT_FALSE(over) << "it had said that it is the last";
      told.push_back(told_now(node, reading));
      if (!first) first = reading.registers.front();
      over = *first != reading.registers.front();
      ++unproven;
      return !over;
    };
    if (proof_every.contains(node))
      repetition.proof = {.request = {.node = node, .address = proof, .count = proof_count},
                          .due =
                              [this, node, &unproven](TimePoint next, Duration /*waited*/) {
                                if (proof_period > Duration::zero()) return world.now() + proof_period;
                                return unproven >= proof_every.at(node) ? next - proof_before
                                                                        : TimePoint::max();
                              },
                          .holds =
                              [this, node, &unproven, &over](const Reading& reading) {
                                EXPECT_FALSE(over);
                                proofs.push_back(told_now(node, reading));
                                unproven = 0;
                                over = reading.registers.front() != value_of(node, proof - watched);
                                return !over;
                              }};
    auto result = co_await bus->watch(std::move(request), std::move(repetition));
    ends[node].push_back({.result = std::move(result), .at = world.now()});
  }
};

}  // namespace axisd::modbus_rtu::test
