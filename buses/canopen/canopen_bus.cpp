#include "buses/canopen/canopen_bus.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace axisd::canopen {

CanopenBus::CanopenBus(Executor executor, Clock& clock, NetworkSettings settings,
                       std::unique_ptr<can::Port> port)
    : settings_(std::move(settings)),
      port_changed_(executor, clock),
      master_(std::move(executor), clock, std::move(port), {.timeout = settings_.sdo_timeout}) {}

CanopenBus::~CanopenBus() = default;

void CanopenBus::start() {
  master_.start({.on_node = [this](const NodeEvent& event) { on_node(event); },
                 .on_emergency =
                     [this](const Emergency& emergency) {
                       const auto node = nodes_.find(emergency.node);
                       if (node != nodes_.end() && node->second.handlers.on_emergency)
                         node->second.handlers.on_emergency(emergency);
                     },
                 .on_port = [this](const can::PortState& state) { on_port(state); }});
}

Result<void> CanopenBus::attach(std::uint8_t node, NodeHandlers handlers) {
  if (const auto added = master_.add_node(node); !added) return added;
  if (!nodes_.try_emplace(node, Node{.handlers = std::move(handlers)}).second)
    return fail(Reason::misconfigured, fmt::format("node {} is in use already", node),
                "give each node an address of its own");
  return {};
}

void CanopenBus::detach(std::uint8_t node) {
  nodes_.erase(node);
  consider_sync();
}

void CanopenBus::watch_heartbeat(std::uint8_t node, Duration timeout) {
  (void)master_.add_node(node, timeout);  // attached: it is a node-ID
}

void CanopenBus::set_readiness(std::uint8_t node, Readiness readiness) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  found->second.readiness = readiness;
  consider_sync();
}

void CanopenBus::consider_sync() {
  if (settings_.sync_period == Duration{} || closed_ || !port_.open || sync_running()) return;
  const auto blocks = [](const auto& node) { return node.second.readiness == Readiness::unknown; };
  const auto settled = [](const auto& node) { return node.second.readiness == Readiness::settled; };
  if (std::ranges::any_of(nodes_, blocks) || std::ranges::none_of(nodes_, settled)) return;
  // The loader has checked the period.
  (void)master_.sync().start({.period = settings_.sync_period}, [this](TimePoint at) { tell_sync(at); });
}

std::shared_ptr<void> CanopenBus::on_sync(std::function<void(TimePoint)> handler) {
  auto token = std::make_shared<std::function<void(TimePoint)>>(std::move(handler));
  sync_handlers_.emplace(++last_sync_handler_, token);
  return token;
}

void CanopenBus::tell_sync(TimePoint at) {
  std::erase_if(sync_handlers_, [](const auto& handler) { return handler.second.expired(); });
  const auto handlers = sync_handlers_;  // a handler may add or end others
  for (const auto& [id, weak] : handlers)
    if (const auto handler = weak.lock()) (*handler)(at);
}

void CanopenBus::on_node(const NodeEvent& event) {
  const auto node = nodes_.find(event.node);
  if (node != nodes_.end() && node->second.handlers.on_event) node->second.handlers.on_event(event);
}

void CanopenBus::on_port(const can::PortState& state) {
  if (port_.open && !state.can_send()) {
    ++losses_;
    last_loss_ = state.error;
  }
  port_ = {.open = state.can_send(), .error = state.error};
  if (!port_.open)
    for (auto& [id, node] : nodes_) node.readiness = Readiness::unknown;
  port_changed_.notify_all();
}

void CanopenBus::close() {
  closed_ = true;
  master_.close();
  port_ = {.open = false, .error = std::nullopt};
  port_changed_.notify_all();
}

}  // namespace axisd::canopen
