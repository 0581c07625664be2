#include "buses/canopen/canopen_bus.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace axisd::canopen {

namespace {

/// Bring-up, and whatever follows a common start that went wrong, is over by then, or it needs a person.
constexpr auto sync_patience = std::chrono::seconds(5);

}  // namespace

CanopenBus::CanopenBus(Executor executor, Clock& clock, NetworkSettings settings,
                       std::unique_ptr<can::Port> port)
    : executor_(std::move(executor)),
      clock_(&clock),
      settings_(std::move(settings)),
      port_changed_(executor_, clock),
      master_(executor_, clock, std::move(port), {.timeout = settings_.sdo_timeout}),
      sync_released_(executor_, clock),
      sync_idle_(executor_, clock) {
  master_.sync().on_idle([this] { sync_idle_.notify_all(); });
}

CanopenBus::~CanopenBus() = default;

void CanopenBus::start() {
  master_.start(
      {.on_node = [this](const NodeEvent& event) { on_node(event); },
       .on_emergency =
           [this](const Emergency& emergency) {
             const auto node = nodes_.find(emergency.node);
             if (node != nodes_.end() && node->second.handlers.on_emergency)
               node->second.handlers.on_emergency(emergency);
           },
       .on_port = [this](const can::PortState& state) { on_port(state); },
       .on_foreign_command = [this](const ForeignCommand& command) { on_foreign_command(command); }});
}

Result<void> CanopenBus::attach(std::uint8_t node, NodeHandlers handlers) {
  if (const auto added = master_.add_node(node); !added) return added;
  if (!nodes_.try_emplace(node, Node{.handlers = std::move(handlers)}).second)
    return fail(Reason::misconfigured, fmt::format("node {} is in use already", node),
                "give each node an address of its own");
  master_.sync().stop();
  consider_sync();
  return {};
}

void CanopenBus::detach(std::uint8_t node) {
  nodes_.erase(node);
  master_.remove_node(node);
  consider_sync();
}

void CanopenBus::watch_heartbeat(std::uint8_t node, Duration timeout) {
  (void)master_.add_node(node, timeout);  // attached: it is a node-ID
}

void CanopenBus::set_readiness(std::uint8_t node, Readiness readiness) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  found->second.readiness = readiness;
  if (readiness == Readiness::settled) found->second.armed = false;
  if (readiness == Readiness::unknown) master_.sync().stop();
  consider_sync();
}

void CanopenBus::consider_sync() {
  const bool wanted = settings_.sync_period != Duration{} && !closed_ && port_.open;
  const bool blocked = wanted && !master_.sync().running() && sync_blocker() != nullptr;
  watch_sync(blocked);
  if (!wanted || blocked || master_.sync().running()) return;
  const auto settled = [](const auto& node) { return node.second.readiness == Readiness::settled; };
  if (std::ranges::none_of(nodes_, settled)) return;
  // The loader has checked the period.
  (void)master_.sync().start({.period = settings_.sync_period}, [this](TimePoint at) { tell_sync(at); });
}

const std::pair<const std::uint8_t, CanopenBus::Node>* CanopenBus::sync_blocker() const {
  const auto found =
      std::ranges::find_if(nodes_, [](const auto& node) { return !node.second.may_hear_sync(); });
  return found == nodes_.end() ? nullptr : &*found;
}

void CanopenBus::watch_sync(bool blocked) {
  if (blocked && !sync_overdue_)
    sync_overdue_ = clock_->call_at(clock_->now() + sync_patience, [this] { tell_sync_trouble(); });
  if (blocked) return;
  sync_overdue_.reset();
  if (std::exchange(sync_trouble_, std::nullopt))
    spdlog::info("{}: nothing stands against SYNC any more", name());
}

/// Again and again as long as it lasts: another node may be the reason meanwhile.
void CanopenBus::tell_sync_trouble() {
  sync_overdue_.reset();
  const auto* blocker = sync_blocker();
  watch_sync(blocker != nullptr);
  if (blocker == nullptr) return;
  const auto& [id, node] = *blocker;
  Error error{.reason = Reason::not_confirmed,
              .message = fmt::format("no SYNC is sent: node {} was heard and not brought up, and may hold "
                                     "something for the next SYNC",
                                     id),
              .remedy = "see the state of its axis or device",
              .where = {.bus = name(), .node = id}};
  if (node.armed) {
    error.message =
        fmt::format("no SYNC is sent: node {} was prepared for a common start, and would start with it", id);
    error.remedy =
        "reconnect the node, or switch its supply off and on; a daemon that is restarted instead would not "
        "know of this, and start it";
  }
  const bool told = sync_trouble_ && sync_trouble_->message == error.message;
  sync_trouble_ = std::move(error);
  if (!told) spdlog::warn("{}", to_string(*sync_trouble_));
}

std::shared_ptr<void> CanopenBus::on_sync(std::function<void(TimePoint)> handler) {
  auto token = std::make_shared<std::function<void(TimePoint)>>(std::move(handler));
  sync_handlers_.emplace(++last_sync_handler_, token);
  return token;
}

