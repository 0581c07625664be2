#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "buses/task.hpp"
#include "daemon/core/bus_access_scan.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/axis/drive_operations.hpp"
#include "devices/drive_access.hpp"

namespace axisd::core {

/// What the API can ask of the drives: hands it to the core thread, where each request is a sequence of its
/// axis, so that closing the machine ends it. Thread: any, from construction (before the core runs) to
/// destruction (after it ended).
class DriveAccessService final : public DriveAccess {
 public:
  /// `machine` and `clock` outlive it.
  DriveAccessService(Executor executor, Clock& clock, MachineCore& machine)
      : executor_(std::move(executor)), clock_(&clock), machine_(&machine) {}

  void drive_info(std::string axis, std::function<void(Result<DriveInfo>)> callback) override;
  void read_parameters(std::string axis, std::vector<std::uint32_t> addresses,
                       ValuesCallback callback) override;
  void write_parameters(std::string axis, std::vector<ParameterValue> values, Requester requester,
                        ValuesCallback callback) override;
  void save_parameters(std::string axis, Requester requester,
                       std::function<void(Result<void>)> callback) override;
  void restore_factory(std::string axis, Requester requester,
                       std::function<void(Result<std::string>)> callback) override;
  void read_segments(std::string axis, SegmentsCallback callback) override;
  void write_segments(std::string axis, SegmentSettings segments, Requester requester,
                      SegmentsCallback callback) override;
  std::shared_ptr<void> change_serial(std::string axis, SerialChange change, Requester requester,
                                      std::function<void(Result<SerialProgress>)> callback) override;

 private:
  using SerialCallback = std::function<void(Result<SerialProgress>)>;
  /// Runs `operation` on the axis as a sequence of the machine and calls back with its result. By reference:
  /// the sequence keeps the object that its coroutine is a member of.
  template <class T>
  void run_at_rest(std::string axis, Requester requester,
                   std::function<Task<Result<T>>(const DriveOperations&)> operation,
                   std::function<void(Result<T>)> callback, const char* name);
  /// The same for who may command the axis.
  template <class T>
  void run_leased(std::string axis, Requester requester,
                  std::function<Task<Result<T>>(const DriveOperations&)> operation,
                  std::function<void(Result<T>)> callback, const char* name);
  template <class T>
  void run(std::string axis, std::function<Task<Result<T>>(const DriveOperations&)> operation,
           std::function<void(Result<T>)> callback, const char* name);
  Task<> run_serial_change(Axis& axis, std::shared_ptr<void> in_use, Requester requester, SerialChange change,
                           std::weak_ptr<void> alive, SerialCallback tell);
  [[nodiscard]] Result<void> check_serial(const Axis& axis, const SerialChange& change) const;
  /// A search for the drive where it will be after its power cycle.
  [[nodiscard]] std::unique_ptr<NodeScan> look_for(const Axis& axis, const SerialChange& change,
                                                   const std::weak_ptr<void>& alive) const;
  /// Searches until it is there.
  Task<Result<void>> find_again(Axis& axis, SerialChange change, std::weak_ptr<void> alive);
  /// A drive that saves may be silent for seconds, and its line with it.
  [[nodiscard]] Result<void> check_bus_rests(const Axis& axis) const;
  [[nodiscard]] std::vector<std::uint8_t> others_on_bus(const Axis& axis) const;
  /// A call that changes something goes to the log; the audit is told by audited().
  [[nodiscard]] static std::shared_ptr<AuditedCall> begin(std::string_view rpc, const std::string& axis,
                                                          const Requester& requester, std::string text);
  /// Tells the audit of the call before anything else is done for it, and once more when it has ended; then
  /// calls back. What the call knows by then is told, too. Thread: any; the call is the core's from now on.
  template <class T>
  [[nodiscard]] std::function<void(Result<T>)> audited(const std::shared_ptr<AuditedCall>& call,
                                                       std::function<void(Result<T>)> callback);
  /// `error`: why it failed; nullptr: it did not.
  void end(AuditedCall& call, const Error* error);

  Executor executor_;
  Clock* clock_;
  MachineCore* machine_;
};

}  // namespace axisd::core
