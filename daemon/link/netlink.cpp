#include "daemon/link/netlink.hpp"

#include <fmt/format.h>
#include <linux/if.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

namespace axisd::link {
namespace {

constexpr std::size_t longest_message = 32768;  // the kernel's
using Buffer = std::array<std::byte, longest_message>;

Error kernel_error(const std::string& what, int why) {
  Error error{.reason = Reason::bus_down,
              .message = fmt::format("{}: {}", what, std::strerror(why)),
              .remedy = "check the adapter and the kernel's log"};
  error.where.native_code = static_cast<std::uint32_t>(why);
  return error;
}

/// The kernel's verdict in an acknowledgement: 0 or an errno.
std::optional<int> verdict_of(std::span<const std::byte> datagram) {
  nlmsghdr header{};
  nlmsgerr error{};
  if (datagram.size() < NLMSG_LENGTH(sizeof(error))) return std::nullopt;
  std::memcpy(&header, datagram.data(), sizeof(header));
  std::memcpy(&error, datagram.data() + NLMSG_HDRLEN, sizeof(error));
  if (header.nlmsg_type != NLMSG_ERROR) return std::nullopt;
  return -error.error;
}

}  // namespace

Result<Netlink> Netlink::open() {
  FileDescriptor socket(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
  if (socket.get() < 0) return fail(kernel_error("cannot speak to the kernel about interfaces", errno));
  // It answers at once when a request has been carried out; one that does not would hold everything up.
  const timeval patience{.tv_sec = 2, .tv_usec = 0};
  ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  return Netlink(std::move(socket));
}

Result<std::span<const std::byte>> Netlink::ask(std::span<const std::byte> request,
                                                std::span<std::byte> buffer) {
  if (::send(socket_.get(), request.data(), request.size(), 0) < 0)
    return fail(kernel_error("rtnetlink", errno));
  const auto length = ::recv(socket_.get(), buffer.data(), buffer.size(), 0);
  if (length < 0) return fail(kernel_error("rtnetlink", errno));
  return std::span<const std::byte>(buffer).first(static_cast<std::size_t>(length));
}

Result<can::LinkReport> Netlink::find(const std::string& interface) {
  Buffer buffer;
  const auto answer = ask(can::link_request(interface), buffer);
  if (!answer) return fail(answer.error());
  const auto reports = can::parse_link_reports(*answer);
  if (reports.empty()) return fail(kernel_error(interface, EBADMSG));
  return reports.front();
}

Result<void> Netlink::set_up(const can::LinkReport& link, bool up) {
  struct Message {
    nlmsghdr header{};
    ifinfomsg link{};
  } message;
  message.header.nlmsg_len = sizeof(message);
  message.header.nlmsg_type = RTM_NEWLINK;
  message.header.nlmsg_flags = NLM_F_REQUEST | NLM_F_ACK;
  message.link.ifi_index = link.index;
  message.link.ifi_change = IFF_UP;
  message.link.ifi_flags = up ? unsigned{IFF_UP} : 0U;
  Buffer buffer;
  const auto answer = ask(std::as_bytes(std::span(&message, 1)), buffer);
  if (!answer) return fail(answer.error());
  const auto verdict = verdict_of(*answer);
  if (!verdict) return fail(kernel_error(link.name, EBADMSG));
  if (*verdict == 0) return {};
  return fail(kernel_error(fmt::format("cannot set {} {}", link.name, up ? "up" : "down"), *verdict));
}

}  // namespace axisd::link
