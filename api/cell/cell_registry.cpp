#include "api/cell/cell_registry.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "api/cell/kept_file.hpp"
#include "api/cell/status.hpp"
#include "buses/limited_log.hpp"

namespace axisd::cell {

CellRegistry::CellRegistry(const boost::asio::any_io_executor& core, const Parts& parts,
                           std::shared_ptr<grpc::ChannelCredentials> trusted,
                           std::function<void(const etcd::Versioned&)> stop_all)
    : parts_(parts),
      keeper_(
          parts.settings.etcd.endpoints.empty()
              ? nullptr
              : std::make_unique<RegistryKeeper>(core, parts.clock, parts.settings, std::move(trusted),
                                                 RegistryKeeper::Events{.changed = [this] { on_changed(); },
                                                                        .stop_all = std::move(stop_all)})),
      since_(parts.clock.now()) {}

void CellRegistry::remember() {
  if (!keeper_) return;
  const auto read = read_kept(parts_.settings.state + "/registry");
  if (!read) {
    spdlog::error("{}; machines are known again as soon as etcd answers", to_string(read.error()));
    v1::CellEvent event;
    event.set_kind(v1::CELL_EVENT_KIND_REGISTRY);
    event.set_text(to_string(read.error()));
    parts_.events.tell(std::move(event));
    return;
  }
  kept::Registry registry;
  if (!*read || !registry.ParseFromString(**read)) return;
  kept::Registry usable;
  for (const auto& each : registry.machines())
    if (etcd::is_usable(each)) *usable.add_machines() = each;
  parts_.machines.remember(usable);
}

void CellRegistry::start() {
  state_ = state();
  if (keeper_) keeper_->start();
}

void CellRegistry::trust(std::shared_ptr<grpc::ChannelCredentials> trusted) {
  if (keeper_) keeper_->trust(std::move(trusted));
}

void CellRegistry::offer(const kept::Registration& own) {
  if (keeper_ && !parts_.settings.axisd.advertise.empty()) keeper_->offer(own);
}

void CellRegistry::save() {
  if (!keeper_) return;
  auto content = parts_.machines.roster().registry().SerializeAsString();
  if (content == saved_) return;
  saved_ = content;
  parts_.disk.write(parts_.settings.state + "/registry", std::move(content), [](const Result<void>& written) {
    if (!written) log_limited(spdlog::level::err, "disk", "registry", to_string(written.error()));
  });
}

void CellRegistry::give_back(std::function<void()> done) {
  if (!keeper_) return done();
  keeper_->give_back([this, done = std::move(done)] {
    keeper_->client().leave();
    done();
  });
}

v1::RegistryState CellRegistry::state() const {
  if (!keeper_) return v1::REGISTRY_STATE_BY_HAND;
  return keeper_->machine().state() == RegistryMachine::State::registered ? v1::REGISTRY_STATE_OK
                                                                          : v1::REGISTRY_STATE_DEGRADED;
}

std::optional<TimePoint> CellRegistry::last_heard() const {
  return keeper_ ? keeper_->machine().last_heard() : std::nullopt;
}

void CellRegistry::tell_conflict() {
  const auto& machine = keeper_->machine();
  const auto* holder = machine.holder();
  const auto held_by = holder == nullptr ? std::string() : holder->machine_id() + holder->axisd_address();
  if (std::exchange(held_by_, held_by) == held_by || holder == nullptr) return;
  v1::CellEvent event;
  event.set_kind(v1::CELL_EVENT_KIND_CONFLICT);
  event.set_machine(parts_.settings.machine);
  event.set_text(machine.trouble());
  spdlog::error("{}; give each machine a name of its own", machine.trouble());
  parts_.events.tell(std::move(event));
}

void CellRegistry::on_changed() {
  const auto& machine = keeper_->machine();
  // Until etcd has said anything, what an earlier run knew stands.
  if (machine.last_heard()) parts_.machines.set_registered(machine.machines());
  tell_conflict();
  const auto now = state();
  if (std::exchange(state_, now) == now) return;
  since_ = parts_.clock.now();
  v1::CellEvent event;
  event.set_kind(v1::CELL_EVENT_KIND_REGISTRY);
  event.set_registry(now);
  event.set_text(now == v1::REGISTRY_STATE_OK ? std::string("registered in etcd")
                                              : fmt::format("cell: degraded: {}", machine.trouble()));
  if (now == v1::REGISTRY_STATE_OK)
    spdlog::info("{}", event.text());
  else
    spdlog::warn("{}", event.text());
  parts_.events.tell(std::move(event));
}

void CellRegistry::describe(v1::GetCellResponse& response) const {
  response.set_registry(state());
  set_time(*response.mutable_registry_since(), parts_.clock.wall(since_));
  if (response.registry() == v1::REGISTRY_STATE_DEGRADED)
    *response.mutable_registry_trouble() = detail_of(
        keeper_->machine().holder() != nullptr ? axisd::v1::REASON_MISCONFIGURED : axisd::v1::REASON_OFFLINE,
        keeper_->machine().trouble(),
        keeper_->machine().holder() != nullptr
            ? "give each machine a name of its own, in axisd.yaml and cell.yaml"
            : "look at etcd; machines that are known are reached and stopped without it");
  if (const auto heard = last_heard()) set_time(*response.mutable_registry_seen(), parts_.clock.wall(*heard));
}

}  // namespace axisd::cell
