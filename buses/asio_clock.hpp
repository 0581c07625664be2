#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include "buses/clock.hpp"

namespace axisd {

/// The real clock, driven by the core's io_context. Thread: core.
class AsioClock final : public Clock {
 public:
  explicit AsioClock(boost::asio::io_context& io);
  [[nodiscard]] TimePoint now() const override { return monotonic_now(); }
  [[nodiscard]] WallTime wall(TimePoint t) const override;

 private:
  void schedule(TimePoint when) override;
  boost::asio::steady_timer timer_;
};

}  // namespace axisd
