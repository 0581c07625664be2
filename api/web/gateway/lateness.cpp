#include "api/web/gateway/lateness.hpp"

#include <algorithm>

namespace axisd::web {

Duration Lateness::of(std::uint32_t sent_ms, TimePoint now) {
  // By the nearest way round: its clock may also be behind the last one's by some messages.
  const auto step = last_sent_ms_
                        ? static_cast<std::int32_t>(sent_ms - static_cast<std::uint32_t>(*last_sent_ms_))
                        : std::int32_t{0};
  const auto sent = last_sent_ms_ ? *last_sent_ms_ + step : static_cast<std::int64_t>(sent_ms);
  last_sent_ms_ = sent;
  const auto took = now.time_since_epoch() - std::chrono::milliseconds(sent);
  if (fastest_) *fastest_ += (now - last_) * drift / 1'000'000;
  last_ = now;
  fastest_ = fastest_ ? std::min<Duration>(*fastest_, took) : Duration(took);
  return took - *fastest_;
}

}  // namespace axisd::web
