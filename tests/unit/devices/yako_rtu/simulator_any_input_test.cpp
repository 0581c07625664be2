// Whatever is sent or poked, with whatever readings of the manual: a simulated drive answers each sound frame
// to it with a sound frame, and its time goes on.
#include <random>

#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

class AnyInput : public ::testing::TestWithParam<std::string_view> {};

simulation::SimulatedNodeSettings any_settings(const simulation::Simulator& simulator, std::mt19937& random) {
  simulation::SimulatedNodeSettings settings;
  for (const auto& one : simulator.switches) settings.switches[std::string(one.name)] = random() % 2 == 0;
  settings.switches["crc_error_answered"] = false;
  settings.mechanics = {.home_switch_from = 500,
                        .home_switch_to = 700,
                        .positive_limit_from = 4000,
                        .negative_limit_from = -4000};
  return settings;
}

TEST_P(AnyInput, IsAnsweredSoundly) {
  const auto& simulator = *simulation::find_simulator(GetParam());
  std::mt19937 random(24);  // NOLINT(cert-msc51-cpp): the same on every run
  for (int round = 0; round < 60; ++round) {
    Bench bench(any_settings(simulator, random), GetParam());
    for (int step = 0; step < 150; ++step) {
      const auto address = static_cast<std::uint16_t>(random() % (simulator.last_register + 3U));
      const auto value = static_cast<std::uint16_t>(random() % 3 == 0 ? random() : random() % 22);
      switch (random() % 8) {
        case 0:
          bench.drive().poke(address, value);
          break;
        case 1:
          bench.drive().set_input(simulator.inputs[random() % simulator.inputs.size()].name,
                                  random() % 2 == 0);
          break;
        case 2:
          bench.drive().block_shaft(random() % 4 == 0);
          bench.drive().push_shaft(static_cast<std::int16_t>(value));
          break;
        case 3:
          EXPECT_NE(-1, bench.read(address, 1 + static_cast<int>(random() % 17)));
          break;
        default:
          EXPECT_NE(
              -1, bench.write(random() % 2 == 0 ? address : static_cast<std::uint16_t>(0x20 + random() % 17),
                              value));
          break;
      }
      bench.wait(std::chrono::milliseconds(random() % 700));
    }
    EXPECT_NE(-1, bench.read(0));
  }
}

INSTANTIATE_TEST_SUITE_P(Models, AnyInput, ::testing::Values("ykd2405pr", "ssd2608pr", "ess42-r"));

}  // namespace
}  // namespace axisd::yako_rtu
