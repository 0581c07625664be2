#include "config/start_warnings.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> warnings_of(std::string_view network, std::string_view axis,
                                     std::string_view more = "") {
  const auto result = load_text(fmt::format(R"(machine: m
buses: {{ can0: {{ canopen: {{ interface: sim{} }} }} }}
axes:
  feeder:
    {{ bus: can0, node: 1, model: yss-c, unit: rev, scale: {{ microstep: 4000 pulses/rev }},
      limits: {{ velocity: 1 rev/s }}{} }}
{})",
                                            network, axis, more),
                                "m.yaml");
  EXPECT_TRUE(result.configuration) << findings(result);
  return result.configuration ? start_warnings(*result.configuration) : std::vector<std::string>();
}

TEST(StartWarnings, FastNodesStartInTime) {
  EXPECT_THAT(warnings_of("", ""), IsEmpty());
  EXPECT_THAT(warnings_of(", sdo_answer: 60 ms", ""), IsEmpty());
  EXPECT_THAT(warnings_of("", ", inputs: { X3: motor_free }"), IsEmpty());
}

TEST(StartWarnings, AnAnswerLaterThanTheGuardPermitsNone) {
  EXPECT_THAT(
      warnings_of(", sdo_answer: 50 ms", ", reboot_guard: 50 ms"),
      ElementsAre(HasSubstr("axis feeder: a start is proven by 1 SDO answer within reboot_guard (50 ms)")));
  EXPECT_THAT(
      warnings_of(", sdo_answer: 20 ms", ", inputs: { X3: motor_free }"),
      ElementsAre(HasSubstr("proven by 14 SDO answers within reboot_guard (100 ms), and takes 280 ms")));
}

TEST(StartWarnings, AStartInAGroupTakesMoreAnswers) {
  // The other one's guard is long enough.
  constexpr auto group =
      "  other: { bus: can0, node: 2, model: yss-c, unit: rev, scale: { microstep: 4000 pulses/rev }, "
      "limits: { velocity: 1 rev/s }, reboot_guard: 400 ms }\n"
      "groups: { both: { axes: [feeder, other] } }\n";
  EXPECT_THAT(warnings_of("", "", group), IsEmpty());
  EXPECT_THAT(
      warnings_of(", sdo_answer: 20 ms", "", group),
      ElementsAre(HasSubstr("a start in a group is proven by up to 14 SDO answers within reboot_guard")));
  EXPECT_THAT(warnings_of(", sdo_answer: 20 ms", ", reboot_guard: 300 ms", group), IsEmpty());
}

TEST(StartWarnings, AWholeStartFitsIntoItsBound) {
  EXPECT_THAT(warnings_of(", sdo_answer: 90 ms", ""),
              ElementsAre(HasSubstr("a start takes up to 23 SDO answers, 2070 ms (sdo_answer)")));
  EXPECT_THAT(warnings_of(", sdo_answer: 90 ms", ", start_within: 5 s"), IsEmpty());
}

}  // namespace
}  // namespace axisd::config
