// StopAll of the cell: which stand, which machines have it, whom to tell. Pure.
//
// Each StopAll is a latch of its own, with an id. What entrances know of them is put together: a latch that
// one of them knows is known to all, and one that somebody released is released for all. So a release takes
// back what its entrance knew of, and never a stop that it had not heard of. It makes no difference in which
// order, or how often, they hear of each other.
//
// A machine, while a latch stands (each run of its axisd for itself):
//
//   untold --seen, not inhibited--> being told --it has latched--> told
//   untold --seen, inhibited------> told        --it failed------> untold
//   any ----another latch, or another run-----> untold
//
// Who is told is not told again by whoever told it: somebody who releases one machine by itself, with that
// machine's own release, has it for as long as its axisd runs.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "api/cell/kept.pb.h"

namespace axisd::cell {

/// Thread: core.
class StopAllMachine {
 public:
  using Latch = v1::StopAllLatch;
  /// How many are remembered. Beyond that the oldest of those that were released are forgotten: an entrance
  /// that still has one of those as standing would bring it back, which stops, and never starts.
  static constexpr std::size_t most = 128;

  /// Everybody is to be told. `id`: unique in the cell. Whoever asks again for the same reason gets the latch
  /// that stands, and so does everybody once there are too many of them.
  Latch stop(Latch latch);
  /// Those that stood.
  std::vector<Latch> release(const std::string& by, const google::protobuf::Timestamp& at);

  /// What somebody else knows.
  struct Merged {
    std::vector<Latch> began, ended;  ///< that this entrance did not know of
    bool other_lacks = false;         ///< this entrance knows something that the other does not
    [[nodiscard]] bool changed() const { return !began.empty() || !ended.empty(); }
  };
  [[nodiscard]] Merged merge(const google::protobuf::RepeatedPtrField<Latch>& others);

  [[nodiscard]] bool stands() const;
  [[nodiscard]] std::vector<Latch> standing() const;
  [[nodiscard]] kept::StopAllRecord record() const;
  /// The same, with whom was told: for the disk.
  [[nodiscard]] kept::StopAllRecord record_with_told() const;
  /// Of a file.
  void restore(const kept::StopAllRecord& record);

  /// A machine was seen, in this run of its axisd. True: it is to be told now.
  [[nodiscard]] bool seen(const std::string& machine, const std::string& instance_id, bool inhibited);
  /// Somebody tells it now, without being asked to by seen().
  void telling(const std::string& machine) { audience_[machine].being_told = true; }
  /// It has latched; it was not seen to. True: that is new.
  [[nodiscard]] bool told(const std::string& machine, const std::string& instance_id);
  void not_told(const std::string& machine);

 private:
  struct Audience {
    std::string told{};  ///< the run of its axisd that has latched; empty: none
    bool being_told = false;
  };
  void put(const Latch& latch, Merged& merged);
  void forget_oldest();

  std::map<std::string, Latch> latches_;  ///< by id
  std::map<std::string, Audience> audience_;
};

}  // namespace axisd::cell
