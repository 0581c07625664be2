// What a node on a CAN network may send: SDO replies, emergencies, TPDOs.
#include <algorithm>
#include <cstring>

#include "buses/can/socketcan_frame.hpp"
#include "buses/canopen/emcy.hpp"
#include "buses/canopen/pdo.hpp"
#include "buses/canopen/sdo_frames.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  can_frame raw{};
  const auto head = input.take(sizeof raw);
  std::memcpy(&raw, head.data(), head.size());
  if (raw.can_dlc > CAN_MAX_DLEN) return;  // the kernel delivers none
  const auto frame = can::from_kernel(raw);
  (void)can::to_kernel(frame);
  (void)canopen::parse_sdo_reply(frame);
  (void)canopen::parse_emergency(static_cast<std::uint8_t>(frame.id & 0x7FU), frame, TimePoint{});

  canopen::PdoMapping mapping;
  for (int objects = input.byte() % 9; objects > 0; --objects) {
    const auto index = std::uint32_t{input.word()} << 16U;
    mapping.push_back(canopen::MappedObject::of(index | input.word()));
  }
  if (!canopen::check_mapping(mapping)) return;
  const auto values = canopen::unpack_pdo(mapping, frame.bytes());
  if (!values) return;
  expect(values->size() == mapping.size(), "each mapped object has its value");
  const auto packed = canopen::pack_pdo(mapping, *values);
  expect(packed.size() == canopen::pdo_size(mapping), "a mapping says how long its PDO is");
  const auto again = canopen::unpack_pdo(mapping, packed);
  expect(again && *again == *values, "what is packed comes out again");
}

}  // namespace axisd::fuzz
