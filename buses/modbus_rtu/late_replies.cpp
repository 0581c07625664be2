#include "buses/modbus_rtu/late_replies.hpp"

#include <algorithm>

namespace axisd::modbus_rtu {

namespace {

/// So long a node is said to answer late.
constexpr auto remembered = std::chrono::minutes(1);

}  // namespace

void LateReplies::note(const Request& request, const ExchangeResult& result, TimePoint now) {
  if (unanswered_ && result.foreign_frames > 0) heard_late_[*unanswered_] = now;
  const bool sent = result.status != ExchangeStatus::not_sent && result.status != ExchangeStatus::unsupported;
  const bool in_vain = result.status == ExchangeStatus::timeout || result.status == ExchangeStatus::cut;
  if (sent) unanswered_ = in_vain ? std::optional(request.node) : std::nullopt;
  const bool read = request.function == Function::read_holding_registers;
  switch (result.status) {
    case ExchangeStatus::replied:
      if (!read) {
        if (may_echo(request, now)) expect(request, now);
      } else if (result.reply.kind == ReplyKind::match) {
        reads_.erase(request.node);
        echoes_.erase(request.node);
        auto& block = answered_[request.node];
        if (request.count >= block.count) block = {.address = request.address, .count = request.count};
      } else if (any_late(request.node, now)) {
        expect(request, now);
      }
      break;
    case ExchangeStatus::timeout:
    case ExchangeStatus::cut:
    case ExchangeStatus::corrupt:
    case ExchangeStatus::io_error:
      expect(request, now);
      break;
    default:
      break;
  }
}

bool LateReplies::answers_late(std::uint8_t node, TimePoint now) const {
  const auto* heard = heard_late_.find(node);
  return heard != nullptr && now - *heard <= remembered;
}

void LateReplies::expect(const Request& request, TimePoint now) {
  if (request.function == Function::read_holding_registers)
    reads_[request.node][request.count] = now + latest;
  else if (request.function == Function::write_single_register)
    echoes_[request.node][{request.address, request.values.front()}] = now + latest;
}

bool LateReplies::is_late(std::uint8_t node, std::uint16_t count, TimePoint now) const {
  const auto late = reads_.find(node);
  if (late == reads_.end()) return false;
  const auto read = late->second.find(count);
  return read != late->second.end() && read->second >= now;
}

bool LateReplies::any_late(std::uint8_t node, TimePoint now) const {
  const auto late = reads_.find(node);
  return late != reads_.end() &&
         std::ranges::any_of(late->second, [&](const auto& read) { return read.second >= now; });
}

bool LateReplies::may_answer(const Request& read, TimePoint now) const {
  return read.function == Function::read_holding_registers && is_late(read.node, read.count, now);
}

bool LateReplies::may_echo(const Request& write, TimePoint now) const {
  if (write.function != Function::write_single_register) return false;
  const auto late = echoes_.find(write.node);
  if (late == echoes_.end()) return false;
  const auto echo = late->second.find({write.address, write.values.front()});
  return echo != late->second.end() && echo->second >= now;
}

std::optional<Request> LateReplies::distinct_read(const Request& waiting, TimePoint now) const {
  const auto* known = answered_.find(waiting.node);
  const auto block = known == nullptr ? Block{.address = waiting.address, .count = waiting.count} : *known;
  const auto of = [&](std::uint16_t count) {
    constexpr int addresses = 0x10000;
    return Request{.node = waiting.node,
                   .address = static_cast<std::uint16_t>(std::min<int>(block.address, addresses - count)),
                   .count = count};
  };
  // Not longer than what waits, if there is such a one: the others of the line wait, too.
  const auto likely = std::min({block.count, waiting.count, longest(waiting.node)});
  for (auto count = likely; count > 0; --count)
    if (!is_late(waiting.node, count, now)) return of(count);
  for (auto count = likely; count <= longest(waiting.node); ++count)
    if (!is_late(waiting.node, count, now)) return of(count);
  return std::nullopt;
}

TimePoint LateReplies::distinct_at(std::uint8_t node, TimePoint now) const {
  auto earliest = TimePoint::max();
  for (std::uint16_t count = 1; count <= longest(node); ++count) {
    if (!is_late(node, count, now)) return now;
    earliest = std::min(earliest, reads_.at(node).at(count));
  }
  return earliest + std::chrono::nanoseconds(1);  // until then it may still come
}

/// What has been answered may be longer: not every device is one of the drives.
std::uint16_t LateReplies::longest(std::uint8_t node) const {
  const auto* known = answered_.find(node);
  return known == nullptr ? longest_read : std::max(longest_read, known->count);
}

}  // namespace axisd::modbus_rtu
