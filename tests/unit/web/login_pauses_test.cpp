#include "api/web/gateway/login_pauses.hpp"

#include <gtest/gtest.h>

namespace axisd::web {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint start{Duration(1h)};

TEST(LoginPauses, GrowWithEachFailureOfANameFromAnAddress) {
  LoginPauses pauses;
  EXPECT_EQ(pauses.left("a", "anna", start), 0s);
  pauses.failed("a", "anna", start);
  pauses.failed("a", "anna", start);
  EXPECT_EQ(pauses.left("a", "anna", start), 0s);
  pauses.failed("a", "anna", start);
  EXPECT_EQ(pauses.left("a", "anna", start), 1s);
  EXPECT_EQ(pauses.left("a", "anna", start + 400ms), 600ms);
  pauses.failed("a", "anna", start);
  EXPECT_EQ(pauses.left("a", "anna", start), 2s);
  for (int i = 0; i < 100; ++i) pauses.failed("a", "anna", start);
  EXPECT_EQ(pauses.left("a", "anna", start), LoginPauses::longest_of_name);
}

TEST(LoginPauses, OfAnAddressAreShort) {
  LoginPauses pauses;
  for (int i = 0; i < 100; ++i) pauses.failed("a", "n" + std::to_string(i), start);
  EXPECT_EQ(pauses.left("a", "anna", start), LoginPauses::longest_of_address);
}

TEST(LoginPauses, LockNobodyOutWhoComesFromElsewhere) {
  LoginPauses pauses;
  for (int i = 0; i < 100; ++i) pauses.failed("a", "anna", start);
  for (int i = 0; i < 100; ++i) pauses.failed("a" + std::to_string(i), "anna", start);
  EXPECT_EQ(pauses.left("b", "anna", start), 0s);
}

TEST(LoginPauses, AreNotShortenedByALogInOfOnesOwn) {
  LoginPauses pauses;
  for (int i = 0; i < 6; ++i) pauses.failed("a", "anna", start);
  pauses.succeeded("a", "mallory");
  EXPECT_EQ(pauses.left("a", "anna", start), 8s);
}

TEST(LoginPauses, AreForgotten) {
  LoginPauses pauses;
  for (int i = 0; i < 9; ++i) pauses.failed("a", "anna", start);
  pauses.succeeded("a", "anna");
  EXPECT_EQ(pauses.left("a", "anna", start), 0s);
  for (int i = 0; i < 9; ++i) pauses.failed("a", "anna", start);
  pauses.failed("c", "carl", start + LoginPauses::remembered);
  for (int i = 0; i < 2; ++i) pauses.failed("a", "anna", start + LoginPauses::remembered);
  EXPECT_EQ(pauses.left("a", "anna", start + LoginPauses::remembered), 0s) << "counted anew";
}

TEST(LoginPauses, RememberABoundedNumber) {
  LoginPauses pauses;
  for (int i = 0; i < 4; ++i) pauses.failed("a", "anna", start);
  for (std::size_t i = 0; i < LoginPauses::most; ++i)
    pauses.failed("x" + std::to_string(i), "x", start + 1ms);
  EXPECT_EQ(pauses.left("a", "bert", start + 1ms), 0s) << "the oldest made room";
}

}  // namespace
}  // namespace axisd::web
