#include "api/server/lane/connection.hpp"

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <utility>

namespace axisd::server::lane {

namespace {

/// Of what waits for a peer that does not read.
constexpr std::size_t most_unsent = std::size_t{256} * 1024;
/// Read at once: it may hold some 60 calls, which whoever comes next waits for.
constexpr std::size_t most_read = 4096;

}  // namespace

Connection::Connection(FileDescriptor socket, std::shared_ptr<const tls::Acceptor> acceptor, OnCall on_call,
                       TimePoint now)
    : socket_(std::move(socket)), http_(std::move(on_call), now) {
  if (acceptor) tls_.emplace(std::move(acceptor));
}

bool Connection::read(TimePoint now) {
  std::array<char, most_read> piece;
  const auto count = recv(socket_.get(), piece.data(), piece.size(), MSG_DONTWAIT);
  if (count < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
  if (count == 0) return false;
  const std::string_view bytes(piece.data(), static_cast<std::size_t>(count));
  bool fine = true;
  if (tls_) {
    std::string plain;
    fine = tls_->receive(bytes, plain);
    if (!plain.empty()) fine = http_.receive(plain, now) && fine;
  } else {
    fine = http_.receive(bytes, now);
  }
  over_ = over_ || !fine;
  return write();
}

/// Moves what HTTP/2 and TLS have to say to out_.
bool Connection::fill() {
  if (!tls_) {
    out_ += http_.take_output();
    return true;
  }
  if (tls_->established() && !tls_->send(http_.take_output())) return false;
  const auto output = tls_->take_output();
  greeted_ = greeted_ || (!output.empty() && !over_);
  out_ += output;
  return true;
}

bool Connection::write() {
  for (;;) {
    if (out_.size() < most_unsent / 2 && !fill()) return false;
    if (out_.empty()) return !over_;
    const auto count = send(socket_.get(), out_.data(), out_.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return (errno == EAGAIN || errno == EWOULDBLOCK) && !over_ && out_.size() < most_unsent;
    out_.erase(0, static_cast<std::size_t>(count));
  }
}

}  // namespace axisd::server::lane