void CanopenBus::tell_sync(TimePoint at) {
  // Completions come in the order of the wire: what is still on its way comes after this SYNC.
  for (auto& [id, node] : nodes_) node.waits = false;
  std::erase_if(sync_handlers_, [](const auto& handler) { return handler.second.expired(); });
  const auto handlers = sync_handlers_;  // a handler may add or end others
  for (const auto& [id, weak] : handlers)
    if (const auto handler = weak.lock()) (*handler)(at);
}

Task<std::shared_ptr<void>> CanopenBus::hold_sync() {
  while (!holder_.expired()) co_await sync_released_.wait();
  std::shared_ptr<void> token(this, [alive = std::weak_ptr(alive_)](void* bus) {
    if (!alive.expired()) static_cast<CanopenBus*>(bus)->release_sync();
  });
  holder_ = token;
  master_.sync().hold();
  while (master_.sync().on_its_way()) co_await sync_idle_.wait();
  co_return token;
}

/// No cycle goes to a node that may still hold what was to start it.
void CanopenBus::release_sync() {
  for (auto& [id, node] : nodes_)
    if (node.armed) set_readiness(id, Readiness::unknown);
  master_.sync().resume();
  consider_sync();
  sync_released_.notify_all();
}

std::optional<Error> CanopenBus::objection_to_sync() const {
  constexpr auto foreign_lasts = std::chrono::seconds(1);
  const auto objection = [this](Reason reason, std::string message, std::string remedy) {
    return Error{.reason = reason,
                 .message = std::move(message),
                 .remedy = std::move(remedy),
                 .outcome = Outcome::not_executed,
                 .where = {.bus = settings_.name}};
  };
  if (closed_ || !port_.open)
    return objection(Reason::bus_down, "the CAN interface cannot send", "see the state of the bus");
  if (const auto foreign = master_.foreign_sync_at(); foreign && clock_->now() - *foreign < foreign_lasts)
    return objection(Reason::misconfigured, "something else on the network sends SYNC",
                     "switch the other SYNC producer off");
  for (const auto& [id, node] : nodes_)
    if (node.readiness == Readiness::unknown)
      return objection(Reason::busy, fmt::format("node {} may hold something for the next SYNC", id),
                       "wait until it is online, or found to be absent");
  return std::nullopt;
}

Task<Result<TimePoint>> CanopenBus::send_sync(can::SendOptions options) {
  if (auto objection = objection_to_sync()) co_return fail(std::move(*objection));
  auto sent = std::make_shared<std::optional<can::SendResult>>();
  master_.sync().send_once(options, [this, sent](const can::SendResult& result) {
    *sent = result;
    if (result.status == can::SendStatus::sent) tell_sync(result.sent_at);
  });
  while (!*sent) co_await sync_idle_.wait();
  if ((*sent)->status == can::SendStatus::sent) co_return (*sent)->sent_at;
  co_return fail(can::error_of(**sent, settings_.name, sync_frame(sync_id, 0)));
}

Task<Result<can::SendResult>> CanopenBus::send_waiting(std::uint8_t node, std::uint32_t cob_id, Bytes bytes,
                                                       can::SendOptions options) {
  if (const auto found = nodes_.find(node); found != nodes_.end()) ++found->second.on_its_way;
  auto sent = co_await master_.send_pdo(cob_id, std::move(bytes), std::move(options));
  if (const auto found = nodes_.find(node); found != nodes_.end()) {
    --found->second.on_its_way;
    found->second.waits = found->second.waits || sent || sent.error().outcome == Outcome::unknown;
  }
  co_return sent;
}

bool CanopenBus::waits(std::uint8_t node) const {
  const auto found = nodes_.find(node);
  return found != nodes_.end() && (found->second.waits || found->second.on_its_way > 0);
}

void CanopenBus::set_armed(std::uint8_t node, bool armed) {
  if (const auto found = nodes_.find(node); found != nodes_.end()) found->second.armed = armed;
}

bool CanopenBus::armed(std::uint8_t node) const {
  const auto found = nodes_.find(node);
  return found != nodes_.end() && found->second.armed;
}

void CanopenBus::on_node(const NodeEvent& event) {
  const auto node = nodes_.find(event.node);
  if (node == nodes_.end()) return;
  if (event.kind == NodeEvent::Kind::booted) {
    node->second.armed = node->second.waits = false;
    consider_sync();
  }
  if (node->second.handlers.on_event) node->second.handlers.on_event(event);
}

void CanopenBus::on_foreign_command(const ForeignCommand& command) {
  for (const auto& [id, node] : nodes_)
    if ((command.node == 0 || command.node == id) && node.handlers.on_foreign_command)
      node.handlers.on_foreign_command(command.what);
}

void CanopenBus::on_port(const can::PortState& state) {
  if (port_.open && !state.can_send()) {
    ++losses_;
    last_loss_ = state.error;
  }
  port_ = {.open = state.can_send(), .error = state.error};
  if (!port_.open)
    for (auto& [id, node] : nodes_) node.readiness = Readiness::unknown;
  consider_sync();
  port_changed_.notify_all();
}

void CanopenBus::close() {
  closed_ = true;
  master_.close();
  port_ = {.open = false, .error = Error{.reason = Reason::cancelled, .message = "the bus is being closed"}};
  consider_sync();
  port_changed_.notify_all();
}

}  // namespace axisd::canopen
