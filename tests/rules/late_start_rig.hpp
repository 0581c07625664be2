// Drives that begin some time after they have acknowledged a start, and what their motors do then.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <string_view>

#include "tests/support/rig.hpp"

namespace axisd::test {

/// An open loop.
inline RigOptions late() { return {.switches = {{"starts_late", true}}}; }

/// A closed loop, with 1000 pulses per mm, and a shaft that follows its motor so late.
inline RigOptions measured_late(std::string_view model, Duration following) {
  RigOptions options{.model = std::string(model), .switches = {{"starts_late", true}}};
  options.adjust = [](AxisSettings& axis) {
    axis.scale.pulses_per_revolution = 10'000;
    axis.homing->method = HomingMethod::negative_limit;
    axis.homing->position = -60;
    axis.homing->max_travel = 600;
    axis.model_settings["released_position"] = std::string("counted");
  };
  options.adjust_drive = [following](simulation::SimulatedNodeSettings& node) {
    for (auto* position : {&node.mechanics.home_switch_from, &node.mechanics.home_switch_to,
                           &node.mechanics.positive_limit_from, &node.mechanics.negative_limit_from})
      if (*position) **position *= 10;
    node.encoder = {.noise = 1, .following = following, .quantised = true, .compliance = 10};
  };
  return options;
}

inline void on_each_measured_late(const std::function<void(const RigOptions&)>& test) {
  for (const auto* model : {"ess42-r", "ssd2608pr"})
    for (const auto following : {milliseconds(8), milliseconds(20), milliseconds(40)}) {
      SCOPED_TRACE(testing::Message() << model << ", following " << following.count() << " ms");
      test(measured_late(model, following));
    }
}

/// The motor gets pulses within `duration`.
inline bool is_driven(Rig& rig, Duration duration) {
  for (const auto end = rig.world.now() + duration; rig.world.now() < end; rig.run(milliseconds(1))) {
    rig.drive->advance(rig.world.now());
    if (rig.drive->shaft_moving()) return true;
  }
  return false;
}

}  // namespace axisd::test
