// Is a motion as fast as it was told to be? By positions alone.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "buses/clock.hpp"

namespace axisd {

/// Finds a motion that is far faster than the drive was told, by where the shaft was and when. A velocity
/// that the drive tells is no witness: where the unit is wrong it is wrong by the same factor. Positions in
/// pulses, velocities in pulses/s. Pure. Thread: core.
///
/// It never finds one that is as fast as told. Between two positions the shaft can have gone no further than
/// the fastest velocity takes it in the longest time that their readings leave, and half of that more, an
/// eighth of a revolution (noise) and the way of 50 ms (a drive that tells old positions) are on top. What
/// else can carry it further is what it had fallen behind, at most a revolution, which is counted, and a
/// counter that was set, which is no motion: the next readings have to go on as fast in the same direction.
///
/// resting -- begin() --> following -- further than possible --> doubted -- goes on so --> too_fast;
/// doubted -- as it should be --> following; following or doubted -- arrive(), the whole way --> too_fast;
/// any -- rest() --> resting; any -- begin() --> following.
class SpeedWatch {
 public:
  enum class State : std::uint8_t { resting, following, doubted, too_fast };
  /// What became of the motion that the caller has under way.
  enum class Event : std::uint8_t {
    begun,    ///< its start was sent, after the newest reading
    sampled,  ///< there is a new reading
    arrived,  ///< the newest reading shows it at rest at its target
  };
  struct Reading {
    TimePoint asked_at{};     ///< the position is at least this fresh,
    TimePoint measured_at{};  ///< and not newer than this
    std::int32_t pulses = 0;  ///< the drive's own counter, which may wrap
    bool moving = false;
  };

  /// `revolution`: pulses, > 0.
  explicit SpeedWatch(double revolution) : revolution_(revolution) {}

  /// A motion was started, which is told to be `fastest` at most (pulses/s, >= 0). `before`: from before it.
  void begin(const Reading& before, double fastest);
  /// A reading of it. True: it has become too fast with this one.
  [[nodiscard]] bool follow(const Reading& reading);
  /// It rests at the target, which lies at that count: a motion too short for two readings is judged by its
  /// whole way. True: it was too fast.
  [[nodiscard]] bool arrive(const Reading& reading);
  /// A reading while nothing is followed.
  void rest(const Reading& reading);

  [[nodiscard]] State state() const { return state_; }
  /// Of the motion that is followed, or was last; pulses/s, as told.
  [[nodiscard]] double fastest() const { return fastest_; }
  /// That of one that was found too fast: at least so much; pulses/s.
  [[nodiscard]] double seen() const { return seen_; }

 private:
  [[nodiscard]] double possible(Duration time) const;
  [[nodiscard]] double margin() const;
  void note_motion(const Reading& reading);
  void look_for_doubt(const Reading& reading);
  [[nodiscard]] bool confirms(const Reading& reading);
  bool find(double gone, Duration time);

  static constexpr std::array<int, 2> directions{1, -1};

  double revolution_;
  State state_ = State::resting;
  double fastest_ = 0;
  Reading start_, last_;
  std::optional<TimePoint> moved_at_;  ///< the newest reading in motion, of whatever kind
  double behind_ = 0;                  ///< pulses that the shaft may have had to catch up at the start
  /// For each direction: pulses by which the shaft is further than it can be; below 0 it may be behind.
  std::array<double, 2> ahead_{};
  int doubted_direction_ = 1;
  double seen_ = 0;
};

}  // namespace axisd
