#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "buses/modbus_rtu/line.hpp"
#include "buses/modbus_rtu/node_table.hpp"
#include "buses/transaction.hpp"

namespace axisd::modbus_rtu {

class Watch;

/// A queued exchange and whom to tell how it ended.
struct Transaction {
  Exchange exchange;
  TransactionClass transaction_class = TransactionClass::parameters;
  std::uint64_t sequence = 0;  ///< order of arrival, unique; set by the queue
  TimePoint queued_at{};       ///< when it was asked for
  TimePoint released_at{};     ///< when it needed to wait for its node no more; long ago if it never did
  bool resync = false;         ///< nobody asked for it: it tells late replies from that of the next
  /// Though a stop, it waits as others do for a node in quarantine, and goes with the readings of moving
  /// axes.
  bool patient = false;
  TimePoint awaited_from = TimePoint::max();  ///< as in TransactionOptions
  bool doubtful = false;   ///< a stop that is likely to go unanswered: it lets others go first
  bool reserved = false;   ///< it was given out before motion that waits: only a stop may take its place
  Watch* watch = nullptr;  ///< that may repeat it
  bool of_others = false;  ///< as in TransactionOptions
  bool given_up = false;   ///< unless it goes out before it can be taken back
  /// Called exactly once each, unless its watch ends between two readings. Several: identical reads or stops
  /// that were merged.
  std::vector<std::function<void(const Transaction&, const ExchangeResult&)>> on_end;
  /// Of what waits with the readings of moving axes: nodes of which one went before it meanwhile.
  std::bitset<256> passed_by;
};
using TransactionPtr = std::unique_ptr<Transaction>;

/// Order of one bus: strict classes, earliest deadline within a class, then order of arrival; among stops the
/// doubtful ones last, as if they had come `doubtful_patience` later, so that no flood of others keeps them
/// away for good. So that no class is ever starved, every `reservation`-th pop takes the head of a class
/// *below* the one that would be next, the lower ones in turn (never instead of a stop). Pure: no I/O, no
/// clock of its own.
///
/// What a stop asks for (take_forbidden, hasten, push, pop) looks only at what waits for its own axis; the
/// rest of the queue costs it the logarithm of its length.
class TransactionQueue {
 public:
  static constexpr int default_reservation = 8;
  static constexpr Duration doubtful_patience = std::chrono::seconds(2);
  explicit TransactionQueue(int reservation = default_reservation) : reservation_(reservation) {}

  /// A read or stop equal to one that waits joins it (and lends its urgency); everything else is queued.
  void push(TransactionPtr transaction);
  /// The same for one that was carried out and asks for something else now: in its old place, ahead of what
  /// was queued since.
  void push_again(TransactionPtr transaction);
  /// Returns one that pop() gave out but that was not sent, to its old place.
  void put_back(TransactionPtr transaction);
  /// The next one, or nullptr. Whether it may be sent still is the caller's to ask. `awaited_by`: motion can
  /// wait; where a reading of class moving_state is awaited by then its class goes before motion: of it the
  /// one that is awaited longest. Whoever waits for another reading is passed once by each node at most, as
  /// in order of arrival.
  TransactionPtr pop(std::optional<TimePoint> awaited_by = {});
  /// The next one of class `lowest` or above, or nullptr; nothing goes before its turn.
  TransactionPtr pop(TransactionClass lowest);
  /// `holds` says so of all that pop() might give out of that class.
  [[nodiscard]] bool all_of(TransactionClass transaction_class,
                            const std::function<bool(const Transaction&)>& holds) const;
  /// Nothing is to be given out but class idle_state.
  [[nodiscard]] bool only_idle() const;
  /// What pop() gives then, or nullptr.
  [[nodiscard]] const Transaction* next_idle() const;
  /// Puts one aside: it is not given out before release() of its node.
  void hold(TransactionPtr transaction);
  /// What was put aside for `node` takes its places again.
  void release(std::uint8_t node, TimePoint now);
  /// Nodes for which something was put aside.
  [[nodiscard]] std::vector<std::uint8_t> held_nodes() const;
  /// A stop waits that goes before this one, which is none of the queue's.
  [[nodiscard]] bool has_stop_before(const Transaction& other) const;
  /// Class of the next one by strict order.
  [[nodiscard]] std::optional<TransactionClass> top_class() const;
  /// What waits for `node` in a lower class than `to` becomes that urgent, but what others wait for.
  void hasten(std::uint8_t node, TransactionClass to);
  /// Takes out all that `gate` forbids to send.
  std::vector<TransactionPtr> take_forbidden(const AxisGate& gate, TimePoint now);
  /// Takes out all reads that wait for `node` in class `lowest` or above, but those that others wait for.
  std::vector<TransactionPtr> take_reads(std::uint8_t node, TransactionClass lowest);
  /// Takes out all whose deadline or validity has passed.
  std::vector<TransactionPtr> take_expired(TimePoint now);
  std::vector<TransactionPtr> take_all();
  /// Earliest deadline, or end of validity, of all; or TimePoint::max().
  [[nodiscard]] TimePoint next_expiry() const;
  [[nodiscard]] std::size_t size() const;
  /// Of one class.
  [[nodiscard]] std::size_t size(TransactionClass transaction_class) const {
    return lanes_.at(static_cast<std::size_t>(transaction_class)).size();
  }

 private:
  struct Order {
    static bool before(const Transaction& a, const Transaction& b);
    bool operator()(const TransactionPtr& a, const TransactionPtr& b) const;
  };
  using Lane = std::set<TransactionPtr, Order>;
  struct Place {
    Transaction* transaction = nullptr;
    bool held = false;
    Lane::iterator in_lane{};  ///< unless held
  };

  static std::uint64_t sequence_of(const Place& place) { return place.transaction->sequence; }
  Lane& lane(TransactionClass transaction_class) {
    return lanes_.at(static_cast<std::size_t>(transaction_class));
  }
  static TransactionClass lane_class(const Transaction& transaction) {
    const bool lower = transaction.patient && transaction.transaction_class == TransactionClass::stop;
    return lower ? TransactionClass::moving_state : transaction.transaction_class;
  }
  void insert(TransactionPtr transaction, bool held);
  TransactionPtr take(Transaction* transaction);
  bool merge(Transaction& transaction);
  [[nodiscard]] std::size_t first_class() const;
  TransactionPtr give(std::size_t top, Transaction* first);
  [[nodiscard]] bool is_awaited(TimePoint by) const;
  [[nodiscard]] Transaction* next_awaited(TimePoint by) const;
  void note_passing(const Transaction& gone);
  Lane* next_below(std::size_t top);

  std::array<Lane, transaction_class_count> lanes_;
  std::map<std::uint8_t, std::vector<TransactionPtr>> held_;
  // Where everything is that waits for one node, or that one gate guards, and what ends by itself.
  NodeTable<std::vector<Place>> by_node_;  ///< in the order of arrival
  std::unordered_map<const AxisGate*, std::vector<Transaction*>> guarded_;
  std::map<std::pair<TimePoint, std::uint64_t>, Transaction*> expiries_;
  int reservation_;
  int popped_since_reservation_ = 0;
  std::size_t last_reserved_ = 0;  ///< class that had the last reservation
  std::uint64_t last_sequence_ = 0;
};

}  // namespace axisd::modbus_rtu
