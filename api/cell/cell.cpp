#include "api/cell/cell.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "api/cell/kept_file.hpp"
#include "api/cell/status.hpp"
#include "axisd/v1/axis_service.pb.h"
#include "buses/limited_log.hpp"
#include "config/text.hpp"

namespace axisd::cell {
namespace {

constexpr Duration own_period = std::chrono::seconds(5), own_patience = std::chrono::seconds(2);

std::string_view name_of(v1::MachineState state) {
  switch (state) {
    case v1::MACHINE_STATE_PRESENT:
      return "present";
    case v1::MACHINE_STATE_SILENT:
      return "silent";
    case v1::MACHINE_STATE_UNREGISTERED:
      return "unregistered";
    case v1::MACHINE_STATE_GONE:
      return "gone";
    default:
      return "not known";
  }
}

bool is_there(v1::MachineState state) {
  return state == v1::MACHINE_STATE_PRESENT || state == v1::MACHINE_STATE_UNREGISTERED;
}

}  // namespace

Cell::Cell(boost::asio::io_context& io, Clock& clock, const Settings& settings, Trust trust,
           Identity identity, RouteTable& routes, OpenCalls& calls)
    : io_(io),
      clock_(clock),
      settings_(settings),
      identity_(std::move(identity)),
      routes_(routes),
      calls_(calls),
      disk_(io.get_executor()),
      events_(identity_.instance_id),
      machines_(io.get_executor(), clock, settings, std::move(trust.machines), routes,
                {.changed = [this](const Roster::Change& change) { on_changed(change); },
                 .touched = [this](const std::set<std::string>& names) { on_touched(names); },
                 .answered = [this](const std::string& name,
                                    const PeerAnswer& answer) { on_answered(name, answer); }}),
      clocks_(clock, machines_),
      registry_(settings.etcd.endpoints.empty()
                    ? nullptr
                    : std::make_unique<RegistryKeeper>(
                          io.get_executor(), clock, settings, std::move(trust.etcd),
                          RegistryKeeper::Events{
                              .changed = [this] { on_registry(); },
                              .stop_all = [this](const etcd::Versioned& key) { stop_all_.read(key); }})),
      stop_all_({.clock = clock,
                 .settings = settings,
                 .machines = machines_,
                 .registry = registry_.get(),
                 .disk = disk_,
                 .tell = [this](v1::CellEvent event) { tell(std::move(event)); },
                 .instance_id = identity_.instance_id}),
      group_moves_(io.get_executor(), clock, routes, [this](v1::CellEvent event) { tell(std::move(event)); }),
      registry_since_(clock.now()) {
  remember();
}

Cell::~Cell() = default;

void Cell::remember() {
  if (!registry_) return;
  const auto read = read_kept(settings_.state + "/registry");
  if (!read) {
    spdlog::error("{}; machines are known again as soon as etcd answers", to_string(read.error()));
    v1::CellEvent event;
    event.set_kind(v1::CELL_EVENT_KIND_REGISTRY);
    event.set_text(to_string(read.error()));
    tell(std::move(event));
    return;
  }
  kept::Registry registry;
  if (!*read || !registry.ParseFromString(**read)) return;
  kept::Registry usable;
  for (const auto& each : registry.machines())
    if (etcd::is_usable(each)) *usable.add_machines() = each;
  machines_.remember(usable);
}

void Cell::start() {
  registry_was_ = registry_state();
  machines_.start();
  if (!settings_.metrics.empty()) clocks_.start();  // else nobody would see them
  look_at_own();
  if (registry_) registry_->start();
}

void Cell::trust(const Trust& trust) {
  machines_.trust(trust.machines);
  if (registry_) registry_->trust(trust.etcd);
}

void Cell::end(std::function<void()> done) {
  const auto over = to_status(grpc::StatusCode::UNAVAILABLE, axisd::v1::REASON_CANCELLED,
                              "axisd-cell is shutting down", "connect again, to any entrance of the cell");
  watchers_.finish(over);
  event_readers_.finish(over);
  group_moves_.end(over);
  own_timer_.reset();
  clocks_.end();
  machines_.end();
  stop_all_.end();
  if (!registry_) return done();
  registry_->give_back([this, done = std::move(done)] {
    registry_->client().leave();
    done();
  });
}

void Cell::tell(v1::CellEvent event) {
  set_time(*event.mutable_at(), clock_.wall(clock_.now()));
  events_.add(std::move(event));
  event_readers_.poke();
}

void Cell::on_changed(const Roster::Change& change) {
  if (is_there(change.to) && !is_there(change.from)) ++lives_.births;
  if (is_there(change.from) && !is_there(change.to)) ++lives_.deaths;
  auto* const entry = machines_.roster().entries().contains(change.name)
                          ? &machines_.roster().entries().find(change.name)->second
                          : nullptr;
  auto text = fmt::format("{} is {}", change.name, name_of(change.to));
  if (entry != nullptr && !entry->peer.trouble().empty()) text += fmt::format(": {}", entry->peer.trouble());
  if (is_there(change.to))
    spdlog::info("{}", text);
  else
    spdlog::warn("{}", text);
  v1::CellEvent event;
  event.set_kind(v1::CELL_EVENT_KIND_MACHINE);
  event.set_machine(change.name);
  event.set_from(change.from);
  event.set_to(change.to);
  event.set_text(std::move(text));
  tell(std::move(event));
}

void Cell::on_touched(const std::set<std::string>& names) {
  ++changes_;
  for (const auto& name : names) changed_at_[name] = changes_;
  watchers_.poke();
  save_registry();
}

void Cell::save_registry() {
  if (!registry_) return;
  auto content = machines_.roster().registry().SerializeAsString();
  if (content == saved_registry_) return;
  saved_registry_ = content;
  disk_.write(settings_.state + "/registry", std::move(content), [](const Result<void>& written) {
    if (!written) log_limited(spdlog::level::err, "disk", "registry", to_string(written.error()));
  });
}

void Cell::on_answered(const std::string& name, const PeerAnswer& answer) {
  stop_all_.seen(name, answer);
  if (name == settings_.machine && answer.instance_id != own_instance_) look_at_own();
}

v1::RegistryState Cell::registry_state() const {
  if (!registry_) return v1::REGISTRY_STATE_BY_HAND;
  return registry_->machine().state() == RegistryMachine::State::registered ? v1::REGISTRY_STATE_OK
                                                                            : v1::REGISTRY_STATE_DEGRADED;
}

void Cell::on_registry() {
  const auto& machine = registry_->machine();
  // Until etcd has said anything, what an earlier run knew stands.
  if (machine.last_heard()) machines_.set_registered(machine.machines());
  const auto* holder = machine.holder();
  const auto held_by = holder == nullptr ? std::string() : holder->machine_id() + holder->axisd_address();
  if (std::exchange(held_by_, held_by) != held_by && holder != nullptr) {
    v1::CellEvent event;
    event.set_kind(v1::CELL_EVENT_KIND_CONFLICT);
    event.set_machine(settings_.machine);
    event.set_text(machine.trouble());
    spdlog::error("{}; give each machine a name of its own", machine.trouble());
    tell(std::move(event));
  }
  const auto state = registry_state();
  if (std::exchange(registry_was_, state) == state) return;
  registry_since_ = clock_.now();
  v1::CellEvent event;
  event.set_kind(v1::CELL_EVENT_KIND_REGISTRY);
  event.set_registry(state);
  event.set_text(state == v1::REGISTRY_STATE_OK ? std::string("registered in etcd")
                                                : fmt::format("cell: degraded: {}", machine.trouble()));
  if (state == v1::REGISTRY_STATE_OK)
    spdlog::info("{}", event.text());
  else
    spdlog::warn("{}", event.text());
  tell(std::move(event));
}

v1::GetCellResponse Cell::get(const Caller& caller) const {
  v1::GetCellResponse response;
  response.set_cell(settings_.cell);
  response.set_machine(settings_.machine);
  response.set_version(AXISD_VERSION);
  response.set_instance_id(identity_.instance_id);
  response.set_registry(registry_state());
  set_time(*response.mutable_registry_since(), clock_.wall(registry_since_));
  if (response.registry() == v1::REGISTRY_STATE_DEGRADED)
    *response.mutable_registry_trouble() =
        detail_of(registry_->machine().holder() != nullptr ? axisd::v1::REASON_MISCONFIGURED
                                                           : axisd::v1::REASON_OFFLINE,
                  registry_->machine().trouble(),
                  registry_->machine().holder() != nullptr
                      ? "give each machine a name of its own, in axisd.yaml and cell.yaml"
                      : "look at etcd; machines that are known are reached and stopped without it");
  for (const auto& latch : stop_all_.machine().standing()) *response.add_stop_all() = latch;
  if (const auto& error = stop_all_.not_durable()) *response.mutable_not_durable() = detail_of(*error);
  response.set_client(caller.name);
  if (registry_ && registry_->machine().last_heard())
    set_time(*response.mutable_registry_seen(), clock_.wall(*registry_->machine().last_heard()));
  return response;
}

v1::ListMachinesResponse Cell::list() const {
  v1::ListMachinesResponse response;
  for (const auto& [name, entry] : machines_.roster().entries())
    *response.add_machines() = machines_.machine(name);
  return response;
}

v1::GetClockResponse Cell::read_clock() const {
  v1::GetClockResponse response;
  response.set_machine(settings_.machine);
  response.set_instance_id(identity_.instance_id);
  set_duration(*response.mutable_clock(), clock_.now().time_since_epoch());
  return response;
}

void Cell::watch_machines(const std::shared_ptr<CoreStream<v1::WatchMachinesResponse>>& stream) {
  watchers_.add(stream);
  stream->serve(
      [this, seen = std::optional<std::uint64_t>()]() mutable -> std::optional<v1::WatchMachinesResponse> {
        if (seen == changes_) return std::nullopt;
        v1::WatchMachinesResponse response;
        const auto& entries = machines_.roster().entries();
        for (const auto& [name, entry] : entries)
          if (!seen || changed_at_[name] > *seen) *response.add_machines() = machines_.machine(name);
        for (const auto& [name, change] : changed_at_)
          if (seen && change > *seen && !entries.contains(name)) response.add_forgotten(name);
        seen = changes_;
        return response;
      });
}

void Cell::watch_events(const std::shared_ptr<CoreStream<v1::WatchEventsResponse>>& stream,
                        const v1::WatchEventsRequest& request) {
  event_readers_.add(stream);
  stream->serve([this, cursor = events_.cursor_of(request),
                 first = true]() mutable -> std::optional<v1::WatchEventsResponse> {
    if (!std::exchange(first, false) && cursor == events_.newest()) return std::nullopt;
    return events_.after(cursor);
  });
}

void Cell::release_stop_all(
    const Caller& caller, std::function<void(const grpc::Status&, const v1::ReleaseStopAllResponse&)> done) {
  auto* const link = machines_.link(settings_.machine);
  ask<axisd::v1::GetInfoResponse>(
      executor(), link->way().main,
      {.path = "/axisd.v1.SystemService/GetInfo",
       .timeout = own_patience,
       .metadata = Callers::metadata_for(caller).value_or(Metadata())},
      axisd::v1::GetInfoRequest(),
      [this, caller, done = std::move(done)](const grpc::Status& status,
                                             const axisd::v1::GetInfoResponse& info) {
        if (!status.ok())
          return done(
              to_status(grpc::StatusCode::UNAVAILABLE, axisd::v1::REASON_OFFLINE,
                        fmt::format("the axisd of {} does not say whether {} may: {}", settings_.machine,
                                    caller.name, config::printable(status.error_message(), 200)),
                        "ask at the entrance of another machine"),
              {});
        // Where an axisd has no `access`, everybody is a maintainer to it: what the caller has here counts as
        // well.
        const bool known =
            caller.local || (Callers::metadata_for(caller) && caller.role == CellRole::maintainer);
        if (info.role() != axisd::v1::ROLE_MAINTAINER || info.machine() != settings_.machine || !known)
          return done(
              to_status(grpc::StatusCode::PERMISSION_DENIED, axisd::v1::REASON_ACCESS_DENIED,
                        fmt::format("ReleaseStopAll needs the role maintainer; {} has less on {}",
                                    config::printable(caller.name), settings_.machine),
                        "ask somebody who has it; roles of certificates are in roles of cell.yaml, and no "
                        "higher than the delegate's in axisd.yaml"),
              {});
        stop_all_.release(
            caller, [done](const v1::ReleaseStopAllResponse& response) { done(grpc::Status::OK, response); });
      });
}

void Cell::look_at_own() {
  own_timer_ = clock_.call_at(clock_.now() + own_period, [this] { look_at_own(); });
  const auto* entry = &machines_.roster().entries().find(settings_.machine)->second;
  if (!entry->peer.is_open()) return;
  own_instance_ = entry->peer.last()->instance_id;
  const auto channel = machines_.link(settings_.machine)->way().main;
  ask<axisd::v1::ListAxesResponse>(
      executor(), channel,
      {.path = "/axisd.v1.AxisService/ListAxes", .timeout = own_patience, .metadata = {}},
      axisd::v1::ListAxesRequest(),
      [this](const grpc::Status& status, const axisd::v1::ListAxesResponse& response) {
        if (!status.ok())
          log_limited(spdlog::level::warn, "own axisd", "axes",
                      fmt::format("the axisd of this machine does not tell its axes: {}",
                                  config::printable(status.error_message(), 200)));
        if (status.ok()) own_.clear_axes();
        for (const auto& axis : response.axes()) own_.add_axes(axis.axis());
        offer();
      });
  ask<axisd::v1::GetConfigResponse>(
      executor(), channel,
      {.path = "/axisd.v1.SystemService/GetConfig", .timeout = own_patience, .metadata = {}},
      axisd::v1::GetConfigRequest(),
      [this](const grpc::Status& status, const axisd::v1::GetConfigResponse& response) {
        if (!status.ok()) return;
        own_.set_configuration_revision(response.revision());
        offer();
      });
}

void Cell::offer() {
  const auto& entry = machines_.roster().entries().find(settings_.machine)->second;
  if (!entry.peer.last()) return;
  own_.set_name(settings_.machine);
  own_.set_machine_id(identity_.machine_id);
  own_.set_cell_address(settings_.advertise);
  own_.set_axisd_address(entry.registration.axisd_address());
  own_.set_stop_address(entry.registration.stop_address());
  own_.set_version(entry.peer.last()->version);
  machines_.set_own(own_);
  if (registry_ && !settings_.axisd.advertise.empty()) registry_->offer(own_);
}

Reading Cell::reading() const {
  Reading reading;
  reading.cell = settings_.cell;
  reading.machine = settings_.machine;
  reading.registry = registry_state();
  if (registry_ && registry_->machine().last_heard())
    reading.registry_age = clock_.now() - *registry_->machine().last_heard();
  for (const auto& [name, entry] : machines_.roster().entries()) {
    const auto& last = entry.peer.last();
    reading.machines.push_back({.name = name,
                                .state = entry.state,
                                .round_trip = last ? std::optional(last->round_trip) : std::nullopt,
                                .stop_all = last && last->inhibited,
                                .clock = clocks_.of(name)});
  }
  reading.tallies = machines_.tallies();
  reading.lives = lives_;
  reading.stops_standing = stop_all_.machine().standing().size();
  reading.told_again = stop_all_.told_again();
  reading.durable = !stop_all_.not_durable();
  reading.open_calls = calls_.open();
  reading.open_moves = group_moves_.open();
  reading.moves = group_moves_.tally();
  reading.refused = routes_.refused.load(std::memory_order_relaxed);
  reading.too_many = routes_.too_many.load(std::memory_order_relaxed);
  reading.durations = routes_.durations();
  return reading;
}

}  // namespace axisd::cell
