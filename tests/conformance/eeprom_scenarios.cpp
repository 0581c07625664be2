// The drive's EEPROM: what is saved, how often, and what the API says of it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

/// What `persist:` can be; a drive that saves on command only has no use for it.
std::vector<std::string> persist_keys(const Setup& setup) {
  if (setup.manual.has("saves_on_command_only")) return {"false"};
  return {"false", "true", "[terminals]"};
}

Recipe persisting(const std::string& persist) { return {.keys = fmt::format("    persist: {}\n", persist)}; }

/// Two restarts in a row, and a power cycle, write nothing: what is there already is not written again.
std::string restarts(const Setup& setup) {
  for (const auto& persist : persist_keys(setup)) {
    SCOPED_TRACE("persist: " + persist);
    Bench bench(setup, persisting(persist));
    bench.pass(2s);
    const auto after_start = bench.eeprom_writes();
    if (persist == "false")
      EXPECT_LE(after_start, 1U) << "only the switch of the EEPROM itself may be saved, if the drive does so";
    if (persist != "false") EXPECT_GT(after_start, 0U) << "nothing was saved";
    // Whether writing the switch of the EEPROM is itself saved is not said: the count takes it so.
    const auto counted = bench.state().eeprom_writes();
    EXPECT_TRUE(counted >= after_start && counted <= after_start + 2) << counted << " for " << after_start;
    for (int i = 0; i < 2; ++i) {
      bench.target->restart();
      bench.await_online();
      bench.pass(2s);
      EXPECT_EQ(bench.eeprom_writes(), after_start) << "restart " << i + 1;
    }
    EXPECT_EQ(bench.state().eeprom_writes(), counted) << "the count was forgotten, or goes on";
    bench.cycle_power();
    bench.pass(3s);
    bench.await_online();
    EXPECT_LE(bench.eeprom_writes() - after_start, persist == "false" ? 1U : 0U) << "power cycle";
    bench.finish(0);
  }
  return "0 writes";
}

std::string thousand_moves(const Setup& setup) {
  const auto all = persist_keys(setup);
  // The wear does not depend on the direction of the axis.
  const int cycles = setup.variant.invert ? 25 : 500 / (setup.brief ? static_cast<int>(all.size()) : 1);
  for (const auto& persist : all) {
    SCOPED_TRACE("persist: " + persist);
    Bench bench(setup, persisting(persist));
    bench.ready();
    const auto before = bench.eeprom_writes();
    for (int i = 0; i < 2 * cycles; ++i) {
      const auto moved = bench.client.move_to(i % 2 == 0 ? 0.5 : 0);
      if (!moved.ok() || moved->state() != v1::COMMAND_STATE_DONE)
        throw Broken("move: " + describe(moved.response));
    }
    EXPECT_EQ(bench.eeprom_writes(), before);
    EXPECT_NEAR(bench.shaft().mm, 0, 0.03);
    bench.finish(2 * cycles);
  }
  return "0 writes";
}

constexpr Scenario scenarios[] = {
    {"restarts_in_a_row", "EEPROM: two restarts in a row", &restarts},
    {"thousand_moves", "EEPROM: 1,000 moves", &thousand_moves},
};

}  // namespace

std::span<const Scenario> eeprom_scenarios() { return scenarios; }

}  // namespace axisd::conformance
