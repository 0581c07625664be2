// Several simulated CAN nodes on one network in virtual time: frames, faults, control commands.
#include "devices/simulation/can_nodes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "devices/simulation/control.hpp"
#include "devices/yss_c/simulator.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::simulation {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CanNodesTest : public ::testing::Test {
 protected:
  CanNodesTest() {
    master = network.join([this](const can::Frame& frame, TimePoint at, bool own) {
      if (!own) heard.push_back({frame, at});
    });
  }
  SimulatedCanNode& put(std::uint8_t address, SimulatedNodeSettings settings = {}) {
    settings.address = address;
    return nodes.nodes().add(std::make_unique<yss_c::SimulatedDrive>(std::move(settings)));
  }
  void send(std::uint32_t id, std::vector<std::uint8_t> bytes) {
    bytes.resize(id == 0 ? 2 : id == 0x80 ? 0 : 8);
    network.transmit(master, can::make_frame(id, bytes));
  }
  /// What comes within `duration`, as "581#60..." texts.
  std::vector<std::string> wait(Duration duration) {
    heard.clear();
    world.run_for(duration);
    std::vector<std::string> texts;
    for (const auto& one : heard) texts.push_back(can::to_string(one.frame));
    return texts;
  }
  std::vector<std::string> ask(std::uint32_t id, std::vector<std::uint8_t> bytes) {
    send(id, std::move(bytes));
    return wait(5ms);
  }
  std::string command(std::string_view text) { return execute_control(nodes.nodes(), text); }

  test::VirtualWorld world;
  can::Network network{world.clock(), 1'000'000};
  NetworkNodes nodes{world.clock(), network};
  can::Network::Id master = 0;
  std::vector<can::ReceivedFrame> heard;
};

const std::vector<std::uint8_t> read_device_type{0x40, 0x00, 0x10, 0x00};

TEST_F(CanNodesTest, EveryNodeAnswersForItselfAfterItsLatency) {
  put(1);
  put(7);
  EXPECT_THAT(ask(0x601, read_device_type), ElementsAre("581#4300100092010400"));
  EXPECT_THAT(ask(0x607, read_device_type), ElementsAre("587#4300100092010400"));
  EXPECT_THAT(ask(0x602, read_device_type), IsEmpty());
  const auto begin = world.now();
  ask(0x601, read_device_type);
  EXPECT_EQ(begin + network.frame_time(heard[0].frame) * 2 + 500us, heard[0].at);
}

TEST_F(CanNodesTest, BootsWithAMessageAndAnswersAfterIt) {
  put(3);
  EXPECT_EQ("ok", command("power 3 off"));
  EXPECT_THAT(ask(0x603, read_device_type), IsEmpty());
  EXPECT_EQ("ok", command("power 3 on"));
  EXPECT_THAT(ask(0x603, read_device_type), IsEmpty()) << "still booting";
  EXPECT_THAT(wait(300ms), ElementsAre("703#00"));
  EXPECT_THAT(ask(0x603, read_device_type), ElementsAre("583#4300100092010400"));
}

TEST_F(CanNodesTest, TwoNodesWithOneIdBothAnswer) {
  put(4);
  put(4);
  EXPECT_EQ(2U, ask(0x604, read_device_type).size());
}

TEST_F(CanNodesTest, ANodeAtAnotherBitRateHearsNothing) {
  SimulatedNodeSettings settings;
  settings.dip_baud = 0;
  put(1, settings);
  EXPECT_THAT(ask(0x601, read_device_type), IsEmpty());
  settings.dip_baud = 1'000'000;
  put(2, settings);
  EXPECT_EQ(1U, ask(0x602, read_device_type).size());
}

TEST_F(CanNodesTest, MovesWhileNobodyAsks) {
  auto& node = put(1);
  for (const std::vector<std::uint8_t>& frame : {std::vector<std::uint8_t>{0x2F, 0x60, 0x60, 0, 1},
                                                 {0x2B, 0x40, 0x60, 0, 6},
                                                 {0x2B, 0x40, 0x60, 0, 0x0F},
                                                 {0x2B, 0x40, 0x60, 0, 0x5F}})
    ask(0x601, frame);
  EXPECT_TRUE(node.shaft_moving());
  wait(5s);
  EXPECT_EQ(5000, node.shaft_pulses());
  EXPECT_EQ("ok position=5000 moving=0 starts=1", command("shaft 1"));
  EXPECT_EQ("ok 5000", command("peek @1 0x606400"));
}

TEST_F(CanNodesTest, DropsRequestsAndReplies) {
  put(1);
  EXPECT_EQ("ok", command("fault drop_request node=1"));
  EXPECT_THAT(ask(0x601, {0x2B, 0x0E, 0x20, 0, 9}), IsEmpty());
  EXPECT_EQ("ok 5", command("peek 1 0x200E00"));
  EXPECT_EQ("ok", command("fault drop_reply object=0x200E skip=1"));
  EXPECT_EQ(1U, ask(0x601, {0x40, 0x0E, 0x20, 0}).size());
  EXPECT_THAT(ask(0x601, {0x2B, 0x0E, 0x20, 0, 9}), IsEmpty());
  EXPECT_EQ("ok 9", command("peek 1 0x200E00")) << "executed all the same";
}

TEST_F(CanNodesTest, AnswersLateAndAborts) {
  put(1);
  command("fault delay_reply delay_ms=20");
  EXPECT_THAT(ask(0x601, read_device_type), IsEmpty());
  EXPECT_EQ(1U, wait(20ms).size());
  command("fault abort object=0x1000 code=0x06090030");
  EXPECT_THAT(ask(0x601, read_device_type), ElementsAre("581#8000100030000906"));
  EXPECT_EQ(0U, nodes.nodes().pending_faults());
}

