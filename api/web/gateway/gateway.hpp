// What all connections of the gateway share.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/tls/identity.hpp"
#include "api/web/gateway/assets.hpp"
#include "api/web/gateway/authority.hpp"
#include "api/web/gateway/login_pauses.hpp"
#include "api/web/gateway/people.hpp"
#include "api/web/gateway/person.hpp"
#include "api/web/gateway/rates.hpp"
#include "api/web/gateway/sessions.hpp"
#include "api/web/gateway/settings.hpp"
#include "api/web/gateway/shares.hpp"
#include "api/web/gateway/upstream.hpp"
#include "buses/clock.hpp"

namespace axisd::web {

/// Something open that serves one page: a connection, or a lane. Thread: the gateway's.
class Guest {
 public:
  virtual ~Guest() = default;
  /// At once; a lane halts what is jogged over it.
  virtual void close() = 0;
  /// Since when nothing is done on it; nothing: it is in use.
  [[nodiscard]] virtual std::optional<TimePoint> idle_since() const = 0;
  /// On whose behalf it does what it does; 0: no session's.
  [[nodiscard]] virtual std::uint64_t session() const = 0;
  /// The same; nullptr: nobody's.
  [[nodiscard]] virtual const Person* person() const = 0;
};

/// Who somebody is, and by which session; 0: by none.
struct Known {
  Person person;
  std::uint64_t session = 0;
};

/// By their names; of a gateway of one machine: that one, without a name.
using Machines = std::map<std::string, std::unique_ptr<Upstream>, std::less<>>;

/// Thread: the one that runs `io`.
class Gateway {
 public:
  /// `client_ca`: PEM, of whose certificates stand for persons; empty: nobody's.
  Gateway(boost::asio::io_context& io, Clock& clock, const Settings& settings, Assets assets, People people,
          Machines machines, const std::string& client_ca);
  Gateway(const Gateway&) = delete;

  /// Who made a request. `cookie`: its header; `certificate`: of the connection (PEM). Errors: nobody.
  [[nodiscard]] std::optional<Known> who(std::string_view cookie, const std::string& certificate,
                                         bool encrypted, bool is_use);
  /// "__Host-axisd", or without TLS, where a browser takes no such cookie, "axisd".
  [[nodiscard]] static std::string_view cookie_name(bool encrypted) {
    return encrypted ? "__Host-axisd" : "axisd";
  }

  /// nullptr: there is none of that name. Empty is the name of the only one, and of no other.
  [[nodiscard]] Upstream* machine(std::string_view name) const;
  /// Empty: everything can be asked of all of them.
  [[nodiscard]] std::string trouble() const;

  void enter(const std::shared_ptr<Guest>& guest);
  /// Ends the guest that has been idle for longest. False: there is none.
  bool make_room();
  /// Ends everything; calls that stop something go on.
  void end_all();
  [[nodiscard]] bool deserted();
  /// Whether a line may be logged about what anybody may bring about as often as they like.
  [[nodiscard]] bool may_tell();

  boost::asio::io_context& io;
  Clock& clock;
  const Settings settings;
  const Assets assets;
  People people;
  const Machines machines;
  LoginPauses pauses;
  const std::unique_ptr<Authority> authority;
  Shares connections, streams, lanes;
  Shares stops;  ///< calls that stop something, which other calls leave their places
  Sessions sessions;

 private:
  void tick();
  void tick_later();
  void end_session(std::uint64_t id);
  [[nodiscard]] std::optional<Known> by_certificate(const std::string& certificate) const;
  /// Whether somebody without a session would be let in as they are.
  [[nodiscard]] bool stands(const Person& person) const;
  [[nodiscard]] std::vector<std::shared_ptr<Guest>> guests();

  std::optional<tls::Identities> identities_;
  std::vector<std::weak_ptr<Guest>> guests_;
  Rate lines_;
  int untold_ = 0;
  Clock::Timer timer_;
};

}  // namespace axisd::web
