#include "config/motion_warnings.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "config/budget.hpp"
#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> warnings_in(const std::string& text) {
  const auto result = load_text(text, source_path("tests/data/eds/m.yaml").string());
  EXPECT_TRUE(result.configuration) << findings(result);
  if (!result.configuration) return {};
  const auto lines = motion_warnings(*result.configuration);
  for (const auto& line : lines) EXPECT_THAT(warnings(*result.configuration), Contains(line));
  return lines;
}

std::vector<std::string> of_feeder(std::string_view keys) {
  return warnings_in(fmt::format(R"(machine: m
buses: {{ line: {{ modbus_rtu: {{ port: sim }} }} }}
axes:
  feeder:
    {{ bus: line, node: 1, model: ykd2405pr, unit: mm, scale: {{ microstep: 1000 pulses/rev, travel: 5 mm/rev }},
      inputs: {{ X0: home }}, {} }}
)",
                                 keys));
}

constexpr std::string_view limited = "limits: { position: [0, 400], velocity: 20 mm/s }";

TEST(MotionWarnings, AJogMayNotGoFurtherThanTheRange) {
  EXPECT_THAT(of_feeder(fmt::format("{}, jog_travel: 10000 mm", limited)),
              ElementsAre(HasSubstr("axis feeder: jog_travel 10000 mm is more than the range of "
                                    "limits.position, 400 mm")));
  EXPECT_THAT(of_feeder(fmt::format("{}, jog_travel: 400 mm", limited)), IsEmpty());
}

TEST(MotionWarnings, HomingEndsBeforeTheEndOfTheRange) {
  const auto homed = [](std::string_view limits, int most) {
    return fmt::format(
        "{}, homing: {{ method: home_positive, velocity: 10 mm/s, search_velocity: 2 mm/s, max_travel: {} mm "
        "}}",
        limits, most);
  };
  EXPECT_THAT(
      of_feeder(homed(limited, 10)),
      ElementsAre(HasSubstr("axis feeder: homing ends after 10 mm (max_travel), of a range of 400 mm")));
  EXPECT_THAT(of_feeder(homed(limited, 400)), IsEmpty());
  EXPECT_THAT(of_feeder(homed("limits: { velocity: 20 mm/s }", 10)), IsEmpty());
}

std::vector<std::string> of_slide(std::string_view file, std::string_view limits) {
  return warnings_in(fmt::format(R"(machine: m
buses: {{ can0: {{ canopen: {{ interface: sim }} }} }}
axes:
  slide:
    bus: can0
    node: 1
    model: cia402
    unit: mm
    scale: {{ microstep: 4096 pulses/rev, travel: 10 mm/rev }}
    limits: {{ {} }}
    drive: {{ eds: {}, velocity_unit: pulses_per_second }}
)",
                                 limits, file));
}

TEST(MotionWarnings, ARampOfTheDrivesOwnIsLongerThanWasAskedFor) {
  // 8192 counts/s, less 2000 a second.
  EXPECT_THAT(
      of_slide("trinamic-tmcc-160.eds", "velocity: 20 mm/s"),
      ElementsAre("axis slide: object 6084h is only read: the drive brakes with 2000 of its acceleration "
                  "units, whatever it is told: from limits.velocity 20 mm/s that takes 4.1 s and 41 mm; "
                  "QuickStop is no harder"));
  EXPECT_THAT(of_slide("trinamic-tmcc-160.eds", "velocity: 0.3 mm/s"), IsEmpty()) << "68 ms";
  EXPECT_THAT(of_slide("trinamic-tmcm-1636.eds", "velocity: 20 mm/s"), IsEmpty())
      << "it brakes as it is told";
}

}  // namespace
}  // namespace axisd::config
