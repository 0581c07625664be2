#pragma once

#include <boost/smart_ptr/atomic_shared_ptr.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/modbus_rtu/node.hpp"
#include "buses/signal.hpp"
#include "buses/task.hpp"
#include "devices/bus_access.hpp"
#include "devices/generic/register_value.hpp"
#include "devices/generic/settings.hpp"

namespace axisd {

/// A node of the line that is not an axis: its registers are read at a steady rate, in class `parameters`,
/// and published (M28).
///
///   offline --all blocks answered--> online --no reply three times, or the port is lost--> offline
///
/// An exception of the device is an answer: it stays online, the registers of that block have no value and
/// the snapshot's error says which. Thread: core, except snapshot().
class ModbusDevice {
 public:
  /// `bus` and `clock` outlive it.
  ModbusDevice(Executor executor, Clock& clock, modbus_rtu::RtuBus& bus, DeviceSettings settings);
  ModbusDevice(const ModbusDevice&) = delete;

  /// Starts polling, once.
  void start();
  /// Ends polling; closed() comes true on the core thread.
  void close();
  [[nodiscard]] bool closed() const { return closing_ && !polling_; }

  /// Writes one register, or the two of a 32-bit value, and reads it back; the value as written. Errors:
  /// invalid_argument (no such register, or not writable), out_of_range, misconfigured (reads back
  /// otherwise), refused, no_reply (outcome unknown), bus_down.
  Task<Result<double>> write(std::string name, double value);

  [[nodiscard]] const DeviceSettings& settings() const { return settings_; }
  /// Thread: any.
  [[nodiscard]] DeviceSnapshotPtr snapshot() const { return snapshot_.load(); }

 private:
  Task<> run();
  Task<bool> port_is_open();
  Task<Result<void>> poll_once();
  Task<Result<void>> read_block(const RegisterBlock& block, TransactionClass urgency);
  void go_online(const Result<void>& polled);
  void go_offline(const Error& cause);
  void publish();
  [[nodiscard]] Error with_name(Error error) const;
  [[nodiscard]] Error unknown_register(std::string_view name) const;

  Executor executor_;
  Clock* clock_;
  modbus_rtu::Node node_;
  DeviceSettings settings_;
  std::vector<RegisterBlock> blocks_;
  Signal wake_;
  bool polling_ = false;
  bool closing_ = false;

  LinkState link_ = LinkState::offline;
  std::optional<Error> error_;
  std::vector<std::optional<double>> values_;
  TimePoint measured_at_{};
  boost::atomic_shared_ptr<const DeviceSnapshot> snapshot_;
};

}  // namespace axisd
