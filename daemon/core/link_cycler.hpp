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

/// Asks somebody with privileges about a CAN interface, and calls back exactly once, on the core thread and
/// never from within the call.
using LinkRequest = std::function<void(const std::string& interface, std::function<void(Result<void>)> done)>;

/// Somebody who can take CAN interfaces down and up.
struct LinkHelper {
  LinkRequest cycle{};  ///< does it: success is that it is up again. Empty: nobody can
  LinkRequest check{};  ///< says whether it would, and changes nothing. Empty: nobody knows
};

/// Has the link of one CAN network cycled when it is bus-off or stalled, because nothing else empties the
/// kernel's queue of frames that would go out when the network comes back (M26). A simulated link needs
/// nobody with privileges. What follows, stops first, is the axes' business: they see the port come back.
/// Thread: core.
class LinkCycler {
 public:
  /// It is asked at once, but not more often than this; doubled each time that the link needs it again.
  static constexpr Duration first_pause = std::chrono::milliseconds(100);
  static constexpr Duration longest_pause = std::chrono::seconds(10);
  /// A link that did without for so long is sound again: the next pause is the first one.
  static constexpr Duration sound_after = std::chrono::seconds(30);

  /// The helper is checked at the start and this often: it may be missing long before it is needed.
  static constexpr Duration check_period = std::chrono::seconds(30);

  /// `bus` outlives run(). What `helper` lacks is not asked for; without `cycle` this only says so.
  LinkCycler(Executor executor, Clock& clock, canopen::CanopenBus& bus, LinkHelper helper);

  /// Serves the network until close() and the bus's own close().
  Task<> run();
  /// Asks for nothing any more. Closing the bus afterwards makes run() notice it.
  void close();
  /// Why the link that needs a cycle did not get it, the last time that it was asked for; of a link that
  /// needs none, why it would not get it.
  [[nodiscard]] const std::optional<Error>& trouble() const { return refused_ ? refused_ : unready_; }

 private:
  struct Reply {
    std::optional<Result<void>> value;
    Signal came;
  };
  Task<> cycle();
  /// Nothing: closed meanwhile.
  Task<std::optional<Result<void>>> ask();
  void report(const Result<void>& answer);
  /// Asks the helper whether it would, without waiting for the answer: a bus-off must not wait for it.
  void check();
  void checked(const Result<void>& answer);
  bool note(std::optional<Error>& trouble, const Result<void>& answer) const;

  Executor executor_;
  Clock* clock_;
  canopen::CanopenBus* bus_;
  LinkHelper helper_;
  std::shared_ptr<Reply> reply_;            ///< while one is awaited
  std::optional<Error> refused_, unready_;  ///< of the cycle that is needed; of the last check
  std::shared_ptr<int> checking_;           ///< while an answer is awaited: whoever holds it may report
  TimePoint check_at_{};
  Duration pause_{};
  TimePoint asked_at_{};
  bool asked_ = false;  ///< ever
  bool closing_ = false;
};

}  // namespace axisd::core
