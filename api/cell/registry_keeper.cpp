#include "api/cell/registry_keeper.hpp"

#include <utility>

namespace axisd::cell {
namespace {

RegistryMachine::Times times_for(Duration ttl) {
  RegistryMachine::Times times;
  times.keep_alive = ttl / 3;
  return times;
}

template <class... Functions>
struct Visitor : Functions... {
  using Functions::operator()...;
};

}  // namespace

RegistryKeeper::RegistryKeeper(boost::asio::any_io_executor core, Clock& clock, const Settings& settings,
                               std::shared_ptr<grpc::ChannelCredentials> trusted, Events events)
    : clock_(clock),
      ttl_(settings.etcd.ttl),
      changed_(std::move(events.changed)),
      machine_(settings.machine, settings.etcd.endpoints.size(), times_for(settings.etcd.ttl)),
      client_(std::move(core), settings.etcd.endpoints, std::move(trusted), settings.cell,
              from_etcd(std::move(events.stop_all))) {}

etcd::Client::Events RegistryKeeper::from_etcd(std::function<void(const etcd::Versioned&)> stop_all) {
  const auto now = [this] { return clock_.now(); };
  return {.listed =
              [this, now](std::vector<kept::Registration> machines) {
                RegistryMachine::Machines all;
                for (auto& each : machines) {
                  const auto name = each.name();
                  all.emplace(name, std::move(each));
                }
                carry_out(machine_.listed(now(), std::move(all)));
              },
          .changed =
              [this, now](const std::string& name, std::optional<kept::Registration> registration) {
                carry_out(machine_.changed(now(), name, std::move(registration)));
              },
          .stop_all = std::move(stop_all),
          .heard =
              [this, now] {
                machine_.heard(now());
                settle();
              },
          .granted = [this, now](std::int64_t lease) { carry_out(machine_.granted(now(), lease)); },
          .written = [this, now] { carry_out(machine_.written(now())); },
          .held = [this, now](const kept::Registration& holder) { carry_out(machine_.held(now(), holder)); },
          .kept_alive = [this, now](bool alive) { carry_out(machine_.kept_alive(now(), alive)); },
          .lost = [this, now](std::string why) { carry_out(machine_.lost(now(), std::move(why))); }};
}

void RegistryKeeper::carry_out(const RegistryMachine::Effects& effects) {
  for (const auto& effect : effects) carry_out(effect);
  settle();
}

void RegistryKeeper::carry_out(const RegistryMachine::Effect& effect) {
  std::visit(Visitor{[this](const RegistryMachine::Look& look) { client_.look(look.endpoint); },
                     [this](const RegistryMachine::Grant&) { client_.grant(ttl_); },
                     [this](const RegistryMachine::Write& write) { client_.write(write.lease, write.value); },
                     [this](const RegistryMachine::KeepAlive& lease) { client_.keep_alive(lease.lease); },
                     [this](const RegistryMachine::AskProgress&) { client_.ask_progress(); },
                     [this](const RegistryMachine::Leave&) { client_.leave(); }},
             effect);
}

void RegistryKeeper::settle() {
  if (machine_.state() == RegistryMachine::State::ended) return;
  timer_ = clock_.call_at(machine_.due(), [this] { carry_out(machine_.time(clock_.now())); });
  if (std::exchange(told_, machine_.revision()) != machine_.revision()) changed_();
}

void RegistryKeeper::give_back(std::function<void()> done) {
  const auto lease = machine_.lease();
  machine_.end();
  timer_.reset();
  client_.revoke(lease, std::move(done));
}

}  // namespace axisd::cell
