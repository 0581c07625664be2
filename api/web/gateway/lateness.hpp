// How much longer a page's messages take than its fastest one did. Pure.
#pragma once

#include <cstdint>
#include <optional>

#include "buses/clock.hpp"

namespace axisd::web {

/// The clocks of page and gateway have nothing in common but their pace, which differs by up to `drift`: what
/// a message took is told by the difference of both, and the least of these differences is that of the
/// fastest.
class Lateness {
 public:
  /// Parts per million. Quartzes differ by up to 100; so slowly a link that became slower for good is
  /// forgiven.
  static constexpr std::int64_t drift = 200;

  /// Of a message that the page sent at `sent_ms` of its own clock. Of the first one: 0.
  Duration of(std::uint32_t sent_ms, TimePoint now);

 private:
  std::optional<Duration> fastest_;
  std::optional<std::int64_t> last_sent_ms_;  ///< of the page's clock, which comes round after 49 days
  TimePoint last_{};
};

}  // namespace axisd::web
