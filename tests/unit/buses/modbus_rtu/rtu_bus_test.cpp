#include "buses/modbus_rtu/rtu_bus.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "bus_rig.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;
using test::BusRig;

/// An FC03 reply does not say which registers it carries: a late one must never answer another read.
TEST(RtuBus, ALateReplyNeverAnswersAnotherRead) {
  for (const bool queued_before : {false, true}) {
    for (int delay = 25; delay < 60; ++delay) {
      for (const int late : {1, 2}) {
        BusRig rig;
        rig.line->network().node(1)->poke(0x0020, 111);
        rig.line->network().node(1)->poke(0x0032, 222);
        rig.line->network().faults().add({.kind = FaultKind::delay_reply,
                                          .node = 1,
                                          .function = 3,
                                          .count = late,
                                          .delay = std::chrono::milliseconds(delay)});
        rig.read("late", 0x0020, 4);
        if (!queued_before) rig.world.run_for(38ms);
        rig.read("next", 0x0032, 4);
        rig.world.run_for(500ms);
        ASSERT_EQ(rig.results.size(), 2U);
        const auto& next = rig.results.at("next");
        if (next) EXPECT_EQ(next->registers.at(0), 222) << delay;
        if (rig.results.at("late")) EXPECT_EQ(rig.results.at("late")->registers.at(0), 111);
      }
    }
  }
}

/// It is not its wiring.
TEST(RtuBus, ANodeThatAnswersTooLateIsToldFromASilentOne) {
  for (const auto kind : {FaultKind::delay_reply, FaultKind::drop_request}) {
    BusRig rig;
    // One that has answered is not held back at once.
    for (std::uint16_t count = 1; count <= 5; ++count) rig.read("before", 0x0003, count);
    rig.world.run_for(100ms);
    rig.results.clear();
    rig.line->network().faults().add({.kind = kind, .node = 1, .count = -1, .delay = 45ms});
    rig.read("first", 0x0003, 10);
    rig.read("second", 0x0020, 4);
    rig.read("third", 0x0040, 6);
    rig.world.run_for(5s);
    ASSERT_EQ(rig.results.size(), 3U);
    for (const auto& [name, result] : rig.results) {
      ASSERT_FALSE(result) << name;
      EXPECT_EQ(result.error().reason, Reason::no_reply) << to_string(result.error());
    }
    const auto& told = rig.results.at("third").error();
    const bool late = kind == FaultKind::delay_reply;
    EXPECT_EQ(told.message.find("turnaround_max (20 ms)") != std::string::npos, late) << to_string(told);
    EXPECT_EQ(told.remedy.find("raise turnaround_max") != std::string::npos, late) << to_string(told);
  }
}

/// For a start at a moment.
TEST(RtuBus, WhatIsHeldLetsGoWhatStopsStartsOrMovesAndNothingElse) {
  BusRig rig;
  const auto read = [&](std::uint16_t address, TransactionClass of) {
    rig.transact(std::to_string(address), {.node = 1, .address = address, .count = 1},
                 {.transaction_class = of});
  };
  read(0x0002, TransactionClass::idle_state);
  while (rig.results.empty()) rig.world.run_for(100us);
  rig.line->forget_wire();
  read(0x0003, TransactionClass::idle_state);
  rig.world.run_for(1us);  // armed; the line must be silent for a while yet
  auto hold = rig.bus->hold();
  EXPECT_EQ(rig.bus->hold(), hold);
  read(0x0004, TransactionClass::parameters);
  rig.world.run_for(50ms);
  EXPECT_TRUE(rig.line->wire().empty());
  read(0x0005, TransactionClass::moving_state);
  read(0x0020, TransactionClass::motion);
  rig.transact("stop",
               {.node = 2, .function = Function::write_single_register, .address = 0x0028, .values = {0}},
               {.transaction_class = TransactionClass::stop});
  rig.world.run_for(50ms);
  ASSERT_EQ(rig.line->wire().size(), 3U);
  hold.reset();
  rig.world.run_for(100ms);
  std::vector<std::uint16_t> order;
  for (const auto& entry : rig.line->wire()) order.push_back(entry.address());
  EXPECT_EQ(order, (std::vector<std::uint16_t>{0x0028, 0x0020, 0x0005, 0x0003, 0x0004}));
}

