#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "buses/canopen/canopen_bus.hpp"
#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "buses/signal.hpp"
#include "buses/task.hpp"

namespace axisd::core {

/// Asks somebody with the privileges for it to take a CAN interface down and up, and calls back exactly once,
/// on the core thread and never from within the call. Success: it is up again.
using RequestLinkCycle =
    std::function<void(const std::string& interface, std::function<void(Result<void>)> done)>;

/// Has the link of one CAN network cycled when it is bus-off or stalled, because nothing else empties the
/// kernel's queue of frames that would go out when the network comes back (M26). What follows, stops first,
/// is the axes' business: they see the port come back. Thread: core.
class LinkCycler {
 public:
  /// It is asked at once, but not more often than this; doubled each time that the link needs it again.
  static constexpr Duration first_pause = std::chrono::milliseconds(100);
  static constexpr Duration longest_pause = std::chrono::seconds(10);
  /// A link that did without for so long is sound again: the next pause is the first one.
  static constexpr Duration sound_after = std::chrono::seconds(30);

  /// `bus` outlives run(). Without `request` nobody can do it; then this only says so.
  LinkCycler(Executor executor, Clock& clock, canopen::CanopenBus& bus, RequestLinkCycle request);

  /// Serves the network until close() and the bus's own close().
  Task<> run();
  /// Asks for nothing any more. Closing the bus afterwards makes run() notice it.
  void close();
  /// Why the link that needs a cycle did not get it, the last time that it was asked for.
  [[nodiscard]] const std::optional<Error>& trouble() const { return trouble_; }

 private:
  struct Reply {
    std::optional<Result<void>> value;
    Signal came;
  };
  Task<> cycle();
  /// Nothing: closed meanwhile.
  Task<std::optional<Result<void>>> ask();
  void report(const Result<void>& answer);

  Executor executor_;
  Clock* clock_;
  canopen::CanopenBus* bus_;
  RequestLinkCycle request_;
  std::shared_ptr<Reply> reply_;  ///< while one is awaited
  std::optional<Error> trouble_;
  Duration pause_{};
  TimePoint asked_at_{};
  bool asked_ = false;  ///< ever
  bool closing_ = false;
};

}  // namespace axisd::core
