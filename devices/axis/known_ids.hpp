// Request ids of commands that have ended, in 20 bytes each: enough to tell a repeat, and what became of it.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "devices/axis/command.hpp"

namespace axisd {

/// An id is remembered for so long after it was last heard of, while its client has room for it ...
inline constexpr Duration remembered = std::chrono::minutes(30);
/// ... and for so long in any case. A request says until when it is valid, at most 10 minutes ahead, so that
/// what is repeated later than this, as it was, has expired.
inline constexpr Duration remembered_at_least = std::chrono::minutes(11);
static_assert(remembered > remembered_at_least && remembered_at_least > longest_validity);

/// One id. Its client and the run of the daemon are those of the IdRun that it lies in.
struct IdRecord {
  std::uint32_t key_high = 0, key_low = 0;  ///< hash of the request_id: one in 10^13 new ids hits another's
  std::uint32_t content = 0;                ///< hash of what was asked
  std::uint32_t number = 0;                 ///< the command's, its lowest bits
  std::uint16_t after_ms = 0;               ///< heard of so long after IdRun::begin
  std::uint8_t end = 0;                     ///< state, and outcome of the cause
  std::uint8_t reason = 0;                  ///< of the cause

  [[nodiscard]] std::uint64_t key() const { return std::uint64_t{key_high} << 32U | key_low; }
  bool operator==(const IdRecord&) const = default;
};
static_assert(sizeof(IdRecord) == 20);

/// Ids of one client, of commands of one run of the daemon, that were last heard of within a minute.
struct IdRun {
  std::string instance;           ///< what ids of commands of that run of the daemon begin with
  std::uint64_t last_number = 0;  ///< the highest of the commands
  TimePoint begin{}, newest{};    ///< when the first and the last were heard of
  std::vector<IdRecord> records;  ///< by key
};

/// A remembered id, in full, while it is put into a run.
struct EndedId {
  std::string_view request_id, digest;
  const Command* command = nullptr;  ///< ended
  TimePoint heard_of{};
};

/// By what an id and a content are known.
std::uint64_t hash_of(std::string_view text);
/// As few runs as hold these.
std::vector<IdRun> runs_of(std::vector<EndedId> ids);

/// The ids of one client. Thread: core.
class KnownIds {
 public:
  struct Found {
    Command command;  ///< what is known of it: id, state, cause in short, and when it was last heard of
    TimePoint heard_of{};
    bool same_content = false;
  };
  [[nodiscard]] std::optional<Found> find(std::string_view request_id, std::string_view digest) const;
  void add(IdRun run);
  /// Of runs that were last heard of before `then` the oldest one. How many ids that were; 0: there is none.
  std::size_t forget_one(TimePoint then);
  [[nodiscard]] std::size_t size() const { return size_; }
  /// When the ids that are forgotten next were last heard of; nothing: there are none.
  [[nodiscard]] std::optional<TimePoint> oldest() const;
  /// In the order in which they are forgotten; tests.
  [[nodiscard]] const std::deque<IdRun>& runs() const { return runs_; }

 private:
  std::deque<IdRun> runs_;
  std::size_t size_ = 0;
};

}  // namespace axisd
