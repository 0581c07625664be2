// The motor of a simulated drive with what is on its shaft: an encoder and a load.
#pragma once

#include <cstdint>

#include "buses/clock.hpp"
#include "devices/simulation/encoder.hpp"
#include "devices/simulation/motor.hpp"

namespace axisd::simulation {

/// How the drive has the shaft at the moment.
struct Hold {
  bool in_control = false;  ///< an energised closed loop: the shaft follows the pulses
  bool energised = false;   ///< the load does not turn it
  bool seen = false;        ///< the counters see it where the load turns it
};

class Shaft {
 public:
  Shaft(const EncoderSettings& encoder, std::uint64_t seed) : encoder_(encoder, seed) {}

  [[nodiscard]] Motor& motor() { return motor_; }
  [[nodiscard]] const Motor& motor() const { return motor_; }
  [[nodiscard]] Encoder& encoder() { return encoder_; }
  [[nodiscard]] const Encoder& encoder() const { return encoder_; }

  /// What the load and the encoder do until `now`. `following`: time constant of the loop.
  void follow(TimePoint now, const Hold& hold, Duration following);
  /// The load turns it. False: it does not give way.
  bool push(std::int64_t pulses, const Hold& hold);
  /// A hand presses on it. False: it does not give way so far.
  bool lean(int counts, const Hold& hold) { return hold.in_control && encoder_.lean(counts); }

  [[nodiscard]] bool turns() const { return motor_.moving() && !motor_.blocked(); }
  /// The counter as the encoder has it, in pulses.
  [[nodiscard]] std::int32_t measured(TimePoint now) const { return encoder_.position(motor_, now); }
  /// The encoder is so near to where the pulses should have brought it.
  [[nodiscard]] bool within(std::int64_t pulses, TimePoint now) const;

  /// The counter is to be cleared then.
  void clear_at(TimePoint due) { clear_due_ = due; }
  void forget_clearing() { clear_due_ = TimePoint::max(); }
  /// TimePoint::max(): nothing waits.
  [[nodiscard]] TimePoint clear_due() const { return clear_due_; }

 private:
  Motor motor_;
  Encoder encoder_;
  TimePoint clear_due_ = TimePoint::max();
};

}  // namespace axisd::simulation
