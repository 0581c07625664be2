// The core of axisd-cell: all of its state.
#pragma once

#include <grpcpp/security/credentials.h>

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>

#include "api/cell/callers.hpp"
#include "api/cell/cell_registry.hpp"
#include "api/cell/clock_watch.hpp"
#include "api/cell/disk.hpp"
#include "api/cell/event_feed.hpp"
#include "api/cell/group_moves.hpp"
#include "api/cell/machine_feed.hpp"
#include "api/cell/machines.hpp"
#include "api/cell/metrics.hpp"
#include "api/cell/open_calls.hpp"
#include "api/cell/own_machine.hpp"
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
  void watch_machines(const std::shared_ptr<CoreStream<v1::WatchMachinesResponse>>& stream) {
    watched_.watch(stream);
  }
  void watch_events(const std::shared_ptr<CoreStream<v1::WatchEventsResponse>>& stream,
                    const v1::WatchEventsRequest& request) {
    events_.watch(stream, request);
  }
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
  [[nodiscard]] EventFeed& events() { return events_; }
  /// For a scrape.
  [[nodiscard]] Reading reading() const;

 private:
  void on_changed(const Roster::Change& change);
  void on_answered(const std::string& name, const PeerAnswer& answer);

  boost::asio::io_context& io_;
  Clock& clock_;
  const Settings& settings_;
  const Identity identity_;
  RouteTable& routes_;
  OpenCalls& calls_;
  Disk disk_;
  EventFeed events_;
  Machines machines_;
  MachineFeed watched_;
  ClockWatch clocks_;
  CellRegistry registry_;
  OwnMachine own_;
  StopAllKeeper stop_all_;
  GroupMoves group_moves_;
  Reading::Lives lives_;
};

}  // namespace axisd::cell
