// The thread that talks on one RS-485 line, because libmodbus blocks.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "buses/modbus_rtu/line.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "buses/modbus_rtu/wakeup.hpp"
#include "buses/task.hpp"

namespace axisd::modbus_rtu {

class SerialPort;
class WireSession;

/// A Line on a serial port. Public functions: thread core; private ones: the worker's own thread.
///
///   opening --ok--> serving { silence -> take the slot -> exchange -> result, or the next of its round }*
///      ^                |
///      +---back-off-----+ the port is lost: an exchange under way ends as io_error, an armed one as not_sent
///
/// Between the threads stand a one-place atomic slot, the Wakeup and post(); there are no locks. A lost port
/// is reported before the result of the exchange that it cost. `not_sent` with the verdict `send` means that
/// the port was gone before a byte went out. Where a stop was announced that the core has not served yet,
/// what is armed waits for it, at most 5 ms. An exchange with serial settings of its
/// own has the port changed between the slot and its first byte, and so has the next one without; the gate is
/// asked after that.
class RtuWorker final : public Line {
 public:
  /// Where the port is now; asked before each opening. Thread: the worker's.
  using PortPath = std::function<Result<std::string>()>;

  /// Results and port changes are posted to `core`. Without `port_path` the port is `settings.port`.
  RtuWorker(Executor core, LineSettings settings, PortPath port_path = {});
  RtuWorker(const RtuWorker&) = delete;
  /// Waits for the request under way to leave the wire and for a reply that has begun, for nothing else. No
  /// callback comes afterwards.
  ~RtuWorker() override;

  void start(ResultHandler on_result, PortHandler on_port) override;
  void arm(const Exchange& exchange) override;
  std::optional<std::span<const ExchangeResult>> revoke() override;
  void cut_wait() override;
  [[nodiscard]] std::shared_ptr<StopNotice> stop_notice() const override { return stop_notice_; }
  [[nodiscard]] TimePoint last_progress() const override;

 private:
  /// Thread: core.
  struct Callbacks {
    ResultHandler on_result;
    PortHandler on_port;
    bool alive = true;
    std::vector<ExchangeResult> told;  ///< last
  };

  void run();
  Result<SerialPort> open_port();
  Error serve(SerialPort port, TimePoint closed_since);
  void bind(WireSession& session, const Exchange& exchange, int& lost);
  bool prepare(WireSession& session, const Exchange& exchange, int& lost);
  [[nodiscard]] bool awaits_stop() const;
  bool yield_to_stop();
  void idle(WireSession& session, int& lost);
  void wait_closed(Duration duration, int native_error);
  void report(const Exchange& exchange, const ExchangeResult& result);
  [[nodiscard]] bool armed() const;
  const Exchange* take();
  void tell();
  std::span<const ExchangeResult> take_results();
  void report(const PortStatus& status);
  void touch();
  /// It may block in the port's driver from now on.
  void expect_port_call();
  [[nodiscard]] bool quitting() const { return wakeup_.quit.load(std::memory_order_acquire); }

  Executor core_;
  LineSettings settings_;
  PortPath port_path_;
  std::shared_ptr<Callbacks> callbacks_ = std::make_shared<Callbacks>();
  std::atomic<const Exchange*> slot_ = nullptr;
  /// In the slot: nothing is armed, and nothing follows what is under way.
  static const Exchange nothing_more;
  /// Not told yet. Whoever holds what is armed has it, too: it goes through the slot, or with a post.
  std::vector<ExchangeResult> results_;
  std::atomic<bool> stop_armed_ = false;  ///< what is in the slot, or was last, is a stop
  std::shared_ptr<StopNotice> stop_notice_ = std::make_shared<StopNotice>();
  bool yielded_ = false;            ///< of the worker: since the last exchange it has waited for a stop
  std::atomic<bool> idle_ = false;  ///< the worker sleeps (or is about to) and must be woken for the slot
  Wakeup wakeup_;
  std::atomic<TimePoint::rep> progress_;
  std::string reported_error_;  ///< last one told to the core, so that a port that stays away is told once
  std::thread thread_;
};

}  // namespace axisd::modbus_rtu
