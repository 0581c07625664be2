// What an encoder shows of a simulated motor: a measurement, unlike a count of pulses.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "buses/clock.hpp"

namespace axisd::simulation {

class Motor;

/// How far a measured position is from where the pulses sent should have brought the shaft. All of it 0 is an
/// encoder that does not exist: it always shows the commanded position.
struct EncoderSettings {
  /// Counts that a reading is off at most (pulses, where those are coarser), at rest as well; another value
  /// every few milliseconds.
  int noise = 0;
  /// The shaft follows with this time constant: behind by speed x this in motion, and settling after it.
  Duration following{};
  /// Whole counts of its resolution are shown, not pulses.
  bool quantised = false;
  /// Counts by which the shaft stays short after a motion backwards (play that the loop does not take up).
  int backlash = 0;
  /// Counts by which an energised shaft gives way to a hand; more is held.
  int compliance = 0;
  /// Pulses per second by which the load turns a released shaft, signed. Needs no encoder.
  double slip = 0;
};

/// Takes over one of them by name: noise=N, following_ms=N, quantised=on|off, backlash=N, compliance=N,
/// slip=N. False: no such name, or a value out of range; nothing is changed then.
bool set_encoder_option(EncoderSettings& settings, std::string_view name, std::string_view value);

/// Pure: equal for equal seeds, times and motions. Costs next to nothing. Thread: as of its simulator.
class Encoder {
 public:
  Encoder(const EncoderSettings& settings, std::uint64_t seed) : settings_(settings), seed_(seed) {}

  void set(const EncoderSettings& settings) { settings_ = settings; }
  [[nodiscard]] const EncoderSettings& settings() const { return settings_; }
  /// Pulses of the motor per count, > 0; 1 at first.
  void set_resolution(double pulses_per_count) { pulses_per_count_ = pulses_per_count; }

  /// The counter as the encoder has it, in pulses, from the drive's origin.
  [[nodiscard]] std::int32_t position(const Motor& motor, TimePoint now) const;
  /// Pulses that the reading is behind the commanded position now, signed.
  [[nodiscard]] std::int64_t deviation(const Motor& motor, TimePoint now) const;
  /// r/min by which a measured velocity is off, at rest as well: at most 1, and 0 without noise.
  [[nodiscard]] int velocity_noise(TimePoint now) const;
  /// What it shows changes with time, though no pulses come.
  [[nodiscard]] bool wavers(const Motor& motor) const;

  /// A hand presses on the energised shaft and bends it by so many counts, until lean(0). False: it is held.
  bool lean(int counts);
  /// The shaft was released or turned otherwise: nothing is bent.
  void relax() { leaning_ = 0; }
  /// Pulses by which the load has turned the shaft since the last call, for Motor::push(). `released`: all
  /// that time.
  std::int64_t slipped(TimePoint now, bool released);

 private:
  [[nodiscard]] std::int64_t noise(TimePoint now) const;
  [[nodiscard]] std::uint64_t random(std::uint64_t stream, TimePoint now) const;

  EncoderSettings settings_;
  std::uint64_t seed_;
  double pulses_per_count_ = 1;
  int leaning_ = 0;
  std::optional<TimePoint> slipped_until_;  ///< nothing: never asked
  double slip_rest_ = 0;                    ///< of a pulse
};

}  // namespace axisd::simulation
