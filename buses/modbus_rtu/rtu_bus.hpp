#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "buses/bus.hpp"
#include "buses/clock.hpp"
#include "buses/modbus_rtu/late_replies.hpp"
#include "buses/modbus_rtu/line.hpp"
#include "buses/modbus_rtu/line_statistics.hpp"
#include "buses/modbus_rtu/node_table.hpp"
#include "buses/modbus_rtu/quarantine.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "buses/modbus_rtu/transaction_queue.hpp"
#include "buses/modbus_rtu/watch.hpp"
#include "buses/signal.hpp"
#include "buses/start_turns.hpp"
#include "buses/task.hpp"

namespace axisd::modbus_rtu {

/// A successful exchange with its times.
struct Answer {
  std::vector<std::uint16_t> registers;  ///< of a read
  TimePoint sent_at;                     ///< first byte of the request on the wire
  TimePoint request_end;                 ///< last byte of the request
  TimePoint answered_at;                 ///< last byte of the reply
  /// False: the reply may be that of the same write of one register before, which was late. It does not show
  /// that the node got this one.
  bool certain = true;
};

/// Told how each transaction ended, sent or not, for traces. Called on the core thread; must not block.
using ExchangeObserver = std::function<void(const Transaction&, const ExchangeResult&)>;

/// One RS-485 line on the core thread: queues transactions, hands the line one at a time, and tells each
/// caller exactly once how its transaction ended. Thread: core.
class RtuBus final : public Bus {
 public:
  RtuBus(Executor executor, Clock& clock, LineSettings settings, std::unique_ptr<Line> line);
  ~RtuBus() override;
  RtuBus(const RtuBus&) = delete;

  void start(ExchangeObserver observer = {});

  /// Queues one request and waits for its end. Errors: `superseded`, `expired`, `lease_lost` (not sent),
  /// `bus_down`, `refused` (native_code is the exception), `no_reply` (outcome unknown), `not_supported` (the
  /// port cannot do options.serial: not sent).
  Task<Result<Answer>> transact(Request request, TransactionOptions options);
  /// A reading in class idle_state that the bus repeats by itself, so that whoever polls a node is woken for
  /// news alone. Ends with the answer of which `repetition` says so, with nothing where end_repetition() came
  /// between two readings or a proof was answered that does not hold or is the last of it, or with an error
  /// of transact(). Of several for one node only the first is repeated.
  Task<Result<std::optional<Answer>>> watch(Request request, Repetition repetition);
  void end_repetition(std::uint8_t node) override;

  void purge_superseded(std::uint8_t node, const AxisGate& gate) override;
  /// Exchanges with serial settings of their own end.
  void about_to_energise() override;
  void hasten(std::uint8_t node, TransactionClass to) override;
  [[nodiscard]] StartTurns* start_turns() override { return &start_turns_; }
  std::shared_ptr<void> hold() override;
  /// Somebody holds it.
  [[nodiscard]] bool held() const { return !held_.expired(); }
  void give_up_readings(std::uint8_t node) override;
  [[nodiscard]] bool holds_back(std::uint8_t node) const override;
  [[nodiscard]] std::optional<QuarantinedNode> quarantined(std::uint8_t node) const override;
  void close() override;
  [[nodiscard]] bool idle() const override { return round_.empty() && queue_.size() == 0; }

  /// Of this node, in place of the line's.
  void set_turnaround_max(std::uint8_t node, std::optional<Duration> turnaround);
  [[nodiscard]] Duration turnaround_max(std::uint8_t node) const;

  [[nodiscard]] const LineSettings& settings() const { return settings_; }
  [[nodiscard]] const std::string& name() const override { return settings_.name; }
  [[nodiscard]] bool simulated() const override { return settings_.simulated(); }
  [[nodiscard]] const PortStatus& port() const override { return port_; }
  [[nodiscard]] Signal& port_changed() override { return port_changed_; }
  /// With how many wait now.
  [[nodiscard]] LineStatistics statistics() const;
  [[nodiscard]] BusCounters counters() const { return statistics_.counters(); }
  /// With how many wait now.
  [[nodiscard]] StatisticsByClass classes() const;
  [[nodiscard]] const BusLoad& load() const { return statistics_.load(); }
  /// When the last stop frame to `node` had gone out, answered or not: its last byte. nullopt: there was
  /// none.
  [[nodiscard]] std::optional<TimePoint> stop_sent_at(std::uint8_t node) const;
  /// When something last happened that voids what earlier readings of `node` proved of its power (M6): an
  /// exchange with it that it did not answer as it should, or refused; a frame of somebody else on the line;
  /// a lost port. Long ago: nothing did.
  [[nodiscard]] TimePoint disturbed_at(std::uint8_t node) const;
  /// Damaged replies of `node` in a row, without a sound one or silence between them.
  [[nodiscard]] int garbled(std::uint8_t node) const;
  /// Nodes that do not answer are probed with back-off. Bus scans, and exchanges with serial settings of
  /// their own, neither count nor wait.
  [[nodiscard]] const Quarantine& quarantine() const { return quarantine_; }
  /// Requests to such nodes that wait for the next probe; none of them is counted as waiting in its class.
  [[nodiscard]] std::size_t held_back() const;
  [[nodiscard]] TimePoint last_progress() const override { return line_->last_progress(); }
  [[nodiscard]] std::shared_ptr<StopNotice> stop_notice() const override { return line_->stop_notice(); }

