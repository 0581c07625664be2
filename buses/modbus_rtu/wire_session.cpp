#include "buses/modbus_rtu/wire_session.hpp"

#include <poll.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "buses/heartbeat.hpp"

namespace axisd::modbus_rtu {
namespace {

constexpr int echo_attempts = 3;
/// How often a wait for an echo asks whether it must end.
constexpr Duration between_looks = std::chrono::milliseconds(1);
/// 248..255 are reserved (Modbus over serial line 2.2): no node answers, so whatever comes back is an echo.
constexpr std::uint8_t nobody = 248;

/// A read, as its reply and its echo differ in shape.
Request probe_of(const LineSettings& line) {
  return {.node = line.echo_witness.value_or(nobody), .address = 0, .count = 1};
}

/// encode() refuses reserved nodes.
Frame frame_of(const Request& probe) {
  Frame frame;
  frame.append(probe.node);
  frame.append(static_cast<std::uint8_t>(probe.function));
  frame.append_word(probe.address);
  frame.append_word(probe.count);
  frame.append_crc();
  return frame;
}

bool is_answer(const Request& probe, std::span<const std::uint8_t> bytes) {
  const auto kind = decode(probe, bytes).kind;
  return kind == ReplyKind::match || kind == ReplyKind::exception;
}

}  // namespace

WireSession::WireSession(SerialPort port, const LineSettings& line, Wakeup& wakeup,
                         std::atomic<TimePoint::rep>& progress)
    : port_(std::move(port)),
      line_(line),
      serial_(line.serial()),
      wakeup_(wakeup),
      progress_(progress),
      last_byte_(monotonic_now()),  // whatever was said before the opening may just have ended
      request_end_(last_byte_) {}

WireSession::~WireSession() {
  const auto end = request_end_ + wire_time(serial_, 1);
  busy_until(end + longest_port_call);  // the port is closed next
  block_until(end);
}

TimePoint WireSession::touch() {
  const auto now = monotonic_now();
  progress_.store(now.time_since_epoch().count(), std::memory_order_relaxed);
  return now;
}

void WireSession::busy_until(TimePoint until) {
  progress_.store(std::max(until, monotonic_now()).time_since_epoch().count(), std::memory_order_relaxed);
}

/// Waits for bytes until `until`, or with `for_bytes` false for the time alone; with `cut_from` a cut ends
/// the wait from that moment on.
WireSession::Wait WireSession::wait_until(TimePoint until, const TimePoint* cut_from, bool for_bytes) {
  for (;;) {
    const auto now = looked_ = touch();
    if (wakeup_.quit.load(std::memory_order_acquire)) return Wait::quit;
    const bool cut = cut_from != nullptr && wakeup_.cut.load(std::memory_order_acquire);
    const auto end = cut ? std::min(until, *cut_from) : until;
    const auto timeout = to_timespec(std::min<Duration>(end - now, heartbeat));
    // A negative descriptor is not looked at.
    std::array<pollfd, 2> watched{
        {{.fd = for_bytes ? port_.descriptor() : -1, .events = POLLIN, .revents = 0},
         {.fd = wakeup_.descriptor(), .events = POLLIN, .revents = 0}}};
    if (ppoll(watched.data(), watched.size(), &timeout, nullptr) < 0 && errno != EINTR) return Wait::failed;
    if ((watched[0].revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return Wait::failed;
    if (watched[0].revents != 0) return Wait::bytes;
    if (watched[1].revents != 0)
      wakeup_.drain();
    else if (monotonic_now() >= end)
      return end < until ? Wait::cut : Wait::timeout;
  }
}

int WireSession::idle(Duration limit) {
  touch();
  const auto timeout = to_timespec(std::min(limit, heartbeat));
  std::array<pollfd, 2> watched{{{.fd = port_.descriptor(), .events = POLLIN, .revents = 0},
                                 {.fd = wakeup_.descriptor(), .events = POLLIN, .revents = 0}}};
  if (ppoll(watched.data(), watched.size(), &timeout, nullptr) < 0) return errno == EINTR ? 0 : errno;
  if (watched[1].revents != 0) wakeup_.drain();
  return (watched[0].revents & (POLLHUP | POLLERR | POLLNVAL)) != 0 ? EIO : 0;
}

/// Takes the bytes that nobody waits for off the port.
WireSession::Bytes WireSession::absorb() {
  if (port_.empty()) return {};
  std::array<std::uint8_t, Frame::capacity> buffer;
  Bytes total;
  for (;;) {
    const auto got = port_.read_available(buffer);
    if (!got) return {.count = total.count, .native_error = got.error()};
    if (*got == 0) return total;
    const auto now = monotonic_now();
    if (total.count == 0 && now - last_byte_ >= silence(serial_)) ++stray_frames_;
    last_byte_ = now;
    total.count += *got;
    if (total.count > 16 * Frame::capacity)
      return total;  // more comes than can be read: let the caller decide
  }
}

int WireSession::keep_silence() {
  const auto give_up = monotonic_now() + babble_limit;
  for (;;) {
    silence_.begin(last_byte_ + silence(serial_));
    const auto heard = absorb();
    if (heard.native_error != 0) return heard.native_error;
    if (heard.count == 0) return 0;
    if (touch() < give_up) continue;
    silence_.abandon();
    return 0;
  }
}

WireSession::Bytes WireSession::read_until_full(std::span<std::uint8_t> buffer, TimePoint until,
                                                const TimePoint* cut_from) {
  Bytes total;
  while (total.count < buffer.size()) {
    const auto wait = wait_until(until, cut_from);
    if (wait == Wait::failed) return {.count = total.count, .native_error = EIO};
    if (wait != Wait::bytes) break;
    const auto got = port_.read_available(buffer.subspan(total.count));
    if (!got) return {.count = total.count, .native_error = got.error()};
    total.count += *got;
    if (*got > 0) last_byte_ = monotonic_now();
  }
  return total;
}

int WireSession::use(const SerialSettings& serial) {
  if (uses(serial)) return 0;
  serial_known_ = false;
  if (const int failed = port_.set_serial(serial); failed != 0) return failed;
  serial_ = serial;
  serial_known_ = true;
  return 0;
}

/// What comes back of the probe that was just sent: as much as an echo has, or an answer.
WireSession::Bytes WireSession::await_echo(std::span<std::uint8_t> buffer, const Request& probe,
                                           const std::function<bool()>& must_end) {
  // Nothing is said into the answer of a node that was asked.
  const auto turnaround = line_.echo_witness ? line_.turnaround_max : Duration::zero();
  const auto may_end = request_end_ + turnaround;
  const auto until = request_end_ + std::max(echo_latency, turnaround);
  Bytes total;
  for (auto now = monotonic_now();
       now < until && total.count < buffer.size() && !(now >= may_end && must_end()); now = monotonic_now()) {
    const auto heard = read_until_full(buffer.subspan(total.count), std::min(until, now + between_looks));
    total.count += heard.count;
    total.native_error = heard.native_error;
    if (total.native_error != 0 || wakeup_.quit.load(std::memory_order_acquire)) break;
    if (is_answer(probe, buffer.first(total.count))) break;
  }
  return total;
}

/// Takes the answer behind the echo off the port; where none comes, waits as long as one may take.
int WireSession::pass_answer(const Request& probe) {
  std::array<std::uint8_t, Frame::capacity> buffer;
  const auto answer = std::span(buffer).first(reply_size(probe));
  const auto until = last_byte_ + line_.turnaround_max + wire_time(serial_, answer.size()) + reply_margin;
  return read_until_full(answer, until).native_error;
}

int WireSession::find_echo(const std::function<bool()>& must_end) {
  if (echo_known_) return 0;
  if (const int lost = use(line_.serial()); lost != 0) return lost;
  const auto probe = probe_of(line_);
  const auto frame = frame_of(probe);
  for (int attempt = 0; attempt < echo_attempts && !echo_known_; ++attempt) {
    if (const int lost = keep_silence(); lost != 0) return lost;
    silence_.finish(must_end);
    if (must_end()) return 0;
    if (const int lost = port_.send(frame); lost != 0) return lost;
    request_end_ = last_byte_ = monotonic_now() + wire_time(serial_, frame.size());
    std::array<std::uint8_t, Frame::capacity> buffer;
    const auto heard = await_echo(std::span(buffer).first(frame.size()), probe, must_end);
    if (heard.native_error != 0) return heard.native_error;
    const auto bytes = std::span(buffer).first(heard.count);
    const bool answered = is_answer(probe, bytes);
    echo_ = std::ranges::equal(bytes, frame.bytes());
    if (echo_ && line_.echo_witness)
      if (const int lost = pass_answer(probe); lost != 0) return lost;
    if (!echo_ && !answered && must_end()) return 0;
    echo_known_ = echo_ || answered || bytes.empty();  // other bytes: somebody else was talking, ask again
  }
  // An echo that is hidden by noise three times is not taken for one; ordinary reads would still find it.
  if (echo_)
    spdlog::info("{}: the adapter on {} hears what it sends; its echo is discarded", line_.name, path());
  echo_known_ = true;
  return 0;
}

}  // namespace axisd::modbus_rtu
