// The power supply of a simulated drive, and the boot that follows it.
#pragma once

#include <optional>

#include "buses/clock.hpp"

namespace axisd::simulation {

class Supply {
 public:
  /// On, and silent until `boot_end`: at power-up, or by a reset.
  void boot(TimePoint boot_end) {
    on_ = true;
    boot_end_ = boot_end;
  }
  /// It has booted long ago.
  void skip_boot() { boot_end_.reset(); }
  void switch_off() {
    on_ = false;
    boot_end_.reset();
  }

  [[nodiscard]] bool on() const { return on_; }
  /// On, and the boot is over.
  [[nodiscard]] bool ready() const { return on_ && !boot_end_; }
  /// Of the boot under way, if there is one.
  [[nodiscard]] std::optional<TimePoint> boot_end() const { return boot_end_; }
  /// The boot has just ended. True once.
  bool booted(TimePoint now) {
    if (!boot_end_ || now < *boot_end_) return false;
    boot_end_.reset();
    return true;
  }

 private:
  bool on_ = false;
  std::optional<TimePoint> boot_end_;
};

}  // namespace axisd::simulation
