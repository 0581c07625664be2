#include "buses/can/response_time.hpp"

#include <algorithm>
#include <vector>

#include "buses/can/port.hpp"

namespace axisd::can {
namespace {

Duration bits(std::int64_t count, std::uint32_t bitrate) {
  return Duration((count * 1'000'000'000 + bitrate - 1) / bitrate);
}

/// Instances of `stream` that are queued within `time`, of which the first waits as long as it may.
std::int64_t instances(const Stream& stream, Duration time) {
  if (stream.period == Duration::max()) return 1;
  return std::max<std::int64_t>(0, (time + stream.jitter + stream.period - Duration(1)) / stream.period);
}

Duration interference(std::span<const Stream> streams, Duration time) {
  Duration sum{};
  for (const auto& stream : streams) sum += instances(stream, time) * stream.transmission;
  return sum;
}

/// The least fixed point of `next` from `time` on.
template <class Next>
std::optional<Duration> settle(Duration time, Duration limit, Next next) {
  for (;;) {
    const auto then = next(time);
    if (then > limit) return std::nullopt;
    if (then == time) return time;
    time = then;
  }
}

}  // namespace

Duration frame_time(int data_bytes, std::uint32_t bitrate) {
  return bits(worst_case_bits({.size = static_cast<std::uint8_t>(data_bytes)}), bitrate);
}

std::optional<Duration> response_time(std::span<const Stream> all, std::size_t index, std::uint32_t bitrate,
                                      Duration limit) {
  const auto& own = all[index];
  const auto bit = bits(1, bitrate);
  std::vector<Stream> higher;
  Duration blocking{};
  for (const auto& stream : all) {
    if (stream.id < own.id) higher.push_back(stream);
    if (stream.id > own.id) blocking = std::max(blocking, stream.transmission);
  }
  auto with_own = higher;
  with_own.push_back(own);
  const auto busy = settle(blocking + own.transmission, limit,
                           [&](Duration time) { return blocking + interference(with_own, time); });
  if (!busy) return std::nullopt;
  Duration worst{};
  for (std::int64_t instance = 0; instance < instances(own, *busy); ++instance) {
    const auto before = blocking + instance * own.transmission;
    const auto waits =
        settle(before, limit, [&](Duration time) { return before + interference(higher, time + bit); });
    if (!waits) return std::nullopt;
    const auto since = instance == 0 ? Duration{} : instance * own.period;
    worst = std::max(worst, own.jitter + *waits - since + own.transmission);
  }
  return worst;
}

std::optional<Duration> queue_response_time(std::span<const Stream> others, Duration ahead, Duration own,
                                            Duration blocking, std::uint32_t bitrate, Duration limit) {
  const auto before = blocking + ahead;
  const auto waits = settle(
      before, limit, [&](Duration time) { return before + interference(others, time + bits(1, bitrate)); });
  if (!waits) return std::nullopt;
  return *waits + own;
}

}  // namespace axisd::can
