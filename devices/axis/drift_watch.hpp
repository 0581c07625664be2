// When the drive's configuration is to be compared again, and what was found.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "buses/clock.hpp"
#include "devices/axis/settings.hpp"

namespace axisd {

/// Pure. Thread: core.
///
///   as_configured -- found(), something --> drifted
///   drifted -- found(), nothing ----------> as_configured
///
/// Beside that a comparison may be under way, from begin() to its end(): the newest alone counts, and none
/// that was given up.
class DriftWatch {
 public:
  enum class State : std::uint8_t { as_configured, drifted };

  /// `period`: from one comparison to the next.
  explicit DriftWatch(Duration period) : period_(period) {}

  /// A comparison begins; its number. What is still being compared counts no more.
  std::uint64_t begin(TimePoint at) {
    before_ = std::exchange(checked_, at);
    under_way_ = ++last_;
    return last_;
  }
  /// That comparison has ended. False: it did not count any more.
  bool end(std::uint64_t number) {
    if (under_way_ != number) return false;
    under_way_ = none;
    return true;
  }
  /// What is being compared counts no more: it is compared again as if it had not begun.
  void give_up() {
    if (std::exchange(under_way_, none) != none) checked_ = before_;
  }
  /// The configuration was applied.
  void applied(TimePoint at) {
    checked_ = at;
    under_way_ = none;
  }
  /// What the drive no longer holds as configured; empty: nothing. True: that is news.
  bool found(const std::string& text) {
    if (text == text_) return false;
    text_ = text;
    return true;
  }
  /// It is time for a comparison. `just_proven`: that the drive was not restarted; what a comparison reads
  /// would keep the next proof waiting, so it waits for one, but not for ever.
  [[nodiscard]] bool is_next(TimePoint now, bool just_proven) const {
    const auto due = checked_ + period_;
    return under_way_ == none && now >= due && (just_proven || now >= due + 2 * continuity_period);
  }

  [[nodiscard]] State state() const { return text_.empty() ? State::as_configured : State::drifted; }
  [[nodiscard]] bool drifted() const { return !text_.empty(); }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  static constexpr std::uint64_t none = 0;

  Duration period_;
  TimePoint checked_{};
  TimePoint before_{};                            ///< checked_ without the newest comparison
  std::uint64_t last_ = none, under_way_ = none;  ///< numbers of comparisons
  std::string text_;
};

}  // namespace axisd
