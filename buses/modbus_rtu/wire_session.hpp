// One open port from its opening to its loss: who may talk when, and what came back.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>

#include "buses/modbus_rtu/line.hpp"
#include "buses/modbus_rtu/punctual_wait.hpp"
#include "buses/modbus_rtu/reply_pace.hpp"
#include "buses/modbus_rtu/serial_port.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "buses/modbus_rtu/wake_latency.hpp"
#include "buses/modbus_rtu/wakeup.hpp"

namespace axisd::modbus_rtu {

/// Silences, echoes and exchanges on one open port. Thread: the line's worker.
///
///   find_echo -> { keep_silence -> [use -> keep_silence] -> exchange | idle }* -> the port is lost
///
/// Functions that return `int` return 0 or the errno with which the port was lost; it is useless afterwards.
class WireSession {
 public:
  /// `progress` is stamped (monotonic, in ticks of TimePoint) with each `heartbeat`; before a wait that
  /// nothing ends sooner, with the end of it.
  WireSession(SerialPort port, const LineSettings& line, Wakeup& wakeup,
              std::atomic<TimePoint::rep>& progress);
  WireSession(const WireSession&) = delete;
  /// Waits until the last request has left: closing or re-opening the port would cut it off.
  ~WireSession();

  /// Finds out whether the adapter hears what it sends, where that is not known. Gives up at once where
  /// `must_end()`, which is asked each millisecond: it is then found out later. A node that was asked
  /// (LineSettings::echo_witness) is left its turnaround all the same.
  int find_echo(const std::function<bool()>& must_end);
  [[nodiscard]] bool uses(const SerialSettings& serial) const { return serial_known_ && serial_ == serial; }
  /// Brings the port to other serial settings; the line must be silent. 0, EINVAL (the port cannot do them)
  /// or the errno with which it was lost.
  int use(const SerialSettings& serial);
  /// Blocks until the line has been silent for as long as must be before a request, but for the time that
  /// waking and sending take.
  int keep_silence();
  /// Passes what is left of the silence. Returns the time.
  TimePoint finish_silence() { return silence_.finish(); }
  /// Less of it once `enough()`.
  template <class Enough>
  void finish_silence(Enough enough) {
    silence_.finish(enough);
  }
  /// Blocks until the wakeup is notified, bytes that nobody asked for come, or `limit` has passed.
  int idle(Duration limit);
  /// Sends `exchange`, when the silence is over, and waits for its end. Precondition: keep_silence() has just
  /// returned.
  ExchangeResult run(const Exchange& exchange);

  [[nodiscard]] const std::string& path() const { return port_.path(); }

 private:
  enum class Wait : std::uint8_t { bytes, timeout, cut, quit, failed };
  struct Bytes {
    std::size_t count = 0;
    int native_error = 0;
  };

  Wait wait_until(TimePoint until, const TimePoint* cut_from, bool for_bytes = true);
  Wait wait_for_reply(const Exchange& exchange, const ExchangeResult& result);
  void sleep_before_reply(const Exchange& exchange, Duration quiet);
  void take_reply(const Exchange& exchange, ExchangeResult& result);
  bool take_expected(const Exchange& exchange, ExchangeResult& result);
  void end_replied(ExchangeResult& result, Reply reply, const Frame& frame, TimePoint first_byte);
  bool end_damaged(ExchangeResult& result, const Frame& bytes, TimePoint first_byte);
  Wait wait_for_more();
  [[nodiscard]] ReplyPace& pace_of(const Exchange& exchange);
  void note_pace(const Exchange& exchange, const ExchangeResult& result);
  [[nodiscard]] TimePoint begin_of(const Frame& frame, TimePoint seen) const;
  bool pass_echo(const Exchange& exchange, ExchangeResult& result);
  bool take_frame(const Exchange& exchange, ExchangeResult& result);
  bool is_own_echo(const Exchange& exchange, const Frame& damaged);
  Bytes read_until_full(std::span<std::uint8_t> buffer, TimePoint until, const TimePoint* cut_from = nullptr);
  Bytes await_echo(std::span<std::uint8_t> buffer, const Request& probe,
                   const std::function<bool()>& must_end);
  int pass_answer(const Request& probe);
  Bytes absorb();
  void settle(ExchangeResult& result);
  void end(ExchangeResult& result, ExchangeStatus status, int native_error = 0);
  TimePoint touch();
  void busy_until(TimePoint until);

  /// A line that never falls silent (a stuck transmitter, a second master) must not keep a stop from being
  /// tried.
  static constexpr Duration babble_limit = std::chrono::milliseconds(250);
  /// Within this an adapter has delivered its own echo: 16 ms latency of an FTDI adapter, hubs and a busy
  /// host.
  static constexpr Duration echo_latency = std::chrono::milliseconds(100);

  SerialPort port_;
  const LineSettings& line_;
  SerialSettings serial_;     ///< as the port is set: of the last bytes, and of the next
  bool serial_known_ = true;  ///< false after a change that failed: the port may have anything
  Wakeup& wakeup_;
  std::atomic<TimePoint::rep>& progress_;
  TimePoint last_byte_;       ///< end of the last character on the wire, sent or received
  TimePoint request_end_;     ///< when the last request has left the adapter
  TimePoint reply_deadline_;  ///< of the exchange under way
  TimePoint looked_;          ///< when the bytes were waited for that were read last; far off: they were not
  PunctualWait silence_;      ///< before a request
  LeastLatency reply_latency_;
  ReplyPace read_pace_, write_pace_;
  bool slept_ = false;     ///< before the reply, as its node's pace is known
  bool expected_ = false;  ///< the reply, any moment: nothing else need be looked at for a while
  bool damaged_ = false;   ///< unsound bytes came during the exchange under way
  bool echo_known_ = false;
  bool echo_ = false;     ///< as far as known
  int stray_frames_ = 0;  ///< bursts that nobody asked for, not yet reported
};

}  // namespace axisd::modbus_rtu
