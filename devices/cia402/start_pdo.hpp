// The RPDO by which a drive starts in one SYNC with others, as it has shown that it does (M22, M24).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "buses/gate.hpp"

namespace axisd::cia402 {

/// Pure. Thread: core. The control word that comes by it waits in the drive for a SYNC. That it does is
/// proven before anything is started by it.
///
///   any      -- refuse() ------------------------------> absent
///   any      -- configure() ---------------------------> unproven
///   unproven -- judge(), it does as CiA 301 says ------> proven
///   unproven -- judge(), it differs -------------------> disproven
///   unproven, proven -- forget() ----------------------> absent
///
/// Disproven outlives forget(): what such an RPDO was sent may act at any time, until it is configured anew.
class StartPdo {
 public:
  enum class State : std::uint8_t { absent, unproven, proven, disproven };
  /// One sequence at a time has NMT and what waits for a SYNC: the other would undo what it does.
  enum class Work : std::uint8_t { none, settling, proving };

  /// The drive has no such RPDO.
  void refuse(std::string why);
  /// `id`: its identifier.
  void configure(std::uint32_t id);
  /// Nothing of it was configured in this power cycle.
  void forget();
  /// It could not be shown yet. Nothing in other states than unproven.
  void note_obstacle(const std::string& why);
  /// `differs`: in what the drive is not as CiA 301 says; empty: in nothing that a start needs. Nothing in
  /// other states than unproven.
  void judge(std::string differs);

  [[nodiscard]] State state() const { return state_; }
  /// Takes the control word at the next SYNC. Nothing: there is none.
  [[nodiscard]] const std::optional<std::uint32_t>& id() const { return id_; }
  /// Why the drive does not start by SYNC; empty: it does.
  [[nodiscard]] const std::string& note() const { return note_; }

  /// Of a start that is prepared now, or shown: give_up() makes it old.
  [[nodiscard]] MotionGuard guard() const { return {.gate = gate_, .epoch = gate_->epoch()}; }
  /// Something else is begun, or may have happened to the drive.
  void give_up() { gate_->raise(); }
  /// Of those guards.
  [[nodiscard]] const AxisGate& gate() const { return *gate_; }

  void begin(Work work) { work_ = work; }
  void end_work() { work_ = Work::none; }
  [[nodiscard]] Work work() const { return work_; }

 private:
  State state_ = State::absent;
  std::optional<std::uint32_t> id_;
  std::string note_ = "it is not configured yet";
  Work work_ = Work::none;
  std::shared_ptr<AxisGate> gate_ = std::make_shared<AxisGate>();
};

}  // namespace axisd::cia402
