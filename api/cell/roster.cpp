#include "api/cell/roster.hpp"

#include <google/protobuf/util/message_differencer.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <utility>

namespace axisd::cell {
namespace {

using google::protobuf::util::TimeUtil;

bool same(const kept::Registration& a, const kept::Registration& b) {
  return google::protobuf::util::MessageDifferencer::Equals(a, b);
}

}  // namespace

void set_time(google::protobuf::Timestamp& to, WallTime time) {
  to = TimeUtil::NanosecondsToTimestamp(
      std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count());
}

void set_duration(google::protobuf::Duration& to, Duration duration) {
  to = TimeUtil::NanosecondsToDuration(duration.count());
}

Duration duration_of(const google::protobuf::Duration& from) {
  constexpr std::int64_t longest = 30LL * 365 * 24 * 3600;
  return std::chrono::seconds(std::clamp<std::int64_t>(from.seconds(), -longest, longest)) +
         Duration(from.nanos());
}

Roster::Entry* Roster::enter(const kept::Registration& registration, TimePoint now) {
  auto found = entries_.find(registration.name());
  if (found == entries_.end()) {
    if (entries_.size() >= most) return nullptr;
    found = entries_.try_emplace(registration.name(), registration.name(), times_, now).first;
  }
  auto& entry = found->second;
  if (same(entry.registration, registration)) return &entry;
  const bool elsewhere = entry.registration.axisd_address() != registration.axisd_address();
  entry.registration = registration;
  if (elsewhere) entry.peer.moved(now);
  touch(registration.name());
  return &entry;
}

void Roster::put_by_hand(const kept::Registration& registration, TimePoint now) {
  if (auto* entry = enter(registration, now)) entry->by_hand = true;
}

void Roster::put_remembered(const kept::Registration& registration, TimePoint now) {
  if (const auto* known = find(registration.name()); known == nullptr || !known->by_hand) {
    auto* entry = enter(registration, now);
    // As long as etcd says nothing else, it is as registered as it was.
    if (entry != nullptr) entry->registered = true;
  }
}

void Roster::set_registered(const std::map<std::string, kept::Registration, std::less<>>& machines,
                            TimePoint now) {
  for (const auto& [name, registration] : machines) {
    auto* entry = find(name);
    if (entry == nullptr) entry = enter(registration, now);
    if (entry == nullptr) continue;
    if (!std::exchange(entry->registered, true)) touch(name);
    if (!entry->by_hand) {
      (void)enter(registration, now);
    } else if (name != own_) {
      // Where it is, is as the configuration says; what it is, it knows best.
      auto merged = registration;
      merged.set_axisd_address(entry->registration.axisd_address());
      merged.set_stop_address(entry->registration.stop_address());
      if (!entry->registration.cell_address().empty())
        merged.set_cell_address(entry->registration.cell_address());
      (void)enter(merged, now);
    }
  }
  for (auto& [name, entry] : entries_)
    if (!machines.contains(name) && std::exchange(entry.registered, false)) touch(name);
}

void Roster::set_own(const kept::Registration& registration) {
  auto* entry = find(own_);
  if (entry == nullptr || same(entry->registration, registration)) return;
  entry->registration = registration;
  touch(own_);
}

Roster::Entry* Roster::find(std::string_view name) {
  const auto found = entries_.find(name);
  return found == entries_.end() ? nullptr : &found->second;
}

v1::MachineState Roster::state_of(const Entry& entry) {
  if (entry.peer.state() == PeerMachine::State::unknown) return v1::MACHINE_STATE_UNSPECIFIED;
  const bool expected = entry.registered || entry.by_hand;
  if (entry.peer.answers()) return expected ? v1::MACHINE_STATE_PRESENT : v1::MACHINE_STATE_UNREGISTERED;
  return expected ? v1::MACHINE_STATE_SILENT : v1::MACHINE_STATE_GONE;
}

void Roster::look(TimePoint now) {
  for (auto it = entries_.begin(); it != entries_.end();) {
    auto& [name, entry] = *it;
    const auto state = state_of(entry);
    if (state != entry.state) {
      changes_.push_back({.name = name, .from = entry.state, .to = state});
      entry.state = state;
      entry.since = now;
      touch(name);
    }
    if (state == v1::MACHINE_STATE_GONE && now - entry.since >= remembered) {
      changes_.push_back({.name = name, .from = state, .to = v1::MACHINE_STATE_UNSPECIFIED});
      touch(name);
      it = entries_.erase(it);
    } else {
      ++it;
    }
  }
}

v1::Machine Roster::machine(const std::string& name, const Clock& clock) const {
  const auto& entry = entries_.find(name)->second;
  const auto& known = entry.registration;
  const auto& last = entry.peer.last();
  v1::Machine machine;
  machine.set_name(name);
  machine.set_cell_address(known.cell_address());
  machine.set_axisd_address(known.axisd_address());
  machine.set_stop_address(known.stop_address());
  *machine.mutable_axes() = known.axes();
  machine.set_version(last ? last->version : known.version());
  machine.set_configuration_revision(known.configuration_revision());
  machine.set_machine_id(known.machine_id());
  machine.set_state(entry.state);
  set_time(*machine.mutable_since(), clock.wall(entry.since));
  if (last) {
    set_duration(*machine.mutable_round_trip(), last->round_trip);
    machine.set_stop_all(last->inhibited);
  }
  machine.set_trouble(entry.peer.trouble());
  machine.set_own(name == own_);
  return machine;
}

kept::Registry Roster::registry() const {
  kept::Registry registry;
  for (const auto& [name, entry] : entries_)
    if (!entry.by_hand) *registry.add_machines() = entry.registration;
  return registry;
}

}  // namespace axisd::cell
