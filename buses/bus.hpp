// A wire as an axis sees it, whatever is spoken on it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "buses/error.hpp"
#include "buses/signal.hpp"
#include "buses/transaction.hpp"

namespace axisd {

class StartTurns;

/// State of the port below a bus.
struct PortStatus {
  bool open = false;
  std::optional<Error> error;  ///< why it is not open, or what is wrong though it is
};

/// A node that does not answer is asked only now and then, so that its neighbours do not wait for it.
struct QuarantinedNode {
  TimePoint since{};         ///< when it was put there
  TimePoint next{};          ///< not asked before; may have passed
  std::uint64_t probes = 0;  ///< in vain since then
};

/// Thread: core, unless said otherwise.
class Bus {
 public:
  virtual ~Bus() = default;
  [[nodiscard]] virtual const std::string& name() const = 0;
  [[nodiscard]] virtual bool simulated() const = 0;
  [[nodiscard]] virtual const PortStatus& port() const = 0;
  /// Fires when the port opens or is lost.
  [[nodiscard]] virtual Signal& port_changed() = 0;

  /// `gate` of `node` was raised: the motion frames that it guarded end, whether they wait or are armed.
  /// Called for each stop before its frame is queued; what waits for others costs it no time.
  virtual void purge_superseded(std::uint8_t node, const AxisGate& gate) = 0;
  /// The axis of `node` is offline, or is stopped again while it does not answer, or has started since:
  /// readings for it that wait end as superseded, so that what it is owed now need not wait for them. Not
  /// those of class `parameters` and below, unless they were hastened, nor what others asked for
  /// (TransactionOptions::of_others).
  virtual void give_up_readings(std::uint8_t /*node*/) {}
  /// A state that the bus reads again and again by itself, because it stays the same, is told with the next
  /// reading, or at once that there is none (Drive::watch_state).
  virtual void end_repetition(std::uint8_t /*node*/) {}
  /// An axis became busy: what it already waits for becomes as urgent as what it asks for now. Not what
  /// others asked for.
  virtual void hasten(std::uint8_t node, TransactionClass to) = 0;
  /// Requests to this node wait for their turn, because it does not answer, or because nobody could tell the
  /// answer to a reading from a late one.
  [[nodiscard]] virtual bool holds_back(std::uint8_t /*node*/) const { return false; }
  /// nullopt: it is asked whenever there is something to ask.
  [[nodiscard]] virtual std::optional<QuarantinedNode> quarantined(std::uint8_t /*node*/) const {
    return std::nullopt;
  }
  /// Where stops are announced before the core knows of them. May be null: the bus gains nothing by it.
  [[nodiscard]] virtual std::shared_ptr<StopNotice> stop_notice() const { return nullptr; }
  /// Where starts of motion keep each other from ending in time: each has its turn there. Null: they do not.
  [[nodiscard]] virtual StartTurns* start_turns() { return nullptr; }
  /// Until the token is dropped nothing begins but stops, starts, and readings of axes that move or stop: for
  /// a start at a moment. What is under way ends. Null: there would be nothing on the bus in the way of it.
  virtual std::shared_ptr<void> hold() { return nullptr; }
  /// A node of this bus is about to be energised: what would be noise to it ends as superseded, unless it has
  /// gone out.
  virtual void about_to_energise() = 0;

  /// Ends everything that waits; what is under way is still awaited. Nothing is accepted any more.
  virtual void close() = 0;
  [[nodiscard]] virtual bool idle() const = 0;
  /// Time of the last progress of a thread of its own (for the watchdog). Thread: any.
  [[nodiscard]] virtual TimePoint last_progress() const = 0;
};

}  // namespace axisd
