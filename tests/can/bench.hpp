// A SocketCanPort on a core thread of its own making, another node on the same interface, and the ip tool.
// For the tests that run in the guest (tests/guest/run.sh): they need root and a kernel with SocketCAN.
#pragma once

#include <linux/can.h>

#include <boost/asio/io_context.hpp>
#include <functional>
#include <string>
#include <vector>

#include "buses/asio_clock.hpp"
#include "buses/can/socketcan_port.hpp"
#include "tests/unit/buses/can/frames.hpp"

namespace axisd::can::test {

/// Runs `ip ARGUMENTS`; several commands: one per line, in one process. Fails the test if one fails.
void ip(const std::string& commands);

/// Another node: a plain socket.
class Peer {
 public:
  explicit Peer(const std::string& interface);
  ~Peer();
  Peer(const Peer&) = delete;
  /// False: the kernel had no room.
  bool send(const Frame& frame);
  /// As a controller does; every socket that asked for error frames sees it.
  void report_error(canid_t classes, std::uint8_t controller_status = 0);
  /// All that came until now, as candump writes it.
  std::vector<std::string> received();

 private:
  int fd_;
};

class Bench {
 public:
  explicit Bench(PortSettings settings);
  ~Bench() { port.close(); }
  Bench(const Bench&) = delete;

  void start();
  /// Runs the core thread until `condition` holds; false: it did not within a time that it surely should
  /// have.
  bool until(const std::function<bool()>& condition);
  bool until(InterfaceState link) {
    return until([this, link] { return port.state().link == link; });
  }
  bool until_ended(std::size_t count) {
    return until([this, count] { return endings.texts().size() >= count; });
  }
  /// Runs the core thread for a while, in which something must not happen.
  void linger(std::chrono::milliseconds time = std::chrono::milliseconds(50));
  void send(std::uint32_t id, TransactionClass transaction_class = TransactionClass::motion) {
    port.send(frame_of(id), options_of(transaction_class), endings.of(id));
  }

  boost::asio::io_context io;
  AsioClock clock{io};
  SocketCanPort port;
  Endings endings;
  std::vector<ReceivedFrame> received;
  std::vector<InterfaceState> states;
  bool patient = false;  ///< frames may gather
};

inline PortSettings settings_of(const std::string& interface) {
  PortSettings settings;
  settings.bus = "cell";
  settings.interface = interface;
  return settings;
}

}  // namespace axisd::can::test
