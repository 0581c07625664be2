// What distinguishes one model of the family from another, beyond its descriptor.
#pragma once

#include <cstdint>
#include <span>

#include "devices/descriptor.hpp"

namespace axisd::yako_rtu {

struct Model {
  const DriveDescriptor* descriptor = nullptr;
  std::uint16_t first_input_function = 0x0041;  ///< register of the first terminal's function (6.1)
  /// The same where `drive: { terminal_registers: wiring }` says so; 0: the model has no such doubt.
  std::uint16_t first_input_function_of_wiring = 0;
  std::span<const std::int32_t> custom_bauds{};                      ///< in the order of the codes of 0x0014
  std::uint8_t minimum_custom_node = 32, maximum_custom_node = 127;  ///< 0x0013
  const char* custom_node_switches = "";  ///< how the address switches must stand for 0x0013 to count
  const char* custom_baud_switches = "";  ///< likewise for 0x0014
  /// Address of a drive whose 0x0013 is as the factory left it, where the manual says; 0: it does not.
  std::uint8_t factory_custom_node = 0;
};

}  // namespace axisd::yako_rtu
