#include "api/cell/machines.hpp"

#include <fmt/format.h>

#include <utility>

#include "api/transport/address.hpp"

namespace axisd::cell {
namespace {

constexpr Duration tick_period = std::chrono::milliseconds(100);
constexpr int ticks_between_lanes = 10;

}  // namespace

Machines::Machines(boost::asio::any_io_executor core, Clock& clock, const Settings& settings,
                   std::shared_ptr<grpc::ChannelCredentials> trusted, RouteTable& routes, Events events)
    : core_(std::move(core)),
      clock_(clock),
      settings_(settings),
      trusted_(std::move(trusted)),
      routes_(routes),
      events_(std::move(events)),
      roster_(settings.machine, PeerMachine::Times()) {
  kept::Registration own;
  own.set_name(settings.machine);
  own.set_cell_address(settings.advertise);
  own.set_axisd_address(settings.axisd.advertise.empty() ? settings.axisd.server : settings.axisd.advertise);
  own.set_stop_address(settings.axisd.advertise.empty() ? settings.axisd.stop_server
                                                        : settings.axisd.stop_advertise);
  roster_.put_by_hand(own, clock.now());
  for (const auto& [name, peer] : settings.peers) {
    kept::Registration registration;
    registration.set_name(name);
    registration.set_cell_address(peer.cell);
    registration.set_axisd_address(peer.axisd);
    registration.set_stop_address(peer.stop);
    roster_.put_by_hand(registration, clock.now());
  }
}

void Machines::remember(const kept::Registry& registry) {
  for (const auto& each : registry.machines()) roster_.put_remembered(each, clock_.now());
}

void Machines::set_registered(const std::map<std::string, kept::Registration, std::less<>>& machines) {
  roster_.set_registered(machines, clock_.now());
  settle();
}

void Machines::set_own(const kept::Registration& own) {
  roster_.set_own(own);
  settle();
}

void Machines::trust(std::shared_ptr<grpc::ChannelCredentials> trusted) {
  trusted_ = std::move(trusted);
  for (auto& [name, link] : links_) {
    link.move_to(link.addresses(), trusted_);
    if (auto* entry = roster_.find(name)) entry->peer.moved(clock_.now());
  }
  settle();
}

MachineLink* Machines::link(const std::string& name) {
  const auto found = links_.find(name);
  return found == links_.end() ? nullptr : &found->second;
}

Addresses Machines::addresses_of(const std::string& name, const Roster::Entry& entry) const {
  if (name == settings_.machine)
    return {.axisd = settings_.axisd.server, .stop = settings_.axisd.stop_server, .cell = {}};
  const auto& known = entry.registration;
  return {.axisd = known.axisd_address(),
          .stop = known.stop_address().empty() ? transport::stop_lane_next_to(known.axisd_address())
                                               : known.stop_address(),
          .cell = known.cell_address()};
}

void Machines::tick() {
  timer_ = clock_.call_at(clock_.now() + tick_period, [this] { tick(); });
  ++ticks_;
  settle();
  bool other = false;
  for (auto& [name, entry] : roster_.entries()) other = look_after(name, entry, clock_.now()) || other;
  if (other) settle();
}

bool Machines::look_after(const std::string& name, Roster::Entry& entry, TimePoint now) {
  auto& link = links_.at(name);
  const bool lost = link.has_been_lost();
  if (lost) entry.peer.connection_lost(now);
  if (ticks_ % ticks_between_lanes == 0) link.warm_lane();
  switch (entry.peer.time(now)) {
    case PeerMachine::Effect::none:
      break;
    case PeerMachine::Effect::ask:
      ask(name, link, false);
      break;
    case PeerMachine::Effect::ask_anew:
      ask(name, link, true);
      return true;
  }
  return lost;
}

void Machines::ask(const std::string& name, MachineLink& link, bool anew) {
  link.ask_who(anew, [this, name](const MachineLink::Answer& answer) { on_answer(name, answer); });
}

void Machines::on_answer(const std::string& name, const MachineLink::Answer& answer) {
  auto* entry = roster_.find(name);
  if (entry == nullptr) return;
  const bool was_inhibited = entry->peer.last() && entry->peer.last()->inhibited;
  const auto before = std::pair(entry->peer.state(), entry->peer.trouble());
  switch (answer.kind) {
    case MachineLink::Answer::Kind::good:
      entry->peer.answered(clock_.now(), answer.said);
      break;
    case MachineLink::Answer::Kind::late:
      entry->peer.late(clock_.now(), answer.why);
      break;
    case MachineLink::Answer::Kind::failed:
      entry->peer.failed(clock_.now(), answer.why);
      break;
  }
  const bool is_its_own = answer.kind == MachineLink::Answer::Kind::good && entry->peer.is_open();
  if (is_its_own && was_inhibited != answer.said.inhibited) roster_.touch(name);
  if (before != std::pair(entry->peer.state(), entry->peer.trouble()) || roster_.is_touched()) settle();
  if (is_its_own) events_.answered(name, answer.said);
}

void Machines::settle() {
  const auto now = clock_.now();
  for (auto& [name, entry] : roster_.entries()) {
    const auto addresses = addresses_of(name, entry);
    const auto found = links_.find(name);
    if (found == links_.end())
      links_.try_emplace(name, core_, trusted_, addresses);
    else if (found->second.addresses() != addresses)
      found->second.move_to(addresses, trusted_);
  }
  roster_.look(now);
  std::erase_if(links_, [this](const auto& link) { return roster_.find(link.first) == nullptr; });
  publish();
  for (const auto& change : roster_.take_changes()) events_.changed(change);
  if (const auto touched = roster_.take_touched(); !touched.empty()) events_.touched(touched);
}

void Machines::publish() {
  const auto before = routes_.now();
  auto routes = std::make_shared<Routes>();
  bool other = before->machines.size() != links_.size();
  for (const auto& [name, entry] : roster_.entries()) {
    auto& tally = tallies_[name];
    if (!tally) tally = std::make_shared<RouteTally>();
    Route route{.way = links_.at(name).way(),
                .open = entry.peer.is_open(),
                .why = entry.peer.trouble().empty() ? "axisd does not answer" : entry.peer.trouble(),
                .tally = tally};
    const auto old = before->machines.find(name);
    other = other || old == before->machines.end() || old->second.open != route.open ||
            old->second.why != route.why || old->second.way.main != route.way.main ||
            old->second.way.lane != route.way.lane;
    routes->machines.emplace(name, std::move(route));
  }
  if (other) routes_.replace(std::move(routes));
}

}  // namespace axisd::cell
