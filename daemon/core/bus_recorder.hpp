#pragma once

#include <functional>
#include <string>

#include "buses/bus_load.hpp"
#include "buses/frame_ring.hpp"
#include "buses/modbus_rtu/rtu_bus.hpp"
#include "daemon/core/observed_port.hpp"

namespace axisd::core {

/// Told each frame of every bus, as it was recorded; must not wait. Thread: core.
using FrameObserver = std::function<void(const std::string& bus, const TracedFrame& frame)>;

/// Sees everything that goes over one bus, or does not: keeps the newest of it for traces and flight records,
/// and tells an observer. Thread: core.
class BusRecorder {
 public:
  /// `memory`: bytes that the frames may take. `bit_rate`: of a CAN network, for its load. `clock` outlives
  /// it.
  BusRecorder(std::string bus, std::size_t memory, int bit_rate, const Clock& clock, FrameObserver observer);
  BusRecorder(const BusRecorder&) = delete;

  /// Of an RS-485 line. What they give must not outlive this.
  [[nodiscard]] modbus_rtu::ExchangeObserver exchange_observer();
  /// Of a CAN network.
  [[nodiscard]] NetworkObserver network_observer();

  [[nodiscard]] const std::string& bus() const { return bus_; }
  [[nodiscard]] const FrameRing& frames() const { return frames_; }
  /// Of a CAN network: each frame with as many stuff bits as it may have at most.
  [[nodiscard]] const BusLoad& network_load() const { return load_; }

 private:
  void on_exchange(const modbus_rtu::Transaction& transaction, const modbus_rtu::ExchangeResult& result);
  void on_sent(const can::Frame& frame, TransactionClass transaction_class, const can::SendResult& result,
               TimePoint at);
  void on_received(const can::ReceivedFrame& received);
  void occupy(const can::Frame& frame, TimePoint end);
  void record(const TracedFrame& frame);

  std::string bus_;
  int bit_rate_;
  FrameRing frames_;
  BusLoad load_;
  FrameObserver observer_;
};

}  // namespace axisd::core
