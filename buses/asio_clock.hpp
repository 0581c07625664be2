#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>

#include "buses/clock.hpp"

namespace axisd {

/// The real clock, on a timer of the kernel's, which is set as seldom as possible: each time is a system
/// call. Thread: core (now() and wall(): any).
class AsioClock final : public Clock {
 public:
  enum class Served : std::uint8_t {
    by_io_context,  ///< whoever runs it, callbacks are called
    by_loop,        ///< the owner calls serve() between handlers, and wake_in_time() before it may sleep
  };
  explicit AsioClock(boost::asio::io_context& io, Served served = Served::by_io_context);
  [[nodiscard]] TimePoint now() const override { return monotonic_now(); }
  [[nodiscard]] WallTime wall(TimePoint t) const override;

  /// Runs what is due at `now`. False: nothing was.
  bool serve(TimePoint now);
  /// From now on a handler of the io_context ends its sleep when the next callback is due, or before.
  void wake_in_time();

 private:
  void schedule(TimePoint when) override;
  void on_wake();

  boost::asio::posix::stream_descriptor timer_;
  Served served_;
  TimePoint wakes_at_ = TimePoint::max();
  bool serving_ = false, waiting_ = false;
};

}  // namespace axisd
