#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "config/configuration.hpp"
#include "devices/axis/axis.hpp"
#include "devices/axis/command_book.hpp"
#include "devices/machine.hpp"
#include "devices/persistence.hpp"

namespace axisd::core {

/// What a machine is built from; tests hand in virtual time and a virtual wire.
struct MachineParts {
  Executor executor;
  Clock* clock = nullptr;
  Persistence* persistence = nullptr;  ///< may be null: nothing is kept
  std::string instance_id;
  std::function<std::unique_ptr<modbus_rtu::Line>(const modbus_rtu::LineSettings&)> make_line;
  modbus_rtu::ExchangeObserver observer;
  std::function<void()> published;
};

/// All buses and axes of one machine. Thread: core.
class MachineCore {
 public:
  MachineCore(MachineParts parts, const config::Configuration& configuration);
  ~MachineCore();
  MachineCore(const MachineCore&) = delete;

  /// Opens the buses and connects the axes. Moves nothing.
  void start();

  [[nodiscard]] Axis* find(std::string_view axis) const;
  [[nodiscard]] const std::vector<std::unique_ptr<Axis>>& axes() const { return axes_; }
  [[nodiscard]] const std::vector<std::unique_ptr<modbus_rtu::RtuBus>>& buses() const { return buses_; }
  [[nodiscard]] CommandBook& book() { return book_; }

  Result<CommandPtr> submit(const std::string& axis, const Action& action, const CommandOptions& options);
  /// Latches the inhibit first, then stops every axis, moving ones first (M14).
  std::vector<Result<CommandPtr>> stop_all(const std::string& client);
  /// Ends the inhibit once that is durable.
  void release_inhibit(const std::string& client, std::function<void(Result<void>)> done);
  /// Who latched the inhibit, or nullptr. Thread: any.
  [[nodiscard]] boost::shared_ptr<const std::string> inhibited_by() const { return inhibited_by_.load(); }
  /// Halts what moves, for the end of the daemon.
  void stop_moving_axes();
  [[nodiscard]] bool at_rest() const;
  [[nodiscard]] std::vector<BusStatus> bus_status() const;
  /// Ends all sequences; then closed() comes true and the machine can be destroyed. Moves nothing.
  void close();
  [[nodiscard]] bool closed() const;
  /// Every bus is open, or it is known why not.
  [[nodiscard]] bool buses_reported() const;

 private:
  void set_inhibit(bool inhibited, const std::string& by);

  MachineParts parts_;
  CommandBook book_;
  bool inhibited_ = false;
  int latches_ = 0;  ///< StopAlls so far
  boost::atomic_shared_ptr<const std::string> inhibited_by_;
  std::vector<std::unique_ptr<modbus_rtu::RtuBus>> buses_;
  std::vector<std::unique_ptr<Axis>> axes_;
  std::map<std::string, Axis*, std::less<>> by_name_;
};

}  // namespace axisd::core
