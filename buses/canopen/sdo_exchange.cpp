// The transfer that is under way at a node: its frames, what answers them, and how it ends.
#include <fmt/format.h>

#include <ranges>
#include <utility>

#include "buses/canopen/cob.hpp"
#include "buses/canopen/sdo_client_state.hpp"

namespace axisd::canopen {

void SdoClient::begin(Node& node, RequestPtr request) {
  const auto now = clock_->now();
  const bool held = node.late.may_come(request->object, now);
  const bool probe = held && request->options.transaction_class != TransactionClass::stop;
  const auto limit = request->options.upload_limit.value_or(settings_.upload_limit);
  auto transfer = request->download ? SdoTransfer::download(request->object, request->bytes)
                                    : SdoTransfer::upload(request->object, limit);
  if (probe) {
    const auto object = node.late.probe(now);
    if (!object) {
      complete(node, std::move(request),
               fail(Reason::no_reply, "not sent: the node has not answered for too long",
                    "check power, wiring, node-ID and bit rate of the node"));
      return;
    }
    ++node.counters.resynchronisations;
    transfer = SdoTransfer::upload(*object, settings_.upload_limit);
  }
  node.active.emplace(Active{.request = std::move(request),
                             .transfer = std::move(transfer),
                             .probe = probe,
                             .ambiguous = held && !probe});
  ++node.counters.transfers;
  send(node, node.active->transfer.first_frame());
}

void SdoClient::send(Node& node, const SdoData& data) {
  auto& active = *node.active;
  const auto& options = active.request->options;
  active.frame_id = ++last_frame_id_;
  active.last_sent.reset();
  can::SendOptions how{.transaction_class = options.transaction_class};
  if (!active.any_sent()) how.deadline = options.deadline;
  if (!active.probe) how.guard = options.guard;
  const auto frame = can::make_frame(sdo_request_id(node.id), data);
  port_->send(frame, how,
              [this, id = node.id, frame_id = active.frame_id, frame](const can::SendResult& result) {
                on_sent(id, frame_id, result, frame);
              });
}

/// Ahead of whatever its class would wait for: the server is busy until it gets this.
void SdoClient::send_abort(Node& node, const SdoData& data, TransactionClass transaction_class) {
  port_->send(
      can::make_frame(sdo_request_id(node.id), data),
      {.transaction_class = transaction_class, .deadline = clock_->now() + settings_.timeout},
      [](const can::SendResult&) { /* nobody waits for it, and its loss costs a repetition at most */ });
}

void SdoClient::on_sent(std::uint8_t id, std::uint64_t frame_id, const can::SendResult& result,
                        const can::Frame& frame) {
  auto& target = node(id);
  if (!target.active || target.active->frame_id != frame_id) return;
  auto& active = *target.active;
  if (result.status == can::SendStatus::sent) {
    active.last_sent = result.sent_at;
    if (!active.any_sent()) {
      active.first_sent = result.sent_at;
      count_begin(active);
      active.limit =
          result.sent_at + active.request->options.transfer_limit.value_or(settings_.transfer_limit);
    }
    return pump(target);
  }
  auto error = can::error_of(result, port_->settings().bus, frame);
  if (result.status == can::SendStatus::unknown) {
    active.request->sent = true;
    target.late.expect(active.transfer.object(), clock_->now());
    error.outcome = active.transfer.complete_at_server() ? Outcome::unknown : Outcome::not_executed;
  } else if (active.any_sent()) {
    send_abort(target, active.transfer.abort(SdoAbort::general), active.request->options.transaction_class);
    error.outcome = Outcome::not_executed;
  }
  fail_active(target, std::move(error), false);
  pump(target);
}

void SdoClient::on_reply(std::uint8_t id, const can::ReceivedFrame& received) {
  const auto found = nodes_.find(id);
  if (found == nodes_.end()) {
    ++others_.unexpected_replies;
    return;
  }
  auto& target = *found->second;
  if (!target.active) return on_unexpected(target);
  auto& active = *target.active;
  const bool others_yield = target.yielded_to_until(clock_->now()).has_value();
  auto step = active.transfer.on_reply(parse_sdo_reply(received.frame));
  using Kind = SdoTransfer::Step::Kind;
  if (step.kind == Kind::ignored) return on_unexpected(target);
  target.surplus.on_answer();
  if (!others_yield && active.last_sent) target.note_answer(clock_->now() - *active.last_sent);
  if (!active.ambiguous) target.late.forget();
  const bool over = step.kind != Kind::send;
  if (over && active.probe) {
    // An abort is as good an answer: both sides are in step again.
    if (step.kind == Kind::failed && step.frame)
      send_abort(target, *step.frame, active.request->options.transaction_class);
    auto request = std::move(active.request);
    target.active.reset();
    target.lane(request->options.transaction_class).push_front(std::move(request));
  } else if (step.kind == Kind::send) {
    active.opened = true;
    const bool gives_way =
        target.stop_waits() && active.request->options.transaction_class != TransactionClass::stop;
    gives_way ? cut(target) : send(target, *step.frame);
  } else if (step.kind == Kind::done) {
    finish(target, SdoAnswer{.bytes = active.transfer.is_download() ? Bytes{} : active.transfer.bytes(),
                             .size_indicated = active.transfer.size_indicated(),
                             .ambiguous = active.ambiguous,
                             .sent_at = active.first_sent,
                             .answered_at = received.at});
  } else {
    ++(step.frame ? target.counters.protocol_errors : target.counters.aborted_by_node);
    if (step.frame) send_abort(target, *step.frame, active.request->options.transaction_class);
    finish(target, fail(std::move(step.error)));
  }
  pump(target);
  if (!others_yield) return;
  const auto yields = [](const auto& node) { return node->yields_until.has_value(); };
  for (auto& node : nodes_ | std::views::values | std::views::filter(yields)) pump(*node);
}

/// Nobody waits for this reply: late, or of a second node with this node-ID.
void SdoClient::on_unexpected(Node& node) {
  ++node.counters.unexpected_replies;
  if (!node.late.explain()) node.surplus.on_surplus();
}

/// A reply or the whole transfer is overdue.
void SdoClient::on_due(Node& node) {
  if (node.active && node.active->last_sent) {
    auto& active = *node.active;
    const auto now = clock_->now();
    const auto timeout = active.request->options.timeout.value_or(settings_.timeout);
    const bool endless = now >= active.limit;
    if (endless || now >= *active.last_sent + timeout) {
      ++node.counters.timeouts;
      node.usual_answer.reset();
      auto error = no_reply_error(active.transfer);
      if (endless && active.limit > active.first_sent + timeout) {
        error.message =
            fmt::format("the transfer did not end in time, {} bytes so far", active.transfer.bytes().size());
        error.remedy = "check that the drive's object dictionary is the expected one";
      }
      node.late.expect(active.transfer.object(), now);
      const auto own_class = active.request->options.transaction_class;
      // Another stop follows at once: see cut().
      if (active.opened || (own_class != TransactionClass::stop && !node.stop_waits()))
        send_abort(node, active.transfer.abort(SdoAbort::timed_out), own_class);
      fail_active(node, std::move(error), !endless);
    }
  }
  pump(node);
}

/// A stop takes the place of what is under way. A server that has not answered yet has nothing open, and is
/// spared the abort: a small one has one buffer, and of two frames in a row loses the second.
void SdoClient::cut(Node& node) {
  auto& active = *node.active;
  ++node.counters.cut_by_stop;
  node.late.expect(active.transfer.object(), clock_->now());
  if (active.opened) send_abort(node, active.transfer.abort(SdoAbort::general), TransactionClass::stop);
  if (active.probe) {
    auto request = std::move(active.request);
    node.active.reset();
    node.lane(request->options.transaction_class).push_front(std::move(request));
    return;
  }
  finish(node,
         fail({.reason = Reason::superseded,
               .message = "a stop took its place",
               .remedy = "read back before repeating it",
               .outcome = active.transfer.complete_at_server() ? Outcome::unknown : Outcome::not_executed}));
}

/// Ends what is under way; with `may_retry`, and attempts left, it is asked again.
void SdoClient::fail_active(Node& node, Error error, bool may_retry) {
  if (node.active->probe) {
    error.message = fmt::format("not sent: the read of object {} before it: {}",
                                to_string(node.active->transfer.object()), error.message);
    error.outcome = Outcome::not_sent;
  } else if (may_retry && --node.active->request->attempts > 0) {
    count_end(*node.active, clock_->now(), &error);
    auto request = std::move(node.active->request);
    request->perhaps_done |= error.outcome == Outcome::unknown;
    request->asked_at = clock_->now();
    node.active.reset();
    node.lane(request->options.transaction_class).push_front(std::move(request));
    return;
  }
  finish(node, fail(std::move(error)));
}

void SdoClient::finish(Node& node, Result<SdoAnswer> result) {
  count_end(*node.active, result ? result->answered_at : clock_->now(), result ? nullptr : &result.error());
  auto request = std::move(node.active->request);
  node.active.reset();
  complete(node, std::move(request), std::move(result));
}

}  // namespace axisd::canopen
