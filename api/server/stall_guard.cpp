#include "api/server/stall_guard.hpp"

#include <chrono>
#include <utility>

namespace axisd::server {
namespace {

using std::chrono::milliseconds;

constexpr Duration check_period = milliseconds(100);
// A reader that reads takes what is on its way within this, and learns why the stream ends.
constexpr Duration closing_limit = milliseconds(100);

}  // namespace

void StallGuard::watch(std::weak_ptr<Stallable> stream) {
  if (streams_.empty()) next_ = monotonic_now() + check_period;
  streams_.push_back(std::move(stream));
}

TimePoint StallGuard::tick(TimePoint now) {
  if (now < next_) return next_;
  std::erase_if(streams_, [&](const std::weak_ptr<Stallable>& weak) {
    const auto stream = weak.lock();
    if (!stream) return true;
    const auto since = stream->writing_since();
    if (!since) return true;
    if (now - *since <= (stream->closing() ? closing_limit : limit_)) return false;
    stream->cancel();
    return true;
  });
  next_ = streams_.empty() ? TimePoint::max() : now + check_period;
  return next_;
}

}  // namespace axisd::server
