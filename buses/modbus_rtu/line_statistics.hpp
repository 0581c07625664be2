#pragma once

#include <array>
#include <cstdint>

#include "buses/bus_load.hpp"
#include "buses/class_statistics.hpp"
#include "buses/modbus_rtu/node_table.hpp"
#include "buses/modbus_rtu/transaction_queue.hpp"

namespace axisd::modbus_rtu {

/// Counters of one line since start, over all nodes and classes.
struct BusCounters {
  std::uint64_t transactions = 0, timeouts = 0, corrupt = 0, exceptions = 0, foreign_frames = 0,
                dropped_expired = 0,
                dropped_superseded = 0,  ///< also those whose lease or port was lost
      io_errors = 0;
};

/// What became of the exchanges with one node.
struct NodeStatistics {
  std::uint64_t replies = 0;  ///< exceptions included
  std::uint64_t timeouts = 0, corrupt = 0, io_errors = 0;
  /// Exchanges that asked for the same as the one before, which had no sound reply. What tells late replies
  /// apart in between counts as neither.
  std::uint64_t repeats = 0;
  /// Replies that refused, by exception code; what is above 15 is no code of the standard: under 0.
  std::array<std::uint64_t, 16> exceptions{};
  Duration longest_turnaround{};  ///< from the request's last byte to the reply's first
  Duration occupied{};            ///< of the line, as BusLoad counts it
};

/// Everything that is counted on one line, in one place. Thread: core. Counting allocates nothing but a
/// node's first entry.
class LineStatistics {
 public:
  LineStatistics(SerialSettings serial, TimePoint since) : serial_(serial), load_(since) {}

  /// A transaction of this class was queued, where now so many wait.
  void queued(TransactionClass transaction_class, std::size_t waiting);
  /// One ended, sent or not.
  void ended(const Transaction& transaction, const ExchangeResult& result);

  /// Notes how many wait now, for whoever gets a copy.
  template <class Count>
  void waiting(const Count& count) {
    for (std::size_t i = 0; i < classes_.size(); ++i)
      classes_.at(i).waiting = count(static_cast<TransactionClass>(i));
  }

  [[nodiscard]] BusCounters counters() const;
  [[nodiscard]] const StatisticsByClass& classes() const { return classes_; }
  /// Not of addresses where only a scan asked, and nobody answered.
  [[nodiscard]] const NodeTable<NodeStatistics>& nodes() const { return nodes_; }
  /// The line is occupied by an exchange from the silence before it to the end of the reply, or of the wait
  /// for it.
  [[nodiscard]] const BusLoad& load() const { return load_; }

 private:
  struct Asked {
    Function function = Function::read_holding_registers;
    std::uint16_t address = 0, count = 0;
    bool in_vain = false;
    friend bool operator==(const Asked&, const Asked&) = default;
  };
  static void drop(Drops& drops, const ExchangeResult& result);
  static void count(Ends& ends, const ExchangeResult& result);
  void sent(const Transaction& transaction, const ExchangeResult& result);
  void count(NodeStatistics& node, const ExchangeResult& result);

  SerialSettings serial_;
  StatisticsByClass classes_;
  NodeTable<NodeStatistics> nodes_;
  NodeTable<Asked> last_;
  std::uint64_t foreign_frames_ = 0;
  BusLoad load_;
};

}  // namespace axisd::modbus_rtu
