#include "api/web/gateway/sessions.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

namespace axisd::web {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

class SessionsTest : public testing::Test {
 protected:
  std::string begin(const std::string& name) {
    return sessions.begin({.name = name, .role = "operator"}, "10.0.0.1", "proof", now);
  }
  std::vector<std::string> ended;
  TimePoint now{Duration(1h)};
  Sessions sessions{{.idle = 10min, .longest = 1h, .most = 4, .most_each = 2},
                    [this](const Session& session) { ended.push_back(session.person.name); }};
};

TEST_F(SessionsTest, AreFoundByTheirCookie) {
  const auto anna = begin("anna"), bert = begin("bert");
  EXPECT_NE(anna, bert);
  EXPECT_EQ(anna.size(), 64U) << "256 bits";
  EXPECT_EQ(sessions.use(anna, now)->person.name, "anna");
  EXPECT_EQ(sessions.look(bert, now)->person.name, "bert");
  for (const auto& token : {std::string(), std::string(64, '0'), anna.substr(1), anna + "0"})
    EXPECT_EQ(sessions.use(token, now), nullptr);
}

TEST_F(SessionsTest, EndWhenTheyAreIdle) {
  const auto token = begin("anna");
  now += 9min;
  EXPECT_NE(sessions.use(token, now), nullptr);
  now += 9min;
  EXPECT_NE(sessions.look(token, now), nullptr);
  now += 1min;
  EXPECT_EQ(sessions.use(token, now), nullptr) << "to look is no use of it";
  EXPECT_THAT(ended, ElementsAre("anna"));
}

TEST_F(SessionsTest, EndHoweverMuchTheyAreUsed) {
  const auto token = begin("anna");
  for (int i = 0; i < 11; ++i) {
    now += 5min;
    ASSERT_NE(sessions.use(token, now), nullptr);
  }
  now += 5min;
  EXPECT_EQ(sessions.use(token, now), nullptr);
}

TEST_F(SessionsTest, EndInTimeWithoutBeingAskedFor) {
  (void)begin("anna");
  sessions.expire(now + 10min - 1ns);
  EXPECT_THAT(ended, IsEmpty());
  sessions.expire(now + 10min);
  EXPECT_THAT(ended, ElementsAre("anna"));
}

TEST_F(SessionsTest, ArePutOffByWhatIsOpenOnThem) {
  const auto token = begin("anna");
  sessions.touch(sessions.list().front().id, now + 9min);
  EXPECT_NE(sessions.look(token, now + 15min), nullptr);
  sessions.touch(sessions.list().front().id, now + 20min);
  EXPECT_EQ(sessions.look(token, now + 20min), nullptr) << "what is over stays so";
}

TEST_F(SessionsTest, AreListedAndRevoked) {
  const auto anna = begin("anna");
  (void)begin("bert");
  const auto all = sessions.list();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all.front().peer, "10.0.0.1");
  EXPECT_TRUE(sessions.end(all.front().id));
  EXPECT_FALSE(sessions.end(all.front().id));
  EXPECT_EQ(sessions.use(anna, now), nullptr);
  sessions.end_if([](const Session& session) { return session.person.name == "bert"; });
  EXPECT_THAT(ended, ElementsAre("anna", "bert"));
  EXPECT_THAT(sessions.list(), IsEmpty());
}

TEST_F(SessionsTest, TheIdlestMakesRoom) {
  const auto first = begin("anna");
  now += 1min;
  const auto second = begin("anna");
  now += 1min;
  EXPECT_NE(sessions.use(first, now), nullptr);
  (void)begin("anna");
  EXPECT_EQ(sessions.use(second, now), nullptr) << "of the same person first";
  EXPECT_NE(sessions.use(first, now), nullptr);
  (void)begin("bert");
  now += 1min;
  EXPECT_NE(sessions.use(first, now), nullptr);
  (void)begin("carl");
  (void)begin("dora");
  EXPECT_EQ(sessions.list().size(), 4U);
  EXPECT_NE(sessions.use(first, now), nullptr);
}

}  // namespace
}  // namespace axisd::web
