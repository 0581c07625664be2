// What a caller is told of how its exchange ended.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "buses/modbus_rtu/rtu_bus.hpp"

namespace axisd::modbus_rtu {

namespace {

/// Damaged replies in a row that are no accident any more.
constexpr int garbled_often = 3;

Error not_sent_error(Verdict verdict) {
  switch (verdict) {
    case Verdict::expired:
      return {.reason = Reason::expired,
              .message = "not sent: its time had passed",
              .remedy = "repeat the request"};
    case Verdict::lease_lost:
      return {.reason = Reason::lease_lost,
              .message = "not sent: the lease is gone",
              .remedy = "acquire it again"};
    default:
      return {.reason = Reason::superseded, .message = "not sent: a stop or a newer command took its place"};
  }
}

Error late_error(Duration turnaround_max) {
  return {
      .reason = Reason::no_reply,
      .message = fmt::format("no reply in time, but a frame later than turnaround_max ({} ms): most likely "
                             "the node answers late",
                             turnaround_max / std::chrono::milliseconds(1)),
      .remedy =
          "raise turnaround_max, of the axis or of its line, to what the node needs; else check power, "
          "wiring, address and baud rate of the node",
      .outcome = Outcome::unknown};
}

Error garbled_error(int in_a_row) {
  Error error{.reason = Reason::no_reply,
              .message = "only damaged bytes came back",
              .remedy = "check termination, shielding and that no address is used twice",
              .outcome = Outcome::unknown};
  if (in_a_row >= garbled_often) {
    error.message =
        fmt::format("only damaged bytes came back, {} times in a row (two nodes on one address?)", in_a_row);
    error.remedy =
        "switch off one node after the other to find a second one with this address; else check the "
        "baud rate, termination and shielding";
  }
  return error;
}

}  // namespace

int RtuBus::garbled(std::uint8_t node) const {
  const auto found = garbled_.find(node);
  return found == garbled_.end() ? 0 : found->second;
}

void RtuBus::note_garbled(const Request& request, const ExchangeResult& result) {
  if (result.status == ExchangeStatus::corrupt) {
    const int in_a_row = ++garbled_[request.node];
    if (in_a_row != garbled_often) return;
    auto error = garbled_error(in_a_row);
    error.where = {.bus = settings_.name, .node = request.node};
    spdlog::warn("{}", to_string(error));
  } else if (result.status != ExchangeStatus::not_sent && result.status != ExchangeStatus::unsupported) {
    garbled_.erase(request.node);
  }
}

TimePoint RtuBus::disturbed_at(std::uint8_t node) const {
  const auto* found = disturbed_.find(node);
  return found == nullptr ? line_disturbed_ : std::max(*found, line_disturbed_);
}

/// Noted as of now: what was asked for before the core heard of it proves nothing.
void RtuBus::note_disturbance(const Request& request, const ExchangeResult& result) {
  using enum ExchangeStatus;
  if (result.foreign_frames > 0) line_disturbed_ = clock_->now();
  if (result.status == not_sent || result.status == unsupported) return;
  if (result.status != replied || result.reply.kind == ReplyKind::exception)
    disturbed_[request.node] = clock_->now();
}

Result<Answer> RtuBus::answer(const Transaction& transaction, const ExchangeResult& result) const {
  const auto& request = transaction.exchange.request;
  if (result.status == ExchangeStatus::replied && result.reply.kind != ReplyKind::exception)
    return Answer{.registers = result.registers(),
                  .sent_at = result.request_begin,
                  .request_end = result.request_end,
                  .answered_at = result.reply_end,
                  .certain = !late_.may_echo(request, clock_->now())};
  auto error = error_of(transaction.exchange, result);
  error.where.bus = settings_.name;
  error.where.node = request.node;
  error.where.object = request.address;
  return fail(std::move(error));
}

Error RtuBus::error_of(const Exchange& exchange, const ExchangeResult& result) const {
  switch (result.status) {
    case ExchangeStatus::replied: {
      Error error{
          .reason = Reason::refused,
          .message = fmt::format("the node answered with exception {:02}", result.reply.exception_code),
          .outcome = Outcome::refused};
      error.where.native_code = result.reply.exception_code;
      return error;
    }
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
      if (late_.answers_late(exchange.request.node, clock_->now()))
        return late_error(turnaround_max(exchange.request.node));
      return {.reason = Reason::no_reply,
              .message = "no reply",
              .remedy = "check power, wiring, address and baud rate of the node",
              .outcome = Outcome::unknown};
    case ExchangeStatus::corrupt:
      return garbled_error(garbled(exchange.request.node));
    case ExchangeStatus::unsupported:
      return {.reason = Reason::not_supported,
              .message = fmt::format("port {} cannot do {}", settings_.port,
                                     to_string(exchange.serial.value_or(settings_.serial()))),
              .remedy = "choose other settings, or another adapter"};
    case ExchangeStatus::not_sent:
      if (result.verdict != Verdict::send) return not_sent_error(result.verdict);
      return port_.error.value_or(
          Error{.reason = Reason::bus_down, .message = "the port was lost before it could be sent"});
    case ExchangeStatus::io_error:
      return {.reason = Reason::bus_down,
              .message = fmt::format("port {}: {}", settings_.port, std::strerror(result.native_error)),
              .remedy = "check the adapter; it is opened again by itself",
              .outcome = Outcome::unknown};
  }
  return {.reason = Reason::internal, .message = "unhandled exchange status"};
}

}  // namespace axisd::modbus_rtu
