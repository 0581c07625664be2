// Profiles that take as long as the slowest one: whole r/min, whole milliseconds, never a shorter ramp.
#include "devices/group/arrival.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "devices/descriptor.hpp"
#include "devices/simulation/profile.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;

struct OneAxis {
  OneAxis() {
    settings.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .unit = "mm"};
    settings.limits.velocity = 100;
    scale = std::make_unique<Scale>(settings.scale);
    planner = std::make_unique<Planner>(settings, *find_drive_model("ykd2405pr"), *scale);
  }
  Arrival arrival(std::int64_t pulses, double velocity = 100) const {
    auto plan = *planner->profile(velocity, {});
    plan.predicted = planner->duration(plan, pulses);
    return {.planner = planner.get(), .plan = plan, .pulses = pulses};
  }
  AxisSettings settings;
  std::unique_ptr<Scale> scale;
  std::unique_ptr<Planner> planner;
};

Duration error_of(const std::vector<Arrival>& arrivals) {
  std::vector<Duration> durations;
  durations.reserve(arrivals.size());
  for (const auto& arrival : arrivals) durations.push_back(arrival.plan.predicted);
  return arrival_error(durations);
}

TEST(Arrival, FasterAxesAreSlowedDownToTheSlowest) {
  const OneAxis axis;
  for (const std::int64_t longest : {3000, 20'000, 39'999, 1'000'000})
    for (const double share : {0.9, 0.5, 0.31, 0.1, -0.7}) {
      SCOPED_TRACE(longest);
      SCOPED_TRACE(share);
      const auto other = static_cast<std::int64_t>(static_cast<double>(longest) * share);
      std::vector arrivals{axis.arrival(longest), axis.arrival(other)};
      const auto before = arrivals;
      arrive_together(arrivals);
      EXPECT_LE(error_of(arrivals), 5ms + before[0].plan.predicted / 500);
      EXPECT_EQ(arrivals[0].plan.velocity_rpm, before[0].plan.velocity_rpm) << "the slowest stays as it is";
      for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_LE(arrivals[i].plan.velocity_rpm, before[i].plan.velocity_rpm);
        EXPECT_GE(arrivals[i].plan.acceleration_time, before[i].plan.acceleration_time);
        EXPECT_GE(arrivals[i].plan.deceleration_time, before[i].plan.deceleration_time);
        EXPECT_LE(arrivals[i].plan.acceleration_time, 2s);
        EXPECT_EQ(arrivals[i].plan.acceleration_time % 1ms, Duration{});
        EXPECT_EQ(*arrivals[i].plan.granted.acceleration_time, arrivals[i].plan.acceleration_time);
        EXPECT_NEAR(*arrivals[i].plan.granted.velocity, arrivals[i].plan.velocity_rpm / 6.0, 1e-9);
      }
    }
}

TEST(Arrival, WhatIsTooShortForItsVelocityGetsTheOneThatItReaches) {
  const OneAxis axis;
  std::vector arrivals{axis.arrival(300)};
  arrive_together(arrivals);
  const auto& plan = arrivals[0].plan;
  EXPECT_LT(plan.velocity_rpm, 600);
  // Both ramps at the mean of both speeds fit into the way.
  const double in_ramps = (plan.start_rpm + plan.velocity_rpm) / 2.0 / 60 * 1000 * 0.2;
  EXPECT_LE(in_ramps, 300);
  EXPECT_GT(in_ramps, 295) << "and no slower than that";
}

/// No reading before can show the end: of a triangular move that is by as much as its ramps meet earlier.
TEST(Arrival, TheSoonestEndIsThatOfTheProfile) {
  const OneAxis axis;
  for (const std::int64_t pulses : {1, 20, 300, 900, 3000, 100'000}) {
    const auto [planner, plan, way] = axis.arrival(-pulses);
    const auto rates = simulation::rates_from(plan.start_rpm, plan.velocity_rpm,
                                              static_cast<double>(plan.acceleration_time / 1ms),
                                              static_cast<double>(plan.deceleration_time / 1ms), 1000);
    const auto profile = simulation::Profile::move(rates.start, rates, static_cast<double>(pulses));
    EXPECT_NEAR(std::chrono::duration<double>(planner->soonest(plan, way)).count(), profile.duration(), 1e-6)
        << pulses;
    EXPECT_LE(planner->soonest(plan, way), plan.predicted);
  }
  EXPECT_EQ(axis.planner->soonest(axis.arrival(0).plan, 0), Duration{});
}

TEST(Arrival, WhoStandsAtItsTargetSlowsNobodyDown) {
  const OneAxis axis;
  std::vector arrivals{axis.arrival(20'000), axis.arrival(0)};
  const auto before = arrivals[0].plan.predicted;
  arrive_together(arrivals);
  EXPECT_EQ(arrivals[0].plan.predicted, before);
  EXPECT_EQ(error_of(arrivals), Duration{});
}

TEST(Arrival, ATinyWayAtTheLowestSpeedIsEarly) {
  const OneAxis axis;
  std::vector arrivals{axis.arrival(1'000'000), axis.arrival(3)};
  arrive_together(arrivals);
  EXPECT_GT(error_of(arrivals), 1s) << "it is told, not hidden";
}

}  // namespace
}  // namespace axisd
