#include "daemon/core/bus_recorder.hpp"

#include <utility>

namespace axisd::core {
namespace {

using modbus_rtu::ExchangeStatus;

/// Why no byte went out.
std::string_view why_not_sent(const modbus_rtu::ExchangeResult& result) {
  if (result.status == ExchangeStatus::unsupported) return "unsupported";
  switch (result.verdict) {
    case Verdict::expired:
      return "expired";
    case Verdict::superseded:
      return "superseded";
    case Verdict::lease_lost:
      return "lease lost";
    case Verdict::send:
      break;
  }
  return "port lost";
}

/// Why there is no sound reply.
std::string_view why_failed(ExchangeStatus status) {
  switch (status) {
    case ExchangeStatus::timeout:
      return "timeout";
    case ExchangeStatus::cut:
      return "cut";
    case ExchangeStatus::corrupt:
      return "corrupt";
    default:
      return "port lost";
  }
}

}  // namespace

BusRecorder::BusRecorder(std::string bus, std::size_t memory, int bit_rate, const Clock& clock,
                         FrameObserver observer)
    : bus_(std::move(bus)),
      bit_rate_(bit_rate),
      frames_(memory),
      load_(clock.now()),
      observer_(std::move(observer)) {}

modbus_rtu::ExchangeObserver BusRecorder::exchange_observer() {
  return [this](const modbus_rtu::Transaction& transaction, const modbus_rtu::ExchangeResult& result) {
    on_exchange(transaction, result);
  };
}

NetworkObserver BusRecorder::network_observer() {
  return {.received = [this](const can::ReceivedFrame& received) { on_received(received); },
          .ended = [this](const can::Frame& frame, TransactionClass transaction_class,
                          const can::SendResult& result,
                          TimePoint at) { on_sent(frame, transaction_class, result, at); },
          .state =
              [this](const can::PortState& state, TimePoint at) {
                record({.at = at,
                        .kind = TracedFrame::Kind::link,
                        .on_network = true,
                        .why = can::to_string(state.link)});
              }};
}

void BusRecorder::record(const TracedFrame& frame) {
  frames_.push(frame);
  if (observer_) observer_(bus_, frame);
}

void BusRecorder::on_exchange(const modbus_rtu::Transaction& transaction,
                              const modbus_rtu::ExchangeResult& result) {
  const auto& request = transaction.exchange.frame;
  TracedFrame frame{.at = result.request_begin,
                    .transaction_class = transaction.transaction_class,
                    .node = transaction.exchange.request.node,
                    .bytes = request.bytes()};
  if (result.status == ExchangeStatus::not_sent || result.status == ExchangeStatus::unsupported) {
    frame.kind = TracedFrame::Kind::not_sent;
    frame.why = why_not_sent(result);
    return record(frame);
  }
  record(frame);
  if (result.reply_frame.size() > 0) {
    frame.kind = TracedFrame::Kind::received;
    frame.at = result.reply_begin;
    frame.bytes = result.reply_frame.bytes();
    record(frame);
  }
  if (result.status == ExchangeStatus::replied) return;
  frame.kind = TracedFrame::Kind::failed;
  frame.at = result.reply_end;
  frame.bytes = {};
  frame.why = why_failed(result.status);
  record(frame);
}

void BusRecorder::on_received(const can::ReceivedFrame& received) {
  occupy(received.frame, received.at);
  TracedFrame frame{.at = received.at, .kind = TracedFrame::Kind::received};
  frame.set(received.frame);
  record(frame);
}

/// A frame that was never confirmed may have been sent, so it has both lines.
void BusRecorder::on_sent(const can::Frame& sent, TransactionClass transaction_class,
                          const can::SendResult& result, TimePoint at) {
  TracedFrame frame{.at = result.handed_over, .transaction_class = transaction_class};
  frame.set(sent);
  const bool confirmed = result.status == can::SendStatus::sent;
  const bool handed_over = confirmed || result.status == can::SendStatus::unknown;
  if (confirmed) occupy(sent, result.sent_at);
  if (handed_over) record(frame);
  if (confirmed) return;
  frame.at = at;
  frame.kind = handed_over ? TracedFrame::Kind::failed : TracedFrame::Kind::not_sent;
  frame.why = can::to_string(result.status);
  record(frame);
}

void BusRecorder::occupy(const can::Frame& frame, TimePoint end) {
  if (bit_rate_ <= 0) return;
  load_.add(end - can::worst_case_time(frame, static_cast<std::uint32_t>(bit_rate_)), end);
}

}  // namespace axisd::core
