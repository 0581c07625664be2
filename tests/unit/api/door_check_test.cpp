// The daemon asks itself what its clients ask.
#include "api/server/door_check.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "api/server/lane/stop_lane.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

class DoorCheck : public Serving {
 protected:
  void serve_both(server::lane::Places::Limits limits = {}) {
    serve();
    lane_ = std::make_unique<server::StopLane>(
        machine_, server::StopLaneOptions{.listen = "unix:" + (directory_ / "stops.sock"), .limits = limits});
    ASSERT_TRUE(lane_->listen());
    lane_->serve();
    knocks_ = server_->knocks();
    for (auto& each : lane_->knocks()) knocks_.push_back(std::move(each));
    check_ = std::make_unique<server::DoorCheck>([this] { return server_->connect_inside(); },
                                                 [this] { return lane_->connect_inside(); }, knocks_);
  }
  /// Those that owe an answer.
  [[nodiscard]] std::vector<std::string> silent() const { return check_->silent_since(TimePoint::max()); }
  [[nodiscard]] bool all_answer() {
    check_->ask();
    return eventually([&] {
      if (silent().empty()) return true;
      check_->ask();
      return false;
    });
  }

  std::unique_ptr<server::StopLane> lane_;
  std::vector<std::shared_ptr<transport::Knock>> knocks_;
  std::unique_ptr<server::DoorCheck> check_;
};

TEST_F(DoorCheck, AsksTheMachineForNothing) {
  serve_both();
  EXPECT_THAT(silent(), IsEmpty()) << "nobody has asked yet";
  EXPECT_TRUE(all_answer());
  EXPECT_TRUE(all_answer());
  EXPECT_THAT(machine_.submitted(), IsEmpty());
  EXPECT_THAT(machine_.log(), IsEmpty());
  EXPECT_THAT(machine_.groups().log(),
              AllOf(Not(IsEmpty()), Each(HasSubstr("stop   kind 2 hold false by local:daemon"))))
      << "as far as the core";
}

TEST_F(DoorCheck, TellsThatTheCoreDoesNotAnswer) {
  serve_both();
  machine_.hold();
  const auto begun = monotonic_now();
  check_->ask();
  EXPECT_TRUE(eventually([&] { return silent() == std::vector<std::string>{"stop lane"}; }));
  check_->ask();  // one question is on its way at a time
  EXPECT_TRUE(eventually([&] { return silent() == std::vector<std::string>{"stop lane"}; }));
  EXPECT_THAT(check_->silent_since(begun), IsEmpty()) << "it was asked later";
  machine_.let_go();
  EXPECT_TRUE(eventually([&] { return silent().empty(); }));
  EXPECT_TRUE(all_answer());
}

TEST_F(DoorCheck, TellsThatTheMainServerHasGone) {
  serve_both();
  EXPECT_TRUE(all_answer());
  server_->shutdown();
  for (int i = 0; i < 3; ++i) {
    check_->ask();
    EXPECT_TRUE(eventually([&] {
      const auto all = silent();
      return std::ranges::find(all, "main server") != all.end();
    }));
  }
}

TEST_F(DoorCheck, TriesEachAddress) {
  serve_both();
  EXPECT_THAT(knocks_, SizeIs(2));
  EXPECT_TRUE(all_answer());
  for (const auto& each : knocks_) EXPECT_TRUE(eventually([&] { return each->got_in(); })) << each->name();
  server_->shutdown();
  lane_->stop();
  check_->ask();
  EXPECT_THAT(silent(), AllOf(Contains("new connections to " + target_),
                              Contains("new connections to unix:" + (directory_ / "stops.sock"))));
}

/// So that one that stands still is told from one that has nothing to do.
TEST_F(DoorCheck, TheAcceptLoopComesRoundWithoutConnections) {
  serve();
  const auto begun = server_->last_progress();
  EXPECT_TRUE(eventually([&] { return server_->last_progress() > begun; }));
}

TEST_F(DoorCheck, ConnectsAnewToALaneThatHasClosedItsConnection) {
  // Its own place is the only one, and the next client gets it.
  serve_both({.connections = 1});
  EXPECT_TRUE(all_answer());
  const auto other = connect("unix:" + (directory_ / "stops.sock"));
  ASSERT_TRUE(other->WaitForConnected(std::chrono::system_clock::now() + patience));
  EXPECT_TRUE(all_answer());
}

}  // namespace
}  // namespace axisd::testing
