// By which way a drive's state comes: by the TPDOs that it sends, else by SDO.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "buses/canopen/canopen_bus.hpp"
#include "buses/signal.hpp"
#include "devices/cia402/state_pdos.hpp"

namespace axisd::cia402 {

/// Pure. Thread: core.
///
///   any               -- refuse() ---------------------------------> by_sdo
///   any               -- expect() ---------------------------------> by_pdo
///   by_pdo            -- miss(), the third in a row ----------------> missing
///   missing           -- polled() ---------------------------------> replaced
///   missing, replaced -- came() -----------------------------------> by_pdo
class StateWay {
 public:
  enum class State : std::uint8_t {
    by_sdo,    ///< the drive cannot send its state
    by_pdo,    ///< it sends it
    missing,   ///< it should, and does not
    replaced,  ///< and was asked by SDO instead
  };

  /// `why`: there are no TPDOs.
  void refuse(const std::string& why);
  /// It is configured to send them, and they are listened to.
  void expect();
  /// They made a reading in time.
  void came();
  /// None came in time.
  void miss();
  /// A reading by SDO came in place of them.
  void polled();

  [[nodiscard]] State state() const { return state_; }
  /// They are not waited for before they are seen again.
  [[nodiscard]] bool fails() const { return state_ == State::missing || state_ == State::replaced; }
  /// Drive::link_note().
  [[nodiscard]] const std::string& note() const { return note_; }

 private:
  State state_ = State::by_sdo;
  int missed_ = 0;  ///< in a row
  std::string note_;
};

/// Thread: core. Listens to the TPDOs of one drive.
class StateLink {
 public:
  /// Both outlive this. `news`: notified when there is a new reading.
  StateLink(canopen::CanopenBus& bus, Signal& news) : bus_(&bus), news_(&news) {}
  ~StateLink() { close(); }
  StateLink(const StateLink&) = delete;

  /// Listens to TPDOs of these identifiers, one for each of `layout`. False: one belongs to another node, and
  /// none is listened to.
  [[nodiscard]] bool listen(const Model& model, std::vector<canopen::PdoMapping> layout,
                            std::span<const std::uint32_t> ids, bool synchronous);
  /// Nothing is listened to any more, and nothing that came counts.
  void close();
  /// They are listened to, and the SYNC that they wait for runs.
  [[nodiscard]] bool can_come() const;

  [[nodiscard]] const StatePdos& pdos() const { return pdos_; }
  [[nodiscard]] StateWay& way() { return way_; }
  [[nodiscard]] const StateWay& way() const { return way_; }

 private:
  void on_pdo(std::size_t index, const can::ReceivedFrame& received);

  canopen::CanopenBus* bus_;
  Signal* news_;
  StatePdos pdos_;
  std::vector<std::uint32_t> subscribed_;
  std::shared_ptr<void> sync_;
  StateWay way_;
};

}  // namespace axisd::cia402
