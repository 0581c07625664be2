// A machine that knows how many calls wait for it: only then virtual time may pass.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "buses/task.hpp"
#include "devices/machine.hpp"

namespace axisd::conformance {

/// The calls that are inside the machine, and the answers that are ready. Answers wait until everything of
/// the same moment has happened, so that what a client does next never races with it. Thread: core, except
/// ended().
class CallLedger {
 public:
  explicit CallLedger(Executor core) : core_(std::move(core)) {}

  /// A call waits as long as this exists.
  class Ticket {
   public:
    explicit Ticket(CallLedger& ledger) : ledger_(&ledger) { ++ledger.waiting_; }
    Ticket(const Ticket&) = delete;
    Ticket& operator=(const Ticket&) = delete;
    ~Ticket() { release(); }
    /// Thread: any.
    void release() {
      if (auto* ledger = std::exchange(ledger_, nullptr)) ledger->ended();
    }

   private:
    CallLedger* ledger_;
  };
  using TicketPtr = std::shared_ptr<Ticket>;

  /// Runs `ask` on the core thread, with a ticket that it has to keep until the call is answered. Thread:
  /// any.
  void enter(std::function<void(TicketPtr)> ask) {
    post(core_, [this, ask = std::move(ask)] { ask(std::make_shared<Ticket>(*this)); });
  }
  /// A callback that hands `callback`'s work over to flush(), and ends the call.
  template <class... Arguments>
  std::function<void(Arguments...)> answer(TicketPtr ticket, std::function<void(Arguments...)> callback) {
    return [this, ticket = std::move(ticket), callback = std::move(callback)](Arguments... arguments) {
      ready_.push_back(
          [callback, ... values = std::move(arguments)]() mutable { callback(std::move(values)...); });
      ticket->release();
    };
  }
  /// Gives the answers that are ready. False: there was none.
  bool flush() {
    const auto ready = std::exchange(ready_, {});
    for (const auto& one : ready) one();
    return !ready.empty();
  }
  [[nodiscard]] bool call_waits() const { return waiting_.load() > 0; }

 private:
  void ended() {
    --waiting_;
    post(core_, [] {});
  }

  Executor core_;
  std::atomic<int> waiting_{0};
  std::vector<std::function<void()>> ready_;
};

/// Passes everything on to `inner`, through the ledger.
std::unique_ptr<Machine> count_calls(Machine& inner, CallLedger& ledger);

}  // namespace axisd::conformance