/// Its stopping axis waits for it, and has nothing else under way.
TEST(RtuBus, AReadingThatIsArmedIsHastenedThoughAStopTakesItsPlace) {
  BusRig rig;
  const auto read = [&](std::uint8_t node, std::uint16_t address, TransactionClass transaction_class) {
    rig.transact(std::to_string(address), {.node = node, .address = address, .count = 1},
                 {.transaction_class = transaction_class});
  };
  read(2, 0x0003, TransactionClass::idle_state);
  while (rig.results.empty()) rig.world.run_for(100us);
  rig.line->forget_wire();
  read(1, 0x0004, TransactionClass::idle_state);
  rig.world.run_for(1us);  // armed; the line must be silent for a while yet
  EXPECT_TRUE(rig.line->wire().empty());
  rig.bus->hasten(1, TransactionClass::moving_state);
  rig.transact("stop",
               {.node = 2, .function = Function::write_single_register, .address = 0x0028, .values = {0}},
               {.transaction_class = TransactionClass::stop});
  read(2, 0x0005, TransactionClass::moving_state);
  rig.world.run_for(200ms);
  std::vector<std::uint16_t> order;
  for (const auto& entry : rig.line->wire()) order.push_back(entry.address());
  EXPECT_EQ(order, (std::vector<std::uint16_t>{0x0028, 0x0004, 0x0005}));
}

/// Somebody reads parameters of a drive that starts meanwhile.
TEST(RtuBus, WhatOthersReadOutlivesAStart) {
  BusRig rig;
  rig.transact("under way", {.node = 2, .address = 0x0003, .count = 1}, {});
  rig.world.run_for(1ms);
  rig.transact("parameters", {.node = 1, .address = 0x0034, .count = 1}, {.of_others = true});
  rig.read("to connect", 0x0035, 1);
  rig.transact("state", {.node = 1, .address = 0x0004, .count = 1},
               {.transaction_class = TransactionClass::idle_state});
  rig.world.run_for(1us);
  rig.bus->hasten(1, TransactionClass::moving_state);
  rig.bus->give_up_readings(1);
  rig.world.run_for(100ms);
  ASSERT_EQ(rig.results.size(), 4U);
  EXPECT_TRUE(rig.results.at("parameters"));
  for (const auto* ended : {"state", "to connect"}) {
    ASSERT_FALSE(rig.results.at(ended));
    EXPECT_EQ(rig.results.at(ended).error().reason, Reason::superseded);
  }
}

/// Also where its node is held back: nobody waits until it may be asked again.
TEST(RtuBus, WhatItsGateForbidsEndsAtOnce) {
  BusRig rig;
  const auto gate = std::make_shared<AxisGate>();
  const TransactionOptions guarded{.guard = {.gate = gate, .epoch = gate->epoch()}, .of_others = true};
  const auto ask = [&](const std::string& name) {
    rig.transact(name, {.node = 1, .address = 0x0034, .count = 1}, guarded);
  };
  rig.line->network().set_connected(false);
  rig.read("in vain", 0x0003, 1);
  rig.world.run_for(50ms);
  ASSERT_TRUE(rig.bus->holds_back(1));
  ask("held");
  rig.world.run_for(1ms);
  EXPECT_EQ(rig.results.size(), 1U);
  gate->raise();
  rig.bus->purge_superseded(1, *gate);
  ask("too late");
  rig.world.run_for(1ms);
  for (const auto* name : {"held", "too late"}) {
    ASSERT_TRUE(rig.results.contains(name));
    ASSERT_FALSE(rig.results.at(name));
    EXPECT_EQ(rig.results.at(name).error().reason, Reason::superseded);
  }
  EXPECT_EQ(rig.line->wire().size(), 1U);
}

