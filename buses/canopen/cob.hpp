// Identifiers of the predefined connection set (CiA 301 7.3.3; YSS-C manual 6.1.2).
#pragma once

#include <cstdint>

namespace axisd::canopen {

inline constexpr std::uint32_t nmt_id = 0x000, sync_id = 0x080;
constexpr std::uint32_t emergency_id(std::uint8_t node) { return 0x080U + node; }
constexpr std::uint32_t sdo_reply_id(std::uint8_t node) { return 0x580U + node; }
constexpr std::uint32_t sdo_request_id(std::uint8_t node) { return 0x600U + node; }
constexpr std::uint32_t heartbeat_id(std::uint8_t node) { return 0x700U + node; }
/// Precondition: `number` is 1..4.
constexpr std::uint32_t tpdo_id(unsigned number, std::uint8_t node) {
  return 0x080U + 0x100U * number + node;
}
constexpr std::uint32_t rpdo_id(unsigned number, std::uint8_t node) {
  return 0x100U + 0x100U * number + node;
}

enum class Service : std::uint8_t {
  nmt,
  sync,
  emergency,
  time,
  tpdo,  ///< sent by the node
  rpdo,  ///< sent to the node
  sdo_reply,
  sdo_request,
  heartbeat,  ///< also boot-up and node guarding
  other,      ///< nothing of the predefined set
};

/// What a frame with this identifier is by default. PDO identifiers can be configured otherwise.
struct CobId {
  Service service = Service::other;
  std::uint8_t node = 0;    ///< 0: the service has none
  std::uint8_t number = 0;  ///< of the PDO, 1..4
  friend bool operator==(const CobId&, const CobId&) = default;
};
CobId classify(std::uint32_t id);

}  // namespace axisd::canopen
