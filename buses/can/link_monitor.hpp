#pragma once

#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>
#include <memory>
#include <string>

#include "buses/can/link_report.hpp"
#include "buses/error.hpp"
#include "buses/task.hpp"

namespace axisd::can {

/// Tells what becomes of the network interfaces, in order, by rtnetlink (which takes no privileges). Not by
/// looking now and then: an interface that goes down and up within a millisecond lost its queue, and that
/// must be seen. Thread: core.
class LinkMonitor {
 public:
  /// `interface`: the one that query() asks for; the kernel reports changes of all.
  LinkMonitor(const Executor& executor, std::string interface,
              std::function<void(const LinkReport&)> on_report);
  ~LinkMonitor() { *self_ = nullptr; }
  LinkMonitor(const LinkMonitor&) = delete;

  /// Begins to listen, and asks. Error: the kernel gives no such socket, or the name is none.
  Result<void> open();
  /// Asks for a report on the interface. Without effect unless open.
  void query();
  void close();
  [[nodiscard]] bool is_open() const { return socket_.is_open(); }

 private:
  void wait();
  void read_all();

  std::string interface_;
  std::function<void(const LinkReport&)> on_report_;
  boost::asio::posix::stream_descriptor socket_;
  std::shared_ptr<LinkMonitor*> self_;  ///< a handler that is already queued finds out that this is gone
};

}  // namespace axisd::can
