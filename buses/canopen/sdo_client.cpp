// Which request of which node comes next, and what ends those that wait.
#include "buses/canopen/sdo_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "buses/canopen/cob.hpp"
#include "buses/canopen/sdo_client_state.hpp"

namespace axisd::canopen {

SdoClient::SdoClient(Executor executor, Clock& clock, can::Port& port, SdoSettings settings)
    : executor_(std::move(executor)), clock_(&clock), port_(&port), settings_(settings) {}

SdoClient::~SdoClient() = default;

SdoClient::Node& SdoClient::node(std::uint8_t id) {
  auto& slot = nodes_[id];
  if (!slot) {
    slot = std::make_unique<Node>();
    slot->id = id;
  }
  return *slot;
}

Task<Result<SdoAnswer>> SdoClient::upload(std::uint8_t node, Object object, SdoOptions options) {
  auto request = std::make_unique<Request>();
  request->object = object;
  request->attempts = options.attempts.value_or(settings_.upload_attempts);
  request->options = std::move(options);
  co_return co_await transact(node, std::move(request));
}

Task<Result<SdoAnswer>> SdoClient::download(std::uint8_t node, Object object, Bytes bytes,
                                            SdoOptions options) {
  auto request = std::make_unique<Request>();
  request->download = true;
  request->object = object;
  request->bytes = std::move(bytes);
  request->attempts = options.attempts.value_or(1);
  request->options = std::move(options);
  co_return co_await transact(node, std::move(request));
}

Task<Result<SdoAnswer>> SdoClient::transact(std::uint8_t id, RequestPtr request) {
  std::optional<Error> why;
  auto& state = port_->state();
  if (!valid_node(id))
    why = Error{.reason = Reason::invalid_argument,
                .message = fmt::format("node-ID {} does not exist", id),
                .remedy = "use 1 to 127"};
  else if (request->download && request->bytes.empty())
    why = Error{.reason = Reason::invalid_argument,
                .message = "nothing to write",
                .remedy = "give at least one byte"};
  else if (closed_)
    why = Error{.reason = Reason::cancelled, .message = "the bus is being closed"};
  else if (!state.can_send())
    why = state.error.value_or(Error{.reason = Reason::bus_down,
                                     .message = fmt::format("the link is {}", can::to_string(state.link))});
  else if (auto& known = node(id);
           known.count() >=
           settings_.queue_limit * (request->options.transaction_class == TransactionClass::stop ? 2 : 1))
    why = Error{.reason = Reason::busy,
                .message = fmt::format("{} requests wait for this node", known.count()),
                .remedy = "retry later"};
  if (why) {
    ++(nodes_.contains(id) ? node(id).counters : others_).rejected;
    why->where = {.bus = port_->settings().bus, .node = id, .object = request->object.key()};
    co_return fail(std::move(*why));
  }

  Promise<Result<SdoAnswer>> promise(executor_, *clock_);
  request->done = [&promise](Result<SdoAnswer> result) { promise.set(std::move(result)); };
  auto& target = node(id);
  request->asked_at = clock_->now();
  const auto own_class = request->options.transaction_class;
  target.lane(own_class).push_back(std::move(request));
  pump(target);
  auto& most = classes_.at(std::to_underlying(own_class)).most_waiting;
  most = std::max(most, waiting(own_class));
  co_return co_await promise.get();
}

/// Begins what may begin. After each change of a node.
void SdoClient::pump(Node& node) {
  if (closed_) return;
  reap(node);
  if (node.active && node.stop_waits() && node.active->last_sent &&
      node.active->request->options.transaction_class != TransactionClass::stop &&
      clock_->now() >= *node.active->last_sent + settings_.turnaround)
    cut(node);
  node.yields_until.reset();
  if (node.count() > 0 && !node.never_yields())
    for (const auto& [id, other] : nodes_)
      if (const auto until = other->yielded_to_until(clock_->now())) node.yields_until = until;
  while (!node.active && !node.yields_until) {
    auto request = node.pop();
    if (!request) break;
    begin(node, std::move(request));
  }
  arm(node);
}

void SdoClient::reap(Node& node) {
  if (node.count() == 0) return;
  const auto now = clock_->now();
  end_queued(node, [now](const Request& request) -> std::optional<Error> {
    if (request.options.deadline < now) return expired_error();
    switch (may_send(request.options.guard, now)) {
      case Verdict::send:
        return std::nullopt;
      case Verdict::expired:
        return expired_error();
      case Verdict::lease_lost:
        return Error{.reason = Reason::lease_lost,
                     .message = "not sent: the lease is gone",
                     .remedy = "acquire it again"};
      case Verdict::superseded:
        break;
    }
    return Error{.reason = Reason::superseded,
                 .message = "not sent: a stop or a newer command took its place"};
  });
}

void SdoClient::end_queued(Node& node, const std::function<std::optional<Error>(const Request&)>& why) {
  for (auto& lane : node.waiting) {
    for (auto& request : lane) {
      if (auto error = why(*request)) complete(node, std::move(request), fail(std::move(*error)));
    }
    std::erase(lane, nullptr);
  }
}

void SdoClient::complete(Node& node, RequestPtr request, Result<SdoAnswer> result) {
  if (!result) {
    if (!request->sent) count_drop(*request, result.error().reason);
    if (request->perhaps_done) result.error().outcome = Outcome::unknown;
    auto& where = result.error().where;
    where.bus = port_->settings().bus;
    where.node = node.id;
    where.object = request->object.key();
  }
  request->done(std::move(result));
}

SdoCounters& SdoCounters::operator+=(const SdoCounters& other) {
  transfers += other.transfers;
  aborted_by_node += other.aborted_by_node;
  timeouts += other.timeouts;
  protocol_errors += other.protocol_errors;
  unexpected_replies += other.unexpected_replies;
  resynchronisations += other.resynchronisations;
  cut_by_stop += other.cut_by_stop;
  rejected += other.rejected;
  return *this;
}

SdoCounters SdoClient::counters(std::uint8_t node) const {
  const auto found = nodes_.find(node);
  return found == nodes_.end() ? SdoCounters{} : found->second->counters;
}

SdoCounters SdoClient::counters() const {
  auto sum = others_;
  for (const auto& [id, node] : nodes_) sum += node->counters;
  return sum;
}

std::size_t SdoClient::waiting(TransactionClass transaction_class) const {
  std::size_t sum = 0;
  for (const auto& [id, node] : nodes_) sum += node->lane(transaction_class).size();
  return sum;
}

StatisticsByClass SdoClient::classes() const {
  auto all = classes_;
  for (std::size_t i = 0; i < all.size(); ++i) all.at(i).waiting = waiting(static_cast<TransactionClass>(i));
  return all;
}

void SdoClient::count_drop(const Request& request, Reason why) {
  auto& drops = classes_.at(std::to_underlying(request.options.transaction_class)).drops;
  switch (why) {
    case Reason::expired:
      ++drops.expired;
      return;
    case Reason::superseded:
      ++drops.superseded;
      return;
    case Reason::lease_lost:
      ++drops.lease_lost;
      return;
    default:
      ++drops.port_lost;
  }
}

void SdoClient::count_begin(const Active& active) {
  if (active.probe) return;
  active.request->sent = true;
  auto& counted = classes_.at(std::to_underlying(active.request->options.transaction_class));
  ++counted.sent;
  counted.queueing.add(active.first_sent - active.request->asked_at);
}

void SdoClient::count_end(const Active& active, TimePoint at, const Error* error) {
  if (active.probe || !active.any_sent()) return;
  auto& counted = classes_.at(std::to_underlying(active.request->options.transaction_class));
  counted.exchange.add(at - active.first_sent);
  auto& ends = counted.ends;
  if (error == nullptr)
    ++ends.answered;
  else if (error->outcome == Outcome::refused)
    ++ends.refused;
  else if (error->reason == Reason::no_reply || error->reason == Reason::superseded)
    ++(error->where.native_code ? ends.damaged : ends.no_reply);
  else if (error->reason == Reason::out_of_range)  // more than was asked for
    ++ends.damaged;
  else
    ++ends.failed;
}

bool SdoClient::answers_twice(std::uint8_t node) const {
  const auto found = nodes_.find(node);
  return found != nodes_.end() && found->second->surplus.habitual();
}

bool SdoClient::urgent() const {
  return std::ranges::any_of(nodes_, [](const auto& each) {
    const auto& active = each.second->active;
    return active && active->request->options.transaction_class <= TransactionClass::motion;
  });
}

void SdoClient::on_boot(std::uint8_t id) {
  const auto found = nodes_.find(id);
  if (found == nodes_.end()) return;
  auto& target = *found->second;
  target.late.forget();  // frames of a node keep their order: nothing of before can follow
  if (target.active && target.active->any_sent())
    finish(target,
           fail(rebooted_error(target.active->transfer.complete_at_server() ? Outcome::unknown
                                                                            : Outcome::not_executed)));
  end_queued(target, [](const Request& request) -> std::optional<Error> {
    if (request.options.transaction_class == TransactionClass::stop) return std::nullopt;
    return rebooted_error(Outcome::not_sent);
  });
  pump(target);
}

void SdoClient::on_port(const can::PortState& state) {
  if (state.can_send()) return;
  const auto error = state.error.value_or(Error{
      .reason = Reason::bus_down, .message = fmt::format("the link is {}", can::to_string(state.link))});
  for (auto& [id, each] : nodes_) {
    end_queued(*each, [&error](const Request&) { return std::optional(error); });
    if (!each->active || !each->active->last_sent) continue;  // in the port: it ends by its completion
    each->late.expect(each->active->transfer.object(), clock_->now());
    auto lost = error;
    lost.outcome = each->active->transfer.complete_at_server() ? Outcome::unknown : Outcome::not_executed;
    fail_active(*each, std::move(lost), false);
    arm(*each);
  }
}

void SdoClient::purge_superseded(std::uint8_t node) {
  if (const auto found = nodes_.find(node); found != nodes_.end()) pump(*found->second);
}

void SdoClient::close() {
  closed_ = true;
  const Error error{.reason = Reason::cancelled, .message = "the bus is being closed"};
  for (auto& [id, each] : nodes_) {
    each->timer.reset();
    end_queued(*each, [&error](const Request&) { return std::optional(error); });
    if (!each->active) continue;
    auto lost = error;
    if (each->active->transfer.complete_at_server()) lost.outcome = Outcome::unknown;
    finish(*each, fail(std::move(lost)));
  }
}

void SdoClient::arm(Node& node) {
  auto when = TimePoint::max();
  if (node.active && node.active->last_sent) {
    const auto sent = *node.active->last_sent;
    when = std::min(node.active->limit,
                    sent + node.active->request->options.timeout.value_or(settings_.timeout));
    if (node.stop_waits() && node.active->request->options.transaction_class != TransactionClass::stop)
      when = std::min(when, sent + settings_.turnaround);
  }
  if (!node.active && node.yields_until) when = std::min(when, *node.yields_until);
  for (const auto& lane : node.waiting) {
    for (const auto& request : lane) {
      const auto last = std::min(request->options.deadline, request->options.guard.not_after);
      if (last != TimePoint::max()) when = std::min(when, last + std::chrono::nanoseconds(1));
    }
  }
  node.timer =
      when == TimePoint::max() ? Clock::Timer{} : clock_->call_at(when, [this, &node] { on_due(node); });
}

}  // namespace axisd::canopen
