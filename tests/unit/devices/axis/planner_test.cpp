// What is granted is what is sent, also where a drive counts velocities in coarse units.
#include "devices/axis/planner.hpp"

#include <gtest/gtest.h>

#include "devices/descriptor.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;

/// 1000 pulses/rev, at most 5 rev/s (300 r/min), ramps of 500 ms.
class CoarseDrive {
 public:
  explicit CoarseDrive(VelocityCount count) {
    settings_.scale = {.pulses_per_revolution = 1000, .unit = "rev"};
    settings_.limits.velocity = 5;
    settings_.limits.acceleration_time = 500ms;
    settings_.limits.start_speed_rpm = 0;
    descriptor_.capabilities.minimum_start_rpm = 0;
    descriptor_.capabilities.maximum_start_rpm = 0;
    descriptor_.capabilities.velocity_count = count;
  }
  [[nodiscard]] Plan profile(double rpm) const { return planner_.profile(rpm / 60, {}).value(); }
  [[nodiscard]] double granted_rpm(double rpm) const { return *profile(rpm).granted.velocity * 60; }
  [[nodiscard]] const Planner& planner() const { return planner_; }

 private:
  AxisSettings settings_;
  DriveDescriptor descriptor_;
  Scale scale_{{.pulses_per_revolution = 1000, .unit = "rev"}};
  Planner planner_{settings_, descriptor_, scale_};
};

TEST(Planner, GrantsWhatIsSentInCoarseCounts) {
  const CoarseDrive tens({.rpm = 10});
  EXPECT_DOUBLE_EQ(tens.granted_rpm(100), 100);
  EXPECT_DOUBLE_EQ(tens.granted_rpm(99), 90);
  EXPECT_DOUBLE_EQ(tens.granted_rpm(59.9), 50) << "never faster";
  const CoarseDrive turns({.rpm = 60});
  EXPECT_DOUBLE_EQ(turns.granted_rpm(300), 300);
  EXPECT_DOUBLE_EQ(turns.granted_rpm(299), 240);
  const CoarseDrive fine({.rpm = 0.1});
  EXPECT_DOUBLE_EQ(fine.granted_rpm(99), 99);
  EXPECT_DOUBLE_EQ(CoarseDrive({}).granted_rpm(99), 99);
}

TEST(Planner, CountsOfPulsesAreFinerTheMoreARevolutionHas) {
  const CoarseDrive pulses({.rpm = 60'000, .of_pulse = true});  // 60 r/min with 1000
  EXPECT_DOUBLE_EQ(pulses.granted_rpm(119), 60);
  const CoarseDrive single({.rpm = 60, .of_pulse = true});
  EXPECT_DOUBLE_EQ(single.granted_rpm(119), 118.98);
}

/// At 240 in place of 299 r/min, on the ramp of 299 r/min in 500 ms.
TEST(Planner, PredictsWhatIsSent) {
  const CoarseDrive turns({.rpm = 60});
  const auto seconds = std::chrono::duration<double>(turns.planner().duration(turns.profile(299), 10'000));
  EXPECT_NEAR(seconds.count(), (10'000 / 4000.0) + (0.5 * 240 / 299), 1e-6);
  const auto exact = std::chrono::duration<double>(turns.planner().duration(turns.profile(240), 10'000));
  EXPECT_NEAR(exact.count(), (10'000 / 4000.0) + 0.5, 1e-6);
}

}  // namespace
}  // namespace axisd
