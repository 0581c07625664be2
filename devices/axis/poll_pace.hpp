// How often the state of an axis is read.
#pragma once

#include <algorithm>
#include <cstdint>

#include "buses/clock.hpp"
#include "devices/axis/settings.hpp"

namespace axisd {

/// So long before a motion is expected to end its state is not read, at most, where readings wait for each
/// other: that one would keep others waiting for their ends.
inline constexpr Duration quiet_before_end = std::chrono::milliseconds(50);

/// When the state is to be read next. Pure. Thread: core.
///
///   usual -- keep_quiet() ----------> quiet, until that time
///   usual, quiet -- expect() -------> fast, from and until those times
///   fast -- came() -----------------> usual
///
/// Quiet goes before fast: what was just started has nothing to tell yet. Where the end of a motion is
/// expected the first reading is awaited, there is none for up to quiet_before_end before it, and it is put
/// off a little for next time where it was too early: that costs another one.
class PollPace {
 public:
  enum class State : std::uint8_t {
    usual,  ///< poll_moving, or poll_idle at rest
    fast,   ///< as fast as the bus can: something is about to be seen
    quiet,  ///< not at all
  };

  PollPace(Duration moving, Duration idle) : moving_(moving), idle_(idle) {}

  /// Something is about to be seen, from then on and for `longest` at most.
  void expect(TimePoint from, Duration longest) {
    fast_from_ = from;
    fast_until_ = from + longest;
    awaited_from_ = TimePoint::max();
  }
  /// As expect(), of the end of a motion, which may come a little later than `from`.
  void expect_end(TimePoint from, Duration longest) {
    expect(from + delay_, longest);
    awaited_from_ = fast_from_;
  }
  /// It was seen, or will not come.
  void came() { expect({}, {}); }
  /// There is a reading that was asked for then.
  void seen(TimePoint asked_at, bool moving) {
    if (asked_at < awaited_from_) return;
    awaited_from_ = TimePoint::max();
    delay_ = moving ? std::min(delay_ + later, longest_delay) : std::max(delay_ - sooner, Duration{});
  }
  /// The drive did not answer one: others go before it now.
  void not_answered() { awaited_from_ = TimePoint::max(); }
  /// From then on the next reading is likely to be the one; TimePoint::max(): no more than others.
  [[nodiscard]] TimePoint awaited_from() const { return awaited_from_; }
  void keep_quiet(TimePoint until) { quiet_until_ = until; }

  [[nodiscard]] State state(TimePoint now) const {
    if (now < quiet_until_) return State::quiet;
    return is_fast(now) ? State::fast : State::usual;
  }
  [[nodiscard]] bool is_fast(TimePoint now) const { return now >= fast_from_ && now < fast_until_; }
  [[nodiscard]] TimePoint quiet_until() const { return quiet_until_; }
  /// When the reading after that one is asked for. `works`: the axis has something to do.
  [[nodiscard]] TimePoint next(TimePoint began, bool works) const {
    if (!works) return began + idle_;
    if (is_fast(began)) return began + fastest_poll;
    if (began >= fast_from_) return began + moving_;
    // In equal steps: a reading just before would keep the line from the one that is awaited.
    const auto left = fast_from_ - began;
    if (awaited_from_ != TimePoint::max() && left <= quiet_before_end) return fast_from_;
    return began + left / ((left + moving_ - Duration(1)) / moving_);
  }

 private:
  /// By how much an end is looked for later next time, and sooner: one reading in twenty is too early.
  static constexpr Duration later = std::chrono::milliseconds(1), sooner = later / 19,
                            longest_delay = std::chrono::milliseconds(20);

  Duration moving_, idle_;
  Duration delay_{};  ///< by which ends came later than expected
  TimePoint fast_from_{}, fast_until_{}, quiet_until_{};
  TimePoint awaited_from_ = TimePoint::max();
};

}  // namespace axisd
