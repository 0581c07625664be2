// One connection to the stop lane: its socket, TLS where there is one, and HTTP/2.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "api/server/lane/http2.hpp"
#include "api/tls/session.hpp"
#include "buses/clock.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::server::lane {

/// Reads and writes what its socket allows, never more than a bounded piece at a time. Thread: the lane's.
class Connection {
 public:
  using OnCall = std::function<void(Http2::Call call)>;

  /// `acceptor`: nullptr: plaintext.
  Connection(FileDescriptor socket, std::shared_ptr<const tls::Acceptor> acceptor, OnCall on_call,
             TimePoint now);

  [[nodiscard]] int fd() const { return socket_.get(); }
  [[nodiscard]] bool wants_to_write() const { return !out_.empty(); }
  /// The peer is who its certificate says, or needs none.
  [[nodiscard]] bool identified() const { return !tls_ || tls_->established(); }
  /// Its handshake has begun: it got an answer.
  [[nodiscard]] bool greeted() const { return !tls_ || greeted_; }
  /// tls::Session::certificate(); nothing: there is no TLS. Precondition: identified().
  [[nodiscard]] std::optional<std::string> certificate() const {
    return tls_ ? std::optional(tls_->certificate()) : std::nullopt;
  }
  [[nodiscard]] int waiting() const { return http_.waiting(); }
  [[nodiscard]] double effort_left(TimePoint now) const { return http_.effort_left(now); }

  /// The socket is readable. False: the connection is over.
  [[nodiscard]] bool read(TimePoint now);
  /// Sends what there is. False: the connection is over.
  [[nodiscard]] bool write();
  void answer(std::int32_t stream, Answer answer) { http_.answer(stream, std::move(answer)); }
  /// Tells the peer that no more is taken.
  void go_away() { http_.go_away(); }

 private:
  bool fill();

  FileDescriptor socket_;
  std::optional<tls::Session> tls_;
  Http2 http_;
  std::string out_;  ///< for the socket
  bool greeted_ = false;
  bool over_ = false;  ///< once out_ is sent
};

}  // namespace axisd::server::lane
