// One exchange on an open port: its request, and the reply to it.
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "buses/modbus_rtu/wire_session.hpp"

namespace axisd::modbus_rtu {
namespace {

using std::chrono::milliseconds;

/// A shorter sleep saves nothing.
constexpr Duration shortest_sleep = milliseconds(1);
/// After the sleep a reply is waited for so long without regard to anything else, which costs less.
constexpr Duration shortly = milliseconds(1);
/// Longest that a worker which is to end is waited for.
constexpr Duration longest_deaf = milliseconds(100);

/// What is known has been checked before.
Reply reply_in(const Exchange& exchange, std::span<const std::uint8_t> bytes) {
  if (exchange.known != nullptr && std::ranges::equal(exchange.known->bytes(), bytes))
    return {.kind = ReplyKind::match};
  return decode(exchange.request, bytes);
}

}  // namespace

ReplyPace& WireSession::pace_of(const Exchange& exchange) {
  return exchange.request.function == Function::read_holding_registers ? read_pace_ : write_pace_;
}

void WireSession::end(ExchangeResult& result, ExchangeStatus status, int native_error) {
  result.status = status;
  result.native_error = native_error;
  // Of a reply, when its last byte came: the silence before the next request counts from there.
  result.reply_end = status == ExchangeStatus::replied ? last_byte_ : monotonic_now();
}

/// After damage: the sender may not have finished. Its remaining bytes belong to no later request.
void WireSession::settle(ExchangeResult& result) {
  const auto give_up = monotonic_now() + babble_limit;
  while (monotonic_now() < give_up &&
         wait_until(monotonic_now() + silence(serial_), nullptr) == Wait::bytes) {
    std::array<std::uint8_t, Frame::capacity> buffer;
    const auto got = port_.read_available(buffer);
    if (!got) return;  // the next use of the port finds it lost
    if (*got > 0) last_byte_ = monotonic_now();
    const auto kept = std::min(*got, Frame::capacity - result.reply_frame.size());
    for (const auto byte : std::span(buffer).first(kept)) result.reply_frame.append(byte);
  }
}

/// Takes the adapter's echo of the request off the port. False: the exchange has ended. Where it is not known
/// whether there is one, what comes first is taken for it: a write may then seem unanswered that was not, but
/// never answered by its own echo.
bool WireSession::pass_echo(const Exchange& exchange, ExchangeResult& result) {
  std::array<std::uint8_t, Frame::capacity> buffer;
  const auto echo = std::span(buffer).first(exchange.frame.size());
  const auto cut_from = request_end_ + exchange.turnaround_max;
  const auto heard = read_until_full(echo, std::min(reply_deadline_, request_end_ + echo_latency), &cut_from);
  if (heard.native_error != 0) {
    end(result, ExchangeStatus::io_error, heard.native_error);
    return false;
  }
  if (std::ranges::equal(echo.first(heard.count), exchange.frame.bytes())) return true;
  // Two talked at once, or the adapter was changed: what follows cannot be told apart from the echo.
  echo_known_ = false;
  result.reply_frame = Frame(echo.first(heard.count));
  settle(result);
  end(result, heard.count == 0 ? ExchangeStatus::timeout : ExchangeStatus::corrupt);
  return false;
}

/// A read and its echo differ in shape, so an echo that the probe missed shows itself here as a damaged
/// reply.
bool WireSession::is_own_echo(const Exchange& exchange, const Frame& damaged) {
  const auto request = exchange.frame.bytes();
  const auto head = damaged.size();
  if (head >= request.size() || !std::ranges::equal(damaged.bytes(), request.first(head))) return false;
  std::array<std::uint8_t, Frame::capacity> buffer;
  const auto tail = std::span(buffer).first(request.size() - head);
  const auto heard = read_until_full(tail, reply_deadline_);
  return heard.native_error == 0 && std::ranges::equal(tail.first(heard.count), request.subspan(head));
}

WireSession::Wait WireSession::wait_for_reply(const Exchange& exchange, const ExchangeResult& result) {
  const auto cut_from = result.request_end + exchange.turnaround_max;
  if (std::exchange(expected_, false)) {
    looked_ = monotonic_now();
    if (port_.comes_within(shortly)) return Wait::bytes;
  }
  const auto wait = wait_until(reply_deadline_, &cut_from);
  // One that has begun is heard to its end.
  return wait == Wait::quit && !port_.empty() ? Wait::bytes : wait;
}

/// No byte of the reply is needed before it is complete, and each piece of it would wake this thread. A write
/// may take a drive a thousand times as long as the one before: then it is waited for as if there had been no
/// sleep. `quiet`: from the end of the request.
void WireSession::sleep_before_reply(const Exchange& exchange, Duration quiet) {
  if (quiet == Duration::zero()) return;
  const auto now = monotonic_now();
  const auto until = std::min(request_end_ + quiet, reply_deadline_);
  if (until - now < shortest_sleep) return;
  const auto cut_from = request_end_ + exchange.turnaround_max;
  // Before that nothing ends it, and a sleep that nothing ends costs less.
  block_until(std::min({until, cut_from, now + longest_deaf}));
  auto woken = touch();
  if (woken < until) {
    wait_until(until, &cut_from, false);
    woken = monotonic_now();
  }
  if (woken >= until) reply_latency_.note(until, woken);
  slept_ = true;
  expected_ = woken + shortly < cut_from;
}

/// For the rest of a reply that has begun: nothing but its deadline ends this.
WireSession::Wait WireSession::wait_for_more() {
  busy_until(reply_deadline_);
  for (;;) {
    looked_ = monotonic_now();
    const auto left = reply_deadline_ - looked_;
    const auto timeout = to_timespec(left);
    pollfd watched{.fd = port_.descriptor(), .events = POLLIN, .revents = 0};
    if (ppoll(&watched, 1, &timeout, nullptr) < 0 && errno != EINTR) return Wait::failed;
    if ((watched.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return Wait::failed;
    if (watched.revents != 0) return Wait::bytes;
    if (left <= Duration::zero()) return Wait::timeout;
  }
}

/// Takes the reply of a node that has always answered: its size is known, so it is read in as few pieces as
/// it comes in, where libmodbus needs six system calls at least. Other sound frames before it are passed
/// over. After damage the node's replies are left to libmodbus for a while. True: the exchange has ended.
bool WireSession::take_expected(const Exchange& exchange, ExchangeResult& result) {
  TimePoint first_byte{};
  constexpr std::size_t head = 3;
  std::array<std::uint8_t, Frame::capacity> buffer;
  std::size_t size = reply_size(exchange.request);
  std::size_t count = 0;
  for (bool first = true;; first = false) {
    const auto wait = first ? Wait::bytes : wait_for_more();
    const auto got = wait == Wait::bytes ? port_.read_available(std::span(buffer).first(size).subspan(count))
                                         : std::expected<std::size_t, int>(0);
    if (!got || wait == Wait::failed) {
      end(result, ExchangeStatus::io_error, got ? EIO : got.error());
      return true;
    }
    if (*got > 0) {
      last_byte_ = reply_latency_.came_by(looked_, touch());
      expected_ = false;  // of what comes after it, nothing is known
    }
    if (count == 0) first_byte = last_byte_;
    count += *got;
    while (count >= head) {
      const auto bytes = std::span(buffer).first(count);
      size = std::min(reply_size(bytes), buffer.size());
      if (size == 0) return end_damaged(result, Frame(bytes), first_byte);
      if (count < size) break;
      const auto reply = reply_in(exchange, bytes.first(size));
      if (reply.kind == ReplyKind::corrupt) return end_damaged(result, Frame(bytes), first_byte);
      if (reply.kind != ReplyKind::foreign) {
        end_replied(result, reply, Frame(bytes.first(size)), first_byte);
        return true;
      }
      ++result.foreign_frames;
      std::ranges::copy(bytes.subspan(size), buffer.begin());
      count -= size;
    }
    if (count == 0) return false;
    if (count < head) size = reply_size(exchange.request);
    if (wait == Wait::timeout) return end_damaged(result, Frame(std::span(buffer).first(count)), first_byte);
  }
}

void WireSession::end_replied(ExchangeResult& result, Reply reply, const Frame& frame, TimePoint first_byte) {
  result.reply = reply;
  result.reply_frame = frame;
  result.reply_begin = begin_of(frame, first_byte);
  end(result, ExchangeStatus::replied);
}

void WireSession::note_pace(const Exchange& exchange, const ExchangeResult& result) {
  const auto node = exchange.request.node;
  const auto after_sleep = looked_ == TimePoint::max() ? Met::ready : Met::awaited;
  if (result.status != ExchangeStatus::replied) {
    read_pace_.forget(node);
    write_pace_.forget(node);
  } else if (!exchange.stop && result.reply.kind == ReplyKind::match) {
    pace_of(exchange).complete(node, wire_time(serial_, result.reply_frame.size()),
                               result.reply_end - result.request_end, slept_ ? after_sleep : Met::awake);
  }
}

/// When a frame began whose last byte has just come: what arrived during the sleep was seen only after it.
TimePoint WireSession::begin_of(const Frame& frame, TimePoint seen) const {
  return std::min(seen, std::max(request_end_, last_byte_ - wire_time(serial_, frame.size())));
}

/// Lets libmodbus read one frame. True: the exchange has ended.
bool WireSession::take_frame(const Exchange& exchange, ExchangeResult& result) {
  const auto first_byte = monotonic_now();
  busy_until(reply_deadline_);
  const auto received = port_.receive(exchange.request.node, reply_deadline_ - first_byte);
  touch();
  if (received.kind == Reception::failed) {
    end(result, ExchangeStatus::io_error, received.native_error);
    return true;
  }
  last_byte_ = monotonic_now();
  const auto reply = decode(exchange.request, received.bytes.bytes());
  if (reply.kind == ReplyKind::match || reply.kind == ReplyKind::exception) {
    end_replied(result, reply, received.bytes, first_byte);
    return true;
  }
  if (received.kind == Reception::frame || received.kind == Reception::filtered) {
    // libmodbus looks at the node before the CRC: a reply whose first byte was damaged ends here, too.
    if (reply.kind == ReplyKind::corrupt) damaged_ = true;
    if (reply.kind == ReplyKind::foreign) ++result.foreign_frames;
    return false;
  }
  if (received.kind == Reception::damaged && is_own_echo(exchange, received.bytes)) {
    echo_ = true;
    return false;
  }
  return end_damaged(result, received.bytes, first_byte);
}

bool WireSession::end_damaged(ExchangeResult& result, const Frame& bytes, TimePoint first_byte) {
  result.reply_frame = bytes;
  result.reply_begin = begin_of(bytes, first_byte);
  settle(result);
  end(result, ExchangeStatus::corrupt);
  return true;
}

/// Waits for the reply, and for what else ends the exchange.
void WireSession::take_reply(const Exchange& exchange, ExchangeResult& result) {
  looked_ = TimePoint::max();
  if (slept_ && take_expected(exchange, result)) return;  // of a long one, most lies ready
  for (;;) {
    const auto wait = wait_for_reply(exchange, result);
    if (wait == Wait::bytes) {
      if (slept_ ? take_expected(exchange, result) : take_frame(exchange, result)) return;
      continue;
    }
    last_byte_ = std::max(last_byte_, request_end_);
    if (wait == Wait::failed) return end(result, ExchangeStatus::io_error, EIO);
    const auto silent = wait == Wait::timeout ? ExchangeStatus::timeout : ExchangeStatus::cut;
    return end(result, damaged_ ? ExchangeStatus::corrupt : silent);
  }
}

ExchangeResult WireSession::run(const Exchange& exchange) {
  ExchangeResult result{.foreign_frames = std::exchange(stray_frames_, 0)};
  damaged_ = false;
  slept_ = false;
  expected_ = false;
  // Before the request, where there is time: a terminal carries its bytes on when this thread sleeps again.
  const auto request_time = wire_time(serial_, exchange.frame.size());
  // The reply to a stop is not slept through: another stop may wait for its end.
  const auto quiet =
      exchange.stop
          ? Duration::zero()
          : pace_of(exchange).quiet(exchange.request.node, wire_time(serial_, reply_size(exchange.request)));
  result.request_begin = silence_.finish();
  if (const int lost = port_.send(exchange.frame); lost != 0) {
    end(result, ExchangeStatus::io_error, lost);
    return result;
  }
  request_end_ = last_byte_ = result.request_end = monotonic_now() + request_time;
  reply_deadline_ = result.request_end + exchange.reply_timeout;
  if ((echo_known_ && !echo_) || pass_echo(exchange, result)) {
    sleep_before_reply(exchange, quiet);
    take_reply(exchange, result);
    if (!echo_known_ && result.status == ExchangeStatus::replied) echo_ = echo_known_ = true;
  }
  note_pace(exchange, result);
  return result;
}

}  // namespace axisd::modbus_rtu
