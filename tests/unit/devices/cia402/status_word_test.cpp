#include "devices/cia402/status_word.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

namespace axisd::cia402 {
namespace {

/// 6.2.1 of the YSS-C's manual as it prints it: bits 6, 5, 3, 2, 1, 0. Where several rows fit, none does.
struct Row {
  const char* bits;
  State state;
};
constexpr Row printed[] = {
    {"0x0000", State::not_ready_to_switch_on}, {"1x0000", State::switch_on_disabled},
    {"010001", State::ready_to_switch_on},     {"010011", State::switched_on},
    {"010111", State::operation_enabled},      {"000111", State::quick_stop_active},
    {"0x1111", State::fault_reaction_active},  {"0x1000", State::fault},
};

State by_the_table(unsigned word) {
  for (const auto& row : printed) {
    bool fits = true;
    const unsigned positions[] = {6, 5, 3, 2, 1, 0};
    for (int i = 0; i < 6; ++i)
      if (row.bits[i] != 'x' && ((word >> positions[i] & 1U) != 0) != (row.bits[i] == '1')) fits = false;
    if (fits) return row.state;
  }
  return State::undefined;
}

TEST(StatusWord, AllCombinationsAsTheTablePrintsThem) {
  for (unsigned word = 0; word <= 0xFFFF; ++word) {
    const auto expected = by_the_table(word);
    const auto found = state_of(static_cast<std::uint16_t>(word));
    if (expected != State::undefined) {
      ASSERT_EQ(found, expected) << std::hex << word;
      continue;
    }
    // What the table leaves out is read without bit 6 (6.2.2 prints it as set in every state), and where bits
    // 0 to 3 alone decide, without bit 5.
    switch (word & 0x0FU) {
      case 0x01:
        ASSERT_EQ(found, State::ready_to_switch_on) << std::hex << word;
        break;
      case 0x03:
        ASSERT_EQ(found, State::switched_on) << std::hex << word;
        break;
      case 0x07:
        ASSERT_EQ(found, (word & 0x20U) != 0 ? State::operation_enabled : State::quick_stop_active)
            << std::hex << word;
        break;
      case 0x08:
        ASSERT_EQ(found, State::fault) << std::hex << word;
        break;
      case 0x0F:
        ASSERT_EQ(found, State::fault_reaction_active) << std::hex << word;
        break;
      default:
        ASSERT_EQ(found, State::undefined) << std::hex << word;
    }
  }
}

TEST(StatusWord, OtherBitsDecideNothing) {
  for (unsigned word = 0; word <= 0xFFFF; ++word)
    ASSERT_EQ(state_of(static_cast<std::uint16_t>(word)), state_of(static_cast<std::uint16_t>(word & 0x6FU)));
}

/// What CiA 402 makes of bits 0 to 3 and 7 of a control word (6.2.1, first table).
bool fits(ControlCommand command, unsigned word) {
  const auto is = [word](unsigned mask, unsigned bits) { return (word & mask) == bits; };
  switch (command) {
    case ControlCommand::shutdown:
      return is(0x87, 0x06);
    case ControlCommand::switch_on:
    case ControlCommand::disable_operation:
      return is(0x8F, 0x07);
    case ControlCommand::enable_operation:
      return is(0x8F, 0x0F);
    case ControlCommand::disable_voltage:
      return is(0x82, 0x00);
    case ControlCommand::quick_stop:
      return is(0x86, 0x02);
    case ControlCommand::fault_reset:
      return is(0x80, 0x80);
  }
  return false;
}

TEST(Transitions, AreNumberedAsInCiA402) {
  std::set<int> numbers;
  for (const auto& transition : transitions()) {
    numbers.insert(transition.number);
    EXPECT_NE(transition.from, transition.to);
    if (transition.command) EXPECT_TRUE(fits(*transition.command, control_word(*transition.command)));
  }
  EXPECT_EQ(numbers.size(), 17U);
  EXPECT_EQ(*numbers.begin(), 0);
  EXPECT_EQ(*numbers.rbegin(), 16);
  EXPECT_TRUE(std::ranges::is_sorted(transitions(), {}, &Transition::number));
  // One command never leads from one state to two.
  std::set<std::pair<State, ControlCommand>> arrows;
  for (const auto& transition : transitions())
    if (transition.command) EXPECT_TRUE(arrows.emplace(transition.from, *transition.command).second);
}

TEST(Transitions, LeadToOperationEnabledBy06And07And0F) {
  std::string words;
  auto state = State::switch_on_disabled;
  while (const auto step = next_to_enabled(state)) {
    EXPECT_EQ(step->from, state);
    words += std::to_string(control_word(*step->command)) + " ";
    state = step->to;
  }
  EXPECT_EQ(state, State::operation_enabled);
  EXPECT_EQ(words, "6 7 15 ");
  for (const auto stuck : {State::fault, State::fault_reaction_active, State::quick_stop_active,
                           State::not_ready_to_switch_on, State::operation_enabled, State::undefined})
    EXPECT_FALSE(next_to_enabled(stuck)) << to_string(stuck);
}

TEST(Transitions, LeadToAReleasedStageFromWhereverItIsOn) {
  for (auto state : {State::switched_on, State::operation_enabled, State::quick_stop_active}) {
    ASSERT_TRUE(is_energised(state));
    const auto step = next_to_released(state);
    ASSERT_TRUE(step);
    EXPECT_EQ(step->from, state);
    EXPECT_FALSE(is_energised(step->to));
    EXPECT_NE(step->command, ControlCommand::quick_stop) << "M12";
  }
}

}  // namespace
}  // namespace axisd::cia402
