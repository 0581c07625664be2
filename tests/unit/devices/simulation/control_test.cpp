// Control commands on a network in virtual time, without a terminal.
#include "devices/simulation/control.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "devices/simulation/crc.hpp"
#include "devices/simulation/simulator.hpp"

namespace axisd::simulation {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Bytes = std::vector<std::uint8_t>;

class ControlTest : public ::testing::Test {
 protected:
  void put(std::string_view model, std::uint8_t address) {
    SimulatedNodeSettings settings;
    settings.address = address;
    network.add(*make_node(model, settings));
  }
  std::string command(std::string_view text) { return execute_control(network, text); }
  std::optional<ReplyPlan> ask(Bytes request) {
    append_frame_crc(request);
    t += 100ms;
    return network.on_request(request, t);
  }
  void wait(Duration duration) { network.advance(t += duration); }

  TimePoint t{1s};
  RtuNetwork network;
};

TEST_F(ControlTest, RaisesEveryAlarmOfTheModelWithItsResetRule) {
  for (const std::string_view model : {"ykd2405pr", "ssd2608pr", "ess42-r"}) {
    SCOPED_TRACE(model);
    network = RtuNetwork();
    network.advance(t);
    put(model, 1);
    for (const int code : {1, 2, 3, 4, 5}) {
      SCOPED_TRACE(code);
      const auto raised = command(fmt::format("alarm 1 {}", code));
      if (code == 4 && model == "ess42-r") {
        EXPECT_THAT(raised, HasSubstr("1, 2, 3, 5")) << "chapter 8 has no 4";
        continue;
      }
      EXPECT_EQ("ok", raised);
      const auto shown = fmt::format("ok {}", code);
      EXPECT_EQ(shown, command("peek 1 6"));
      ask({1, 6, 0, 0x2A, 0, 1});
      EXPECT_EQ(code == 4 ? "ok 0" : shown, command("peek 1 6")) << "after 0x002A";
      EXPECT_EQ("ok", command("alarm 1 0"));
      EXPECT_EQ(code == 1 || code == 5 ? shown : "ok 0", command("peek 1 6")) << "without its cause";
      command("power 1 off");
      command("power 1 on");
      wait(1s);
      EXPECT_EQ("ok 0", command("peek 1 6"));
    }
  }
}

TEST_F(ControlTest, ABlockedShaftStopsAClosedLoopAndLosesStepsOfAnOpenOne) {
  network.advance(t);
  put("ykd2405pr", 1);
  put("ssd2608pr", 2);
  put("ess42-r", 3);
  for (const auto* node : {"1", "2", "3"}) EXPECT_EQ("ok", command(fmt::format("block {} on", node)));
  for (const std::uint8_t node : {1, 2, 3}) ask({node, 6, 0, 0x27, 0, 1});  // 5000 pulses at 60 r/min
  wait(10s);
  EXPECT_EQ("ok 0", command("peek 1 6"));
  EXPECT_EQ("ok 5000", command("peek 1 0x0B"));
  EXPECT_EQ("ok position=0 moving=0 starts=1", command("shaft 1"));
  EXPECT_EQ("ok 5", command("peek 2 6"));
  EXPECT_EQ("ok 5", command("peek 3 6"));
  EXPECT_EQ("ok", command("block 1 off"));
}

TEST_F(ControlTest, PushesAShaftThatIsNotHeld) {
  network.advance(t);
  put("ssd2608pr", 1);
  EXPECT_THAT(command("push 1 50"), HasSubstr("release"));
  ask({1, 6, 0, 0x29, 0, 0});
  EXPECT_EQ("ok", command("push 1 -50"));
  EXPECT_EQ("ok position=-50 moving=0 starts=0", command("shaft 1"));
  EXPECT_EQ("ok 65486", command("peek 1 0x0B"));
}

TEST_F(ControlTest, SetsThePaceOfAMotor) {
  network.advance(t);
  put("ykd2405pr", 1);
  put("ykd2405pr", 2);
  EXPECT_EQ("ok", command("pace 2 10"));
  for (const std::uint8_t node : {1, 2}) ask({node, 6, 0, 0x27, 0, 1});  // 5000 pulses at 60 r/min
  wait(400ms);
  const auto position = [this](const char* node) {
    return std::stoi(command(fmt::format("peek {} 0x0B", node)).substr(3));
  };
  EXPECT_LT(3 * position("2"), position("1"));
  wait(60s);
  EXPECT_EQ(position("2"), 5000) << "distances are as told";
}

TEST_F(ControlTest, NamesDrivesByAddressOrPlace) {
  network.advance(t);
  put("ykd2405pr", 7);
  put("ssd2608pr", 7);
  EXPECT_EQ("ok 769", command("peek 7 0"));
  EXPECT_EQ("ok 769", command("peek @1 0"));
  EXPECT_EQ("ok 773", command("peek @2 0"));
  for (const auto* nobody : {"peek @3 0", "peek @0 0", "peek @x 0", "peek 8 0", "peek x 0"})
    EXPECT_THAT(command(nobody), StartsWith("error no node")) << nobody;
}

TEST_F(ControlTest, TwoDrivesOnOneAddressDamageEachReplyEvenIfTheySayTheSame) {
  network.advance(t);
  put("ykd2405pr", 7);
  put("ykd2405pr", 7);
  for (const auto& request :
       {Bytes{7, 3, 0, 0x20, 0, 4}, Bytes{7, 6, 0, 0x20, 0, 9}, Bytes{7, 3, 0, 0x27, 0, 1}}) {
    const auto reply = ask(request);
    ASSERT_TRUE(reply);
    EXPECT_FALSE(frame_is_sound(reply->bytes));
  }
  EXPECT_EQ("ok 9", command("peek @2 0x20")) << "both did as they were told";
  EXPECT_EQ("ok", command("power @2 off"));
  EXPECT_TRUE(frame_is_sound(ask({7, 3, 0, 0x20, 0, 4})->bytes));
}

TEST_F(ControlTest, CutsTheCableAndPlansFaults) {
  network.advance(t);
  put("ykd2405pr", 1);
  EXPECT_EQ("ok", command("cut"));
  EXPECT_FALSE(ask({1, 3, 0, 0, 0, 1}));
  EXPECT_EQ("ok", command("join"));
  EXPECT_EQ("ok", command("fault drop_reply count=1"));
  EXPECT_FALSE(ask({1, 3, 0, 0, 0, 1}));
  EXPECT_TRUE(ask({1, 3, 0, 0, 0, 1}));
  EXPECT_EQ("ok", command("fault drop_reply count=-1"));
  EXPECT_EQ("ok", command("fault clear"));
  EXPECT_TRUE(ask({1, 3, 0, 0, 0, 1}));
}

TEST_F(ControlTest, RefusesWhatItDoesNotUnderstand) {
  network.advance(t);
  put("ykd2405pr", 1);
  for (const auto* wrong : {"", "hangup", "replug", "block 1", "block 1 maybe", "push 1", "push 1 x",
                            "pace 1 0", "pace 1", "alarm 1 6", "alarm 1", "cut 1", "fault", "nonsense 1"})
    EXPECT_THAT(command(wrong), StartsWith("error ")) << wrong;
}

}  // namespace
}  // namespace axisd::simulation
