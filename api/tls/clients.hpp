// Whether a client may be listened to, by its certificate: also while its connection is open.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "api/tls/identity.hpp"
#include "api/tls/pem_files.hpp"
#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd::tls {

/// A client, by its certificate.
struct Client {
  std::string name;                ///< as of Identities
  std::optional<Error> refusal{};  ///< unauthenticated: nothing is taken from it, stops included
};

/// Looks at certificates as a handshake does, and at what the authorities have revoked: a connection that was
/// made with a good certificate ends to have any right when that is revoked, expires, or is of an authority
/// that is not trusted any more. When it began was looked at by the handshake: a clock that steps back later
/// takes nothing away. A revocation list that is out of date goes on to revoke what it names. Thread: any.
class Clients {
 public:
  /// `contents`: as read() gives them.
  explicit Clients(const Files& contents);
  ~Clients();
  Clients(const Clients&) = delete;

  /// `pem`: the client's certificate, and behind it those that it came with. To be asked of each call.
  [[nodiscard]] Client of(const std::string& pem, WallTime now) const;

 private:
  struct Trusted;
  /// What was found, and how long it holds.
  struct Known {
    Client client;
    WallTime from, until;
  };
  [[nodiscard]] Known look_at(const std::string& pem, WallTime now) const;

  const Identities identities_;
  const std::unique_ptr<const Trusted> trusted_;
  mutable std::mutex mutex_;
  /// Under mutex_; by a hash of what the client has shown, which may be long.
  mutable std::unordered_map<std::string, Known> known_;
};

}  // namespace axisd::tls
