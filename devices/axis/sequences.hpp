// The coroutines of an axis.
#pragma once

#include "buses/task.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/axis_life.hpp"

namespace axisd {

/// Runs them and counts them, so that what they use outlives them. Knows whether the axis serves or ends.
/// Thread: core.
class Sequences {
 public:
  explicit Sequences(const AxisContext& context) : context_(context) {}
  Sequences(const Sequences&) = delete;

  /// Runs a sequence and counts it while it lives.
  void launch(Task<> sequence, const char* name);
  /// None runs any more.
  [[nodiscard]] bool none() const { return running_ == 0; }
  [[nodiscard]] AxisLife& life() { return life_; }
  [[nodiscard]] const AxisLife& life() const { return life_; }

 private:
  const AxisContext& context_;

  AxisLife life_;
  int running_ = 0;
};

}  // namespace axisd