/// As before, where another read has to go out before it: the first one was lost.
TEST(RtuBus, AReadingIsHastenedWhileAnotherGoesBeforeIt) {
  BusRig rig;
  const auto read = [&](std::string name, std::uint8_t node, std::uint16_t address, TransactionClass of) {
    rig.transact(std::move(name), {.node = node, .address = address, .count = 1}, {.transaction_class = of});
  };
  rig.line->network().faults().add({.kind = FaultKind::drop_reply, .node = 1, .function = 3});
  read("lost", 1, 0x0004, TransactionClass::idle_state);
  while (rig.results.empty() || rig.bus->holds_back(1)) rig.world.run_for(1ms);
  rig.line->forget_wire();
  read("hastened", 1, 0x0004, TransactionClass::idle_state);
  while (rig.line->wire().empty()) rig.world.run_for(100us);
  rig.bus->hasten(1, TransactionClass::moving_state);
  for (const std::uint16_t address : {5, 6})
    read(std::to_string(address), 2, address, TransactionClass::moving_state);
  rig.world.run_for(200ms);
  std::vector<int> order;
  for (const auto& entry : rig.line->wire()) order.push_back(entry.node());
  EXPECT_EQ(order, (std::vector<int>{1, 1, 2, 2}));
}

/// The echo of a write that was late answers the same write when it is repeated: a read between the two may
/// still be on its way.
TEST(RtuBus, TheEchoOfARepeatedWriteDoesNotProveThatAReadIsNoLongerLate) {
  for (int delay = 60; delay < 110; delay += 2) {
    BusRig rig;
    rig.line->network().node(1)->poke(0x0020, 111);
    rig.line->network().node(1)->poke(0x0032, 222);
    rig.line->network().faults().add({.kind = FaultKind::delay_reply,
                                      .node = 1,
                                      .function = 6,
                                      .delay = std::chrono::milliseconds(delay)});
    rig.line->network().faults().add(
        {.kind = FaultKind::delay_reply, .node = 1, .function = 3, .delay = std::chrono::milliseconds(60)});
    Request stop{.node = 1, .function = Function::write_single_register, .address = 0x0028};
    stop.values.push_back(0);
    const TransactionOptions urgent{.transaction_class = TransactionClass::stop};
    rig.transact("stop", stop, urgent);
    rig.world.run_for(35ms);
    rig.transact("late",
                 {.node = 1, .function = Function::read_holding_registers, .address = 0x0020, .count = 4},
                 urgent);
    rig.world.run_for(35ms);
    rig.transact("repeated", stop, urgent);
    rig.read("next", 0x0032, 4);
    rig.world.run_for(800ms);
    if (const auto& next = rig.results.at("next")) EXPECT_EQ(next->registers.at(0), 222) << delay;
  }
}

/// The echo of a write that was late would say of the next such write that it was executed.
TEST(RtuBus, AnEchoThatMayBeAnOldOneIsNotCertain) {
  BusRig rig;
  auto& faults = rig.line->network().faults();
  const auto stop = [&](const std::string& name, std::uint16_t value) {
    rig.transact(
        name, {.node = 1, .function = Function::write_single_register, .address = 0x0028, .values = {value}});
    rig.world.run_for(60ms);
    return rig.results.at(name);
  };
  ASSERT_TRUE(stop("first", 0));
  EXPECT_TRUE(stop("first", 0)->certain);
  faults.add({.kind = FaultKind::delay_reply, .node = 1, .delay = 70ms});
  EXPECT_FALSE(stop("late", 0));
  faults.add({.kind = FaultKind::drop_request, .node = 1});
  const auto lost = stop("lost", 0);
  ASSERT_TRUE(lost) << "the echo of the one before did not come";
  EXPECT_FALSE(lost->certain);
  EXPECT_TRUE(stop("another", 1)->certain);
  EXPECT_FALSE(stop("again", 0)->certain);
  rig.read("read", 0x0004, 1);
  rig.world.run_for(60ms);
  ASSERT_TRUE(rig.results.at("read"));
  EXPECT_TRUE(stop("after a read", 0)->certain);
}

