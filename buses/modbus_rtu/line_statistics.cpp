#include "buses/modbus_rtu/line_statistics.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace axisd::modbus_rtu {

void LineStatistics::queued(TransactionClass transaction_class, std::size_t waiting) {
  auto& most = classes_.at(std::to_underlying(transaction_class)).most_waiting;
  most = std::max(most, waiting);
}

void LineStatistics::ended(const Transaction& transaction, const ExchangeResult& result) {
  foreign_frames_ += static_cast<std::uint64_t>(result.foreign_frames);
  if (result.status == ExchangeStatus::not_sent || result.status == ExchangeStatus::unsupported)
    drop(classes_.at(std::to_underlying(transaction.transaction_class)).drops, result);
  else
    sent(transaction, result);
}

void LineStatistics::drop(Drops& drops, const ExchangeResult& result) {
  if (result.status == ExchangeStatus::unsupported) {
    ++drops.unsupported;
    return;
  }
  switch (result.verdict) {
    case Verdict::expired:
      ++drops.expired;
      return;
    case Verdict::superseded:
      ++drops.superseded;
      return;
    case Verdict::lease_lost:
      ++drops.lease_lost;
      return;
    case Verdict::send:
      ++drops.port_lost;
  }
}

void LineStatistics::count(Ends& ends, const ExchangeResult& result) {
  switch (result.status) {
    case ExchangeStatus::replied:
      ++(result.reply.kind == ReplyKind::exception ? ends.refused : ends.answered);
      return;
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
      ++ends.no_reply;
      return;
    case ExchangeStatus::corrupt:
      ++ends.damaged;
      return;
    case ExchangeStatus::io_error:
      ++ends.failed;
      return;
    case ExchangeStatus::not_sent:
    case ExchangeStatus::unsupported:
      return;
  }
}

void LineStatistics::sent(const Transaction& transaction, const ExchangeResult& result) {
  const auto& exchange = transaction.exchange;
  auto& of_class = classes_.at(std::to_underlying(transaction.transaction_class));
  ++of_class.sent;
  count(of_class.ends, result);
  of_class.queueing.add(result.request_begin - std::max(transaction.queued_at, transaction.released_at));
  of_class.exchange.add(result.reply_end - result.request_begin);
  const auto begin = result.request_begin - silence(exchange.serial.value_or(serial_));
  const auto before = load_.occupied();
  load_.add(begin, result.reply_end);
  const bool scanned_in_vain =
      transaction.transaction_class == TransactionClass::scan && result.status != ExchangeStatus::replied;
  if (scanned_in_vain && nodes_.find(exchange.request.node) == nullptr) return;
  auto& node = nodes_[exchange.request.node];
  node.occupied += load_.occupied() - before;
  count(node, result);
  if (transaction.resync) return;
  Asked asked{.function = exchange.request.function,
              .address = exchange.request.address,
              .count = exchange.request.count,
              .in_vain = true};
  auto& last = last_[exchange.request.node];
  if (asked == last) ++node.repeats;
  asked.in_vain = result.status != ExchangeStatus::replied;
  last = asked;
}

void LineStatistics::count(NodeStatistics& node, const ExchangeResult& result) {
  switch (result.status) {
    case ExchangeStatus::replied:
      ++node.replies;
      if (result.reply.kind == ReplyKind::exception) {
        const std::size_t code = result.reply.exception_code;
        ++node.exceptions.at(code < node.exceptions.size() ? code : 0);
      }
      if (result.reply_begin > result.request_end)
        node.longest_turnaround = std::max(node.longest_turnaround, result.reply_begin - result.request_end);
      return;
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
      ++node.timeouts;
      return;
    case ExchangeStatus::corrupt:
      ++node.corrupt;
      return;
    case ExchangeStatus::io_error:
      ++node.io_errors;
      return;
    case ExchangeStatus::not_sent:
    case ExchangeStatus::unsupported:
      return;
  }
}

BusCounters LineStatistics::counters() const {
  BusCounters sum{.foreign_frames = foreign_frames_};
  for (const auto& [address, node] : nodes_) {
    sum.transactions += node.replies;
    sum.timeouts += node.timeouts;
    sum.corrupt += node.corrupt;
    sum.io_errors += node.io_errors;
    sum.exceptions += std::accumulate(node.exceptions.begin(), node.exceptions.end(), std::uint64_t{});
  }
  for (const auto& one : classes_) {
    sum.dropped_expired += one.drops.expired;
    sum.dropped_superseded += one.drops.superseded + one.drops.lease_lost + one.drops.port_lost;
  }
  return sum;
}

}  // namespace axisd::modbus_rtu
