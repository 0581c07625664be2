// Who has logged in. Pure, but for the random numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "api/web/gateway/person.hpp"
#include "buses/clock.hpp"

namespace axisd::web {

/// How long sessions last, and how many there may be.
struct SessionLimits {
  Duration idle = std::chrono::hours(1);      ///< without a request
  Duration longest = std::chrono::hours(12);  ///< whatever happens
  std::size_t most = 256, most_each = 16;     ///< of all; of one person: the one idle for longest makes room
};

/// What a browser's cookie stands for.
struct Session {
  std::uint64_t id = 0;  ///< to name it by; no secret
  Person person;
  std::string peer;   ///< the address that logged in
  std::string proof;  ///< hash of the password that it was begun with
  TimePoint begun{}, used{};
};

/// Kept in memory alone: a restart ends them. Only hashes of the cookies are kept. Thread: one at a time.
class Sessions {
 public:
  /// Of a session that has ended, whyever: what is open on it has to end, too.
  using Ended = std::function<void(const Session&)>;
  Sessions(SessionLimits limits, Ended ended) : limits_(limits), ended_(std::move(ended)) {}

  /// What the cookie says: 256 random bits in hex.
  [[nodiscard]] std::string begin(Person person, std::string peer, std::string proof, TimePoint now);
  /// nullptr: there is none, or it is over. A use of it puts off its idle end.
  [[nodiscard]] const Session* use(std::string_view token, TimePoint now);
  /// The same without putting off anything.
  [[nodiscard]] const Session* look(std::string_view token, TimePoint now);
  /// Something was asked for on what is open on it.
  void touch(std::uint64_t id, TimePoint now);
  /// False: there is none.
  bool end(std::uint64_t id);
  /// Ends those of which that is true.
  void end_if(const std::function<bool(const Session&)>& doomed);
  /// Ends what is over.
  void expire(TimePoint now);
  /// Oldest first.
  [[nodiscard]] std::vector<Session> list() const;
  /// When it ends unless it is used.
  [[nodiscard]] TimePoint end_of(const Session& session) const;

 private:
  using Table = std::map<std::string, Session>;  ///< by the hash of the token
  Table::iterator find(std::string_view token, TimePoint now);
  Table::iterator erase(Table::iterator session);
  void make_room(const Person& person);

  const SessionLimits limits_;
  const Ended ended_;
  std::uint64_t last_id_ = 0;
  Table sessions_;
};

}  // namespace axisd::web
