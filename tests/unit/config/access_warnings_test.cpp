#include "config/access_warnings.hpp"

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

Configuration loaded(std::string_view access) {
  const auto result = load_text(fmt::format(R"(machine: m
buses: {{ a: {{ modbus_rtu: {{ port: sim }} }} }}
axes:
  x: {{ bus: a, node: 1, model: ykd2405pr, unit: rev, scale: {{ microstep: 4000 pulses/rev }},
       limits: {{ velocity: 1 rev/s }} }}
{})",
                                            access),
                                "m.yaml");
  EXPECT_TRUE(result.configuration) << findings(result);
  return result.configuration.value_or(Configuration());
}

TEST(AccessWarnings, NobodyHasARole) {
  for (const auto* access :
       {"access: {}", "access: { roles: {} }", "access: { axes: { x: { roles: {} } } }"}) {
    EXPECT_THAT(access_warnings(loaded(access)), ElementsAre(HasSubstr("nobody has a role: "))) << access;
    EXPECT_THAT(warnings(loaded(access)), Contains(HasSubstr("nobody has a role: "))) << access;
  }
}

TEST(AccessWarnings, NobodyCanMove) {
  EXPECT_THAT(access_warnings(loaded("access: { roles: { anna: viewer }, delegates: { web: viewer } }")),
              ElementsAre(HasSubstr("above viewer")));
}

TEST(AccessWarnings, SomebodyCanMove) {
  for (const auto* access :
       {"", "access: { roles: { anna: operator } }", "access: { delegates: { web: operator } }",
        "access: { axes: { x: { roles: { anna: maintainer } } } }"})
    EXPECT_THAT(access_warnings(loaded(access)), IsEmpty()) << access;
}

}  // namespace
}  // namespace axisd::config
