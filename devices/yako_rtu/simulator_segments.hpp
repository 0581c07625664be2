// Segments that terminals select: their positions in PT mode (manual 7.3), their speeds in PV mode (7.4).
#pragma once

#include <cstdint>

#include "buses/clock.hpp"
#include "devices/simulation/motion.hpp"
#include "devices/yako_rtu/simulator_memory.hpp"
#include "devices/yako_rtu/simulator_terminals.hpp"

namespace axisd::yako_rtu {

class Segments {
 public:
  /// Both must outlive it.
  Segments(const Memory& memory, const Terminals& terminals) : memory_(&memory), terminals_(&terminals) {}

  /// 7.3.2: the PINs must be valid 5 ms before and after the PT edge.
  void pin_changed(TimePoint now);
  void select(TimePoint now);
  /// When the selected segment starts; TimePoint::max() if none does.
  [[nodiscard]] TimePoint due() const { return due_; }
  /// The selected segment's move, with the motor as it is now. Nothing waits any more.
  [[nodiscard]] simulation::Plan begin_selected(const simulation::Motor& motor);

  void enable_pv(bool on) { pv_on_ = on; }
  /// r/min that the terminals ask for, signed; 0: the motor is to stand.
  [[nodiscard]] int wanted_rpm() const;
  /// Endless, at the wanted speed.
  [[nodiscard]] simulation::Plan pv_plan() const;
  /// r/min that the motor runs at, signed.
  [[nodiscard]] int running_rpm() const { return running_rpm_; }
  void run_at(int rpm) { running_rpm_ = rpm; }
  /// To the speed of `plan` within the time of its segment.
  [[nodiscard]] simulation::Rates changed(const simulation::Plan& plan, double speed) const;

  /// Nothing starts any more.
  void stop();

 private:
  [[nodiscard]] std::uint16_t value(std::uint16_t first, int segment) const;
  [[nodiscard]] int pv_segment() const { return pv_on_ ? terminals_->segment() : 0; }

  const Memory* memory_;
  const Terminals* terminals_;
  TimePoint pins_changed_{};
  TimePoint due_ = TimePoint::max();  ///< 5 ms after its edge
  int selected_ = 0;
  bool pv_on_ = false;
  int running_rpm_ = 0;
};

}  // namespace axisd::yako_rtu
