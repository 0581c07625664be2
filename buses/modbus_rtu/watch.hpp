// Readings that the bus repeats by itself.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
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

/// A second request of a watch: its answer shows that the readings are worth what they seem to be.
struct Proof {
  Request request;
  /// When it is to be asked for, where the next reading is asked for at `next` and the last exchange waited
  /// for so long until it was sent. Not before that reading: later than `next`, whatever it is; it is asked
  /// again behind each answer. Called on the core thread; must not block, and not call the bus.
  std::function<TimePoint(TimePoint next, Duration waited)> due;
  /// The readings go on. Called once per answer at most, though somebody waits for it by then. Likewise.
  std::function<bool(const Reading&)> holds;
};

/// How a reading is repeated.
struct Repetition {
  Duration period{};  ///< from when one is asked for to the next; on a full line it waits in the queue, too
  /// This one says nothing new, and nobody waits for another: the reading goes on. Called on the core thread;
  /// must not block, and not call the bus.
  std::function<bool(const Reading&)> goes_on;
  std::optional<Proof> proof{};
};

/// One reading that is being repeated. Between two of them its transaction rests here. Thread: core.
class Watch {
 public:
  /// `proof`: the exchange of the repetition's proof, if it has one. `woken`: called once where it ends
  /// between two readings.
  Watch(Repetition repetition, std::optional<Exchange> proof, std::function<void()> woken)
      : repetition_(std::move(repetition)), other_(std::move(proof)), woken_(std::move(woken)) {}

  /// Its transaction asks for the proof.
  [[nodiscard]] bool proves() const { return proves_; }

  /// The reading under way is the last one.
  [[nodiscard]] bool over() const { return over_; }
  /// Whether another reading follows this answer. A reading that is the last one is judged by whoever gets
  /// it, a proof here in any case.
  [[nodiscard]] bool goes_on(const Reading& answer) const {
    if (proves_) return repetition_.proof->holds(answer) && !over_;
    return !over_ && repetition_.goes_on(answer);
  }
  /// Gives `transaction`, which has `waited` until it was sent, what it asks for next. Returns when it does.
  [[nodiscard]] TimePoint turn(Transaction& transaction, Duration waited) {
    if (!proves_) next_reading_ = transaction.queued_at + repetition_.period;
    const auto proof_at = other_ ? repetition_.proof->due(next_reading_, waited) : TimePoint::max();
    // Behind a proof, another one only where readings are rarer than proofs: they keep none of them waiting.
    const bool proof_is_next =
        proves_ ? proof_at > transaction.queued_at && proof_at < next_reading_ : proof_at <= next_reading_;
    if (proof_is_next != proves_) std::swap(transaction.exchange, *other_);
    proves_ = proof_is_next;
    return proves_ ? proof_at : next_reading_;
  }
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
  std::optional<Exchange> other_;  ///< what its transaction does not ask for at the moment
  bool proves_ = false;
  TimePoint next_reading_{};
  std::function<void()> woken_;
  bool over_ = false;
  TransactionPtr resting_;
  Clock::Timer due_;
};

}  // namespace axisd::modbus_rtu
