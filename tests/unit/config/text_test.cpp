#include "config/text.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace axisd::config {
namespace {

TEST(Text, PrintableIsValidUtf8WithoutControlCharacters) {
  EXPECT_EQ(printable("plain"), "plain");
  EXPECT_EQ(printable("\x1B[31mred\n\x7F"), "?[31mred??");
  EXPECT_EQ(printable("\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80"), "\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80");
  EXPECT_EQ(printable("\xC2\x9Bm"), "?m") << "C1: control sequence introducer";
  EXPECT_EQ(printable("\xFF\xC0\x80\xE0\x80\x80"), "??????") << "overlong";
  EXPECT_EQ(printable("\xED\xA0\x80"), "???") << "surrogate";
  EXPECT_EQ(printable("\xE2\x82"), "??") << "cut off";
  EXPECT_EQ(printable(std::string(1000, 'a')), std::string(60, 'a') + "...");
}

TEST(Text, NearestFindsTypingErrors) {
  constexpr std::array<std::string_view, 4> keys{"velocity", "node", "on_lease_loss", "bus"};
  EXPECT_EQ(nearest("velocty", keys), "velocity");
  EXPECT_EQ(nearest("Velocity", keys), "velocity");
  EXPECT_EQ(nearest("on-lease-loss", keys), "on_lease_loss");
  EXPECT_EQ(nearest("nod", keys), "node");
  EXPECT_EQ(nearest("colour", keys), "");
  EXPECT_EQ(nearest("", keys), "");
  EXPECT_EQ(nearest(std::string(100'000, 'x'), keys), "");
  EXPECT_EQ(suggest("velocty", keys), "did you mean 'velocity'?");
  EXPECT_EQ(suggest("zzz", keys), "permitted: velocity, node, on_lease_loss or bus");
  EXPECT_EQ(suggest("zzz", {}), "");
}

}  // namespace
}  // namespace axisd::config
