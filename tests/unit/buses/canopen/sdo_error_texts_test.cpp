// What an operator reads of a transfer that failed: its place and the drive's own code, each once.
#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "network.hpp"

namespace axisd::canopen {
namespace {

using namespace test;

constexpr Object control{0x6040, 0};

int count_of(std::string_view text, std::string_view part) {
  int count = 0;
  for (auto at = text.find(part); at != std::string_view::npos; at = text.find(part, at + part.size()))
    ++count;
  return count;
}

void expect_place_once(const std::string& text) {
  for (const auto* part : {"can0", "node 7", "6040h:00"}) EXPECT_EQ(count_of(text, part), 1) << text;
}

TEST(SdoErrorTexts, RefusalsHaveTheirCodeOnce) {
  for (const std::uint32_t code : {0x06020000U, 0x06090030U, 0x06070010U, 0x06040047U, 0x12345678U}) {
    Network net;
    net.servers[7].objects[control] = {0, 2};
    net.servers[7].refusals[control] = code;
    net.download("write", 7, control, {0x0F, 0});
    net.world.run_for(10ms);
    const auto& error = net.results.at("write").error();
    const auto text = to_string(error);
    expect_place_once(text);
    char digits[9];
    std::snprintf(digits, sizeof digits, "%08X", static_cast<unsigned>(code));
    EXPECT_EQ(count_of(text, digits), 1) << text;
    EXPECT_EQ(error.where.native_code, code);
    EXPECT_FALSE(error.remedy.empty()) << text;
  }
}

TEST(SdoErrorTexts, WhatGotNoAnswerSaysSo) {
  Network net;
  net.download("write", 7, control, {0x0F, 0});
  net.world.run_for(1s);
  const auto text = to_string(net.results.at("write").error());
  expect_place_once(text);
  EXPECT_EQ(text,
            "can0 node 7 object 6040h:00: no reply; check power, wiring, node-ID and bit rate of the node");
}

TEST(SdoErrorTexts, WhatWaitedForAnotherObjectNamesBoth) {
  Network net;
  net.download("first", 7, control, {0x0F, 0});
  net.download("second", 7, control, {0x1F, 0});
  net.world.run_for(1s);
  const auto text = to_string(net.results.at("second").error());
  expect_place_once(text);
  EXPECT_EQ(count_of(text, "not sent: the read of object 1000h:00 before it: no reply"), 1) << text;
}

TEST(SdoErrorTexts, AStopAndAnEmptyWriteNameTheirPlaceOnce) {
  Network net;
  net.download("empty", 7, control, {});
  net.download("cut", 7, control, {0x0F, 0});
  net.world.run_for(1ms);
  net.upload("stop", 7, {0x6041, 0}, {.transaction_class = TransactionClass::stop});
  net.world.run_for(1s);
  expect_place_once(to_string(net.results.at("empty").error()));
  expect_place_once(to_string(net.results.at("cut").error()));
  EXPECT_EQ(net.results.at("cut").error().message, "a stop took its place");
}

}  // namespace
}  // namespace axisd::canopen
