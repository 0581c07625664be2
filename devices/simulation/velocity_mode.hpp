// Profile velocity mode of a simulated drive (CiA 402): the target velocity that it follows.
#pragma once

#include <cstdint>

namespace axisd::simulation {

class VelocityMode {
 public:
  /// Something else than 60FFh stopped it: it needs a new one.
  [[nodiscard]] bool held() const { return held_; }
  void hold(bool held = true) { held_ = held; }
  void release() { held_ = false; }

  /// What it runs at, in the object's unit, signed.
  [[nodiscard]] std::int64_t velocity() const { return velocity_; }
  /// True: it has to stop before it can run so.
  bool change_to(std::int64_t wanted) {
    const bool turns = wanted == 0 || (wanted < 0) != (velocity_ < 0);
    velocity_ = wanted;
    return turns;
  }

 private:
  bool held_ = false;
  std::int64_t velocity_ = 0;
};

}  // namespace axisd::simulation
