#include "buses/can/socketcan_port.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/sock_diag.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

#include "buses/can/socketcan_frame.hpp"

namespace axisd::can {
namespace {

using namespace std::chrono_literals;

constexpr Duration first_back_off = 250ms;
constexpr Duration longest_back_off = 4s;
constexpr unsigned frames_per_turn = 32;  // then others have their turn on the core thread
/// Nodes answer a SYNC one after another, a frame in 0.1 ms or more: this long they gather. What else comes
/// in between, an EMCY, waits no longer than that.
constexpr Duration gather_time = 500us;
constexpr int most_turns = 128;  // what the receive buffer holds at most, several times over
constexpr int receive_buffer = 1 << 20;

template <class T>
bool set_option(int fd, int level, int option, T value) {
  return ::setsockopt(fd, level, option, &value, sizeof(value)) == 0;
}

/// A raw CAN socket bound to interface `index`, or -1 with errno.
int bound_socket(int index) {
  const int fd = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd < 0) return -1;
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  // The kernel may give less buffer than asked for; overflows are counted.
  set_option(fd, SOL_SOCKET, SO_RCVBUF, receive_buffer);
  if (set_option(fd, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, 1) &&
      set_option(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, wanted_errors()) &&
      set_option(fd, SOL_SOCKET, SO_TIMESTAMPNS, 1) && set_option(fd, SOL_SOCKET, SO_RXQ_OVFL, 1) &&
      ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0)
    return fd;
  const int why = errno;
  ::close(fd);
  errno = why;
  return -1;
}

}  // namespace

/// What one recvmmsg(2) takes: a system call for each frame, and one more to learn that there is no other,
/// would cost more than all that is done with the frames.
struct SocketCanPort::Batch {
  struct Slot {
    can_frame frame{};
    alignas(cmsghdr) std::array<std::byte, 128> control{};
    iovec data{.iov_base = &frame, .iov_len = sizeof(frame)};
  };

  Batch() {
    for (std::size_t i = 0; i < slots.size(); ++i) {
      messages.at(i).msg_hdr.msg_iov = &slots.at(i).data;
      messages.at(i).msg_hdr.msg_iovlen = 1;
      messages.at(i).msg_hdr.msg_control = slots.at(i).control.data();
    }
  }

  /// How many frames it took, or -1 with errno.
  int receive(int socket) {
    for (auto& message : messages) message.msg_hdr.msg_controllen = Slot{}.control.size();
    return ::recvmmsg(socket, messages.data(), frames_per_turn, MSG_DONTWAIT, nullptr);
  }

  std::array<Slot, frames_per_turn> slots;
  std::array<mmsghdr, frames_per_turn> messages{};
};

/// The kernel stamps with the wall clock, which may be set at any moment: what cannot be is taken for now.
TimePoint SocketCanPort::Moment::of(const timespec& stamp) const {
  const Duration age = wall.time_since_epoch() -
                       (std::chrono::seconds(stamp.tv_sec) + std::chrono::nanoseconds(stamp.tv_nsec));
  return age < Duration{} || age > 10s ? now : now - age;
}

SocketCanPort::SocketCanPort(const Executor& executor, Clock& clock, PortSettings settings)
    : PortCore(clock, std::move(settings)),
      monitor_(executor, this->settings().interface, [this](const LinkReport& report) { on_report(report); }),
      socket_(executor),
      self_(std::make_shared<SocketCanPort*>(this)),
      batch_(std::make_unique<Batch>()) {}

SocketCanPort::~SocketCanPort() { *self_ = nullptr; }

void SocketCanPort::open() { try_again(); }

void SocketCanPort::shut() {
  retry_.reset();
  monitor_.close();
  close_socket();
}

void SocketCanPort::try_again() {
  if (monitor_.is_open()) return monitor_.query();
  if (const auto opened = monitor_.open(); !opened) {
    tracker().unusable(opened.error());
    link_changed();
    try_again_later();
  }
}

void SocketCanPort::try_again_later() {
  back_off_ = std::clamp(2 * back_off_, first_back_off, longest_back_off);
  retry_ = clock().call_at(clock().now() + back_off_, [this] {
    try_again();
    settle();
  });
}

void SocketCanPort::on_report(const LinkReport& report) {
  if (closed()) return;
  const bool ours = report.index == 0 || report.name == settings().interface;
  if (!ours && (index_ == 0 || report.index != index_)) return;
  catch_up();  // what the socket has is of before this report
  const bool another = report.index != index_ && report.index != 0;
  if (report.gone && another && index_ != 0) return;  // one of that name that was replaced already
  if (report.gone || !ours) {
    tracker().removed();
    close_socket();
  } else if (!report.is_can) {
    close_socket();
    tracker().unusable({.reason = Reason::misconfigured,
                        .message = fmt::format("{} is no CAN interface", report.name),
                        .remedy = "correct the interface's name (ip link show type can)"});
  } else {
    if (another && index_ != 0) {
      tracker().removed();
      link_changed();
      close_socket();
    }
    if (report.up)
      on_up(report);
    else
      tracker().down();
  }
  link_changed();
  settle();
}

void SocketCanPort::on_up(const LinkReport& report) {
  if (index_ == 0 && !open_socket(report.index)) return;
  echo_is_proof_ = report.echo;
  const auto configured = settings().bitrate;
  std::optional<Error> objection;
  if (configured != 0 && report.bitrate && *report.bitrate != configured)
    objection = Error{.reason = Reason::misconfigured,
                      .message = fmt::format("CAN interface {} runs at {} bit/s, configured are {}",
                                             report.name, *report.bitrate, configured),
                      .remedy =
                          "set the interface's bit rate (systemd-networkd: [CAN] BitRate=), or correct "
                          "`bitrate` of the bus; nothing is sent meanwhile"};
  tracker().up(std::move(objection));
  if (report.controller) tracker().controller(*report.controller);
}

