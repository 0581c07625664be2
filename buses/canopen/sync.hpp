// SYNC producer (CiA 301 7.2.5).
#pragma once

#include <functional>
#include <utility>

#include "buses/can/port.hpp"
#include "buses/canopen/cob.hpp"
#include "buses/clock.hpp"

namespace axisd::canopen {

struct SyncSettings {
  Duration period = std::chrono::milliseconds(10);
  std::uint32_t cob_id = sync_id;
  std::uint8_t counter_overflow =
      0;  ///< 0: SYNC without data; 2..240: it carries a counter 1..overflow (1019h)
};

/// Cycles since start().
struct SyncCounters {
  std::uint64_t sent = 0;
  std::uint64_t missed =
      0;              ///< not sent within their period: the core was late or the network did not take it
  Duration latest{};  ///< largest delay of a cycle's begin
};

/// The SYNC frame; `counter` 0: without data.
can::Frame sync_frame(std::uint32_t cob_id, std::uint8_t counter);

/// Sends SYNC at absolute times, so that it does not drift. A cycle that is late by its period is left out,
/// never sent twice in a row. Thread: core.
class SyncProducer {
 public:
  /// Called when a SYNC is on the network, with its time.
  using Handler = std::function<void(TimePoint)>;
  SyncProducer(Clock& clock, can::Port& port) : clock_(&clock), port_(&port) {}
  SyncProducer(const SyncProducer&) = delete;

  /// The first SYNC goes out one period from now. It does not start again by itself when the link was lost: a
  /// set-point that waits for a SYNC in a drive must be neutralised before (M24). invalid_argument: a period
  /// below 1 ms, or a counter overflow that CiA 301 does not allow.
  Result<void> start(SyncSettings settings, Handler on_sync = {});
  void stop();
  /// Cycles are left out (and not counted as missed) until resume(), which goes on at the times of before.
  void hold();
  void resume();
  [[nodiscard]] bool held() const { return held_; }
  /// Sends one SYNC now, beside the cycles, which need not run; it is not counted.
  void send_once(const can::SendOptions& options, can::Completion completion);
  /// SYNCs were given to the port that have not ended.
  [[nodiscard]] bool on_its_way() const { return on_its_way_ > 0; }
  /// Called when that ceases.
  void on_idle(std::function<void()> handler) { on_idle_ = std::move(handler); }
  /// Cycles are under way, held or not.
  [[nodiscard]] bool running() const { return running_; }
  [[nodiscard]] const SyncCounters& counters() const { return counters_; }

 private:
  void arm();
  void on_cycle();
  void put(const can::SendOptions& options, can::Completion completion);

  Clock* clock_;
  can::Port* port_;
  SyncSettings settings_;
  Handler on_sync_;
  SyncCounters counters_;
  TimePoint due_{};
  std::uint8_t counter_ = 0;
  std::uint64_t run_ = 0;  ///< completions of an earlier run are not counted
  bool running_ = false, held_ = false;
  int on_its_way_ = 0;
  TimePoint sent_once_ = TimePoint::min();
  std::function<void()> on_idle_;
  Clock::Timer timer_;
};

}  // namespace axisd::canopen
