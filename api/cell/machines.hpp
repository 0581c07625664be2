// All machines of the cell, each with its connections: who answers, and where calls may go.
#pragma once

#include <grpcpp/security/credentials.h>

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "api/cell/machine_link.hpp"
#include "api/cell/roster.hpp"
#include "api/cell/routes.hpp"
#include "api/cell/settings.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// Thread: core.
class Machines {
 public:
  struct Events {
    std::function<void(const Roster::Change&)> changed;
    /// Otherwise than before, in whatever; after changed.
    std::function<void(const std::set<std::string>& names)> touched;
    std::function<void(const std::string& name, const PeerAnswer&)> answered;
  };
  /// `settings` and `routes` outlive this.
  Machines(boost::asio::any_io_executor core, Clock& clock, const Settings& settings,
           std::shared_ptr<grpc::ChannelCredentials> trusted, RouteTable& routes, Events events);

  /// From now on they are asked.
  void start() { tick(); }
  /// Nobody is asked any more.
  void end() { timer_.reset(); }
  void remember(const kept::Registry& registry);
  void set_registered(const std::map<std::string, kept::Registration, std::less<>>& machines);
  void set_own(const kept::Registration& own);
  /// With other certificates: everything is connected anew.
  void trust(std::shared_ptr<grpc::ChannelCredentials> trusted);

  [[nodiscard]] const Roster& roster() const { return roster_; }
  /// nullptr: there is no such machine.
  [[nodiscard]] MachineLink* link(const std::string& name);
  [[nodiscard]] v1::Machine machine(const std::string& name) const { return roster_.machine(name, clock_); }
  [[nodiscard]] const std::map<std::string, std::shared_ptr<RouteTally>>& tallies() const { return tallies_; }

 private:
  void tick();
  /// True: its connection is another one now, or none.
  [[nodiscard]] bool look_after(const std::string& name, Roster::Entry& entry, TimePoint now);
  void ask(const std::string& name, MachineLink& link, bool anew);
  void on_answer(const std::string& name, const MachineLink::Answer& answer);
  [[nodiscard]] Addresses addresses_of(const std::string& name, const Roster::Entry& entry) const;
  /// Connections are as the roster is, and everybody is told what has changed.
  void settle();
  void publish();

  boost::asio::any_io_executor core_;
  Clock& clock_;
  const Settings& settings_;
  std::shared_ptr<grpc::ChannelCredentials> trusted_;
  RouteTable& routes_;
  const Events events_;
  Roster roster_;
  std::map<std::string, MachineLink> links_;
  std::map<std::string, std::shared_ptr<RouteTally>> tallies_;
  Clock::Timer timer_;
  int ticks_ = 0;
};

}  // namespace axisd::cell
