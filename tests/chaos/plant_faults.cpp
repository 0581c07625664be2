// Which transactions a fault strikes, and which fault: by the dice.
#include <algorithm>
#include <array>

#include "tests/chaos/plant.hpp"

namespace axisd::chaos {

using simulation::FaultKind;
using namespace std::chrono_literals;

namespace {

struct Likely {
  FaultKind kind;
  int weight;
  Duration longest_delay;
};
/// A doubled reply comes within the silence: one that is later and as long as the reply that is waited for
/// then cannot be told from it by anybody, as it carries neither a number nor a register.
constexpr std::array on_a_line{
    Likely{FaultKind::drop_request, 30, {}},      Likely{FaultKind::drop_reply, 30, {}},
    Likely{FaultKind::delay_reply, 40, 120ms},    Likely{FaultKind::delay_reply, 6, 1200ms},
    Likely{FaultKind::corrupt_request, 15, {}},   Likely{FaultKind::corrupt_reply, 15, {}},
    Likely{FaultKind::truncate_reply, 10, {}},    Likely{FaultKind::drip, 5, 4ms},
    Likely{FaultKind::duplicate_request, 15, {}}, Likely{FaultKind::duplicate_reply, 15, 1ms},
    Likely{FaultKind::foreign_frame, 10, {}},     Likely{FaultKind::reboot_before, 1, 300ms},
    Likely{FaultKind::reboot_after, 1, 300ms}};

/// Of an SDO request; an RPDO or an NMT command has no reply to be lost or late.
constexpr std::array on_can_requests{
    Likely{FaultKind::drop_request, 40, {}},    Likely{FaultKind::drop_reply, 40, {}},
    Likely{FaultKind::delay_reply, 40, 120ms},  Likely{FaultKind::delay_reply, 6, 1200ms},
    Likely{FaultKind::abort, 12, {}},           Likely{FaultKind::wrong_toggle, 6, {}},
    Likely{FaultKind::endless_upload, 3, {}},   Likely{FaultKind::silence, 3, 900ms},
    Likely{FaultKind::flood, 1, 40ms},          Likely{FaultKind::emcy, 3, {}},
    Likely{FaultKind::reboot_before, 1, 300ms}, Likely{FaultKind::reboot_after, 1, 300ms}};
constexpr std::array on_can_commands{
    Likely{FaultKind::drop_request, 40, {}}, Likely{FaultKind::silence, 3, 900ms},
    Likely{FaultKind::reboot_before, 1, 300ms}, Likely{FaultKind::reboot_after, 1, 300ms}};

template <std::size_t N>
simulation::Fault draw(const std::array<Likely, N>& faults, Dice& dice) {
  int all = 0;
  for (const auto& one : faults) all += one.weight;
  auto left = dice.pick(all);
  const auto chosen =
      std::ranges::find_if(faults, [&](const Likely& one) { return (left -= one.weight) < 0; });
  return {.kind = chosen->kind, .delay = dice.up_to(chosen->longest_delay)};
}

constexpr std::uint32_t nmt_command = 0x000, sync_id = 0x080, sdo_reply = 0x580, sdo_request = 0x600,
                        heartbeat = 0x700;
/// Of a client: no node answers it, so that what strikes an answer would strike that of the next request.
constexpr std::uint8_t sdo_abort = 0x80;
/// TPDO4: a flood there takes the bus, and claims no status word and no position that the node does not have.
constexpr std::uint16_t flooded = 0x480;
/// A SYNC goes out a hundred times a second, and no transaction waits for it.
constexpr double sync_share = 0.002;

}  // namespace

void Plant::set_faulty(bool faulty) {
  faulty_ = faulty;
  for (const auto& [name, line] : lines_) line->network().faults().clear();
  for (auto& station : stations) station.silent_until = {};
  if (faulty) return;
  for (const auto& [name, line] : lines_) line->set_open(true);
  if (network_) mend_network();
}

void Plant::mend_network() {
  nodes_->nodes().clear_faults();
  nodes_->nodes().set_connected(true);
  network_->set_stalled(false);
  if (port_->state().link == can::InterfaceState::down) port_->set_up(true);
}

void Plant::bound(const std::string& line, const test::WireEntry& entry) {
  const auto station = std::ranges::find_if(
      stations, [&](const Station& one) { return one.bus == line && one.node == entry.node(); });
  if (station == stations.end()) return;
  ++on_lines_.transactions;
  if (on_bind) on_bind(*station, read_request(entry.request, station->drive->drive()));
  auto& virtual_line = *lines_.at(line);
  virtual_line.network().faults().clear();
  if (faulty_ && strike(*station, virtual_line)) ++on_lines_.faulted;
  if (virtual_line.wire().size() > 1000) virtual_line.forget_wire();  // `entry` was in it
}

/// Decides what happens to the request that is about to go out.
bool Plant::strike(Station& station, test::VirtualLine& line) {
  auto& faults = line.network().faults();
  if (world.now() < station.silent_until) {
    faults.add({.kind = FaultKind::drop_request});
    return true;
  }
  if (dice_.chance(0.0005)) station.silent_until = world.now() + dice_.up_to(6s);
  if (dice_.chance(0.0001)) {
    faults.add({.kind = FaultKind::hang_up});
    mendings_.push_back(
        world.clock().call_at(world.now() + dice_.up_to(2s), [&line] { line.set_open(true); }));
    return true;
  }
  if (!dice_.chance(share_)) return false;
  faults.add(draw(on_a_line, dice_));
  return true;
}

void Plant::handed_over(const can::Frame& frame) {
  if (frame.id >= heartbeat) return;
  for (auto& station : stations) {
    if (!station.on_can()) continue;
    const auto telegram = read_frame(frame, station.drive->drive());
    if (on_bind) on_bind(station, telegram);
    if (frame.id == sdo_request + station.node && frame.data[0] != sdo_abort)
      asked_by_sdo_[station.node] = telegram;
    const bool own = frame.id == nmt_command ? frame.data[1] == station.node
                                             : frame.id != sync_id && (frame.id & 0x7FU) == station.node;
    if (own) ++on_can_.transactions;
    const bool may_be_struck = own || (frame.id == sync_id && dice_.chance(sync_share));
    if (!faulty_ || !may_be_struck || !strike(station, frame)) continue;
    ++on_can_.faulted;
    if (!own) ++on_can_.transactions;
  }
}

bool Plant::strike(Station& station, const can::Frame& frame) {
  auto& nodes = nodes_->nodes();
  if (dice_.chance(0.0002)) strike_network(frame);
  if (frame.id != sync_id && !dice_.chance(share_)) return false;
  const bool answered = frame.id - sdo_request == station.node && frame.data[0] != sdo_abort;
  auto fault = answered ? draw(on_can_requests, dice_) : draw(on_can_commands, dice_);
  fault.node = station.node;
  // What sends by itself has identifiers of its own.
  if (fault.kind == FaultKind::flood)
    fault.cob = static_cast<std::uint16_t>(flooded + station.node);
  else if (fault.kind != FaultKind::emcy)
    fault.cob = static_cast<std::uint16_t>(frame.id);
  nodes.add_fault(fault);
  return true;
}

/// A drawn abort strikes the next request that is heard: later than drawn, where a node is silent.
void Plant::answered(const can::Frame& frame) {
  if (frame.id <= sdo_reply || frame.id >= sdo_request || frame.data[0] != sdo_abort || !on_refused) return;
  for (auto& station : stations)
    if (station.on_can() && frame.id == sdo_reply + station.node)
      on_refused(station, asked_by_sdo_[station.node]);
}

/// The network as a whole: the cable, the controller, the interface, nobody who acknowledges; and a
/// controller or a kernel that loses the frame, or its echo.
void Plant::strike_network(const can::Frame& frame) {
  const auto later = [this](Duration longest, auto mend) {
    mendings_.push_back(world.clock().call_at(world.now() + dice_.up_to(longest), mend));
  };
  switch (dice_.pick(5)) {
    case 0:
      nodes_->nodes().set_connected(false);
      later(1500ms, [this] { nodes_->nodes().set_connected(true); });
      break;
    case 1:
      // Never from within a call of the port's own.
      later({}, [this] { port_->report(can::Controller::bus_off); });
      break;
    case 2:
      later({}, [this] { port_->set_up(false); });
      later(1500ms, [this] { port_->set_up(true); });
      break;
    case 3:
      network_->set_fault([frame, lost = dice_.pick(2) == 0, over = false](const can::Frame& each) mutable {
        if (over || each != frame) return can::Network::Fault{};
        over = true;
        return can::Network::Fault{.drop = lost, .unconfirmed = true};
      });
      break;
    default:
      network_->set_stalled(true);
      later(400ms, [this] { network_->set_stalled(false); });
      break;
  }
}

}  // namespace axisd::chaos
