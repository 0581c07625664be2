// Whatever the file holds: an answer, never a crash, an exception or an unprintable message.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

void expect_answer(const std::string& text) {
  const auto result = load_text(text, "mutant.yaml");
  ASSERT_EQ(result.configuration.has_value(), result.diagnostics.empty()) << text;
  const auto lines = std::ranges::count(text, '\n') + 2;
  for (const auto& diagnostic : result.diagnostics) {
    ASSERT_GE(diagnostic.line, 1) << text;
    ASSERT_LE(diagnostic.line, lines) << text;
    ASSERT_GE(diagnostic.column, 1) << text;
    const auto line = to_string(diagnostic);
    ASSERT_TRUE(std::ranges::none_of(line, [](char c) { return static_cast<unsigned char>(c) < 0x20; }))
        << line;
  }
}

class Robustness : public ::testing::TestWithParam<const char*> {};

TEST_P(Robustness, SurvivesTruncation) {
  const auto text = read_text(source_path(GetParam()));
  for (std::size_t length = 0; length < text.size(); length += 11) expect_answer(text.substr(0, length));
}

TEST_P(Robustness, SurvivesMutations) {
  const auto original = read_text(source_path(GetParam()));
  std::mt19937 random(8);
  const auto below = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  const std::string likely = "{}[]:,-&*!|>'\"%@`#?\n \t~<=0123456789.eE/\xC3\xFF";
  for (int i = 0; i < 1000; ++i) {
    auto text = original;
    for (auto changes = 1 + below(4); changes > 0; --changes) {
      const auto at = below(text.size());
      switch (below(4)) {
        case 0:
          text[at] = likely[below(likely.size())];
          break;
        case 1:
          text.insert(at, 1, likely[below(likely.size())]);
          break;
        case 2:
          text.erase(at, 1 + below(20));
          break;
        default:
          text.insert(at, original.substr(below(original.size()), below(60)));
          break;
      }
    }
    expect_answer(text);
  }
}

INSTANTIATE_TEST_SUITE_P(Examples, Robustness,
                         ::testing::Values("config/examples/demo.yaml", "config/examples/reference.yaml"));

TEST(Robustness, SurvivesDeepNesting) {
  for (const auto* part : {"[", "{", "{a: ", "- ", "? ", "a:\n ", "&a ", "!!x "}) {
    std::string text;
    for (int i = 0; i < 20'000; ++i) text += part;
    expect_answer(text);
  }
}

TEST(Robustness, ManyWrongKeysTakeNoTime) {
  std::string text = "machine: press\n";
  for (int i = 0; i < 20'000; ++i) text += "key" + std::to_string(i) + ": 1\n";
  expect_answer(text);
}

TEST(Robustness, LongValuesAreRefused) {
  const std::string value(500'000, 'a');
  for (const auto* key : {"machine: ", "server: { listen: ", "state_directory: /", "axes: { ",
                          "buses: { a: { modbus_rtu: { port: /"}) {
    expect_answer(key + value);
    expect_answer(key + value + "}}}");
  }
}

}  // namespace
}  // namespace axisd::config
