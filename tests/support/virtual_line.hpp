// An RS-485 line in virtual time: the slot and the silences of the real worker, simulated drives behind them.
#pragma once

#include <vector>

#include "buses/modbus_rtu/line.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "devices/simulation/rtu_network.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

struct WireEntry {
  TimePoint begin;  ///< first byte of the request
  std::vector<std::uint8_t> request;
  modbus_rtu::ExchangeStatus status;
  [[nodiscard]] std::uint8_t node() const { return request.at(0); }
  [[nodiscard]] std::uint8_t function() const { return request.at(1); }
  [[nodiscard]] std::uint16_t address() const {
    return static_cast<std::uint16_t>(request.at(2) << 8U | request.at(3));
  }
  /// Value of a write of one register.
  [[nodiscard]] std::uint16_t value() const {
    return static_cast<std::uint16_t>(request.at(4) << 8U | request.at(5));
  }
};

class VirtualLine final : public modbus_rtu::Line {
 public:
  VirtualLine(VirtualWorld& world, modbus_rtu::LineSettings settings);

  simulation::RtuNetwork& network() { return network_; }
  /// Every request that went over the wire.
  [[nodiscard]] const std::vector<WireEntry>& wire() const { return wire_; }
  void forget_wire() { wire_.clear(); }
  /// Plugs the adapter in or out.
  void set_open(bool open);

  void start(ResultHandler on_result, PortHandler on_port) override;
  void arm(const modbus_rtu::Exchange& exchange) override;
  bool revoke() override;
  void cut_wait() override;
  [[nodiscard]] TimePoint last_progress() const override { return world_->now(); }

 private:
  void bind();
  void request_sent();
  void end(modbus_rtu::ExchangeStatus status, Verdict verdict = Verdict::send);

  VirtualWorld* world_;
  modbus_rtu::LineSettings settings_;
  simulation::RtuNetwork network_;
  ResultHandler on_result_;
  PortHandler on_port_;
  bool open_ = true;
  const modbus_rtu::Exchange* armed_ = nullptr;
  const modbus_rtu::Exchange* under_way_ = nullptr;
  modbus_rtu::ExchangeResult result_;
  std::vector<std::uint8_t> reply_bytes_;
  bool reply_coming_ = false;
  TimePoint quiet_since_{};
  Clock::Timer timer_, cut_timer_;
  std::vector<WireEntry> wire_;
};

}  // namespace axisd::test
