// StopAllMachine, with machines to tell, a disk, an etcd and the other entrances.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/cell/callers.hpp"
#include "api/cell/disk.hpp"
#include "api/cell/machines.hpp"
#include "api/cell/registry_keeper.hpp"
#include "api/cell/settings.hpp"
#include "api/cell/stop_all_machine.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// Thread: core.
class StopAllKeeper {
 public:
  struct Parts {
    Clock& clock;
    const Settings& settings;
    Machines& machines;
    RegistryKeeper* registry;  ///< nullptr: there is no etcd
    Disk& disk;
    /// What is told of it.
    std::function<void(v1::CellEvent)> tell;
    std::string instance_id;
  };
  /// All of them outlive this. Reads the file. Blocks for the disk.
  explicit StopAllKeeper(Parts parts);

  using Stopped = std::function<void(v1::StopAllResponse)>;
  /// Tells everybody at once; `done` when all have answered, or after about a second.
  void stop(const Caller& caller, const std::string& reason, Stopped done);
  using Released = std::function<void(v1::ReleaseStopAllResponse)>;
  /// For whoever may: first everybody who tells machines is to know of it, then each machine is asked.
  void release(const Caller& caller, Released done);
  /// What another entrance knows; what this one knows then.
  [[nodiscard]] v1::ExchangeStopAllResponse exchange(const v1::ExchangeStopAllRequest& request);

  /// Others are not told any more, and nothing is written.
  void end() {
    spreading_.reset();
    saving_.reset();
  }
  /// A machine has said who it is.
  void seen(const std::string& machine, const PeerAnswer& answer);
  /// The key in etcd is this now.
  void read(const etcd::Versioned& key);

  [[nodiscard]] const StopAllMachine& machine() const { return machine_; }
  /// Why it is not on the disk. Unset: it is.
  [[nodiscard]] const std::optional<Error>& not_durable() const { return not_durable_; }
  /// How often a machine was told again that had come back.
  [[nodiscard]] std::uint64_t told_again() const { return told_again_; }

 private:
  struct Stopping;
  struct Releasing;
  void tell_machine(const std::string& name, const std::shared_ptr<Stopping>& stopping,
                    const Metadata& metadata);
  void tell_again(const std::string& name, const std::string& instance_id);
  void release_machines(const std::shared_ptr<Releasing>& releasing);
  /// On the disk and in etcd; the answer says what came of it.
  template <class Answer>
  void keep(Answer& answer, const std::shared_ptr<Answer>& alive);
  [[nodiscard]] StopAllMachine::Merged merge(const etcd::Versioned& key);
  using Done = std::function<void(std::optional<axisd::v1::ErrorDetail>)>;
  /// On the disk.
  void save(Done done);
  /// The same within 100 ms, with what else comes until then.
  void save_soon();
  /// In etcd, together with what is there already.
  void share(Done done, int attempts = 4);
  /// With all other entrances that can be reached; `done` when all have answered.
  void spread(std::function<void()> done);
  void take_in(const StopAllMachine::Merged& merged);
  /// Those that answer and are wanted, where they were not told.
  void tell_if(const std::function<bool(const std::string& machine)>& wanted);
  void announce(v1::CellEventKind kind, const v1::StopAllLatch& latch, std::string text);
  void spread_now_and_then();

  Parts parts_;
  const std::string path_;
  StopAllMachine machine_;
  std::optional<Error> not_durable_;
  etcd::Versioned key_;
  std::uint64_t last_id_ = 0, told_again_ = 0;
  bool to_save_ = false;
  Clock::Timer spreading_, saving_;
};

}  // namespace axisd::cell
