#include "buses/canopen/cob.hpp"

#include "buses/canopen/object.hpp"

namespace axisd::canopen {

CobId classify(std::uint32_t id) {
  constexpr std::uint32_t time_id = 0x100;
  if (id == nmt_id) return {.service = Service::nmt};
  if (id == sync_id) return {.service = Service::sync};
  if (id == time_id) return {.service = Service::time};
  const auto node = static_cast<std::uint8_t>(id & 0x7FU);
  const auto function = id >> 7U;
  if (!valid_node(node)) return {};
  switch (function) {
    case 0x1:
      return {.service = Service::emergency, .node = node};
    case 0x3:
    case 0x5:
    case 0x7:
    case 0x9:
      return {
          .service = Service::tpdo, .node = node, .number = static_cast<std::uint8_t>((function - 1) / 2)};
    case 0x4:
    case 0x6:
    case 0x8:
    case 0xA:
      return {
          .service = Service::rpdo, .node = node, .number = static_cast<std::uint8_t>((function - 2) / 2)};
    case 0xB:
      return {.service = Service::sdo_reply, .node = node};
    case 0xC:
      return {.service = Service::sdo_request, .node = node};
    case 0xE:
      return {.service = Service::heartbeat, .node = node};
    default:
      return {};
  }
}

}  // namespace axisd::canopen
