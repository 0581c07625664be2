#include "devices/simulation/control_socket.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>

namespace axisd::simulation {

namespace {

constexpr std::size_t longest_line = 4096;
constexpr std::size_t most_clients = 16;
constexpr int when_full_ms = 100;  ///< until a descriptor is asked for again

/// Of this user or root. A file has its permissions instead.
bool is_trusted(int socket) {
  ucred peer{};
  socklen_t size = sizeof(peer);
  if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return false;
  return peer.uid == 0 || peer.uid == geteuid();
}

}  // namespace

ControlSocket::ControlSocket(std::string path, Handler handler)
    : path_(std::move(path)), handler_(std::move(handler)) {}

Result<std::unique_ptr<ControlSocket>> ControlSocket::open(std::string path, Handler handler) {
  std::unique_ptr<ControlSocket> control(new ControlSocket(std::move(path), std::move(handler)));
  if (auto listening = control->listen(); !listening) return std::unexpected(listening.error());
  control->thread_ = std::thread([raw = control.get()] { raw->run(); });
  return control;
}

Result<void> ControlSocket::listen() {
  const auto failure = [&](int number) {
    return fail(Reason::invalid_argument, fmt::format("{}: {}", path_, std::strerror(number)),
                "choose another path for the control socket");
  };
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  if (path_.empty() || path_.size() >= sizeof(address.sun_path)) return failure(ENAMETOOLONG);
  path_.copy(address.sun_path, path_.size());
  auto size = static_cast<socklen_t>(sizeof(address));
  struct stat status{};
  if (is_abstract()) {
    address.sun_path[0] = '\0';
    size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path_.size());
  } else if (lstat(path_.c_str(), &status) == 0) {
    if (!S_ISSOCK(status.st_mode)) return failure(EEXIST);
    unlink(path_.c_str());
  }
  const int listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener < 0) return failure(errno);
  if (bind(listener, reinterpret_cast<const sockaddr*>(&address), size) != 0 || ::listen(listener, 8) != 0) {
    const int number = errno;
    close(listener);
    return failure(number);
  }
  listener_ = listener;
  wake_fd_ = eventfd(0, EFD_CLOEXEC);
  return wake_fd_ < 0 ? Result<void>(failure(errno)) : Result<void>{};
}

ControlSocket::~ControlSocket() {
  stopping_ = true;
  const std::uint64_t one = 1;
  if (thread_.joinable()) {
    [[maybe_unused]] const auto written = write(wake_fd_, &one, sizeof(one));
    thread_.join();
  }
  for (const auto& client : clients_) close(client.socket);
  if (wake_fd_ >= 0) close(wake_fd_);
  if (listener_ < 0) return;
  close(listener_);
  if (!is_abstract()) unlink(path_.c_str());
}

void ControlSocket::run() {
  std::vector<pollfd> waited;
  bool out_of_descriptors = false;
  while (!stopping_) {
    // poll() leaves out what is negative: who comes then waits in the listener's queue.
    const bool full = out_of_descriptors || clients_.size() >= most_clients;
    waited = {{wake_fd_, POLLIN, 0}, {full ? -1 : listener_, POLLIN, 0}};
    for (const auto& client : clients_) waited.push_back({client.socket, POLLIN, 0});
    if (poll(waited.data(), waited.size(), out_of_descriptors ? when_full_ms : -1) < 0) continue;
    out_of_descriptors = false;
    std::vector<Client> kept;
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      if (waited[i + 2].revents == 0 || serve(clients_[i]))
        kept.push_back(std::move(clients_[i]));
      else
        close(clients_[i].socket);
    }
    clients_ = std::move(kept);
    if (waited[1].revents != 0) out_of_descriptors = !let_in();
  }
}

/// False: there is no descriptor for it.
bool ControlSocket::let_in() {
  const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (socket < 0) return errno != EMFILE && errno != ENFILE && errno != ENOMEM && errno != ENOBUFS;
  if (is_abstract() && !is_trusted(socket))
    close(socket);
  else
    clients_.push_back({.socket = socket, .input = {}});
  return true;
}

/// False: the client is gone, or sends no line ends.
bool ControlSocket::serve(Client& client) {
  std::array<char, 1024> buffer{};
  const auto size = recv(client.socket, buffer.data(), buffer.size(), 0);
  if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) return false;
  if (size > 0) client.input.append(buffer.data(), static_cast<std::size_t>(size));
  for (auto end = client.input.find('\n'); end != std::string::npos; end = client.input.find('\n')) {
    const auto reply = handler_(std::string_view(client.input).substr(0, end)) + "\n";
    client.input.erase(0, end + 1);
    if (send(client.socket, reply.data(), reply.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(reply.size()))
      return false;
  }
  return client.input.size() < longest_line;
}

}  // namespace axisd::simulation
