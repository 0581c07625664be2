#include "devices/audit_ration.hpp"

#include <gtest/gtest.h>

#include <string>

namespace axisd {
namespace {

using namespace std::chrono_literals;

class Ration : public testing::Test {
 protected:
  /// How many of so many are told.
  int told(const std::string& client, int count) {
    int result = 0;
    for (int i = 0; i < count; ++i) result += ration_.take(client, now_) ? 1 : 0;
    return result;
  }
  static constexpr int most = static_cast<int>(AuditRation::refusals);
  AuditRation ration_{AuditRation::refusals};
  TimePoint now_{1h};
};

TEST_F(Ration, EachHasSoManyAMinuteAndTheRestIsCounted) {
  EXPECT_EQ(told("loud", most + 40), most);
  EXPECT_EQ(told("calm", 1), 1);
  now_ += 59s;
  EXPECT_EQ(told("loud", 1), 0);
  now_ += 1s;
  EXPECT_EQ(ration_.take("loud", now_), 41U);
  EXPECT_EQ(ration_.take("loud", now_), 0U);
}

TEST_F(Ration, WhomADelegateSpeaksForShareItsOne) {
  int count = 0;
  for (int i = 0; i < 2 * most; ++i) count += told("p" + std::to_string(i) + " via web", 1);
  EXPECT_EQ(count, most);
}

TEST_F(Ration, ManyNamesTakeABoundedShare) {
  constexpr int names = 3 * static_cast<int>(AuditRation::identities);
  int count = 0;
  for (int i = 0; i < names; ++i) count += told("c" + std::to_string(i), 1);
  EXPECT_EQ(count, static_cast<int>(AuditRation::identities) + most) << "those beyond share one";
  now_ += 1min;
  EXPECT_EQ(told("new", 1), 1);
}

}  // namespace
}  // namespace axisd
