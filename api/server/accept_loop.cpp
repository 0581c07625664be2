#include "api/server/accept_loop.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <system_error>
#include <utility>

namespace axisd::server {
namespace {

// Kept free for serial ports that come back, state files and the like.
constexpr int kept_descriptors = 64;

int descriptor_limit() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  return static_cast<int>(std::min<rlim_t>(limit.rlim_cur, 1U << 20U));
}

}  // namespace

Result<void> AcceptLoop::start(std::vector<Entry> entries, int most) {
  wake_ = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  reserve_ = FileDescriptor(open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (wake_.get() < 0 || reserve_.get() < 0)
    return fail(Reason::internal,
                "cannot open descriptors for the accept loop: " + std::generic_category().message(errno),
                "raise LimitNOFILE of the service");
  // The kernel gives out the lowest free number, so the number of a new descriptor tells how many are open.
  // gRPC does not tell when it closes a connection.
  first_refused_descriptor_ =
      std::max(reserve_.get() + 1,
               std::min(descriptor_limit() - kept_descriptors, reserve_.get() + kept_descriptors + most));
  entries_ = std::move(entries);
  thread_ = std::thread([this] { run(); });
  pthread_setname_np(thread_.native_handle(), "axisd-accept");
  return {};
}

void AcceptLoop::stop() {
  if (thread_.joinable()) {
    stopping_ = true;
    eventfd_write(wake_.get(), 1);
    thread_.join();
  }
  entries_.clear();
}

void AcceptLoop::run() {
  std::vector<pollfd> polled{{.fd = wake_.get(), .events = POLLIN, .revents = 0}};
  for (const auto& entry : entries_)
    polled.push_back({.fd = entry.socket.fd.get(), .events = POLLIN, .revents = 0});
  while (!stopping_) {
    if (poll(polled.data(), polled.size(), -1) < 0 && errno != EINTR) {
      spdlog::error("accept loop: poll: {}", std::generic_category().message(errno));
      return;
    }
    bool fine = true;
    for (std::size_t i = 0; i < entries_.size(); ++i)
      if (polled[i + 1].revents != 0) fine = accept_one(entries_[i]) && fine;
    // The system is short of memory or descriptors: the connection waits in the backlog.
    if (!fine) poll(polled.data(), 1, 100);
  }
}

bool AcceptLoop::accept_one(const Entry& entry) {
  FileDescriptor connection(accept4(entry.socket.fd.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (connection.get() < 0) {
    const auto code = errno;
    if (code == EMFILE || code == ENFILE) return turn_away(entry);
    return code != ENOBUFS && code != ENOMEM;  // the rest concerns one connection that is gone already
  }
  if (connection.get() >= first_refused_descriptor_) {
    connection = {};
    const auto count = ++refused_;
    if (std::has_single_bit(count))
      spdlog::warn("too many connections (server.limits.connections): {} turned away since start", count);
    return true;
  }
  if (entry.socket.unix_path.empty()) {
    const int on = 1;
    setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }
  Acceptor::NewConnectionParameters parameters;
  parameters.listener_fd = entry.socket.fd.get();
  parameters.fd = connection.release();
  entry.acceptor->HandleNewConnection(&parameters);
  return true;
}

bool AcceptLoop::turn_away(const Entry& entry) {
  reserve_ = {};
  FileDescriptor surplus(accept4(entry.socket.fd.get(), nullptr, nullptr, SOCK_CLOEXEC));
  const bool closed = surplus.get() >= 0;
  surplus = {};
  reserve_ = FileDescriptor(open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!closed) return false;  // somebody else took the reserve meanwhile
  const auto count = ++refused_;
  if (std::has_single_bit(count))
    spdlog::error("out of file descriptors: {} connections turned away since start; raise LimitNOFILE",
                  count);
  return true;
}

}  // namespace axisd::server
