// Who has connected to the stop lane and has said nothing yet.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "api/server/lane/crowd.hpp"
#include "api/transport/listen.hpp"
#include "buses/clock.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::server::lane {

/// Accepts connections, and keeps them until they speak: a descriptor and some hundred bytes each, without
/// TLS or HTTP/2, so that there is room for far more of them than for whoever has spoken. Nobody else is
/// slower for them. Thread: the lane's.
class Lobby {
 public:
  struct Guest {
    FileDescriptor socket;
    std::string address;  ///< as gRPC writes it
    Crowd::Origin origin;
    bool local = false;  ///< on a unix socket
  };
  /// Accepted at once, before those who are there are served again.
  static constexpr int most_accepted = 16;
  /// Told of at once. Each may cost a handshake.
  static constexpr int most_told = 8;

  /// No more than a sixteenth of the descriptors that the process may have.
  explicit Lobby(Crowd::Limits limits);

  /// Readable: somebody speaks, or has left. Below 0: the system gave none.
  [[nodiscard]] int fd() const { return told_.get(); }
  /// Lets in who waits there. False: the system has no descriptors.
  [[nodiscard]] bool accept_from(const transport::ListeningSocket& socket, TimePoint now);
  struct Speakers {
    std::vector<Guest> guests;  ///< who are no longer here
    bool all = true;            ///< else others may speak as well
  };
  /// Those who speak, in that order. Closes those who have left.
  [[nodiscard]] Speakers take_speakers();
  /// Closes those who have been silent for too long.
  void end_overdue(TimePoint now);
  [[nodiscard]] TimePoint next_due() const { return crowd_.next_due(); }
  /// Closes one. False: there is nobody.
  bool make_room();
  void clear();

 private:
  using Id = Crowd::Id;
  void enter(Guest guest, TimePoint now);
  void close(Id id);

  FileDescriptor told_;
  Crowd crowd_;
  std::map<Id, Guest> guests_;
  Id last_ = 0;
  std::uint64_t closed_ = 0;
};

}  // namespace axisd::server::lane