bool SocketCanPort::open_socket(int index) {
  const int fd = bound_socket(index);
  if (fd < 0) {
    on_error(errno);
    return false;
  }
  socket_.assign(fd);
  index_ = index;
  overflows_ = 0;
  back_off_ = Duration{};
  ++counts().openings;
  wait();
  return true;
}

void SocketCanPort::close_socket() {
  boost::system::error_code ignored;
  gathering_.reset();
  socket_.close(ignored);
  index_ = 0;
}

void SocketCanPort::wait() {
  socket_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                     [self = self_, index = index_](const boost::system::error_code& error) {
                       if (error || *self == nullptr || (*self)->index_ != index) return;
                       const auto took = (*self)->read_some();
                       (*self)->settle();
                       if ((*self)->index_ == index) (*self)->go_on(took);
                     });
}

/// As long as frames come, nobody needs to be woken by them.
void SocketCanPort::go_on(Took last) {
  if (last == Took::some && may_gather())
    gathering_ = clock().call_at(clock().now() + gather_time, [this] { on_gathered(); });
  else
    wait();
}

void SocketCanPort::on_gathered() {
  const int index = index_;
  const auto took = read_some();
  settle();
  if (index_ == index) go_on(took);
}

void SocketCanPort::catch_up() {
  for (int turns = 0; turns < most_turns && read_some() != Took::nothing; ++turns) {
  }
}

SocketCanPort::Took SocketCanPort::read_some() {
  if (index_ == 0) return Took::nothing;
  const int count = batch_->receive(socket_.native_handle());
  if (count < 0) {
    if (errno == EAGAIN) return Took::nothing;
    on_error(errno);
    return Took::some;
  }
  const auto now = clock().now();
  const Moment moment{.now = now, .wall = clock().wall(now)};
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    if (batch_->messages.at(i).msg_len == sizeof(can_frame))
      on_message(batch_->slots.at(i).frame, batch_->messages.at(i).msg_hdr, moment);
  return count == frames_per_turn ? Took::as_many_as_fit : Took::some;  // an error comes with the next call
}

void SocketCanPort::on_message(const can_frame& frame, msghdr& message, const Moment& moment) {
  auto at = moment.now;
  for (auto* each = CMSG_FIRSTHDR(&message); each != nullptr; each = CMSG_NXTHDR(&message, each)) {
    if (each->cmsg_level != SOL_SOCKET) continue;
    if (each->cmsg_type == SO_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(each), sizeof(stamp));
      at = moment.of(stamp);
    } else if (each->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t total = 0;
      std::memcpy(&total, CMSG_DATA(each), sizeof(total));
      counts().receive_overflows += total - std::exchange(overflows_, total);
    }
  }
  if ((frame.can_id & CAN_ERR_FLAG) != 0) {
    ++counts().error_frames;
    if (const auto controller = controller_of(frame)) {
      tracker().controller(*controller);
      link_changed();
    }
  } else if ((message.msg_flags & MSG_CONFIRM) != 0) {  // sent by this very socket
    own_frame_seen(from_kernel(frame), at, moment.now, echo_is_proof_);
  } else {
    frame_received(from_kernel(frame), at);
  }
}

void SocketCanPort::on_error(int error) {
  if (error == EINTR) return;
  if (error == ENETDOWN) {
    tracker().down();
    monitor_.query();  // it may be up again already
  } else if (error == ENODEV || error == ENXIO) {
    // Even if an interface of that name comes back, this socket would never receive again.
    tracker().removed();
    close_socket();
    monitor_.query();
  } else {
    tracker().unusable(
        {.reason = Reason::bus_down,
         .message = fmt::format("CAN interface {}: {}", settings().interface, std::strerror(error)),
         .remedy = error == EAFNOSUPPORT
                       ? "load the kernel's modules can and can-raw, and allow address family AF_CAN"
                       : "check the adapter and the kernel's log"});
    close_socket();
    try_again_later();
  }
  link_changed();
}

PortCore::Written SocketCanPort::write(const Frame& frame) {
  const auto kernel = to_kernel(frame);
  for (;;) {
    if (::send(socket_.native_handle(), &kernel, sizeof(kernel), MSG_DONTWAIT) >= 0) return Written::taken;
    if (errno == ENOBUFS || errno == EAGAIN) return Written::full;
    if (errno == EINTR) continue;
    on_error(errno);
    return Written::lost;
  }
}

bool SocketCanPort::drained() {
  if (index_ == 0) return false;
  std::array<std::uint32_t, SK_MEMINFO_VARS> memory{};
  socklen_t size = sizeof(memory);
  return ::getsockopt(socket_.native_handle(), SOL_SOCKET, SO_MEMINFO, memory.data(), &size) == 0 &&
         memory.at(SK_MEMINFO_WMEM_ALLOC) == 0;
}

/// With IFF_ECHO a driver gives the socket's memory back as soon as it has put the frame into a mailbox
/// (can_put_echo_skb()): there it may wait for ever, for its turn or for somebody who acknowledges.
bool SocketCanPort::empty_below() { return !echo_is_proof_ && drained(); }

}  // namespace axisd::can
