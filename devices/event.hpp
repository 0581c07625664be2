// What happened on a machine, in order: kept for a while, so that a client that was away can catch up.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "devices/axis/snapshot.hpp"
#include "devices/configuration_change.hpp"
#include "devices/kept_state.hpp"

namespace axisd {

/// A terminal changed between two samples (M29). Pulses shorter than the refresh period are not seen.
struct TerminalEdge {
  std::string terminal;  ///< "X0", "Y1"
  std::string function;  ///< as configured; empty without one
  bool active = false;   ///< after the edge
  WallTime after{};      ///< it was still the other way then (the request of the previous sample)
  WallTime before{};     ///< it was seen then
};

struct StateChange {
  AxisState from = AxisState::disabled, to = AxisState::disabled;
  MotionCause cause = MotionCause::none;  ///< of a motion that begins
};

struct LinkChange {
  LinkState to = LinkState::offline;
  std::string detail;  ///< why it is not online, or what a drive was found doing that is being connected
};

/// The drive no longer holds what the configuration says; or holds it again (`text` empty).
struct ConfigurationDrift {
  std::string text;
};

/// Who may command an axis changed. Renewals are no event.
struct LeaseChange {
  enum class What : std::uint8_t { acquired, released, expired, taken };
  What what = What::acquired;
  std::string holder;  ///< from now on; empty: nobody
  std::string before;  ///< until now; empty: nobody
};

/// Somebody began or ceased to hold an axis in Stopping. A hold that is renewed is no event.
struct StopHoldChange {
  enum class What : std::uint8_t {
    held,
    released,
    not_durable,  ///< the disk failed: the hold stands, and ends with this run of the daemon
  };
  What what = What::held;
  HoldKey hold;
  std::string by;  ///< who released it, or holds it; empty: nobody
};

/// A command was accepted, or has ended: `command` as it stood then. Its renewals and repeats are no events.
struct CommandChange {
  std::shared_ptr<const Command> command;
};

/// An axis went into ErrorStop, or another cause took the place of the first.
struct AxisFault {
  Error cause;
};

/// The newest frames of a bus were written to a file.
struct FlightRecordWritten {
  std::string bus, name, reason;
};

/// Another configuration is served from now on.
struct ConfigurationReloaded {
  std::string client;            ///< who asked for it
  std::string before, revision;  ///< of the texts
  std::vector<ConfigurationChange> changes;
};

/// What the daemon remembers is not certain, so that motion waits; or somebody has accepted that.
struct KeptStateChange {
  std::vector<Conviction> convictions;  ///< that stand, or that were accepted
  std::string accepted_by;              ///< empty: they stand
};

/// StopAll inhibits motion of the whole machine, or was released (M14).
struct InhibitChange {
  enum class What {
    latched,      ///< by a StopAll, also one on top of another
    released,     ///< by a ReleaseStopAll
    stands,       ///< that of an earlier run, at the start of the daemon
    not_durable,  ///< it would not outlive a restart of the daemon
  } what = What::latched;
  std::string by;  ///< who called StopAll, or released it
};

/// The certificates of `server.tls` end soon, have ended, or were read again.
struct CertificateNotice {
  enum class What : std::uint8_t {
    expires_soon,
    expired,
    replaced,      ///< new connections get what the files hold now
    not_replaced,  ///< what they hold now is not usable: that of before stays
  };
  What what = What::replaced;
  std::string path;    ///< the file; empty: all of them
  WallTime expires{};  ///< the file, or what is served from now on: its first certificate to end
  std::string text;    ///< one line, with what to do
};

/// Registers were saved to the EEPROM of the axis's drive.
struct EepromWritten {
  std::uint64_t registers = 0;  ///< since the last event of the kind
  std::uint64_t total = 0;      ///< since the axis is known on this computer
};

using EventContent =
    std::variant<TerminalEdge, StateChange, LinkChange, ConfigurationDrift, FlightRecordWritten, LeaseChange,
                 ConfigurationReloaded, StopHoldChange, CommandChange, AxisFault, KeptStateChange,
                 InhibitChange, CertificateNotice, EepromWritten>;

struct Event {
  std::uint64_t sequence = 0;  ///< counts from 1 in each run of the daemon
  WallTime at{};
  std::string axis;  ///< empty: it concerns a bus, or the machine
  EventContent content;
};

/// Thread: any.
class EventSource {
 public:
  struct Batch {
    std::vector<Event> events;  ///< oldest first
    std::uint64_t lost = 0;     ///< events after the cursor that are no longer kept
    std::uint64_t newest = 0;   ///< sequence of the newest event of all
  };
  virtual ~EventSource() = default;
  /// Events with a sequence above `cursor`, at most `most`.
  [[nodiscard]] virtual Batch events_after(std::uint64_t cursor, std::size_t most) const = 0;
  /// Called on the core thread after each event; must only hand over. Set once before serving.
  virtual void on_event(std::function<void()> notify) = 0;
};

}  // namespace axisd
