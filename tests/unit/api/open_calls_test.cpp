// What ends with the certificate of its client, in virtual time.
#include "api/server/open_calls.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <vector>

namespace axisd::testing {
namespace {

using server::OpenCalls;

struct FakeCall final : server::OpenCall {
  void close(const grpc::Status& status) override { ends.push_back(status.error_code()); }
  std::vector<grpc::StatusCode> ends;
};

class JudgedCalls : public ::testing::Test {
 protected:
  OpenCalls::Judge judge() {
    return [this] {
      ++asked_;
      return refusal_;
    };
  }

  OpenCalls calls_;
  std::optional<Error> refusal_;
  int asked_ = 0;
  TimePoint now_ = TimePoint{} + std::chrono::hours(1);
};

TEST_F(JudgedCalls, EndWithinASecondWhenTheyMayNotGoOn) {
  const auto judged = std::make_shared<FakeCall>(), free = std::make_shared<FakeCall>();
  ASSERT_TRUE(calls_.add(judged, "", judge()));
  ASSERT_TRUE(calls_.add(free, ""));
  const auto next = calls_.tick(now_);
  EXPECT_EQ(next, now_ + OpenCalls::judged_every);
  EXPECT_EQ(asked_, 1);
  refusal_ = Error{.reason = Reason::unauthenticated, .message = "has expired", .remedy = "renew it"};
  EXPECT_EQ(calls_.tick(next - Duration(1)), next) << "it is not time yet";
  EXPECT_EQ(asked_, 1);
  EXPECT_TRUE(judged->ends.empty());
  EXPECT_EQ(calls_.tick(next), next + OpenCalls::judged_every);
  EXPECT_EQ(judged->ends, std::vector{grpc::StatusCode::UNAUTHENTICATED});
  EXPECT_TRUE(free->ends.empty());
}

TEST(OpenCalls, AreInProgressUntilTheyAreAnswered) {
  OpenCalls calls;
  const auto first = std::make_shared<FakeCall>(), second = std::make_shared<FakeCall>(),
             other = std::make_shared<FakeCall>();
  ASSERT_TRUE(calls.add(first, "ipv4:a:1"));
  ASSERT_TRUE(calls.add(second, "ipv4:a:1"));
  ASSERT_TRUE(calls.add(other, "ipv4:a:2"));
  EXPECT_EQ(calls.in_progress("ipv4:a:1"), 2);
  EXPECT_EQ(calls.in_progress("ipv4:a:2"), 1);
  EXPECT_EQ(calls.in_progress("ipv4:a:3"), 0);
  calls.answered(first.get());
  calls.answered(first.get());
  EXPECT_EQ(calls.in_progress("ipv4:a:1"), 1) << "it is its client's to take the answer";
  calls.remove(first.get());
  EXPECT_EQ(calls.in_progress("ipv4:a:1"), 1);
  calls.remove(second.get());
  EXPECT_EQ(calls.in_progress("ipv4:a:1"), 0);
  calls.close_all({}, {});
  const auto late = std::make_shared<FakeCall>();
  EXPECT_FALSE(calls.add(late, "ipv4:a:1"));
  EXPECT_EQ(calls.in_progress("ipv4:a:1"), 0);
}

TEST_F(JudgedCalls, ThatHaveEndedAreNotAskedOf) {
  auto removed = std::make_shared<FakeCall>(), gone = std::make_shared<FakeCall>();
  ASSERT_TRUE(calls_.add(removed, "", judge()));
  ASSERT_TRUE(calls_.add(gone, "", judge()));
  calls_.remove(removed.get());
  gone.reset();
  (void)calls_.tick(now_);
  EXPECT_EQ(asked_, 0);
}

}  // namespace
}  // namespace axisd::testing
