#include "buses/can/link_monitor.hpp"

#include <fmt/format.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace axisd::can {

LinkMonitor::LinkMonitor(const Executor& executor, std::string interface,
                         std::function<void(const LinkReport&)> on_report)
    : interface_(std::move(interface)),
      on_report_(std::move(on_report)),
      socket_(executor),
      self_(std::make_shared<LinkMonitor*>(this)) {}

Result<void> LinkMonitor::open() {
  if (interface_.empty() || interface_.size() >= IF_NAMESIZE)
    return fail(Reason::misconfigured, fmt::format("'{}' is no name of a network interface", interface_),
                "give 1 to 15 characters, as ip link shows it");
  const int fd = ::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE);
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = RTMGRP_LINK;
  if (fd < 0 || ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    const int why = errno;
    if (fd >= 0) ::close(fd);
    return fail(Reason::bus_down, fmt::format("cannot watch the network interfaces: {}", std::strerror(why)),
                "allow address family AF_NETLINK to the service");
  }
  socket_.assign(fd);
  wait();
  query();
  return {};
}

void LinkMonitor::query() {
  if (!socket_.is_open()) return;
  const auto request = link_request(interface_);
  // What does not fit is asked again by whoever wants to know.
  static_cast<void>(::send(socket_.native_handle(), request.data(), request.size(), MSG_DONTWAIT));
}

void LinkMonitor::close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
}

void LinkMonitor::wait() {
  socket_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                     [self = self_](const boost::system::error_code& error) {
                       if (error || *self == nullptr) return;
                       (*self)->read_all();
                       if ((*self)->socket_.is_open()) (*self)->wait();
                     });
}

void LinkMonitor::read_all() {
  std::array<std::byte, 32768> buffer;  // the kernel's largest message
  while (socket_.is_open()) {
    const auto length = ::recv(socket_.native_handle(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (length < 0 && errno == EINTR) continue;
    if (length < 0 && errno == ENOBUFS) {  // reports were lost
      query();
      continue;
    }
    if (length <= 0) return;
    for (const auto& report : parse_link_reports(std::span(buffer).first(static_cast<std::size_t>(length))))
      on_report_(report);
  }
}

}  // namespace axisd::can
