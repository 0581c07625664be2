// A homing from its trigger until the drive is back in position mode.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "buses/gate.hpp"
#include "devices/cia402/homing_watch.hpp"

namespace axisd::cia402 {

/// Pure. Thread: core.
///
///   any     -- begin() ------------------------------------------------> homing
///   homing  -- take(), it has ended -----------------------------------> leaving
///   homing  -- stop() -------------------------------------------------> leaving
///   idle    -- stop(), a homing of somebody else was under way --------> leaving
///   leaving -- go_back(); left(): position mode is reached ------------> idle
///   leaving -- give_up(): something else is begun ---------------------> idle
///   any     -- forget() -----------------------------------------------> idle
///
/// Leaving: the drive is to go back to position mode, where bit 13 is the power stage alone.
class HomingRun {
 public:
  enum class State : std::uint8_t { idle, homing, leaving };

  /// What the next one begins with.
  void prepare(HomingWatch::Start start) { next_ = start; }
  [[nodiscard]] const HomingWatch::Start& prepared() const { return next_; }
  /// `from`: where the motor stands.
  void begin(TimePoint at, std::optional<std::int32_t> from);
  /// The drive was seen to have begun it, between two readings.
  void note_begun() { watch_.note_begun(); }
  /// True: it goes on. Precondition: active().
  bool take(const DriveSample& sample, HomingWatch::Signs signs);
  /// `found`: the drive homes, and nobody here has begun it.
  void stop(bool found);
  void left() { leaving_ = false; }
  /// The way back to position mode is begun. What is sent for it has this guard, which give_up() and stop()
  /// make old.
  [[nodiscard]] MotionGuard go_back();
  /// Nothing of the way back is sent any more.
  void give_up();
  /// Of that guard.
  [[nodiscard]] const AxisGate& gate() const { return *gate_; }
  /// The drive was switched off and on.
  void forget();

  /// `told`: the drive says that it is homed. `bit_fell`: at rest, and its bit is 0. How our last homing of
  /// this power cycle ended counts more, until the drive has forgotten it.
  bool is_homed(bool told, bool bit_fell);

  [[nodiscard]] State state() const;
  [[nodiscard]] bool active() const { return state() == State::homing; }

 private:
  HomingWatch watch_;
  HomingWatch::Start next_;
  bool leaving_ = false;
  std::shared_ptr<AxisGate> gate_ = std::make_shared<AxisGate>();
  std::optional<bool> ended_home_;  ///< nothing: as the drive says
};

}  // namespace axisd::cia402
