// Process data objects: mapping, packing, and what a configured PDO looks like (CiA 301 7.2.2, 7.5.2.35 to
// 38).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "buses/canopen/object.hpp"
#include "buses/error.hpp"

namespace axisd::canopen {

struct MappedObject {
  Object object;
  std::uint8_t bits = 0;  ///< 1..64
  /// As 1600h and 1A00h hold it: index, sub-index and length in bits.
  [[nodiscard]] constexpr std::uint32_t raw() const {
    return std::uint32_t{object.index} << 16U | std::uint32_t{object.sub} << 8U | bits;
  }
  static constexpr MappedObject of(std::uint32_t raw) {
    return {{static_cast<std::uint16_t>(raw >> 16U), static_cast<std::uint8_t>(raw >> 8U)},
            static_cast<std::uint8_t>(raw)};
  }
  friend constexpr bool operator==(const MappedObject&, const MappedObject&) = default;
};
using PdoMapping = std::vector<MappedObject>;

/// Refuses lengths of 0 and more than 64 bits in all.
Result<void> check_mapping(const PdoMapping& mapping);
/// Bytes of a PDO with this mapping.
std::size_t pdo_size(const PdoMapping& mapping);
/// Values side by side, lowest bit first; bits beyond an object's length are cut off. Precondition:
/// check_mapping() and as many values as objects.
Bytes pack_pdo(const PdoMapping& mapping, std::span<const std::uint64_t> values);
/// One value per object. Too few bytes are an error (CiA 301: EMCY 8210h); more are ignored (8220h).
Result<std::vector<std::uint64_t>> unpack_pdo(const PdoMapping& mapping, std::span<const std::uint8_t> bytes);

enum class PdoDirection : std::uint8_t {
  receive,   ///< RPDO: sent to the node
  transmit,  ///< TPDO: sent by the node
};

/// Transmission types 1..240: with every so manieth SYNC; these are the others in use.
inline constexpr std::uint8_t acyclic_synchronous = 0, event_driven_of_manufacturer = 0xFE,
                              event_driven_of_profile = 0xFF;

/// One PDO as it should be.
struct PdoSettings {
  PdoDirection direction = PdoDirection::transmit;
  std::uint16_t number = 1;  ///< 1..512; number 1 is what the YSS-C's manual calls RPDO0 and TPDO0
  bool enabled = true;       ///< false: only switched off
  std::uint32_t cob_id = 0;  ///< 11 bits
  std::uint8_t transmission_type = event_driven_of_profile;
  std::optional<std::uint16_t> inhibit_time{};  ///< in 0.1 ms; nothing: left alone
  std::optional<std::uint16_t> event_timer{};   ///< in ms; nothing: left alone
  PdoMapping mapping{};
};
std::string name_of(PdoDirection direction, std::uint16_t number);  ///< "TPDO 1"

/// One PDO as the node has it; absent: no such sub-index.
struct PdoState {
  std::uint32_t cob_id_entry = 0;  ///< raw: bit 31 off, bit 30 no remote request
  std::optional<std::uint8_t> transmission_type{};
  std::optional<std::uint16_t> inhibit_time{}, event_timer{};
  PdoMapping mapping{};  ///< as many as sub 0 counts

  static constexpr std::uint32_t off_bit = 1U << 31U, no_remote_bit = 1U << 30U, id_mask = 0x1FFFFFFFU;
  [[nodiscard]] bool enabled() const { return (cob_id_entry & off_bit) == 0; }
  [[nodiscard]] std::uint32_t cob_id() const { return cob_id_entry & id_mask; }
};

/// What differs between the two, in words; nothing: as wanted.
std::vector<std::string> differences(const PdoState& found, const PdoSettings& wanted);

/// Where a PDO's parameters are.
Object communication_object(PdoDirection direction, std::uint16_t number, std::uint8_t sub);
Object mapping_object(PdoDirection direction, std::uint16_t number, std::uint8_t sub);

}  // namespace axisd::canopen
