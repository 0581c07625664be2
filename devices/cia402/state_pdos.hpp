// Puts together the TPDOs that tell a drive's state.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "buses/canopen/pdo.hpp"
#include "buses/clock.hpp"
#include "devices/cia402/encoding.hpp"

namespace axisd::cia402 {

/// One coherent look at the drive.
struct Reading {
  Values values;
  TimePoint asked_at{};     ///< everything is at least this fresh
  TimePoint measured_at{};  ///< the last of it had come
};

/// Pure. With SYNC a reading is what came between two SYNCs, and as old as the first of them; by event it is
/// the newest PDO of each, and as old as the oldest of them.
///
/// A drive may need longer than a period. It then completes each cycle with what the SYNC before asked for,
/// which shows only once: the first cycle that is so ends incomplete. From then on all readings count as one
/// period older, until it sends twice within a cycle, because it has caught up.
class StatePdos {
 public:
  /// Signs are those of `model`'s dictionary, which outlives this.
  void begin(const Model& model, std::vector<canopen::PdoMapping> layout, bool synchronous);
  void on_sync(TimePoint at);
  /// `begin`: of its frame on the wire, `end` likewise. PDOs that are too short are ignored. True: there is a
  /// new reading.
  [[nodiscard]] bool on_pdo(std::size_t index, std::span<const std::uint8_t> bytes, TimePoint begin,
                            TimePoint end);
  /// The newest reading, if it is no older than `since`.
  [[nodiscard]] std::optional<Reading> since(TimePoint since) const;

  [[nodiscard]] bool synchronous() const { return synchronous_; }
  /// Its PDOs answer the SYNC before the last.
  [[nodiscard]] bool late() const { return late_; }
  [[nodiscard]] const std::vector<canopen::PdoMapping>& layout() const { return layout_; }

 private:
  struct Part {
    std::vector<std::uint64_t> values;
    TimePoint begin{}, end{};
    bool there = false;
  };
  [[nodiscard]] bool complete() const;
  void assemble(TimePoint asked_at);

  const Model* model_ = nullptr;
  std::vector<canopen::PdoMapping> layout_;
  bool synchronous_ = false;
  std::vector<Part> parts_;
  std::optional<TimePoint> sync_, previous_sync_;
  bool late_ = false;
  std::optional<Reading> newest_;
};

}  // namespace axisd::cia402
