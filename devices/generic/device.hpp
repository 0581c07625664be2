#pragma once

#include <boost/smart_ptr/atomic_shared_ptr.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/bus.hpp"
#include "buses/clock.hpp"
#include "buses/signal.hpp"
#include "buses/task.hpp"
#include "devices/bus_access.hpp"
#include "devices/generic/settings.hpp"

namespace axisd {

/// The part of a device that every thread may use; it outlives the device for whoever holds it. Thread: any.
struct DeviceFace {
  boost::atomic_shared_ptr<const DeviceSnapshot> snapshot;  ///< not null
};
using DeviceFacePtr = std::shared_ptr<DeviceFace>;

/// A node of a bus that is not an axis: its values are read at a steady rate, in class `parameters`, and
/// published (M28).
///
///   offline --it answered all reads--> online --no reply three times, or the port is lost--> offline
///
/// A refusal by the device is an answer: it stays online, what was refused has no value and the snapshot's
/// error says which. Thread: core, except snapshot().
class Device {
 public:
  /// `bus` and `clock` outlive it.
  Device(Executor executor, Clock& clock, Bus& bus, DeviceSettings settings);
  virtual ~Device() = default;
  Device(const Device&) = delete;

  /// Starts polling, once.
  void start();
  /// Ends polling; closed() comes true on the core thread.
  void close();
  [[nodiscard]] bool closed() const { return closing_ && !polling_; }
  /// Whoever writes to it holds this meanwhile.
  [[nodiscard]] std::shared_ptr<void> use() { return users_; }
  [[nodiscard]] bool in_use() const { return users_.use_count() > 1; }
  [[nodiscard]] bool closing() const { return closing_; }

  /// Writes one value and reads it back; the value as written. Errors: invalid_argument (no such value, or
  /// not writable), out_of_range, misconfigured (reads back otherwise), no_reply (outcome unknown), bus_down,
  /// and what the device refuses with.
  Task<Result<double>> write(std::string name, double value);

  [[nodiscard]] const DeviceSettings& settings() const { return settings_; }
  /// Thread: any.
  [[nodiscard]] DeviceSnapshotPtr snapshot() const { return face_->snapshot.load(); }
  /// Thread: any.
  [[nodiscard]] DeviceFacePtr face() const { return face_; }

 protected:
  /// A raw number as it was read.
  struct Reading {
    std::uint32_t raw = 0;
    TimePoint at{};
  };
  /// Reads everything and keeps it; the first refusal is returned at the end, any other failure at once.
  virtual Task<Result<void>> poll_once() = 0;
  /// Writes the value with this index, with one attempt.
  virtual Task<Result<void>> write_raw(std::size_t index, std::uint32_t raw) = 0;
  virtual Task<Result<Reading>> read_raw(std::size_t index) = 0;

  [[nodiscard]] TransactionClass poll_class() const;
  void keep(std::size_t index, const Reading& reading);
  /// The device refuses to tell.
  void forget(std::size_t index) { values_[index].reset(); }
  [[nodiscard]] Error with_name(Error error) const;
  /// It came from the device: the device is there.
  [[nodiscard]] static bool is_answer(const Error& error) { return error.outcome == Outcome::refused; }

 private:
  Task<> run();
  Task<bool> port_is_open();
  void go_online(const Result<void>& polled);
  void go_offline(const Error& cause);
  void publish();
  [[nodiscard]] Error unknown_value(std::string_view name) const;

  Executor executor_;
  Clock* clock_;
  Bus* bus_;
  DeviceSettings settings_;
  Signal wake_;
  std::shared_ptr<int> users_ = std::make_shared<int>();
  bool polling_ = false;
  bool closing_ = false;

  LinkState link_ = LinkState::offline;
  std::optional<Error> error_;
  std::vector<std::optional<double>> values_;
  TimePoint measured_at_{};
  const std::shared_ptr<DeviceFace> face_ = std::make_shared<DeviceFace>();
};

}  // namespace axisd