/// One identifier, one queue: the client relies on it.
TEST_F(CanNodesTest, ALateAnswerIsNotOvertaken) {
  put(1);
  command("fault delay_reply delay_ms=20");
  EXPECT_THAT(ask(0x601, read_device_type), IsEmpty());
  EXPECT_THAT(ask(0x601, {0x40, 0x01, 0x10, 0}), IsEmpty());
  EXPECT_THAT(wait(20ms), ElementsAre("581#4300100092010400", "581#4F01100000000000"));
  command("fault delay_reply delay_ms=20");
  ask(0x601, read_device_type);
  command("fault reboot node=1");
  EXPECT_THAT(wait(400ms), ElementsAre("701#00")) << "what was not sent yet is gone with the supply";
}

TEST_F(CanNodesTest, GoesSilentAndComesBack) {
  put(1);
  command("fault silence node=1 delay_ms=100");
  EXPECT_THAT(ask(0x601, read_device_type), IsEmpty());
  wait(100ms);
  EXPECT_EQ(1U, ask(0x601, read_device_type).size());
  command("fault silence node=1");
  wait(1h);
  EXPECT_THAT(ask(0x601, read_device_type), IsEmpty());
  command("fault clear");
  EXPECT_EQ(1U, ask(0x601, read_device_type).size());
}

TEST_F(CanNodesTest, RebootsNowOrWhenAFrameComes) {
  put(1);
  command("fault reboot node=1 delay_ms=50");
  EXPECT_THAT(wait(349ms), IsEmpty());
  EXPECT_THAT(wait(2ms), ElementsAre("701#00"));
  command("fault reboot_after object=0x200E skip=1");
  ask(0x601, {0x40, 0x0E, 0x20, 0});
  EXPECT_THAT(ask(0x601, {0x2B, 0x0E, 0x20, 0, 9}), IsEmpty());
  EXPECT_THAT(wait(300ms), ElementsAre("701#00"));
  EXPECT_EQ("ok 5", command("peek 1 0x200E00")) << "200Eh is not saved";
}

TEST_F(CanNodesTest, FloodsAtTheBitRateForAWhile) {
  put(1);
  command("fault flood node=1 cob=0x081 delay_ms=10");
  const auto sent = wait(20ms);
  EXPECT_EQ(75, std::ranges::count(sent, "081#5555555555555555")) << "10 ms of 135 bits each";
  EXPECT_THAT(wait(20ms), IsEmpty());
}

TEST_F(CanNodesTest, EmitsAnEmergency) {
  put(1);
  command("fault emcy node=1 code=0x8130 bytes=11");
  EXPECT_THAT(wait(5ms), ElementsAre("081#3081110000000000"));
}

TEST_F(CanNodesTest, UploadsWithoutEndOrWithAWrongToggle) {
  put(1);
  command("fault endless_upload object=0x1000");
  EXPECT_THAT(ask(0x601, read_device_type), ElementsAre("581#4000100000000000"));
  for (int i = 0; i < 20; ++i) {
    const bool toggle = i % 2 != 0;
    EXPECT_THAT(ask(0x601, {static_cast<std::uint8_t>(toggle ? 0x70 : 0x60)}),
                ElementsAre(toggle ? "581#1042434445464748" : "581#0042434445464748"));
  }
  EXPECT_THAT(ask(0x601, {0x80, 0, 0x10, 0, 0, 0, 4, 5}), IsEmpty());
  EXPECT_THAT(ask(0x601, read_device_type), ElementsAre("581#4300100092010400"))
      << "the client's abort ends it";
  command("fault wrong_toggle");
  ask(0x601, read_device_type);
  EXPECT_THAT(ask(0x601, {0x60}), ElementsAre("581#1042434445464748"));
}

TEST_F(CanNodesTest, ACutCableLetsTheDrivesGoOn) {
  auto& node = put(1);
  command("cut");
  EXPECT_THAT(ask(0x601, {0x2B, 0x0E, 0x20, 0, 9}), IsEmpty());
  node.raise_alarm(1);
  EXPECT_THAT(wait(5ms), IsEmpty());
  command("join");
  EXPECT_THAT(ask(0x601, {0x40, 0x3F, 0x60, 0}), ElementsAre("581#4B3F600001FF0000"));
}

TEST_F(CanNodesTest, SaysWhatIsWrongWithAFault) {
  put(1);
  EXPECT_THAT(command("fault echo"), HasSubstr("use one of drop_request, drop_reply"));
  EXPECT_THAT(command("fault abort register=1"), HasSubstr("use node=, cob=, object="));
  EXPECT_THAT(command("power 9 on"), HasSubstr("no node 9"));
}

TEST_F(CanNodesTest, NodesHearEachOther) {
  put(1);
  auto& other = put(2);
  send(0, {1, 0});
  wait(1ms);
  // Node 1 maps its status word to TPDO1, whose identifier is RPDO1 of node 2.
  ask(0x601, {0x23, 0x00, 0x18, 1, 0x81, 1, 0, 0x80});
  ask(0x601, {0x23, 0x00, 0x18, 1, 0x02, 2, 0, 0x80});
  ask(0x601, {0x23, 0x00, 0x1A, 1, 0x10, 0, 0x41, 0x60});
  ask(0x601, {0x2F, 0x00, 0x1A, 0, 1});
  ask(0x601, {0x23, 0x00, 0x18, 1, 0x02, 2, 0, 0});
  wait(5ms);
  EXPECT_EQ(0x0250U, other.peek(0x604000));
}

}  // namespace
}  // namespace axisd::simulation
