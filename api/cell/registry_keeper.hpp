// RegistryMachine, with an etcd and a clock.
#pragma once

#include <grpcpp/security/credentials.h>

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <string>

#include "api/cell/etcd/client.hpp"
#include "api/cell/registry_machine.hpp"
#include "api/cell/settings.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// Thread: core.
class RegistryKeeper {
 public:
  struct Events {
    std::function<void()> changed;                         ///< something of machine() is otherwise
    std::function<void(const etcd::Versioned&)> stop_all;  ///< the key, as it is now
  };
  /// Precondition: the settings have an etcd.
  RegistryKeeper(boost::asio::any_io_executor core, Clock& clock, const Settings& settings,
                 std::shared_ptr<grpc::ChannelCredentials> trusted, Events events);

  void start() { carry_out(machine_.start(clock_.now())); }
  void trust(std::shared_ptr<grpc::ChannelCredentials> trusted) { client_.trust(std::move(trusted)); }
  void offer(const kept::Registration& own) { carry_out(machine_.offer(clock_.now(), own)); }
  /// The registration goes, so that others need not wait for it to expire. `done`: called at any rate.
  void give_back(std::function<void()> done);

  [[nodiscard]] const RegistryMachine& machine() const { return machine_; }
  [[nodiscard]] etcd::Client& client() { return client_; }

 private:
  [[nodiscard]] etcd::Client::Events from_etcd(std::function<void(const etcd::Versioned&)> stop_all);
  void carry_out(const RegistryMachine::Effects& effects);
  void carry_out(const RegistryMachine::Effect& effect);
  void settle();

  Clock& clock_;
  const Duration ttl_;
  const std::function<void()> changed_;
  RegistryMachine machine_;
  etcd::Client client_;
  std::uint64_t told_ = 0;
  Clock::Timer timer_;
};

}  // namespace axisd::cell