/// A reply that is late may still be on its way when the port was lost and is open again.
TEST(RtuBus, ALateReplyNeverAnswersAReadAfterThePortWasOpenedAgain) {
  for (int delay = 30; delay < 120; delay += 2) {
    BusRig rig;
    rig.line->network().node(1)->poke(0x0020, 111);
    rig.line->network().node(1)->poke(0x0032, 222);
    rig.line->network().faults().add({.kind = FaultKind::delay_reply,
                                      .node = 1,
                                      .function = 3,
                                      .delay = std::chrono::milliseconds(delay)});
    rig.read("late", 0x0020, 4);
    rig.world.run_for(40ms);
    rig.line->set_open(false);
    rig.line->set_open(true);
    rig.read("next", 0x0032, 4);
    rig.world.run_for(500ms);
    ASSERT_EQ(rig.results.size(), 2U);
    if (const auto& next = rig.results.at("next")) EXPECT_EQ(next->registers.at(0), 222) << delay;
  }
}

/// A drive has no register 0x0500: its refusal could be that of the read before, and so could the next.
TEST(RtuBus, AReadThatIsRefusedCostsOneReadMoreAfterItsReplyWasLost) {
  BusRig rig;
  rig.read("state", 0x0003, 10);
  rig.world.run_for(100ms);
  rig.line->network().faults().add({.kind = FaultKind::drop_reply, .node = 1, .function = 3});
  rig.read("lost", 0x0500, 1);
  rig.read("again", 0x0500, 1);
  rig.world.run_for(500ms);
  EXPECT_EQ(rig.results.at("lost").error().reason, Reason::no_reply);
  EXPECT_EQ(rig.results.at("again").error().reason, Reason::refused)
      << to_string(rig.results.at("again").error());
  const auto& wire = rig.line->wire();
  ASSERT_EQ(wire.size(), 4);
  EXPECT_EQ(wire[2].address(), 0x0003) << "known to be answered";
  EXPECT_EQ(wire[2].value(), 2);
  EXPECT_EQ(wire[3].address(), 0x0500);
}

/// Whatever is lost, late or refused: no read goes out while a late reply could be taken for its own.
TEST(RtuBus, NoReadIsAnsweredByALateReplyHoweverManyAreLost) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    BusRig rig;
    std::mt19937 dice(seed);
    constexpr std::array<std::uint16_t, 4> places{0x0003, 0x0020, 0x0090, 0x0500};
    for (std::uint16_t i = 0; i < 32; ++i) rig.line->network().node(1)->poke(0x0090 + i, 0x4000 + i);
    constexpr std::array kinds{FaultKind::drop_reply, FaultKind::delay_reply, FaultKind::drop_request,
                               FaultKind::corrupt_reply};
    rig.line->set_on_bind([&](const test::WireEntry&) {
      rig.line->network().faults().clear();
      if (dice() % 10 < 8)
        rig.line->network().faults().add(
            {.kind = kinds.at(dice() % kinds.size()), .delay = std::chrono::milliseconds(dice() % 3000)});
    });
    for (int i = 0; i < 300; ++i) {
      const auto place = places.at(dice() % places.size());
      rig.read((place == 0x0090 ? "marked " : "other ") + std::to_string(i), place,
               static_cast<std::uint16_t>(1 + dice() % 3));
      rig.world.run_for(std::chrono::milliseconds(dice() % 200));
    }
    rig.line->set_on_bind({});
    rig.line->network().faults().clear();
    rig.world.run_for(20s);
    EXPECT_EQ(rig.results.size(), 300) << "none is held for ever";
    for (const auto& [name, result] : rig.results)
      if (result && name.starts_with("marked")) EXPECT_EQ(result->registers.front(), 0x4000) << name;
  }
}

