// The seam between the core's bus and whatever carries frames: a worker thread on a tty, or a virtual wire.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "buses/bus.hpp"
#include "buses/modbus_rtu/frame.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "buses/transaction.hpp"

namespace axisd::modbus_rtu {

/// One exchange as the line sees it. The core owns it and leaves it alone while it is armed or under way.
struct Exchange {
  Request request;
  MotionGuard guard;
  TimePoint deadline = TimePoint::max();
  Duration reply_timeout{};   ///< from the last byte of the request to the last byte of the reply
  Duration turnaround_max{};  ///< from the last byte of the request; after it a stop may cut the wait
  std::optional<SerialSettings> serial{};  ///< other settings than the line's, for this exchange alone
  bool stop = false;                       ///< it waits for no stop that was announced
  /// Carried out behind this one without the core, if this one says nothing new: a round. Unless its first
  /// byte went out longer than `round_longest` before.
  const Exchange* then = nullptr;
  Duration round_longest{};
  /// The last reply to this request, if there is one, a sound one; not the core's meanwhile.
  const Frame* known = nullptr;
  Frame frame{};  ///< encoded request with CRC; long, and last, so that all the rest stands together
};

enum class ExchangeStatus : std::uint8_t {
  replied,      ///< `reply` answers the request (a match or an exception)
  timeout,      ///< sent completely; no valid reply within the timeout
  cut,          ///< like timeout, but the wait was cut short by cut_wait() past turnaround_max
  corrupt,      ///< sent completely; only damaged bytes came back
  not_sent,     ///< no byte went out: refused at the bind (`verdict` says why), or `send`: the port was lost
                ///< before
  unsupported,  ///< no byte went out: the port cannot do `serial`
  io_error,     ///< the port failed; `native_error` is errno. Some bytes may have gone out.
};

struct ExchangeResult {
  ExchangeStatus status = ExchangeStatus::io_error;
  Verdict verdict = Verdict::send;
  Reply reply{};
  int native_error = 0;
  int foreign_frames = 0;     ///< discarded while waiting
  TimePoint request_begin{};  ///< first byte out (at the bind)
  TimePoint request_end{};    ///< last byte out (computed from the baud rate)
  TimePoint reply_begin{};    ///< first byte in; unset without a reply
  TimePoint reply_end{};      ///< last byte in, or the end of the wait
  Frame reply_frame{};        ///< raw bytes
  /// Of a read that was answered.
  [[nodiscard]] std::vector<std::uint16_t> registers() const {
    const Registers read(reply_frame);
    return {read.values().begin(), read.values().end()};
  }
};

/// The reply is the one that is known, and nothing else was heard.
[[nodiscard]] inline bool says_nothing_new(const Exchange& exchange, const ExchangeResult& result) {
  return result.status == ExchangeStatus::replied && result.foreign_frames == 0 &&
         exchange.known != nullptr && *exchange.known == result.reply_frame;
}

/// What stands behind `exchange` follows its result, the last of `results`, without the core.
[[nodiscard]] inline bool round_goes_on(const Exchange& exchange, std::span<const ExchangeResult> results) {
  return exchange.then != nullptr && says_nothing_new(exchange, results.back()) &&
         results.back().reply_end - results.front().request_begin < exchange.round_longest;
}

/// Carries one exchange at a time, with the mandatory silence before each. All calls from the core thread;
/// both callbacks arrive on the core thread.
class Line {
 public:
  /// Of one exchange, or of those of a round that were carried out, in their order.
  using ResultHandler = std::function<void(std::span<const ExchangeResult>)>;
  using PortHandler = std::function<void(const PortStatus&)>;
  virtual ~Line() = default;

  /// Sets the callbacks and starts opening the port (again and again, with back-off).
  virtual void start(ResultHandler on_result, PortHandler on_port) = 0;
  /// Puts `exchange` into the one-place slot. It is bound, and its guard checked, when the silence has
  /// passed; the line then has the serial settings of `exchange`. Where there is one behind it, that comes
  /// into the slot in its turn, until one says something new. Precondition: the port is open, the slot is
  /// empty and nothing is under way. Ends with exactly one on_result, unless revoke() succeeds.
  virtual void arm(const Exchange& exchange) = 0;
  /// Takes back what is in the slot, and what stands behind it: the results so far, valid until the next
  /// call. nullopt: it was already bound. The results will come, and nothing follows it.
  virtual std::optional<std::span<const ExchangeResult>> revoke() = 0;
  /// A stop waits: end the wait for a silent node as soon as its turnaround_max has passed without a byte.
  virtual void cut_wait() = 0;
  /// Where stops are announced that the core does not know of yet. May be null.
  [[nodiscard]] virtual std::shared_ptr<StopNotice> stop_notice() const { return nullptr; }
  /// Time of the last progress of the line's own thread (for the watchdog). Thread: any.
  [[nodiscard]] virtual TimePoint last_progress() const = 0;
};

}  // namespace axisd::modbus_rtu
