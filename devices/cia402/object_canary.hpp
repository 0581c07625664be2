// The canary of a drive whose motion block is several objects, written one after the other (M6, M7).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "devices/canary.hpp"
#include "devices/cia402/encoding.hpp"
#include "devices/drive.hpp"

namespace axisd::cia402 {

/// Pure. Thread: core.
///
///   any   -- expect_marks() ---------------------------------> marks
///   any   -- found(), written() -----------------------------> block
///   block -- note_write(), its reply was lost ---------------> either
///   block -- note_write(), it is as after a power-up now ----> nothing
///   any   -- rewrite(), distrust() of all that it may hold --> marks, or nothing
///   any   -- forget() ---------------------------------------> nothing
///
/// Contents that a power-up may leave are no canary: they are kept out of what is written, and of what
/// counts.
class ObjectCanary {
 public:
  enum class State : std::uint8_t {
    nothing,  ///< the drive has to be configured
    marks,    ///< of an earlier run of the daemon: one of them
    block,    ///< this one
    either,   ///< one of several
  };
  enum class Written : std::uint8_t { yes, no, unknown };

  /// `factory`: what a power-up leaves of a drive as the factory sent it.
  explicit ObjectCanary(const MotionBlock& factory) : blocks_(factory) {}

  [[nodiscard]] State state() const;
  /// A drive that holds something else has lost its memory.
  [[nodiscard]] bool expects_anything() const { return state() != State::nothing; }
  [[nodiscard]] bool is_expected(const MotionBlock& block) const;
  /// Contents that the drive may hold, the oldest first; none: not known, or known by marks alone.
  [[nodiscard]] std::span<const MotionBlock> blocks() const { return blocks_.blocks(); }
  /// It holds this one, as far as anything is known.
  [[nodiscard]] bool is(const MotionBlock& block) const { return blocks_.is(block); }

  /// All of it was read, and is_expected(). `foreign_writes`: of other masters, until it was asked for.
  void found(const MotionBlock& block, std::uint64_t foreign_writes);
  /// Another master has written to the node since found().
  [[nodiscard]] bool may_be_foreign(std::uint64_t foreign_writes) const {
    return foreign_writes != foreign_writes_;
  }
  /// One object of state `block` was to be changed.
  void note_write(const MotionBlock& before, const MotionBlock& after, Written written);
  void written(const MotionBlock& block);
  /// It is written anew, whatever stands there. Marks stay until that is done.
  void rewrite() { blocks_.forget(); }
  void forget();
  void expect_marks(std::vector<ContinuityMark> marks);

  /// As of Canary.
  void note_power_up(const MotionBlock& block) { blocks_.note_power_up(block); }
  void distrust(const MotionBlock& block) { blocks_.distrust(block); }
  /// A block like it that no power-up leaves.
  [[nodiscard]] MotionBlock distinct(const MotionBlock& block) const {
    return blocks_.distinct(block, acceleration);
  }
  /// The fewest of `objects` whose contents tell the block from each that a power-up may leave.
  [[nodiscard]] std::vector<MotionObject> telling(const MotionBlock& block,
                                                  const std::vector<MotionObject>& objects) const;

  /// What is kept on the disk. Nothing: it is not known well enough.
  [[nodiscard]] std::optional<ContinuityMark> mark() const;
  /// Of all contents from now until `block` is written, one object after the other.
  [[nodiscard]] std::vector<ContinuityMark> marks_until(const MotionBlock& block) const;

 private:
  Canary<MotionBlock> blocks_;
  std::vector<ContinuityMark> marks_;
  std::uint64_t foreign_writes_ = 0;
};

}  // namespace axisd::cia402
