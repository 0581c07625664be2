// What the SDO client keeps for each node. Used by sdo_client.cpp and sdo_exchange.cpp only.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "buses/canopen/sdo_client.hpp"
#include "buses/canopen/surplus_replies.hpp"

namespace axisd::canopen {

inline Error no_reply_error(const SdoTransfer& transfer) {
  return {.reason = Reason::no_reply,
          .message = "no reply",
          .remedy = "check power, wiring, node-ID and bit rate of the node",
          .outcome = transfer.complete_at_server() ? Outcome::unknown : Outcome::not_executed};
}

inline Error expired_error() {
  return {
      .reason = Reason::expired, .message = "not sent: its time had passed", .remedy = "repeat the request"};
}

inline Error rebooted_error(Outcome outcome) {
  return {.reason = Reason::rebooted,
          .message = "the node booted before it answered",
          .remedy = "check the drive's supply; configure it again, then repeat the request",
          .outcome = outcome};
}

struct SdoClient::Request {
  bool download = false;
  Object object;
  Bytes bytes;
  SdoOptions options;
  int attempts = 1;
  bool perhaps_done = false;  ///< an earlier attempt may have been executed
  TimePoint asked_at{};       ///< of this attempt
  bool sent = false;          ///< some attempt, or perhaps
  std::function<void(Result<SdoAnswer>)> done;
};

struct SdoClient::Active {
  RequestPtr request;
  SdoTransfer transfer;
  bool probe = false;  ///< `transfer` reads another object, to bring both sides in step before `request`
  bool ambiguous = false;
  bool opened = false;                   ///< the server has answered, and waits for what continues it
  std::uint64_t frame_id = 0;            ///< of the frame that was sent last
  TimePoint first_sent{};                ///< end of the first frame
  std::optional<TimePoint> last_sent{};  ///< end of the last frame; nothing while it waits in the port
  TimePoint limit = TimePoint::max();    ///< of the whole transfer
  [[nodiscard]] bool any_sent() const { return first_sent != TimePoint{}; }
};

struct SdoClient::Node {
  std::uint8_t id = 0;
  std::array<std::deque<RequestPtr>, transaction_class_count> waiting;
  std::optional<Active> active;
  LateReplies late;
  SurplusReplies surplus;
  SdoCounters counters;
  /// The longest of late that nobody yielded to; nothing: it has not answered, or not the last time.
  std::optional<Duration> usual_answer{};
  std::optional<TimePoint> yields_until{};  ///< to another node's reply; nothing: it need not
  /// Of so many requests one comes from a lower class than the highest, so that polling starves nobody.
  static constexpr unsigned reservation = 8;
  unsigned bound = 0;  ///< requests that overtook a lower class
  Clock::Timer timer;

  std::deque<RequestPtr>& lane(TransactionClass transaction_class) {
    return waiting.at(std::to_underlying(transaction_class));
  }
  [[nodiscard]] bool stop_waits() const { return !waiting.front().empty(); }
  /// A stop waits, or what tells whether it has worked.
  [[nodiscard]] bool never_yields() const {
    return stop_waits() || !waiting.at(std::to_underlying(TransactionClass::moving_state)).empty();
  }
  /// On a full network the reply of the highest node-ID loses each arbitration. So while a reply is overdue,
  /// by what its node takes as a rule and by a cycle of SYNC with its PDOs, for a while nothing is begun at
  /// the others but for stops. Nothing: they need not yield to it.
  [[nodiscard]] std::optional<TimePoint> yielded_to_until(TimePoint now) const {
    constexpr Duration cycle = std::chrono::milliseconds(20), patience = std::chrono::milliseconds(20);
    if (!usual_answer || !active || !active->last_sent) return std::nullopt;
    const auto since = *active->last_sent + std::max(cycle, 2 * *usual_answer);
    return now < since || now >= since + patience ? std::nullopt : std::optional(since + patience);
  }
  void note_answer(Duration took) {
    usual_answer = std::max(took, usual_answer.value_or(Duration{}) * 7 / 8);
  }
  [[nodiscard]] std::size_t count() const {
    std::size_t sum = 0;
    for (const auto& one : waiting) sum += one.size();
    return sum;
  }
  RequestPtr pop() {
    auto first = std::ranges::find_if(waiting, [](const auto& one) { return !one.empty(); });
    if (first == waiting.end()) return nullptr;
    if (first != waiting.begin()) {
      const auto lower = std::find_if(first + 1, waiting.end(), [](const auto& one) { return !one.empty(); });
      if (lower != waiting.end() && ++bound % reservation == 0) first = lower;
    }
    auto request = std::move(first->front());
    first->pop_front();
    return request;
  }
};

}  // namespace axisd::canopen
