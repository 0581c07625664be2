// The core of axisd-cell: all of its state.
#pragma once

#include <grpcpp/security/credentials.h>

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "api/cell/callers.hpp"
#include "api/cell/clock_watch.hpp"
#include "api/cell/core_stream.hpp"
#include "api/cell/disk.hpp"
#include "api/cell/event_log.hpp"
#include "api/cell/group_moves.hpp"
#include "api/cell/machines.hpp"
#include "api/cell/metrics.hpp"
#include "api/cell/open_calls.hpp"
#include "api/cell/registry_keeper.hpp"
#include "api/cell/routes.hpp"
#include "api/cell/settings.hpp"
#include "api/cell/stop_all_keeper.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// What certificates a process connects with.
struct Trust {
  std::shared_ptr<grpc::ChannelCredentials> machines, etcd;
};

/// Thread: core, which runs `io`.
class Cell {
 public:
  struct Identity {
    std::string instance_id, machine_id;
  };
  /// `settings`, `routes` and `calls` outlive this. Reads files. Blocks for the disk.
  Cell(boost::asio::io_context& io, Clock& clock, const Settings& settings, Trust trust, Identity identity,
       RouteTable& routes, OpenCalls& calls);
  ~Cell();
  Cell(const Cell&) = delete;

  void start();
  /// With other certificates, from now on.
  void trust(const Trust& trust);
  /// Streams end, and the registration is given back. `done`: within a second or so.
  void end(std::function<void()> done);

  // What CellService asks for.
  [[nodiscard]] v1::GetCellResponse get(const Caller& caller) const;
  [[nodiscard]] v1::ListMachinesResponse list() const;
  [[nodiscard]] v1::GetClockResponse read_clock() const;
  void watch_machines(const std::shared_ptr<CoreStream<v1::WatchMachinesResponse>>& stream);
  void watch_events(const std::shared_ptr<CoreStream<v1::WatchEventsResponse>>& stream,
                    const v1::WatchEventsRequest& request);
  void stop_all(const Caller& caller, const std::string& reason, StopAllKeeper::Stopped done) {
    stop_all_.stop(caller, reason, std::move(done));
  }
  /// Whether the axisd beside this entrance says that the caller is a maintainer.
  void release_stop_all(const Caller& caller,
                        std::function<void(const grpc::Status&, const v1::ReleaseStopAllResponse&)> done);
  void move_group(const Caller& caller, const v1::MoveGroupRequest& request, TimePoint start_by,
                  GroupMoves::Answer answer) {
    group_moves_.move(caller, request, start_by, std::move(answer));
  }
  [[nodiscard]] v1::ExchangeStopAllResponse exchange(const v1::ExchangeStopAllRequest& request) {
    return stop_all_.exchange(request);
  }

  [[nodiscard]] boost::asio::any_io_executor executor() { return io_.get_executor(); }
  [[nodiscard]] Disk& disk() { return disk_; }
  /// For a scrape.
  [[nodiscard]] Reading reading() const;

 private:
  void tell(v1::CellEvent event);
  void on_changed(const Roster::Change& change);
  void on_touched(const std::set<std::string>& names);
  void on_answered(const std::string& name, const PeerAnswer& answer);
  void on_registry();
  [[nodiscard]] v1::RegistryState registry_state() const;
  /// What this machine registers as, as its axisd says.
  void look_at_own();
  void offer();
  void remember();
  void save_registry();

  boost::asio::io_context& io_;
  Clock& clock_;
  const Settings& settings_;
  const Identity identity_;
  RouteTable& routes_;
  OpenCalls& calls_;
  Disk disk_;
  EventLog events_;
  Machines machines_;
  ClockWatch clocks_;
  std::unique_ptr<RegistryKeeper> registry_;  ///< nullptr: without etcd
  StopAllKeeper stop_all_;
  GroupMoves group_moves_;
  CoreStreams<v1::WatchMachinesResponse> watchers_;
  CoreStreams<v1::WatchEventsResponse> event_readers_;
  /// Counts changes of machines; of each machine, and of each that is forgotten, the last one.
  std::uint64_t changes_ = 0;
  std::map<std::string, std::uint64_t> changed_at_;
  kept::Registration own_;
  std::string own_instance_;  ///< the run of the own axisd that own_ is of
  v1::RegistryState registry_was_ = v1::REGISTRY_STATE_UNSPECIFIED;
  TimePoint registry_since_;
  std::string held_by_;  ///< who has this machine's name, as it was told last
  std::string saved_registry_;
  Reading::Lives lives_;
  Clock::Timer own_timer_;
  std::shared_ptr<int> alive_ = std::make_shared<int>();
};

}  // namespace axisd::cell
