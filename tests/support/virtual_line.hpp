// An RS-485 line in virtual time: the slot and the silences of the real worker, simulated drives behind them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "buses/modbus_rtu/line.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "devices/simulation/rtu_network.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

struct WireEntry {
  TimePoint begin;  ///< first byte of the request
  TimePoint end{};  ///< last byte on the wire because of it, or the end of the wait
  std::vector<std::uint8_t> request;
  modbus_rtu::ExchangeStatus status;
  modbus_rtu::SerialSettings serial{};  ///< of the line, while this was on it
  [[nodiscard]] std::uint8_t node() const { return request.at(0); }
  [[nodiscard]] std::uint8_t function() const { return request.at(1); }
  [[nodiscard]] std::uint16_t address() const {
    return static_cast<std::uint16_t>(request.at(2) << 8U | request.at(3));
  }
  [[nodiscard]] bool is_write() const { return function() != 0x03; }
  /// Value of a write of one register.
  [[nodiscard]] std::uint16_t value() const {
    return static_cast<std::uint16_t>(request.at(4) << 8U | request.at(5));
  }
  /// Of a write of several registers.
  [[nodiscard]] std::vector<std::uint16_t> block() const {
    std::vector<std::uint16_t> values;
    for (std::size_t i = 7; i + 3 < request.size(); i += 2)
      values.push_back(static_cast<std::uint16_t>(request[i] << 8U | request[i + 1]));
    return values;
  }
};

/// A reply that comes after its wait has ended is still heard: by the exchange that is waiting then, as on a
/// real line.
class VirtualLine final : public modbus_rtu::Line {
 public:
  VirtualLine(VirtualWorld& world, modbus_rtu::LineSettings settings);

  simulation::RtuNetwork& network() { return network_; }
  /// Every request that went over the wire.
  [[nodiscard]] const std::vector<WireEntry>& wire() const { return wire_; }
  void forget_wire() { wire_.clear(); }
  /// Called at the bind of each frame, before its first byte.
  void set_on_bind(std::function<void(const WireEntry&)> on_bind) { on_bind_ = std::move(on_bind); }
  /// What the adapter can do; everything if unset.
  void set_can_do(std::function<bool(const modbus_rtu::SerialSettings&)> can_do) {
    can_do_ = std::move(can_do);
  }
  /// Plugs the adapter in or out.
  void set_open(bool open);

  void start(ResultHandler on_result, PortHandler on_port) override;
  void arm(const modbus_rtu::Exchange& exchange) override;
  std::optional<std::span<const modbus_rtu::ExchangeResult>> revoke() override;
  void cut_wait() override;
  [[nodiscard]] TimePoint last_progress() const override { return world_->now(); }

 private:
  [[nodiscard]] TimePoint earliest_begin() const;
  void bind();
  bool use(const modbus_rtu::SerialSettings& serial);
  void request_sent();
  void await_cut();
  [[nodiscard]] bool reply_has_begun() const;
  void arrive(TimePoint when, std::span<const std::uint8_t> bytes, TimePoint busy_until);
  void hear(std::span<const std::uint8_t> bytes);
  void end(modbus_rtu::ExchangeStatus status, Verdict verdict = Verdict::send);
  void await_bind();

  VirtualWorld* world_;
  modbus_rtu::LineSettings settings_;
  modbus_rtu::SerialSettings serial_;  ///< as the port is set now
  std::function<bool(const modbus_rtu::SerialSettings&)> can_do_;
  simulation::RtuNetwork network_;
  ResultHandler on_result_;
  PortHandler on_port_;
  bool open_ = true;
  const modbus_rtu::Exchange* armed_ = nullptr;
  const modbus_rtu::Exchange* under_way_ = nullptr;
  modbus_rtu::ExchangeResult result_;
  std::vector<modbus_rtu::ExchangeResult> results_, told_;  ///< of a round
  bool revoked_ = false;
  bool reply_coming_ = false;
  bool cut_wanted_ = false;  ///< of what is armed or under way
  TimePoint quiet_since_{};
  TimePoint last_reply_end_{};
  Clock::Timer timer_, cut_timer_;
  std::map<std::uint64_t, Clock::Timer> arrivals_;
  std::uint64_t last_arrival_ = 0;
  std::function<void(const WireEntry&)> on_bind_;
  std::vector<WireEntry> wire_;
};

}  // namespace axisd::test