 private:
  struct Known {
    Frame request, reply;
  };
  /// What the last repeated reading of a node says, and its proof.
  using KnownOfNode = std::array<Known, 2>;
  [[nodiscard]] Exchange exchange_for(Request request, const Frame& frame, TransactionOptions options) const;
  Result<TransactionPtr> prepare(Request request, TransactionOptions options) const;
  void submit(TransactionPtr transaction);
  [[nodiscard]] bool is_repeated(const Transaction& ended, const ExchangeResult& result) const;
  void repeat(TransactionPtr transaction, const ExchangeResult& result, TimePoint now);
  [[nodiscard]] std::size_t waiting(TransactionClass transaction_class) const;
  void pump();
  bool take_back();
  void finish(std::span<const ExchangeResult> results);
  void finish(TransactionPtr transaction, const ExchangeResult& result, TimePoint now);
  void extend_round();
  [[nodiscard]] Watch* watch_of(std::uint8_t node) const;
  bool recall(std::uint8_t node);
  static void know(Exchange& exchange, Known& known);
  void note_known(const Exchange& exchange, const ExchangeResult& result);
  [[nodiscard]] TransactionPtr pop(TimePoint now);
  [[nodiscard]] bool starts_can_wait(TimePoint now) const;
  [[nodiscard]] bool can_wait(const Transaction& motion, TimePoint now) const;
  void arm_next();
  [[nodiscard]] bool must_wait(const Transaction& transaction, TimePoint now) const;
  [[nodiscard]] TimePoint ready_at(std::uint8_t node, TimePoint now) const;
  void await_release();
  void release_ready();
  void note_silence(const Transaction& ended, const ExchangeResult& result);
  TransactionPtr resync_before(TransactionPtr waiting);
  void on_results(std::span<const ExchangeResult> results);
  void on_port(const PortStatus& status);
  void reap(TimePoint now);
  void drop(TransactionPtr transaction, TimePoint now);
  void note(const Transaction& transaction, const ExchangeResult& result);
  void note_disturbance(const Request& request, const ExchangeResult& result);
  void end(TransactionPtr transaction, const ExchangeResult& result);
  void note_garbled(const Request& request, const ExchangeResult& result);
  [[nodiscard]] Result<Answer> answer(const Transaction& transaction, const ExchangeResult& result) const;
  [[nodiscard]] Error error_of(const Exchange& exchange, const ExchangeResult& result) const;

  Executor executor_;
  Clock* clock_;
  LineSettings settings_;
  std::map<std::uint8_t, Duration> turnarounds_;  ///< of nodes that have their own
  std::unique_ptr<Line> line_;
  PortStatus port_;
  Signal port_changed_;
  StartTurns start_turns_;
  std::uint64_t gave_way_ = 0;  ///< turns to start, to readings of other axes; never more than have begun
  TransactionQueue queue_;
  std::vector<TransactionPtr> round_;          ///< armed or under way, in the order of the line
  NodeTable<std::unique_ptr<Watch>> watches_;  ///< null: no more
  NodeTable<std::unique_ptr<KnownOfNode>> known_;
  LateReplies late_;
  NodeTable<TimePoint> stops_sent_;
  NodeTable<TimePoint> disturbed_;
  TimePoint line_disturbed_{};
  std::map<std::uint8_t, int> garbled_;  ///< damaged replies in a row, by node
  Quarantine quarantine_;
  Clock::Timer expiry_, release_;
  LineStatistics statistics_;
  bool closed_ = false;
  ExchangeObserver observer_;
  std::shared_ptr<AxisGate> override_gate_ = std::make_shared<AxisGate>();
  std::weak_ptr<void> held_;  ///< whoever holds the line for a start
  std::shared_ptr<int> alive_ = std::make_shared<int>();
};

}  // namespace axisd::modbus_rtu
