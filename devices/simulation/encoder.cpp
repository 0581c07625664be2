#include "devices/simulation/encoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "devices/simulation/motor.hpp"
#include "devices/simulation/text.hpp"

namespace axisd::simulation {

namespace {

/// How long a reading at rest stays as it is: about as long as a fast poll, so that most readings differ.
constexpr Duration noise_period = std::chrono::milliseconds(3);

std::uint64_t scramble(std::uint64_t value) {  // splitmix64
  value += 0x9E3779B97F4A7C15U;
  value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9U;
  value = (value ^ (value >> 27U)) * 0x94D049BB133111EBU;
  return value ^ (value >> 31U);
}

bool take(int& into, std::string_view value, int most) {
  const auto number = parse_number<int>(value);
  if (!number || *number < 0 || *number > most) return false;
  into = *number;
  return true;
}

}  // namespace

bool set_encoder_option(EncoderSettings& settings, std::string_view name, std::string_view value) {
  if (name == "noise") return take(settings.noise, value, 1000);
  if (name == "backlash") return take(settings.backlash, value, 100'000);
  if (name == "compliance") return take(settings.compliance, value, 100'000);
  if (name == "following_ms") {
    int milliseconds = 0;
    if (!take(milliseconds, value, 1000)) return false;
    settings.following = std::chrono::milliseconds(milliseconds);
    return true;
  }
  if (name == "quantised") {
    const auto on = parse_on_off(value);
    if (on) settings.quantised = *on;
    return on.has_value();
  }
  if (name != "slip") return false;
  const auto rate = parse_number<std::int32_t>(value);
  if (rate) settings.slip = *rate;
  return rate.has_value();
}

std::int64_t Encoder::noise(TimePoint now) const {
  if (settings_.noise <= 0) return 0;
  const auto width = static_cast<std::uint64_t>(settings_.noise) * 2 + 1;
  return static_cast<std::int64_t>(random(0, now) % width) - settings_.noise;
}

std::uint64_t Encoder::random(std::uint64_t stream, TimePoint now) const {
  const auto period = static_cast<std::uint64_t>(now.time_since_epoch() / noise_period);
  return scramble((seed_ + (stream << 32U)) ^ scramble(period));
}

int Encoder::velocity_noise(TimePoint now) const {
  constexpr std::uint64_t stream = 1, width = 3;
  return settings_.noise > 0 ? static_cast<int>(random(stream, now) % width) - 1 : 0;
}

bool Encoder::wavers(const Motor& motor) const {
  constexpr double visible = 0.25;  // pulses
  return settings_.noise > 0 || settings_.slip != 0 || std::abs(motor.behind()) > visible;
}

std::int64_t Encoder::deviation(const Motor& motor, TimePoint now) const {
  const auto short_by = motor.direction() < 0 ? -settings_.backlash : 0;
  const auto bent = static_cast<double>(leaning_ - short_by) * pulses_per_count_;
  auto shaft = static_cast<double>(motor.shaft()) - motor.behind() + bent;
  if (settings_.quantised) shaft = std::round(shaft / pulses_per_count_) * pulses_per_count_;
  // Counts finer than pulses: what is shown wavers by whole pulses all the same.
  shaft += static_cast<double>(noise(now)) * std::max(1.0, pulses_per_count_);
  return motor.commanded() - std::llround(shaft);
}

std::int32_t Encoder::position(const Motor& motor, TimePoint now) const {
  return static_cast<std::int32_t>(motor.counter() - deviation(motor, now));
}

bool Encoder::lean(int counts) {
  if (std::abs(counts) > settings_.compliance) return false;
  leaning_ = counts;
  return true;
}

std::int64_t Encoder::slipped(TimePoint now, bool released) {
  const auto since = std::exchange(slipped_until_, now).value_or(now);
  const auto passed = std::chrono::duration<double>(now - since).count();
  if (!released || settings_.slip == 0) {
    slip_rest_ = 0;
    return 0;
  }
  const auto total = slip_rest_ + settings_.slip * passed;
  const auto pulses = std::trunc(total);
  slip_rest_ = total - pulses;
  return static_cast<std::int64_t>(pulses);
}

}  // namespace axisd::simulation
