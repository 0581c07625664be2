#pragma once

#include <grpcpp/security/credentials.h>

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "api/cell/disk.hpp"
#include "api/cell/event_feed.hpp"
#include "api/cell/machines.hpp"
#include "api/cell/registry_keeper.hpp"
#include "api/cell/settings.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// RegistryKeeper, where there is an etcd: its machines are told of, what becomes of it is an event, and what
/// was known last is kept on the disk. Thread: core.
class CellRegistry {
 public:
  struct Parts {
    Clock& clock;
    const Settings& settings;
    Machines& machines;
    Disk& disk;
    EventFeed& events;
  };
  /// All parts outlive this. `stop_all`: the key of StopAll, as it is now.
  CellRegistry(const boost::asio::any_io_executor& core, const Parts& parts,
               std::shared_ptr<grpc::ChannelCredentials> trusted,
               std::function<void(const etcd::Versioned&)> stop_all);

  /// What an earlier run knew, until etcd says anything. Blocks for the disk.
  void remember();
  void start();
  void trust(std::shared_ptr<grpc::ChannelCredentials> trusted);
  void offer(const kept::Registration& own);
  /// On the disk, where it is otherwise than there.
  void save();
  /// The registration goes. `done`: called at any rate.
  void give_back(std::function<void()> done);

  /// nullptr: there is no etcd.
  [[nodiscard]] RegistryKeeper* keeper() const { return keeper_.get(); }
  [[nodiscard]] v1::RegistryState state() const;
  /// When etcd was last heard of. Nothing: not since the start.
  [[nodiscard]] std::optional<TimePoint> last_heard() const;
  /// How it is, since when, and why.
  void describe(v1::GetCellResponse& response) const;

 private:
  void on_changed();
  void tell_conflict();

  const Parts parts_;
  std::unique_ptr<RegistryKeeper> keeper_;
  v1::RegistryState state_ = v1::REGISTRY_STATE_UNSPECIFIED;  ///< as it was told last
  TimePoint since_;
  std::string held_by_;  ///< who has this machine's name, as it was told last
  std::string saved_;
};

}  // namespace axisd::cell
