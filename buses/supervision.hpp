// Whether the watchdog may be told that the daemon lives.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "buses/clock.hpp"

namespace axisd {

/// Decides from what its threads have stamped. Nothing that it decides on can hold it up: it reads times, and
/// waits for nobody. A thread that has not come round for three quarters of the watchdog's interval is taken
/// for dead, and is looked for four times in each interval: so it is told within one interval of its last
/// stamp, as soon as systemd misses a process that stands still as a whole. Clients that get no answer are
/// another matter: with who floods the main address it is busy for a while, and stops have one of their own.
/// Pure. Thread: one.
class Supervision {
 public:
  struct Part {
    std::string name;
    TimePoint last;  ///< progress; may lie ahead, where it is known to be busy until then
  };
  enum class Sign : std::uint8_t {
    alive,
    silent,  ///< clients get no answer: nothing is told, so that the watchdog's interval runs out
    dead,    ///< at once
    unsure,  ///< this was held up itself, and so may they have been: look again soon
  };
  struct Finding {
    Sign sign = Sign::alive;
    std::vector<std::string> dead{};  ///< parts
    Duration next;                    ///< until the next look
  };

  /// Zero: nobody watches; then what is found is only told in the log.
  explicit Supervision(Duration interval);

  /// Until the first look.
  [[nodiscard]] Duration period() const { return period_; }
  /// A door that owes an answer since before that gives none.
  [[nodiscard]] TimePoint doors_owe_since(TimePoint now) const;
  [[nodiscard]] Finding look(TimePoint now, const std::vector<Part>& parts, bool doors_answer);

 private:
  const Duration period_;
  const Duration stalled_after_;
  TimePoint last_look_;  ///< far back: there was none
};

}  // namespace axisd
