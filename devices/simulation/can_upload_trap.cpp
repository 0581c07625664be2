#include "devices/simulation/can_upload_trap.hpp"

#include <array>

namespace axisd::simulation {

std::optional<can::Frame> UploadTrap::on_request(const can::Frame& request) {
  const auto id = 0x580U + node_;
  const auto command = static_cast<unsigned>(request.data[0] >> 5U);
  if (!begun_) {
    begun_ = true;
    // Segmented, without a size.
    return can::make_frame(
        id, std::array<std::uint8_t, 8>{0x40, request.data[1], request.data[2], request.data[3]});
  }
  if (command != 3) return std::nullopt;
  const bool answered = wrong_toggle_ != toggle_;
  toggle_ = !toggle_;
  std::array<std::uint8_t, 8> segment{static_cast<std::uint8_t>(answered ? 0x10U : 0U)};
  for (std::size_t i = 1; i < segment.size(); ++i) segment.at(i) = static_cast<std::uint8_t>('A' + i);
  return can::make_frame(id, segment);
}

}  // namespace axisd::simulation
