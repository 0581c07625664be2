// How many streams connections may have open. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"

namespace axisd::transport {

/// Each stream costs gRPC some 12 KiB, however few bytes began it, and more while it ends. How many there are
/// only gRPC knows, and it is dear to ask. So the bytes that came say how many there are at most, and gRPC is
/// asked where that is too many: most about those of whom least is known. Idle are streams that are no calls
/// in progress: half of a request, an answer that is not taken, or one that only passes by. Those that last
/// have been idle at two looks, and cannot be others by then, as too few have ended.
///
/// Too many: of one connection, at two looks, or twice as many at once; of all those that last, then those of
/// the address that has most of them go; of all idle ones, the same. Thread: one at a time.
class StreamBudget {
 public:
  using Id = std::uint64_t;
  struct Limits {
    /// What a client is told. gRPC 1.51 holds only those to it that acknowledge its settings.
    static constexpr int told = 2048;
    /// Of one connection. More than `told`: streams that have ended count until gRPC has let go of them.
    std::int64_t of_one = told + 1024;
    std::int64_t lasting = 3072;  ///< of all together
    std::int64_t idle = 8192;     ///< of all together: more than pass by where all clients are busy
  };
  /// What gRPC counts since a connection began, and the calls that are in progress there.
  struct Seen {
    std::int64_t started = 0, ended = 0, in_progress = 0;
  };
  /// A stream begins with a frame of so many bytes at least.
  static constexpr std::uint64_t least_bytes = 10;
  /// Between two looks at streams that last.
  static constexpr Duration lasts_for = std::chrono::milliseconds(200);
  /// gRPC may be in the midst of what it has read: what came shortly before a look is looked for once more.
  static constexpr Duration taken_in_after = std::chrono::milliseconds(100);
  /// What was seen before that says nothing any more.
  static constexpr Duration known_for = std::chrono::seconds(1);

  explicit StreamBudget(Limits limits) : limits_(limits) {}

  void enter(Id id, const std::string& address) { connections_[id].address = address; }
  /// How many it had open when it was looked at last.
  std::int64_t leave(Id id);
  /// All bytes since it began.
  void received(Id id, std::uint64_t bytes);
  /// Whom to ask gRPC about now; nobody while all together are few enough.
  [[nodiscard]] std::vector<Id> doubtful(TimePoint now) const;
  /// `unread`: bytes that gRPC has not read yet.
  void seen(Id id, const Seen& seen, std::uint64_t unread, TimePoint now);
  /// gRPC does not know it: not yet, or not any more. Others are asked about first then.
  void unknown(Id id, TimePoint now);
  /// Whom to cut off, and who is to leave then.
  [[nodiscard]] std::vector<Id> beyond(TimePoint now) const;

 private:
  struct Connection {
    std::string address;
    std::uint64_t bytes = 0, accounted = 0;  ///< received; and by then at the last look
    std::int64_t late = 0;                   ///< may have begun shortly before a look,
    TimePoint late_at{};                     ///< which was then
    TimePoint looked{};
    std::int64_t open = 0, idle = 0, lasting = 0;  ///< at the last look
    int crowded = 0;                               ///< looks in a row with more than `of_one`
    struct Sample {
      TimePoint at{};
      std::int64_t ended = 0, idle = 0;
    };
    std::optional<Sample> before;  ///< what `lasting` is told by
    [[nodiscard]] std::int64_t since_look() const {
      return static_cast<std::int64_t>((bytes - accounted) / least_bytes);
    }
    /// How many may have begun that no look has seen.
    [[nodiscard]] std::int64_t doubt(TimePoint now) const {
      return since_look() + (now - looked >= taken_in_after ? late : 0);
    }
  };
  using Measure = std::function<std::int64_t(const Connection&)>;
  /// Adds to `cut` until those that are left are no more than `most`, by `measure`.
  void shed(std::vector<Id>& cut, std::int64_t most, const Measure& measure) const;

  Limits limits_;
  std::map<Id, Connection> connections_;
};

}  // namespace axisd::transport
