// Frames and times on a simulated line, and what its faults do.
#include "devices/simulation/rtu_network.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "devices/simulation/crc.hpp"
#include "devices/simulation/simulator.hpp"

namespace axisd::simulation {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

Bytes framed(Bytes bytes) {
  append_frame_crc(bytes);
  return bytes;
}
const Bytes read_block = framed({1, 3, 0, 0x20, 0, 4});
const Bytes read_other = framed({2, 3, 0, 0x20, 0, 4});
const Bytes start_move = framed({1, 6, 0, 0x27, 0, 1});

/// Two drives on one line.
class RtuNetworkTest : public ::testing::Test {
 protected:
  explicit RtuNetworkTest(RtuNetworkSettings settings = {}) : network(settings) {
    network.advance(t);
    for (const std::uint8_t address : {1, 2}) {
      SimulatedNodeSettings node;
      node.address = address;
      network.add(*make_node("ykd2405pr", node));
    }
  }
  void fault(std::string_view text) { network.faults().add(parse_fault(text).value()); }
  std::optional<ReplyPlan> ask(const Bytes& request) {
    t += 100ms;
    return network.on_request(request, t);
  }

  TimePoint t{1s};
  RtuNetwork network;
};

TEST_F(RtuNetworkTest, RepliesAfterTheTurnaroundByteByByte) {
  const auto reply = ask(read_block);
  ASSERT_TRUE(reply);
  EXPECT_EQ(13U, reply->bytes.size());
  EXPECT_TRUE(frame_is_sound(reply->bytes));
  EXPECT_EQ(t + 2ms, reply->begin);
  EXPECT_EQ(t + 2ms + 13 * network.character_time(), reply->end);
  EXPECT_EQ(reply->begin + network.character_time(), reply->arrivals.front());
  EXPECT_EQ(reply->end, reply->arrivals.back());
}

TEST(RtuNetworkTimes, FollowTheBaudRate) {
  RtuNetwork slow({.baud = 9600});
  EXPECT_EQ(Duration(1041666), slow.character_time());
  EXPECT_EQ(Duration(3645831), slow.silence());
  EXPECT_EQ(slow.silence(), slow.turnaround()) << "no faster than the end of the frame is recognised";
  RtuNetwork fast({.baud = 38400, .bits_per_character = 11, .turnaround = 5ms});
  EXPECT_EQ(Duration(286458), fast.character_time());
  EXPECT_EQ(1750us, fast.silence());
  EXPECT_EQ(5ms, fast.turnaround());
}

TEST_F(RtuNetworkTest, OnlyTheAddressedNodeAnswers) {
  EXPECT_EQ(2, ask(read_other)->bytes[0]);
  EXPECT_FALSE(ask(framed({3, 3, 0, 0x20, 0, 4})));
}

TEST_F(RtuNetworkTest, SplitsTheStreamBySilence) {
  network.on_bytes(std::span(read_block).first(3), t);
  network.on_bytes(std::span(read_block).subspan(3), t + 1ms);  // within the silence: the same frame
  EXPECT_EQ(t + 1ms + 5 * network.character_time() + 1750us, network.next_event());
  network.advance(network.next_event() - 1ns);
  EXPECT_FALSE(network.take_reply());
  network.advance(network.next_event());
  const auto reply = network.take_reply();
  ASSERT_TRUE(reply);
  EXPECT_EQ(t + 1ms + 5 * network.character_time() + 2ms, reply->begin);
  EXPECT_EQ(TimePoint::max(), network.next_event());
}

TEST_F(RtuNetworkTest, TwoFramesWithASilenceAreTwoAndWithoutAreNone) {
  network.on_bytes(read_block, t);
  network.on_bytes(read_other, t + 10ms);
  network.advance(t + 20ms);
  EXPECT_EQ(1, network.take_reply()->bytes[0]);
  EXPECT_EQ(2, network.take_reply()->bytes[0]);
  network.on_bytes(read_block, t + 30ms);
  network.on_bytes(read_other, t + 30ms);
  network.advance(t + 60ms);
  EXPECT_FALSE(network.take_reply());
}

TEST_F(RtuNetworkTest, AClashOfAddressesDamagesTheReply) {
  SimulatedNodeSettings twin;
  twin.eeprom = {{0x0011, 3}};
  network.add(*make_node("ykd2405pr", twin));
  EXPECT_FALSE(frame_is_sound(ask(framed({1, 3, 0, 0x11, 0, 1}))->bytes));
}

/// One drive with switches for `baud` and the format code of 0x0015 in its EEPROM.
std::unique_ptr<SimulatedRtuNode> drive_at(int baud, std::uint16_t format) {
  SimulatedNodeSettings settings;
  settings.dip_baud = baud;
  settings.eeprom = {{0x0015, format}};
  return *make_node("ykd2405pr", settings);
}

TEST(RtuNetworkSerial, OtherSettingsThanTheNodesAreGarbageToIt) {
  using enum modbus_rtu::Parity;
  struct Case {
    Serial line;
    bool heard;
  };
  RtuNetwork network;
  TimePoint t{1s};
  network.advance(t);
  network.add(drive_at(19200, 2));  // 8E1
  EXPECT_TRUE(network.on_request(read_block, t)) << "nobody said how the line is set";
  for (const auto& [line, heard] :
       {Case{{.baud = 19200, .format = {.parity = even}}, true},
        Case{{.baud = 38400, .format = {.parity = even}}, false}, Case{{.baud = 19200}, false},
        Case{{.baud = 19200, .format = {.parity = odd}}, false},
        Case{{.baud = 19200, .format = {.stop_bits = 2}}, false},
        Case{{.baud = 19200, .format = {}, .parity_hidden = true}, true},
        Case{{.baud = 19200, .format = {.stop_bits = 2}, .parity_hidden = true}, false}}) {
    network.set_serial(line);
    EXPECT_EQ(heard, network.on_request(read_block, t += 100ms).has_value())
        << line.baud << ' ' << line.format.stop_bits;
  }
}

TEST(RtuNetworkSerial, TimesFollowTheLine) {
  RtuNetwork network;
  network.set_serial({.baud = 9600, .format = {.parity = modbus_rtu::Parity::even}});
  EXPECT_EQ(Duration(1'145'833), network.character_time());
  network.set_serial({.baud = 128000});
  EXPECT_EQ(Duration(78'125), network.character_time());
}

TEST(RtuNetworkSerial, NodesJoinTheLineThatTheyAreAddedToOrThatIsSetFirst) {
  for (const bool before : {false, true}) {
    RtuNetwork network;
    TimePoint t{1s};
    network.advance(t);
    if (before) network.set_serial({.baud = 38400, .format = {.stop_bits = 2}});
    auto& node = network.add(*make_node("ykd2405pr", {}));
    if (!before) network.set_serial({.baud = 38400, .format = {.stop_bits = 2}});
    EXPECT_EQ(1, node.peek(0x0015));
    EXPECT_TRUE(network.on_request(read_block, t += 100ms));
    network.set_serial({.baud = 115200});
    EXPECT_FALSE(network.on_request(read_block, t += 100ms)) << "a later change is the master's alone";
  }
}

TEST(RtuNetworkSerial, AChangeOfTheNodesCountsFromItsNextPowerUp) {
  RtuNetwork network;
  TimePoint t{1s};
  network.advance(t);
  network.set_serial({.baud = 115200});
  auto& node = network.add(*make_node("ykd2405pr", {}));
  EXPECT_TRUE(network.on_request(framed({1, 6, 0, 0x15, 0, 3}), t += 100ms));
  EXPECT_TRUE(network.on_request(read_block, t += 100ms));
  node.set_power(false);
  node.set_power(true);
  EXPECT_FALSE(network.on_request(read_block, t += 1s));
  network.set_serial({.baud = 115200, .format = {.parity = modbus_rtu::Parity::odd}});
  EXPECT_TRUE(network.on_request(read_block, t += 100ms));
}

TEST_F(RtuNetworkTest, ACutCableLeavesTheDrivesRunning) {
  ask(framed({1, 6, 0, 0x27, 0, 2}));
  network.set_connected(false);
  EXPECT_FALSE(ask(read_block));
  const auto before = network.node(1)->shaft_pulses();
  network.advance(t += 1s);
  EXPECT_GT(network.node(1)->shaft_pulses(), before);
  network.set_connected(true);
  EXPECT_TRUE(ask(read_block));
}

TEST_F(RtuNetworkTest, DropsTheRequestBeforeOrTheReplyAfterItsExecution) {
  fault("drop_request register=0x27");
  EXPECT_FALSE(ask(start_move));
  EXPECT_EQ(0, network.node(1)->starts());
  fault("drop_reply register=0x27");
  EXPECT_TRUE(ask(read_block)) << "another register";
  EXPECT_FALSE(ask(start_move));
  EXPECT_EQ(1, network.node(1)->starts());
  EXPECT_EQ(0U, network.faults().pending());
}

TEST_F(RtuNetworkTest, FiltersSkipsAndCounts) {
  fault("drop_reply node=1 function=3 skip=1 count=2");
  EXPECT_TRUE(ask(read_other));
  EXPECT_TRUE(ask(read_block));
  EXPECT_FALSE(ask(read_block));
  EXPECT_FALSE(ask(read_block));
  EXPECT_TRUE(ask(read_block));
  fault("drop_reply count=-1");
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(ask(read_block));
  network.faults().clear();
  EXPECT_TRUE(ask(read_block));
}

TEST_F(RtuNetworkTest, ARegisterFilterMatchesWithinABlock) {
  fault("drop_reply register=0x0022");
  EXPECT_TRUE(ask(framed({1, 3, 0, 0x20, 0, 2})));
  EXPECT_FALSE(ask(read_block));
}

TEST_F(RtuNetworkTest, DelaysDripsDamagesAndShortens) {
  fault("delay_reply delay_ms=7");
  EXPECT_EQ(t + 100ms + 9ms, ask(read_block)->begin);
  fault("drip delay_ms=3");
  const auto dripped = ask(read_block);
  EXPECT_EQ(network.character_time() + 3ms, dripped->arrivals[5] - dripped->arrivals[4]);
  fault("corrupt_reply");
  const auto damaged = ask(read_block);
  EXPECT_EQ(13U, damaged->bytes.size());
  EXPECT_FALSE(frame_is_sound(damaged->bytes));
  fault("truncate_reply");
  EXPECT_EQ(12U, ask(read_block)->bytes.size());
}

TEST_F(RtuNetworkTest, EchoesAndPutsForeignFramesBeforeTheReply) {
  const auto plain = ask(read_block)->bytes;
  fault("echo");
  auto expected = read_block;
  expected.insert(expected.end(), plain.begin(), plain.end());
  const auto echoed = ask(read_block);
  EXPECT_EQ(expected, echoed->bytes);
  EXPECT_EQ(t + network.character_time(), echoed->arrivals[0]);
  fault("foreign_frame bytes=0902");
  EXPECT_EQ(9, ask(read_block)->bytes[0]);
  fault("foreign_frame");
  const auto foreign = ask(read_block);
  EXPECT_TRUE(frame_is_sound(std::span(foreign->bytes).first(7)));
  EXPECT_EQ(plain, Bytes(foreign->bytes.begin() + 7, foreign->bytes.end()));
}

TEST_F(RtuNetworkTest, RebootsBeforeOrAfterTheRequest) {
  ask(framed({1, 6, 0, 0x20, 0, 9}));
  fault("reboot_before");
  EXPECT_FALSE(ask(start_move));
  EXPECT_EQ(0, network.node(1)->starts());
  network.advance(t += 300ms);
  EXPECT_EQ(5, network.node(1)->peek(0x20)) << "RAM is lost";
  fault("reboot_after delay_ms=50");
  EXPECT_FALSE(ask(start_move));
  EXPECT_EQ(1, network.node(1)->starts());
  EXPECT_EQ(t + 50ms, network.next_event());
  network.advance(t += 200ms);
  EXPECT_FALSE(ask(read_block)) << "300 ms after the 50";
  EXPECT_TRUE(ask(read_block));
}

TEST_F(RtuNetworkTest, AHangUpIsReportedOnce) {
  fault("hang_up");
  EXPECT_FALSE(ask(start_move));
  EXPECT_EQ(0, network.node(1)->starts());
  EXPECT_TRUE(network.take_hang_up());
  EXPECT_FALSE(network.take_hang_up());
}

TEST_F(RtuNetworkTest, TheObserverSeesBothDirections) {
  std::vector<std::pair<bool, Bytes>> seen;
  network.set_observer([&](TimePoint, bool received, std::span<const std::uint8_t> frame) {
    seen.emplace_back(received, Bytes(frame.begin(), frame.end()));
  });
  const auto reply = ask(read_block);
  fault("drop_request");
  ask(read_block);
  ASSERT_EQ(3U, seen.size());
  EXPECT_EQ(std::pair(true, read_block), seen[0]);
  EXPECT_EQ(std::pair(false, reply->bytes), seen[1]);
  EXPECT_EQ(std::pair(true, read_block), seen[2]);
}

TEST(FaultText, NamesWhatIsWrong) {
  for (const auto* wrong : {"", "nonsense", "drip delay_ms=x", "drop_reply node=300", "drop_reply count",
                            "echo bytes=123", "echo bytes=GG", "drop_reply whatever=1"})
    EXPECT_FALSE(parse_fault(wrong)) << wrong;
  const auto fault =
      parse_fault("foreign_frame node=3 function=16 register=0x0027 count=-1 skip=2 delay_ms=4 bytes=0aFF");
  ASSERT_TRUE(fault);
  EXPECT_EQ(FaultKind::foreign_frame, fault->kind);
  EXPECT_EQ(3, fault->node);
  EXPECT_EQ(16, fault->function);
  EXPECT_EQ(0x27, fault->register_address);
  EXPECT_EQ(-1, fault->count);
  EXPECT_EQ(2, fault->skip);
  EXPECT_EQ(4ms, fault->delay);
  EXPECT_EQ((Bytes{0x0A, 0xFF}), fault->bytes);
  EXPECT_EQ("foreign_frame", to_string(fault->kind));
}

TEST(MakeNode, RefusesWhatItDoesNotKnow) {
  SimulatedNodeSettings settings;
  EXPECT_TRUE(make_node("ykd2405pr", settings));
  EXPECT_THAT(make_node("nothing", settings).error().remedy, ::testing::HasSubstr("ykd2405pr"));
  settings.switches["nonsense"] = true;
  EXPECT_THAT(make_node("ykd2405pr", settings).error().message, ::testing::HasSubstr("nonsense"));
  settings.switches.clear();
  settings.wires["X9"] = {};
  EXPECT_THAT(make_node("ykd2405pr", settings).error().message, ::testing::HasSubstr("X9"));
  settings.wires.clear();
  settings.address = 128;
  EXPECT_EQ(Reason::out_of_range, make_node("ykd2405pr", settings).error().reason);
  settings.address = 33;
  EXPECT_TRUE(make_node("ykd2405pr", settings));
  EXPECT_THAT(make_node("ess42-r", settings).error().remedy, ::testing::HasSubstr("1 to 32"));
  settings.address = 1;
  settings.dip_address = 16;
  EXPECT_TRUE(make_node("ykd2405pr", settings));
  EXPECT_THAT(make_node("ess42-r", settings).error().remedy, ::testing::HasSubstr("0 to 15"));
  settings.dip_address.reset();
  settings.dip_baud = 38400;
  EXPECT_TRUE(make_node("ykd2405pr", settings));
  EXPECT_THAT(make_node("ess42-r", settings).error().remedy, ::testing::HasSubstr("custom"));
  settings.dip_baud = 0;
  EXPECT_TRUE(make_node("ess42-r", settings));
  settings.eeprom[0x0139] = 20;
  EXPECT_TRUE(make_node("ess42-r", settings));
  EXPECT_THAT(make_node("ykd2405pr", settings).error().message, ::testing::HasSubstr("0x0139"));
}

}  // namespace
}  // namespace axisd::simulation
