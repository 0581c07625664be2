#include "buses/asio_clock.hpp"

namespace axisd {

AsioClock::AsioClock(boost::asio::io_context& io) : timer_(io) {}

WallTime AsioClock::wall(TimePoint t) const {
  return std::chrono::system_clock::now() +
         std::chrono::duration_cast<std::chrono::system_clock::duration>(t - monotonic_now());
}

void AsioClock::schedule(TimePoint when) {
  timer_.expires_at(when);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;  // superseded by an earlier wake-up
    const auto next = run_due(now());
    if (next != TimePoint::max()) schedule(next);
  });
}

}  // namespace axisd
