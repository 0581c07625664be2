#pragma once

#include <boost/asio/posix/stream_descriptor.hpp>
#include <memory>

#include "buses/can/link_monitor.hpp"
#include "buses/can/port_core.hpp"

struct msghdr;
struct can_frame;
struct timespec;

namespace axisd::can {

/// A CAN interface of the kernel. It is neither configured nor set up or down here: that takes privileges.
/// Thread: core.
class SocketCanPort final : public PortCore {
 public:
  SocketCanPort(const Executor& executor, Clock& clock, PortSettings settings);
  ~SocketCanPort() override;

 private:
  struct Batch;
  enum class Took : std::uint8_t {
    nothing,
    some,  ///< or an error
    as_many_as_fit,
  };
  /// When frames were taken from the socket, on both clocks.
  struct Moment {
    TimePoint now;
    WallTime wall;
    [[nodiscard]] TimePoint of(const timespec& stamp) const;
  };

  void open() override;
  void shut() override;
  Written write(const Frame& frame) override;
  void catch_up() override;
  bool drained() override;
  bool empty_below() override;

  void on_report(const LinkReport& report);
  void on_up(const LinkReport& report);
  bool open_socket(int index);
  void close_socket();
  void wait();
  /// After a look at the socket: takes up the next frames one by one, or lets them gather.
  void go_on(Took last);
  void on_gathered();
  /// Takes frames, or an error, from the socket.
  Took read_some();
  void on_message(const can_frame& frame, msghdr& message, const Moment& moment);
  /// The socket failed with `error`: what that says of the link.
  void on_error(int error);
  void try_again_later();
  void try_again();

  LinkMonitor monitor_;
  boost::asio::posix::stream_descriptor socket_;
  std::shared_ptr<SocketCanPort*> self_;  ///< a handler that is already queued finds out that this is gone
  std::unique_ptr<Batch> batch_;
  int index_ = 0;  ///< interface that the socket is bound to; 0: none
  bool echo_is_proof_ = false;
  std::uint32_t overflows_ = 0;  ///< of this socket
  Clock::Timer retry_, gathering_;
  Duration back_off_{};
};

}  // namespace axisd::can
