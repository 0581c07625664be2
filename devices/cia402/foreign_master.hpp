// Another master on the network that tells a node what to do.
#pragma once

#include <string>

#include "buses/clock.hpp"

namespace axisd::cia402 {

/// Pure. Thread: core. Whoever floods the network with commands is told of once: what comes in a row, each
/// within `lasts` of the one before, is one concern.
class ForeignMaster {
 public:
  /// After the last command it is no longer a concern of today's.
  static constexpr Duration lasts = std::chrono::seconds(10);

  /// `what`: it did. True: it is the first of them.
  bool note(const std::string& what, TimePoint at) {
    const bool first = !concerns(at);
    at_ = at;
    if (first) text_ = "another master " + what;
    return first;
  }
  [[nodiscard]] bool concerns(TimePoint now) const { return !text_.empty() && now - at_ <= lasts; }
  /// Of the first of them.
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
  TimePoint at_{};
};

}  // namespace axisd::cia402
