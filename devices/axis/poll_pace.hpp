// How often the state of an axis is read.
#pragma once

#include <algorithm>
#include <cstdint>

#include "buses/clock.hpp"
#include "devices/axis/settings.hpp"

namespace axisd {

/// When the state is to be read next. Pure. Thread: core.
///
///   usual -- keep_quiet() ----------> quiet, until that time
///   usual, quiet -- expect() -------> fast, from and until those times
///
/// Quiet goes before fast: what was just started has nothing to tell yet.
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
  }
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
    const auto next = began + moving_;
    return began < fast_from_ ? std::min(next, fast_from_) : next;
  }

 private:
  Duration moving_, idle_;
  TimePoint fast_from_{}, fast_until_{}, quiet_until_{};
};

}  // namespace axisd
