// Whatever comes together by chance: repeated readings, others of all classes, what takes rounds apart, and a
// wire that loses, delays and damages.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <ranges>
#include <utility>
#include <vector>

#include "watch_rig.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;
using test::WatchRig;
using test::WireEntry;

struct Chances {
  unsigned faults_in_100 = 0;
  bool loses_port = false;
};

class Chaos {
 public:
  Chaos(std::uint32_t seed, Chances chances) : dice_(seed), chances_(chances) {}

  void run() {
    rig_.line->set_on_bind([this](const WireEntry& entry) { on_bind(entry); });
    for (int step = 0; step < 400; ++step) {
      act();
      rig_.world.run_for(std::chrono::microseconds(dice_() % 25'000));
    }
    chances_ = {};
    rig_.line->set_open(true);
    for (int node = 1; node <= rig_.nodes; ++node) rig_.bus->end_repetition(static_cast<std::uint8_t>(node));
    rig_.world.run_for(30s);
    check();
  }

 private:
  struct Call {
    Request request;
    std::string name;
    TransactionClass transaction_class;
  };

  std::uint8_t a_node() { return static_cast<std::uint8_t>(1 + dice_() % static_cast<unsigned>(rig_.nodes)); }
  std::chrono::milliseconds ms(unsigned limit) { return std::chrono::milliseconds(dice_() % limit); }

  void act() {
    const auto node = a_node();
    switch (dice_() % 20) {
      default:
        return rig_.watch(node, 5ms + ms(150));
      case 6:
      case 7:
      case 8:
      case 9:
      case 10:
        return ask(node);
      case 11:
        return halt(node);
      case 12:
        return rig_.bus->hasten(node,
                                dice_() % 2 == 0 ? TransactionClass::motion : TransactionClass::moving_state);
      case 13:
      case 14:
      case 15:
        return rig_.bus->end_repetition(node);
      case 16:
        return rig_.bus->give_up_readings(node);
      case 17:
      case 18:
        return rig_.poke(node, WatchRig::value_of(node, static_cast<std::uint16_t>(dice_() % 16 << 8U)));
      case 19:
        if (!chances_.loses_port || dice_() % 3 != 0) return;
        rig_.line->set_open(false);
        rig_.world.run_for(ms(20));
        rig_.line->set_open(true);
    }
  }
  TransactionOptions options(unsigned classes) {
    return {.transaction_class = static_cast<TransactionClass>(dice_() % classes),
            .deadline = dice_() % 8 == 0 ? rig_.world.now() + ms(60) : TimePoint::max()};
  }
  void ask(std::uint8_t node) {
    const bool as_watched = dice_() % 3 == 0;
    const auto address = static_cast<std::uint16_t>(WatchRig::watched + (as_watched ? 0 : dice_() % 8));
    const auto count = static_cast<std::uint16_t>(as_watched ? WatchRig::watched_count : 1 + dice_() % 6);
    auto how = options(transaction_class_count);
    // Those do not wait until no late reply could be taken for their own.
    if (how.transaction_class == TransactionClass::stop) how.transaction_class = TransactionClass::motion;
    call({.node = node, .address = address, .count = count}, std::move(how));
  }
  void halt(std::uint8_t node) {
    call({.node = node, .function = Function::write_single_register, .address = 0x0028, .values = {0}},
         options(2));
  }
  void call(Request request, TransactionOptions how) {
    calls_.push_back({.request = request,
                      .name = std::to_string(calls_.size()),
                      .transaction_class = how.transaction_class});
    rig_.transact(calls_.back().name, std::move(request), std::move(how));
  }

  void on_bind(const WireEntry& entry) {
    EXPECT_TRUE(is_somebodys(entry)) << int{entry.node()} << " " << entry.address() << " " << entry.value();
    auto& faults = rig_.line->network().faults();
    faults.clear();
    if (dice_() % 100 >= chances_.faults_in_100) return;
    constexpr std::array kinds{FaultKind::drop_request,  FaultKind::drop_reply,     FaultKind::delay_reply,
                               FaultKind::corrupt_reply, FaultKind::truncate_reply, FaultKind::foreign_frame};
    const auto kind = kinds.at(dice_() % kinds.size());
    // On time, or after its time.
    faults.add({.kind = kind, .delay = dice_() % 2 == 0 ? ms(10) : ms(3000)});
  }
  [[nodiscard]] bool is_somebodys(const WireEntry& entry) {
    const auto watch = rig_.ends.find(entry.node());
    const auto ended = watch == rig_.ends.end() ? 0 : static_cast<int>(watch->second.size());
    if (!entry.is_write() && entry.address() == WatchRig::watched &&
        entry.value() == WatchRig::watched_count && rig_.watches[entry.node()] > ended)
      return true;
    if (std::ranges::any_of(calls_, [&](const Call& one) {
          return !rig_.results.contains(one.name) &&
                 std::ranges::equal(encode(one.request)->bytes(), entry.request);
        }))
      return true;
    // One that is to show that no reply is late.
    const auto& wire = rig_.line->wire();
    return !entry.is_write() && std::ranges::any_of(wire, [&](const WireEntry& before) {
      return &before != &entry && before.node() == entry.node() && !before.is_write() &&
             before.status != ExchangeStatus::replied && entry.begin - before.end <= LateReplies::latest;
    });
  }

  void check() {
    rig_.expect_silences();
    std::vector<TimePoint> sent;
    for (const auto& entry : rig_.line->wire()) sent.push_back(entry.begin);
    EXPECT_EQ(sent, rig_.noted) << "each is told once, in the order of the wire";
    EXPECT_TRUE(std::ranges::is_sorted(rig_.told, {}, &test::Told::sent_at));
    for (const auto& one : rig_.told) expect_of(one.node, 0, WatchRig::watched_count, one.registers);
    check_watches();
    check_calls();
    EXPECT_TRUE(rig_.bus->idle());
    EXPECT_GE(sent.size(), 150U) << "there was something to see";
    EXPECT_GE(rig_.told.size(), 20U);
  }
  void check_watches() {
    for (const auto& [node, begun] : rig_.watches) {
      ASSERT_EQ(rig_.ends[node].size(), static_cast<std::size_t>(begun)) << int{node};
      for (const auto& end : rig_.ends[node])
        if (end.result && *end.result) expect_of(node, 0, WatchRig::watched_count, (*end.result)->registers);
    }
  }
  void check_calls() {
    // Those that went out, by the node and the end that they have in common: one frame serves several only
    // if a stop is among them, which joins what waits already.
    std::map<std::pair<std::uint8_t, TimePoint>, std::vector<TransactionClass>> writes;
    for (const auto& [request, name, transaction_class] : calls_) {
      ASSERT_EQ(rig_.results[name].size(), 1U) << name;
      const auto& result = rig_.results[name].front();
      const bool is_write = request.function != Function::read_holding_registers;
      if (is_write && (result || result.error().outcome != Outcome::not_sent))
        writes[{request.node, rig_.ended_at.at(name)}].push_back(transaction_class);
      if (result && !is_write)
        expect_of(request.node, static_cast<std::uint16_t>(request.address - WatchRig::watched),
                  request.count, result->registers);
    }
    EXPECT_EQ(std::ranges::count_if(rig_.line->wire(), &WireEntry::is_write), std::ssize(writes))
        << "each goes out once, or its caller knows that it did not";
    for (const auto& classes : writes | std::views::values)
      EXPECT_TRUE(classes.size() == 1 || std::ranges::count(classes, TransactionClass::stop) > 0);
  }
  /// Bits 8 to 11 of the first are what a test pokes.
  static void expect_of(std::uint8_t node, std::uint16_t first, std::uint16_t count,
                        std::span<const std::uint16_t> registers) {
    ASSERT_EQ(registers.size(), count);
    for (std::uint16_t i = 0; i < count; ++i)
      EXPECT_EQ(registers[i] & 0xF0FFU, WatchRig::value_of(node, static_cast<std::uint16_t>(first + i)));
  }

  WatchRig rig_{5};
  std::mt19937 dice_;
  Chances chances_;
  std::vector<Call> calls_;
};

class RtuBusWatchChance : public ::testing::TestWithParam<std::uint32_t> {};

TEST_P(RtuBusWatchChance, OnASoundLine) { Chaos(GetParam(), {}).run(); }
TEST_P(RtuBusWatchChance, OnALineThatLosesAndDamages) { Chaos(GetParam(), {.faults_in_100 = 4}).run(); }
TEST_P(RtuBusWatchChance, WhereThePortIsLost) {
  Chaos(GetParam(), {.faults_in_100 = 3, .loses_port = true}).run();
}

INSTANTIATE_TEST_SUITE_P(Seeds, RtuBusWatchChance, ::testing::Range(1U, 13U));

}  // namespace
}  // namespace axisd::modbus_rtu
