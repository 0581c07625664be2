#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "buses/modbus_rtu/line.hpp"
#include "buses/transaction.hpp"

namespace axisd::modbus_rtu {

/// A queued exchange and whom to tell how it ended.
struct Transaction {
  Exchange exchange;
  TransactionClass transaction_class = TransactionClass::parameters;
  std::uint64_t sequence = 0;  ///< order of arrival; set by the queue
  TimePoint queued_at{};       ///< when it was asked for
  bool reserved = false;       ///< it was given out by the reservation: only a stop may take its place
  /// Called exactly once each. Several: identical reads that were merged.
  std::vector<std::function<void(const Transaction&, const ExchangeResult&)>> on_end;
};
using TransactionPtr = std::unique_ptr<Transaction>;

/// Order of one bus: strict classes, earliest deadline within a class, then order of arrival. So that no
/// class is ever starved, every `reservation`-th pop takes the head of a class *below* the one that would be
/// next, the lower ones in turn (never instead of a stop). Pure: no I/O, no clock of its own.
class TransactionQueue {
 public:
  static constexpr int default_reservation = 8;
  explicit TransactionQueue(int reservation = default_reservation) : reservation_(reservation) {}

  /// A read equal to one that waits joins it (and lends it its urgency); everything else is queued.
  void push(TransactionPtr transaction);
  /// Returns one that pop() gave out but that was not sent, to its old place.
  void put_back(TransactionPtr transaction);
  /// The next one, or nullptr.
  TransactionPtr pop();
  /// Puts one aside: it is not given out before release().
  void hold(TransactionPtr transaction) { held_.push_back(std::move(transaction)); }
  /// Those that were put aside and are `ready` take their places again.
  void release(const std::function<bool(const Transaction&)>& ready);
  [[nodiscard]] const std::vector<TransactionPtr>& held() const { return held_; }
  /// Class of the next one by strict order.
  [[nodiscard]] std::optional<TransactionClass> top_class() const;
  /// What waits for `node` in a lower class than `to` becomes that urgent.
  void hasten(std::uint8_t node, TransactionClass to);
  /// Takes out all whose deadline has passed, or whose guard forbids sending.
  std::vector<TransactionPtr> take_unsendable(TimePoint now);
  std::vector<TransactionPtr> take_all();
  /// Earliest deadline of all, or TimePoint::max().
  [[nodiscard]] TimePoint next_deadline() const;
  [[nodiscard]] std::size_t size() const;
  /// Of one class.
  [[nodiscard]] std::size_t size(TransactionClass transaction_class) const {
    return lanes_.at(static_cast<std::size_t>(transaction_class)).size();
  }

 private:
  using Lane = std::deque<TransactionPtr>;
  Lane& lane(TransactionClass transaction_class) {
    return lanes_.at(static_cast<std::size_t>(transaction_class));
  }
  bool merge(Transaction& transaction);
  void insert(TransactionPtr transaction);
  static void take_unsendable(auto& from, TimePoint now, std::vector<TransactionPtr>& into);
  Lane* next_below(std::size_t top);

  std::array<Lane, transaction_class_count> lanes_;
  std::vector<TransactionPtr> held_;
  int reservation_;
  int popped_since_reservation_ = 0;
  std::size_t last_reserved_ = 0;  ///< class that had the last reservation
  std::uint64_t last_sequence_ = 0;
};

}  // namespace axisd::modbus_rtu
