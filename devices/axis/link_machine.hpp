// The way to the drive: does it answer, and is it configured?
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "buses/error.hpp"
#include "devices/axis/snapshot.hpp"

namespace axisd {

/// What is known of the link to a drive, and why it is not online. Pure. Thread: core.
///
///   offline     -- answers() --------------------> configuring
///   configuring, offline -- configured() --------> verifying, silent
///   silent      -- answers() --------------------> verifying
///   verifying   -- connected() ------------------> online
///   configuring, verifying -- failed(): silent --> offline, silent
///   offline, silent -- failed(): it answers -----> configuring, verifying
///   online      -- lost() -----------------------> silent
///   any         -- restarted(), reconfigure() ---> configuring
///   any         -- port_closed(), close() -------> offline; silent where it was configured
class LinkMachine {
 public:
  enum class State : std::uint8_t {
    offline,      ///< it does not answer, and was not configured in this power cycle
    silent,       ///< it does not answer, and was configured before
    configuring,  ///< it answers; its configuration is not known to be right
    verifying,    ///< it answers and was configured; that it kept its memory is not known yet
    online,
  };

  // Events
  /// True: that is news.
  bool answers();
  void configured();
  void connected();
  /// An attempt to connect was in vain. True: for another reason than the one before.
  bool failed(const Error& cause, bool answers);
  void port_closed(Error cause);
  void lost(const Error& cause);
  void restarted(const Error& cause);
  /// Its memory is no longer what the configuration made it.
  void reconfigure(Error cause);
  void close() { go_silent(); }
  /// Another reason why it is not, or will not be, online.
  void explain(Error cause) { error_ = std::move(cause); }
  /// The bus could not send for a while. Nothing where it is not online: whatever is under way fails by
  /// itself, and is repeated. True: somebody has to act upon it.
  bool bus_lost(Error cause);
  void forget_bus_loss() { bus_loss_.reset(); }

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] LinkState shown() const;
  [[nodiscard]] bool online() const { return state_ == State::online; }
  [[nodiscard]] bool offline() const { return state_ == State::offline || state_ == State::silent; }
  /// In this power cycle of the drive.
  [[nodiscard]] bool is_configured() const {
    return state_ != State::offline && state_ != State::configuring;
  }
  /// Why it is not online.
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  /// Not acted upon yet.
  [[nodiscard]] const std::optional<Error>& bus_loss() const { return bus_loss_; }
  /// Seen since the daemon started.
  [[nodiscard]] int restarts() const { return restarts_; }

 private:
  void go_silent() { state_ = is_configured() ? State::silent : State::offline; }
  void go_answering() { state_ = is_configured() ? State::verifying : State::configuring; }

  State state_ = State::offline;
  std::optional<Error> error_;
  std::optional<Error> bus_loss_;
  int restarts_ = 0;
};

}  // namespace axisd
