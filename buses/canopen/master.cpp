#include "buses/canopen/master.hpp"

#include <fmt/format.h>

#include <utility>

#include "buses/canopen/cob.hpp"

namespace axisd::canopen {

namespace {

constexpr bool begins_download(const can::Frame& frame) {
  constexpr unsigned command_bits = 0xE0, download = 0x20;
  return frame.size >= 4 && (frame.data[0] & command_bits) == download;
}

}  // namespace

std::optional<ForeignCommand> parse_foreign_command(const can::Frame& frame) {
  const auto [service, node, number] = classify(frame.id);
  if (frame.rtr || frame.extended) return std::nullopt;
  if (service == Service::nmt && frame.size >= 2) {
    const auto command = static_cast<NmtCommand>(frame.data[0]);
    return ForeignCommand{.node = frame.data[1], .what = fmt::format("sends NMT '{}'", to_string(command))};
  }
  if (service == Service::rpdo)
    return ForeignCommand{.node = node, .what = fmt::format("sends RPDO {}", number)};
  if (service != Service::sdo_request || !begins_download(frame)) return std::nullopt;
  constexpr Object control_word{0x6040, 0}, target_velocity{0x60FF, 0};
  const Object object{static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8U), frame.data[3]};
  if (object != control_word && object != target_velocity) return std::nullopt;
  return ForeignCommand{.node = node, .what = fmt::format("writes {} by SDO", to_string(object))};
}

Master::Master(Executor executor, Clock& clock, std::unique_ptr<can::Port> port, SdoSettings sdo)
    : executor_(std::move(executor)),
      clock_(&clock),
      port_(std::move(port)),
      sdo_(executor_, clock, *port_, sdo),
      nmt_(clock, [this](const NodeEvent& event) { on_node_event(event); }),
      sync_(clock, *port_) {}

Master::~Master() = default;

void Master::start(MasterHandlers handlers) {
  handlers_ = std::move(handlers);
  port_->start({.on_frame = [this](const can::ReceivedFrame& received) { on_frame(received); },
                .on_state = [this](const can::PortState& state) { on_port_state(state); },
                // The answers to SYNC come in crowds. Before it runs, bring-up goes from answer to answer.
                .may_gather = [this] { return sync_.running() && !sdo_.urgent(); }});
}

void Master::close() {
  handlers_ = {};
  pdos_.clear();
  sync_.stop();
  nmt_.forget_states();
  sdo_.close();
  port_->close();
}

Result<void> Master::add_node(std::uint8_t node, Duration heartbeat_timeout) {
  if (!valid_node(node))
    return fail(Reason::invalid_argument, fmt::format("node-ID {} does not exist", node), "use 1 to 127");
  nodes_.insert(node);
  foreign_nodes_.erase(node);
  nmt_.watch(node, heartbeat_timeout);
  return {};
}

void Master::remove_node(std::uint8_t node) {
  if (nodes_.erase(node) > 0) nmt_.watch(node, {});
}

Task<can::SendResult> Master::sent(can::Frame frame, can::SendOptions options) {
  Promise<can::SendResult> promise(executor_, *clock_);
  port_->send(frame, options, [&promise](const can::SendResult& result) { promise.set(result); });
  co_return co_await promise.get();
}

Task<Result<void>> Master::command(std::uint8_t node, NmtCommand command,
                                   TransactionClass transaction_class) {
  const auto frame = nmt_frame(command, node);
  if (!frame) co_return fail(frame.error());
  const bool resets = command == NmtCommand::reset_node || command == NmtCommand::reset_communication;
  // Before it is sent: the boot-up message may come before its confirmation.
  if (resets) nmt_.expect_boot(node, true);
  const auto result = co_await sent(*frame, {.transaction_class = transaction_class});
  if (result.status == can::SendStatus::sent) co_return Result<void>{};
  if (resets && result.status != can::SendStatus::unknown) nmt_.expect_boot(node, false);
  auto error = can::error_of(result, port_->settings().bus, *frame);
  error.where.node = node;
  co_return fail(std::move(error));
}