TEST(RtuBus, OneSilentNodeDoesNotDisturbItsNeighbour) {
  BusRig rig;
  rig.line->network().node(1)->set_power(false);
  rig.read("silent", 0x0003, 10, 1);
  rig.read("other", 0x0003, 10, 2);
  rig.world.run_for(1s);
  EXPECT_EQ(rig.results.at("silent").error().reason, Reason::no_reply);
  EXPECT_EQ(rig.results.at("silent").error().outcome, Outcome::unknown);
  EXPECT_TRUE(rig.results.at("other"));
  EXPECT_EQ(rig.bus->counters().timeouts, 1U);
}

TEST(RtuBus, AStopOvertakesWhatIsArmedAndCutsAnotherNodesSilence) {
  BusRig rig;
  rig.line->network().node(1)->set_power(false);
  for (std::uint16_t i = 0; i < 5; ++i)
    rig.read("r" + std::to_string(i), static_cast<std::uint16_t>(0x0020 + i), 1, 1);
  rig.world.run_for(5ms);
  Request stop{.node = 2, .function = Function::write_single_register, .address = 0x0028};
  stop.values.push_back(0);
  const auto asked = rig.world.now();
  rig.transact("stop", stop, {.transaction_class = TransactionClass::stop});
  rig.world.run_for(1s);
  EXPECT_TRUE(rig.results.at("stop"));
  ASSERT_GE(rig.line->wire().size(), 2U);
  EXPECT_EQ(rig.line->wire()[1].address(), 0x0028);
  EXPECT_LE(rig.line->wire()[1].begin - asked, 25ms);  // turnaround_max and the silence
}

/// Of a node that does not answer: a new stop goes at once, its repetition as seldom as any probe, and at
/// once when anything is heard of the node.
TEST(RtuBus, WhatIsHeldBackGoesOutInItsTurnThoughTimePassesMeanwhile) {
  BusRig rig(true);
  rig.line->network().node(1)->set_power(false);
  for (int i = 0; i < 4; ++i) rig.read("in vain", 0x0003, 10);
  ASSERT_TRUE(rig.world.run_until([&] { return rig.bus->held_back() > 0; }, 5s));
  const auto asked = rig.line->wire().size();
  EXPECT_TRUE(rig.world.run_until([&] { return rig.line->wire().size() > asked; }, 5s));
}

TEST(RtuBus, RepeatedStopsToASilentNodeWaitForTheirTurn) {
  BusRig rig;
  rig.line->network().node(1)->set_power(false);
  for (int i = 0; i < 8; ++i) {
    rig.world.run_for(2s);
    rig.read("r", 0x0020, 1, 1);
    rig.world.run_for(50ms);
  }
  ASSERT_TRUE(rig.bus->holds_back(1));
  Request stop{.node = 1, .function = Function::write_single_register, .address = 0x0028};
  stop.values.push_back(0);
  const auto stops_in = [&](Duration time) {
    rig.line->forget_wire();
    rig.world.run_for(time);
    return std::ranges::count(rig.line->wire(), 0x0028, &test::WireEntry::address);
  };
  rig.transact("new", stop, {.transaction_class = TransactionClass::stop});
  EXPECT_EQ(stops_in(50ms), 1);
  rig.transact("again", stop, {.transaction_class = TransactionClass::stop, .patient = true});
  EXPECT_EQ(stops_in(1s), 0);
  rig.line->network().node(1)->set_power(true);
  rig.world.run_for(100ms);  // it boots
  EXPECT_FALSE(rig.results.contains("again"));
  rig.transact("looked for", {.node = 1, .function = Function::read_holding_registers, .count = 1},
               {.transaction_class = TransactionClass::scan});
  EXPECT_EQ(stops_in(50ms), 1);
  EXPECT_TRUE(rig.results.contains("again"));
  EXPECT_FALSE(rig.bus->holds_back(1));
}

