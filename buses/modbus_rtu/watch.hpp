// Readings that the bus repeats by itself.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <utility>

#include "buses/clock.hpp"
#include "buses/modbus_rtu/transaction_queue.hpp"

namespace axisd::modbus_rtu {

/// What an answer to a repeated reading says, and when.
struct Reading {
  std::span<const std::uint16_t> registers;
  TimePoint sent_at;      ///< first byte of the request
  TimePoint answered_at;  ///< last byte of the reply
};

/// How a reading is repeated.
struct Repetition {
  Duration period{};  ///< from when one is asked for to the next; on a full line it waits in the queue, too
  /// This one says nothing new, and nobody waits for another: the reading goes on. Called on the core thread;
  /// must not block, and not call the bus.
  std::function<bool(const Reading&)> goes_on;
};

/// One reading that is being repeated. Between two of them its transaction rests here. Thread: core.
class Watch {
 public:
  /// `woken`: called once where it ends between two readings.
  Watch(Repetition repetition, std::function<void()> woken)
      : repetition_(std::move(repetition)), woken_(std::move(woken)) {}

  /// The reading under way is the last one.
  [[nodiscard]] bool over() const { return over_; }
  /// Whether another reading follows this one.
  [[nodiscard]] bool goes_on(const Reading& reading) const { return !over_ && repetition_.goes_on(reading); }
  /// When the one that follows is asked for.
  [[nodiscard]] TimePoint next(TimePoint asked_at) const { return asked_at + repetition_.period; }
  /// `due`: when `transaction` is to be taken.
  void rest(TransactionPtr transaction, Clock::Timer due) {
    resting_ = std::move(transaction);
    due_ = std::move(due);
  }
  [[nodiscard]] TransactionPtr take_resting() {
    due_.reset();
    return std::exchange(resting_, nullptr);
  }
  /// The reading under way is the last one, or none is.
  void end() {
    over_ = true;
    if (take_resting()) woken_();
  }

 private:
  Repetition repetition_;
  std::function<void()> woken_;
  bool over_ = false;
  TransactionPtr resting_;
  Clock::Timer due_;
};

}  // namespace axisd::modbus_rtu