Task<Result<can::SendResult>> Master::send_pdo(std::uint32_t cob_id, Bytes bytes, can::SendOptions options) {
  constexpr std::uint32_t highest_id = 0x7FF;
  constexpr std::size_t most_bytes = 8;
  if (cob_id == 0 || cob_id > highest_id || bytes.size() > most_bytes)
    co_return fail(Reason::invalid_argument, fmt::format("a PDO {:X}h of {} bytes", cob_id, bytes.size()),
                   "use an identifier of 11 bits, not 0, and 8 bytes at most");
  const auto frame = can::make_frame(cob_id, bytes);
  const auto result = co_await sent(frame, std::move(options));
  if (result.status != can::SendStatus::sent)
    co_return fail(can::error_of(result, port_->settings().bus, frame));
  if (const auto cob = classify(cob_id); cob.service == Service::rpdo) ++traffic_.at(cob.node).rpdos;
  co_return result;
}

Result<void> Master::subscribe_pdo(std::uint32_t cob_id, PdoHandler handler) {
  if (!handler) {
    pdos_.erase(cob_id);
    return {};
  }
  const auto service = classify(cob_id).service;
  const bool taken = service != Service::tpdo && service != Service::rpdo && service != Service::other;
  if (taken || !pdos_.try_emplace(cob_id, std::move(handler)).second)
    return fail(Reason::misconfigured,
                fmt::format("the identifier {:03X}h is used for something else already", cob_id),
                "give each PDO an identifier of its own, from 181h to 57Fh");
  return {};
}

void Master::purge_superseded(std::uint8_t node, const AxisGate& gate) {
  port_->purge_superseded(gate);
  sdo_.purge_superseded(node);
}

void Master::on_frame(const can::ReceivedFrame& received) {
  const auto& frame = received.frame;
  if (frame.extended) {
    ++counters_.unknown_cob;
    return;
  }
  const auto [service, node, number] = classify(frame.id);
  if (service == Service::tpdo && !frame.rtr) ++traffic_.at(node).tpdos;
  if (const auto pdo = pdos_.find(frame.id); pdo != pdos_.end() && !frame.rtr) {
    const auto handler = pdo->second;  // it may end its own subscription
    return handler(received);
  }
  switch (service) {
    case Service::sdo_reply:
      // Also of nodes that are only looked for.
      return sdo_.on_reply(node, received);
    case Service::heartbeat:
    case Service::emergency:
    case Service::tpdo:
      if (nodes_.contains(node)) return on_service(node, frame.id, received);
      ++counters_.foreign_node;
      foreign_nodes_.insert(node);
      return;
    case Service::sync:
      ++counters_.foreign_syncs;
      foreign_sync_at_ = received.at;
      [[fallthrough]];
    case Service::nmt:
    case Service::sdo_request:
    case Service::rpdo:
      ++counters_.foreign_node;  // own frames do not come here: another master
      if (service == Service::rpdo || (service == Service::sdo_request && begins_download(frame)))
        ++traffic_.at(node).foreign_writes;
      if (const auto command = parse_foreign_command(frame); command && handlers_.on_foreign_command)
        handlers_.on_foreign_command(*command);
      return;
    case Service::time:
    case Service::other:
      ++counters_.unknown_cob;
  }
}

void Master::on_service(std::uint8_t node, std::uint32_t id, const can::ReceivedFrame& received) {
  if (id == heartbeat_id(node)) return on_heartbeat(node, received);
  if (id == emergency_id(node)) return on_emergency(node, received);
  ++counters_.unknown_cob;  // a PDO that nobody wants
}

void Master::on_heartbeat(std::uint8_t node, const can::ReceivedFrame& received) {
  if (const auto heartbeat = parse_heartbeat(received.frame))
    nmt_.on_heartbeat(node, *heartbeat, received.at);
  else
    ++counters_.malformed;
}

void Master::on_emergency(std::uint8_t node, const can::ReceivedFrame& received) {
  const auto emergency = parse_emergency(node, received.frame, received.at);
  if (!emergency) {
    ++counters_.malformed;
    return;
  }
  emergencies_.add(*emergency);
  if (handlers_.on_emergency) handlers_.on_emergency(*emergency);
}

void Master::on_node_event(const NodeEvent& event) {
  if (event.kind == NodeEvent::Kind::heartbeat_lost) ++traffic_.at(event.node).heartbeats_lost;
  if (event.kind == NodeEvent::Kind::booted) {
    ++traffic_.at(event.node).boots;
    sdo_.on_boot(event.node);
    emergencies_.on_boot(event.node);
  }
  if (handlers_.on_node) handlers_.on_node(event);
}

void Master::on_port_state(const can::PortState& state) {
  if (!state.can_send()) {
    sync_.stop();
    nmt_.forget_states();
  }
  sdo_.on_port(state);
  if (handlers_.on_port) handlers_.on_port(state);
}

}  // namespace axisd::canopen
