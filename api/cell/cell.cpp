#include "api/cell/cell.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "api/cell/status.hpp"
#include "config/text.hpp"

namespace axisd::cell {
namespace {

constexpr Duration own_patience = std::chrono::seconds(2);

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
      events_(clock, identity_.instance_id),
      machines_(io.get_executor(), clock, settings, std::move(trust.machines), routes,
                {.changed = [this](const Roster::Change& change) { on_changed(change); },
                 .touched =
                     [this](const std::set<std::string>& names) {
                       watched_.touched(names);
                       registry_.save();
                     },
                 .answered = [this](const std::string& name,
                                    const PeerAnswer& answer) { on_answered(name, answer); }}),
      watched_(machines_),
      clocks_(clock, machines_),
      registry_(
          io.get_executor(),
          {.clock = clock, .settings = settings, .machines = machines_, .disk = disk_, .events = events_},
          std::move(trust.etcd), [this](const etcd::Versioned& key) { stop_all_.read(key); }),
      own_(io.get_executor(), clock, settings, identity_.machine_id, machines_,
           [this](const kept::Registration& own) { registry_.offer(own); }),
      stop_all_({.clock = clock,
                 .settings = settings,
                 .machines = machines_,
                 .registry = registry_.keeper(),
                 .disk = disk_,
                 .tell = [this](v1::CellEvent event) { events_.tell(std::move(event)); },
                 .instance_id = identity_.instance_id}),
      group_moves_(io.get_executor(), clock, routes,
                   [this](v1::CellEvent event) { events_.tell(std::move(event)); }) {
  registry_.remember();
}

Cell::~Cell() = default;

void Cell::start() {
  machines_.start();
  if (!settings_.metrics.empty()) clocks_.start();  // else nobody would see them
  own_.start();
  registry_.start();
}

void Cell::trust(const Trust& trust) {
  machines_.trust(trust.machines);
  registry_.trust(trust.etcd);
}

void Cell::end(std::function<void()> done) {
  const auto over = to_status(grpc::StatusCode::UNAVAILABLE, axisd::v1::REASON_CANCELLED,
                              "axisd-cell is shutting down", "connect again, to any entrance of the cell");
  watched_.finish(over);
  events_.finish(over);
  group_moves_.end(over);
  own_.end();
  clocks_.end();
  machines_.end();
  stop_all_.end();
  registry_.give_back(std::move(done));
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
  events_.tell(std::move(event));
}

void Cell::on_answered(const std::string& name, const PeerAnswer& answer) {
  stop_all_.seen(name, answer);
  if (name == settings_.machine) own_.seen(answer.instance_id);
}

v1::GetCellResponse Cell::get(const Caller& caller) const {
  v1::GetCellResponse response;
  response.set_cell(settings_.cell);
  response.set_machine(settings_.machine);
  response.set_version(AXISD_VERSION);
  response.set_instance_id(identity_.instance_id);
  registry_.describe(response);
  for (const auto& latch : stop_all_.machine().standing()) *response.add_stop_all() = latch;
  if (const auto& error = stop_all_.not_durable()) *response.mutable_not_durable() = detail_of(*error);
  response.set_client(caller.name);
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

Reading Cell::reading() const {
  Reading reading;
  reading.cell = settings_.cell;
  reading.machine = settings_.machine;
  reading.registry = registry_.state();
  if (const auto heard = registry_.last_heard()) reading.registry_age = clock_.now() - *heard;
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
