// What the objects of the simulated standard drive say of its motions, in counts of the motor.
#pragma once

#include <cstdint>
#include <optional>

#include "devices/cia402_eds/simulator_units.hpp"
#include "devices/simulation/canopen_dictionary.hpp"
#include "devices/simulation/profile.hpp"

namespace axisd::cia402_eds {

class MotionObjects {
 public:
  /// `dictionary` must outlive it.
  explicit MotionObjects(const simulation::CanopenDictionary& dictionary) : dictionary_(&dictionary) {}

  void set_units(const ShaftUnits& units) { units_ = units; }
  [[nodiscard]] const ShaftUnits& units() const { return units_; }

  [[nodiscard]] bool has(std::uint16_t index, std::uint8_t sub = 0) const {
    return dictionary_->find(index, sub) != nullptr;
  }
  [[nodiscard]] std::int64_t get(std::uint16_t index, std::uint8_t sub = 0) const {
    return dictionary_->get(index, sub);
  }
  /// Of an object that the drive may lack.
  [[nodiscard]] std::int64_t value(std::uint16_t index, std::int64_t without) const;
  /// Counts beyond which the encoder's deviation is a following error (6065h), or not in position (6067h);
  /// nothing: this is not watched.
  [[nodiscard]] std::optional<std::int64_t> window(std::uint16_t index) const;
  /// Counts of the motor per second.
  [[nodiscard]] double speed(std::int64_t velocity) const;
  /// 6081h, within 607Fh where that is anything.
  [[nodiscard]] double profile_speed() const;
  /// Counts of the motor per second squared; 0 in the object is at once. What a drive lacks has 6083h
  /// instead, and 6085h first 6084h.
  [[nodiscard]] double ramp(std::uint16_t index) const;
  [[nodiscard]] simulation::Rates rates(double cruise) const;

 private:
  const simulation::CanopenDictionary* dictionary_;
  ShaftUnits units_{};
};

}  // namespace axisd::cia402_eds