TEST(RtuBus, HoldsBackWhileNoReplyCouldBeToldFromALateOne) {
  BusRig rig;
  const auto wait_for = [&](const std::string& name, TransactionClass transaction_class) {
    rig.transact(name, {.node = 1, .address = 0x0003, .count = 2}, {.transaction_class = transaction_class});
  };
  rig.line->network().faults().add({.kind = simulation::FaultKind::corrupt_reply, .count = -1});
  for (std::uint16_t count = 1; count <= LateReplies::longest_read; ++count) {
    EXPECT_FALSE(rig.bus->holds_back(1));
    rig.read("garbled", 0x0003, count);
    rig.world.run_for(50ms);
  }
  rig.line->network().faults().clear();
  EXPECT_TRUE(rig.bus->holds_back(1));
  EXPECT_FALSE(rig.bus->holds_back(2));
  wait_for("state", TransactionClass::idle_state);
  wait_for("asked for", TransactionClass::parameters);
  rig.world.run_for(1s);
  EXPECT_TRUE(rig.results.contains("garbled"));
  EXPECT_EQ(rig.results.size(), 1U);
  rig.bus->give_up_readings(2);
  rig.world.run_for(10ms);
  EXPECT_EQ(rig.results.size(), 1U);
  rig.bus->give_up_readings(1);
  rig.world.run_for(10ms);
  ASSERT_TRUE(rig.results.contains("state"));
  EXPECT_EQ(rig.results.at("state").error().reason, Reason::superseded);
  EXPECT_EQ(rig.results.at("state").error().outcome, Outcome::not_sent);
  EXPECT_FALSE(rig.results.contains("asked for"));
  rig.world.run_for(LateReplies::latest);
  EXPECT_FALSE(rig.bus->holds_back(1));
  ASSERT_TRUE(rig.results.contains("asked for"));
  EXPECT_TRUE(rig.results.at("asked for"));
}

TEST(RtuBus, ARaisedGateIsNeverSent) {
  for (int offset = 0; offset < 40; ++offset) {
    BusRig rig;
    const auto gate = std::make_shared<AxisGate>();
    rig.read("busy", 0x0003, 10);
    Request trigger{.node = 1, .function = Function::write_single_register, .address = 0x0027};
    trigger.values.push_back(5);
    rig.transact(
        "trigger", trigger,
        {.transaction_class = TransactionClass::motion, .guard = {.gate = gate, .epoch = gate->epoch()}});
    rig.world.run_for(std::chrono::microseconds(offset * 400));
    const bool was_sent = std::ranges::any_of(
        rig.line->wire(), [](const test::WireEntry& entry) { return entry.address() == 0x0027; });
    gate->raise();
    rig.bus->purge_superseded(1, *gate);
    rig.world.run_for(1s);
    EXPECT_EQ(rig.results.at("trigger").has_value(), was_sent);
    if (!was_sent) EXPECT_EQ(rig.results.at("trigger").error().reason, Reason::superseded);
  }
}

TEST(RtuBus, ExpiredAndLostPortsAreSaid) {
  BusRig rig;
  rig.read("first", 0x0003, 10);
  rig.transact("late",
               {.node = 1, .function = Function::read_holding_registers, .address = 0x0010, .count = 1},
               {.deadline = rig.world.now() + 1ms});
  rig.world.run_for(100ms);
  EXPECT_EQ(rig.results.at("late").error().reason, Reason::expired);
  EXPECT_EQ(rig.results.at("late").error().outcome, Outcome::not_sent);
  rig.read("under way", 0x0003, 10);
  rig.read("waiting", 0x0010, 2);
  rig.world.run_for(3ms);
  rig.line->set_open(false);
  rig.world.run_for(100ms);
  EXPECT_EQ(rig.results.at("under way").error().outcome, Outcome::unknown);
  EXPECT_EQ(rig.results.at("waiting").error().outcome, Outcome::not_sent);
  EXPECT_EQ(rig.results.at("waiting").error().reason, Reason::bus_down);
  EXPECT_TRUE(rig.bus->idle());
}

}  // namespace
}  // namespace axisd::modbus_rtu
