#include "api/grpc_text/grpc_text.hpp"

#include <gmock/gmock.h>

#include <chrono>

namespace axisd::grpc_text {
namespace {

using namespace std::chrono_literals;
using testing::Eq;
using testing::Optional;

TEST(GrpcText, ReadsTimeouts) {
  EXPECT_THAT(timeout_of("150m"), Optional(Eq(Duration(150ms))));
  EXPECT_THAT(timeout_of("2S"), Optional(Eq(Duration(2s))));
  EXPECT_THAT(timeout_of("1M"), Optional(Eq(Duration(1min))));
  EXPECT_THAT(timeout_of("3u"), Optional(Eq(Duration(3us))));
  EXPECT_THAT(timeout_of("4n"), Optional(Eq(Duration(4ns))));
  EXPECT_THAT(timeout_of("00000000S"), Optional(Eq(Duration::zero())));
  for (const auto* text :
       {"", "m", "1", "-1m", "-0m", "+1m", "1.5S", "123456789m", "1x", " 1m", "1 m", "1mm"})
    EXPECT_FALSE(timeout_of(text).has_value()) << text;
}

TEST(GrpcText, TheLongestTimeoutsAreStillTimesToCome) {
  for (const auto* text : {"99999999H", "99999999M", "99999999S"}) {
    const auto timeout = timeout_of(text);
    ASSERT_TRUE(timeout) << text;
    EXPECT_GT(*timeout, 1h) << text;
    EXPECT_GT(monotonic_now() + *timeout, monotonic_now()) << text;
  }
}

TEST(GrpcText, EncodesWhatALineCannotHold) {
  EXPECT_EQ(percent_encoded("\xC3\xA4 a"), "%C3%A4 a");
  EXPECT_EQ(percent_encoded("100 %\r\n"), "100 %25%0D%0A");
}

}  // namespace
}  // namespace axisd::grpc_text
