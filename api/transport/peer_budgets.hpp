// What clients of one address may take of the main address. Pure.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"

namespace axisd::transport {

/// Places: an address has three quarters of them at most. Where it has them all, or nobody has one left, a
/// new connection gets the place of one that has not said hello yet, else of one on which nothing has gone on
/// for a while. Bytes: who asks gets answers, so that what is sent is in proportion to what comes back; a
/// flood (rapid reset, half-open streams, CONTINUATION) brings nothing back. What an address sends beyond
/// `proportion` times what it gets runs into a bucket that empties at `rate`. Where it is above `burst` those
/// connections that filled it most are to be cut off, and take out of it what they brought: the others are
/// not to blame. No further one is let in for as long as it would have taken until it is down to half of
/// that. Thread: one at a time.
class PeerBudgets {
 public:
  using Id = std::uint64_t;
  struct Limits {
    int connections = 256;  ///< in all
    double proportion = 4;
    double rate = 256 * 1024;                 ///< bytes per second
    double burst = 1024 * 1024;               ///< bytes: several of the longest messages
    double longest_penalty = 5;               ///< seconds until a bucket is empty, at most
    Duration idle = std::chrono::seconds(5);  ///< from then on it gives way
    /// Until one that has ended its sending has to be over: answers that it does not take keep it.
    Duration leaving = std::chrono::seconds(15);
    double suspect = 128 * 1024;  ///< bytes: see most_one_sided()
    /// Of the process, in bytes: above it the most one-sided connections end.
    std::size_t memory = std::size_t{192} * 1024 * 1024;
  };
  /// Since the connection began, as the kernel counts it.
  struct Traffic {
    std::uint64_t received = 0, sent = 0;  ///< bytes
  };
  /// Of HTTP/2: its preface and an empty frame of settings.
  static constexpr std::uint64_t hello = 33;
  /// Pings, with TLS around them, are no more in that time, however often it is counted; a call is more, and
  /// so are the messages of a stream.
  static constexpr std::uint64_t quiet = 100;
  static constexpr Duration quiet_for = std::chrono::milliseconds(250);
  enum class Entry : std::uint8_t { granted, full, address_full, address_floods };

  explicit PeerBudgets(Limits limits) : limits_(limits) {}

  /// A new connection from `address`; it is known from then on if it is granted. `counted`: its traffic is;
  /// it never gives way otherwise.
  [[nodiscard]] Entry enter(Id id, const std::string& address, TimePoint now, bool counted = true);
  /// Who has to leave so that a connection from `address` is let in that was not, as far as is counted.
  /// Nothing: nobody has to.
  [[nodiscard]] std::optional<Id> gives_way(const std::string& address, TimePoint now) const;
  /// False: by what it has sent and got by now it does not have to leave.
  [[nodiscard]] bool still_gives_way(Id id, const Traffic& total, TimePoint now);
  void leave(Id id);
  /// It is cut off for another reason: its address is treated as after a flood.
  void blame(Id id, TimePoint now);
  /// Takes over what was counted by now. Those to cut off, which are to leave then.
  [[nodiscard]] std::vector<Id> count(const std::map<Id, Traffic>& traffic, TimePoint now);
  /// Who has sent most without getting anything for it since it began: streams that never end take memory
  /// however slowly they are begun. Nothing: nobody has sent more than `suspect`.
  [[nodiscard]] std::optional<Id> most_one_sided() const;
  [[nodiscard]] std::size_t connections() const { return connections_.size(); }
  /// That are remembered: with connections, or a bucket that is not empty yet.
  [[nodiscard]] std::size_t addresses() const { return addresses_.size(); }

 private:
  struct Bucket {
    double level = 0;  ///< bytes
    TimePoint since{};
  };
  struct Address {
    int connections = 0;
    Bucket bucket;
    TimePoint kept_out_until{};
  };
  struct Connection {
    std::string address;
    bool may_go = true;
    Traffic counted{};
    Bucket bucket{};
    TimePoint begun{}, active{};
    Traffic noted{};  ///< what is compared with to tell whether something goes on
    TimePoint noted_at{};
    bool said_hello = false;
    double one_sided = 0;  ///< bytes since it began
  };
  [[nodiscard]] int most_of_one() const;
  static void look(Connection& connection, const Traffic& total, TimePoint now);
  [[nodiscard]] double level_of(const Bucket& bucket, TimePoint now) const;
  void fill(Bucket& bucket, double more, TimePoint now) const;
  /// As after a flood that filled its bucket so far.
  void keep_out(Address& address, double level, TimePoint now) const;
  void forget_idle(TimePoint now);

  Limits limits_;
  std::map<Id, Connection> connections_;
  std::map<std::string, Address> addresses_;
};

}  // namespace axisd::transport
