// M25: others may share the network. What another master starts or stops there is told as an event.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <variant>
#include <vector>

#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// What events tell of another master.
std::vector<std::string> told(CanRig& rig) {
  std::vector<std::string> texts;
  for (const auto& event : rig.machine->events().events_after(0, 1000).events)
    if (const auto* change = std::get_if<LinkChange>(&event.content))
      if (change->detail.find("another master") != std::string::npos) texts.push_back(change->detail);
  return texts;
}

class OtherMaster {
 public:
  explicit OtherMaster(CanRig& rig)
      : rig_(&rig), id_(rig.network.join([](const can::Frame&, TimePoint, bool) {})) {}
  void send(std::uint32_t id, const std::vector<std::uint8_t>& bytes) {
    rig_->network.transmit(id_, can::make_frame(id, bytes));
    rig_->run(100ms);
  }

 private:
  CanRig* rig_;
  can::Network::Id id_;
};

TEST(M25, WhatAxisdItselfSendsIsNoOtherMasters) {
  for (const Duration period : {Duration(0ms), Duration(10ms)}) {
    CanRig rig({.sync_period = period, .limits = false});
    rig.ready();
    rig.done(MoveRelativeRequest{.distance = 10});
    rig.done(StopRequest{.kind = StopKind::stop});
    rig.done(DisableRequest{});
    rig.run(3s);
    EXPECT_THAT(told(rig), IsEmpty());
  }
}

TEST(M25, TheStartOfAnotherMasterIsAnEventAndIsStopped) {
  struct Case {
    std::uint32_t id;
    std::vector<std::uint8_t> bytes;
    const char* text;
  };
  const Case cases[] = {{0x200U + CanRig::node_id, {0x1F, 0}, "another master sends RPDO 1"},
                        {0x600U + CanRig::node_id,
                         {0x2B, 0x40, 0x60, 0, 0x1F, 0, 0, 0},
                         "another master writes 6040h:00 by SDO"}};
  for (const auto& one : cases) {
    SCOPED_TRACE(one.text);
    CanRig rig({.limits = false});
    rig.ready();
    rig.done(MoveRelativeRequest{.distance = 1});
    rig.run(500ms);
    rig.touch([](auto& node) { node.poke(0x607A00, 50'000); });
    OtherMaster other(rig);
    other.send(one.id, one.bytes);
    EXPECT_THAT(told(rig), ElementsAre(HasSubstr(one.text)));
    EXPECT_THAT(rig.state()->link_note, HasSubstr(one.text));
    rig.run(3s);
    EXPECT_FALSE(rig.drive->shaft_moving()) << "nobody here asked for it (M4)";
    rig.run(15s);
    EXPECT_EQ(rig.state()->link_note, "");
  }
}

TEST(M25, NmtOfAnotherMasterIsAnEvent) {
  for (const std::uint8_t node : {std::uint8_t{0}, CanRig::node_id}) {
    CanRig rig({.limits = false});
    rig.ready();
    OtherMaster other(rig);
    other.send(0, {0x01, node});
    EXPECT_THAT(told(rig), ElementsAre(HasSubstr("another master sends NMT 'start'")));
    other.send(0, {0x01, 77});
    EXPECT_EQ(told(rig).size(), 1U) << "to a node that is not of this axis";
  }
}

TEST(M25, AFloodOfAnotherMasterIsOneEvent) {
  CanRig rig({.limits = false});
  rig.ready();
  OtherMaster other(rig);
  for (int i = 0; i < 100; ++i) {
    other.send(0, {0x01, CanRig::node_id});
    other.send(0x500U + CanRig::node_id, {0});  // RPDO 4, which maps nothing
  }
  EXPECT_EQ(told(rig).size(), 1U);
  // Reading starts nothing.
  rig.run(15s);
  other.send(0x600U + CanRig::node_id, {0x40, 0x41, 0x60, 0, 0, 0, 0, 0});
  EXPECT_EQ(told(rig).size(), 1U);
}

TEST(M25, WhatComesAndGoesBesideItIsNoNewsOfAnotherMaster) {
  CanRig rig({.limits = false});
  rig.ready();
  OtherMaster other(rig);
  for (int i = 0; i < 3; ++i) {
    other.send(0, {0x01, CanRig::node_id});
    rig.network.set_fault([](const can::Frame& frame) {
      return can::Network::Fault{.drop = frame.id == 0x280U + CanRig::node_id};
    });
    rig.run(2s);
    EXPECT_THAT(rig.state()->link_note, HasSubstr("; state by SDO polling"));
    rig.network.set_fault({});
    rig.run(2s);
    EXPECT_THAT(rig.state()->link_note, HasSubstr("another master"));
  }
  EXPECT_EQ(told(rig).size(), 1U);
}

}  // namespace
}  // namespace axisd::test
