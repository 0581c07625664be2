// Brings the PDOs of a node into the wanted form, and says what was achieved.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "buses/canopen/pdo.hpp"
#include "buses/canopen/remote_node.hpp"

namespace axisd::canopen {

struct PdoOutcome {
  enum class Kind : std::uint8_t {
    as_found,  ///< was as wanted: nothing was written
    changed,   ///< is as wanted now
    deviates,  ///< the node does not let it be as wanted; `remarks` says how `state` differs
    failed,    ///< `error`; it may be off now
  };
  PdoDirection direction = PdoDirection::transmit;
  std::uint16_t number = 1;
  Kind kind = Kind::failed;
  PdoState state{};               ///< as read back at the end
  std::vector<Object> written{};  ///< accepted ones, in order; some may be saved to the node's EEPROM (RW/S)
  std::vector<Object> read_only{};  ///< entries that the node refused to change
  std::vector<std::string> remarks{};
  std::optional<Error> error{};  ///< also where the node refused an entry, though it could be read back

  /// It can carry the wanted objects, if with another COB-ID, type or time than wanted: look at `state`.
  [[nodiscard]] bool carries(const PdoMapping& wanted) const {
    return kind != Kind::failed && state.enabled() && state.mapping == wanted;
  }
};

/// The procedure of CiA 301 7.5.2.36 and 7.5.2.38 for one PDO: switch it off (COB-ID bit 31), mapping count
/// 0, entries, count, transmission type, inhibit and event time, switch it on; then read everything back. It
/// is compared first and only differences are written. Entries that the node holds to be read-only (on the
/// YSS-C COB-IDs and counts are printed RO, chapter 7) are left as they are. Downloads are not repeated
/// unless `options.attempts` says so; all of them may be. `permit` (may be empty) is asked once, before the
/// first download, for at most how many there will be: its error is that of the outcome, and nothing is
/// written.
Task<PdoOutcome> configure_pdo(RemoteNode node, PdoSettings wanted, SdoOptions options = {},
                               std::function<Result<void>(std::uint64_t writes)> permit = {});

/// All of them, in order; after a loss of the node the rest is not tried. One outcome for each.
Task<std::vector<PdoOutcome>> configure_pdos(RemoteNode node, std::vector<PdoSettings> wanted,
                                             SdoOptions options = {});

/// The PDO as the node has it.
Task<Result<PdoState>> read_pdo(RemoteNode node, PdoDirection direction, std::uint16_t number,
                                SdoOptions options = {});

}  // namespace axisd::canopen
