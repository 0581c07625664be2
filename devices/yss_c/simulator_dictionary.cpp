#include "devices/yss_c/simulator_dictionary.hpp"

#include "devices/simulation/canopen_server.hpp"

namespace axisd::yss_c {

namespace {

constexpr bool plain = false, sign = true, maps = true, stays = false;
constexpr auto ro = Access::ro, rw = Access::rw, saved = Access::rw_saved, wo = Access::wo;

// Index, sub, bytes, signed, access, minimum, maximum, default, may be mapped. 607Ah and 60FFh are printed as
// U32 with a negative range: signed.
// clang-format off
constexpr simulation::ObjectRow rows[] = {
    {0x2000, 0, 2, plain, ro, 0, 65535, 0, maps},
    {0x2001, 0, 2, plain, ro, 0, 1, 0, maps},
    {0x2002, 0, 2, sign, ro, -32768, 32767, 0, maps},
    {0x2003, 0, 2, plain, ro, 0, 65535, 0, maps},
    {0x2004, 0, 2, plain, ro, 0, 65535, 0, maps},
    {0x2005, 0, 2, plain, saved, 0, 1, 0, maps},
    {0x2006, 0, 2, plain, saved, 0, 15, 8, maps},
    {0x2007, 0, 2, plain, saved, 0, 1, 0, maps},
    {0x2008, 0, 2, plain, saved, 0, 127, 0, maps},
    {0x2009, 0, 2, plain, saved, 0, 5, 0, maps},
    {0x200A, 0, 2, plain, saved, 0, 1, 0, maps},
    {0x200C, 0, 2, plain, saved, 0, 1, 0, maps},
    {0x200E, 0, 2, plain, rw, 2, 300, 5, maps},
    {0x200F, 0, 2, plain, wo, 0, 1, 0, maps},
    {0x2010, 0, 2, plain, wo, 0, 2, 0, maps},
    {0x2011, 0, 2, plain, wo, 0, 1, 0, maps},
    {0x2012, 0, 2, plain, wo, 0, 1, 0, maps},
    {0x2030, 0, 2, plain, ro, 0, 65535, 16, stays},
    {0x2030, 1, 2, plain, saved, 0, 65535, 0, maps},
    {0x2030, 2, 2, plain, saved, 0, 14, 0, maps},
    {0x2030, 3, 2, plain, saved, 0, 14, 0, maps},
    {0x2030, 4, 2, plain, saved, 0, 14, 0, maps},
    {0x2030, 5, 2, plain, saved, 0, 14, 0, maps},
    {0x2030, 6, 2, plain, saved, 0, 14, 0, maps},
    {0x2030, 7, 2, plain, saved, 0, 14, 0, maps},
    {0x2030, 8, 2, plain, saved, 0, 14, 0, maps},
    {0x2030, 12, 2, plain, saved, 0, 65535, 0, maps},
    {0x2030, 13, 2, plain, saved, 0, 4, 0, maps},
    {0x2030, 14, 2, plain, saved, 0, 4, 0, maps},
    {0x2030, 15, 2, plain, saved, 0, 4, 0, maps},
    {0x2042, 0, 2, plain, saved, 0, 150, 100, maps},
    {0x2043, 0, 2, plain, saved, 0, 100, 50, maps},
    {0x2044, 0, 2, plain, saved, 0, 100, 40, maps},
    {0x2045, 0, 2, plain, saved, 100, 500, 100, maps},
    {0x2046, 0, 2, plain, saved, 0, 20000, 4000, maps},
    {0x2047, 0, 2, plain, saved, 1, 4000, 10, maps},
    {0x2048, 0, 2, plain, saved, 0, 1024, 5, maps},
    {0x2049, 0, 2, plain, saved, 1, 256, 16, maps},
    {0x204A, 0, 2, plain, saved, 1, 256, 16, maps},
    {0x204B, 0, 2, plain, saved, 1, 200, 162, maps},
    {0x204C, 0, 2, plain, saved, 0, 30000, 8000, maps},
    {0x204D, 0, 2, plain, saved, 0, 1000, 48, maps},
    {0x204E, 0, 2, plain, saved, 0, 1024, 358, maps},
    {0x204F, 0, 2, plain, saved, 1, 200, 10, maps},
    {0x2050, 0, 2, plain, saved, 0, 1, 0, maps},
    {0x2051, 0, 2, plain, saved, 0, 65535, 15360, maps},
    {0x2052, 0, 2, plain, saved, 1, 50, 16, maps},
    {0x2053, 0, 2, plain, saved, 1, 50, 10, maps},
    {0x2054, 0, 2, plain, saved, 0, 65535, 32, maps},
    {0x2055, 0, 2, plain, saved, 0, 65535, 320, maps},
    {0x2056, 0, 2, plain, saved, 1, 50, 15, maps},
    {0x2057, 0, 2, plain, saved, 0, 65535, 33, maps},
    {0x2058, 0, 2, plain, saved, 0, 65535, 320, maps},
    {0x2059, 0, 2, plain, saved, 1, 50, 20, maps},
    {0x205A, 0, 2, plain, saved, 0, 65535, 35, maps},
    {0x205B, 0, 2, plain, saved, 0, 65535, 320, maps},
    {0x205C, 0, 2, plain, saved, 1, 50, 30, maps},
    {0x205D, 0, 2, plain, saved, 0, 65535, 38, maps},
    {0x205E, 0, 2, plain, saved, 0, 65535, 384, maps},
    {0x205F, 0, 2, plain, saved, 1, 50, 40, maps},
    {0x2060, 0, 2, plain, saved, 0, 65535, 39, maps},
    {0x2061, 0, 2, plain, saved, 0, 65535, 512, maps},
    {0x2062, 0, 2, plain, saved, 1, 50, 46, maps},
    {0x2063, 0, 2, plain, saved, 0, 65535, 40, maps},
    {0x2064, 0, 2, plain, saved, 0, 65535, 640, maps},
    {0x2065, 0, 2, plain, saved, 0, 65535, 32, maps},
    {0x2066, 0, 2, plain, saved, 0, 65535, 320, maps},
    {0x2067, 0, 2, plain, saved, 0, 65535, 10, maps},
    {0x2068, 0, 2, plain, saved, 0, 65535, 10, maps},
    {0x2069, 0, 2, plain, saved, 0, 65535, 10, maps},
    {0x206A, 0, 2, plain, saved, 0, 65535, 10, maps},
    {0x603F, 0, 2, plain, ro, 0, 65285, 0, maps},
    {0x6040, 0, 2, plain, rw, 0, 65535, 0, maps},
    {0x6041, 0, 2, plain, ro, 0, 65535, 0, maps},
    {0x605D, 0, 2, sign, rw, 0, 1, 0, stays},
    {0x6060, 0, 1, sign, rw, 0, 6, 0, maps},
    {0x6061, 0, 1, sign, ro, 0, 6, 0, maps},
    {0x6064, 0, 4, sign, rw, -2147483648, 2147483647, 0, maps},
    {0x607A, 0, 4, sign, rw, -1000000, 1000000, 5000, maps},
    {0x607C, 0, 4, sign, rw, -1000000, 1000000, 0, maps},
    {0x6081, 0, 4, plain, rw, 5, 3000, 120, maps},
    {0x6083, 0, 4, plain, rw, 0, 2000, 100, maps},
    {0x6084, 0, 4, plain, rw, 0, 2000, 100, maps},
    {0x6098, 0, 1, plain, rw, 0, 29, 0, maps},
    {0x6099, 0, 1, plain, ro, 0, 255, 2, stays},
    {0x6099, 1, 4, plain, rw, 5, 3000, 120, maps},
    {0x6099, 2, 4, plain, rw, 5, 3000, 60, maps},
    {0x609A, 0, 4, plain, rw, 30, 2000, 100, maps},
    {0x60FF, 0, 4, sign, rw, -3000, 3000, 0, maps},
};
// clang-format on

simulation::ObjectRow as_read(simulation::ObjectRow row, const Behaviour& behaviour) {
  const bool homing_range = row.index == 0x6099 || row.index == 0x609A;
  if (behaviour.ranges_of_chapter_6 && homing_range && row.access == rw) row.minimum = 0;
  if (behaviour.ranges_of_chapter_6 && row.index == 0x607C) {
    row.minimum = -0x7FFFFFFF;
    row.maximum = 0x7FFFFFFF;
  }
  if (behaviour.start_speed_u32 && row.index == 0x200E) row.size = 4;
  if (behaviour.motion_objects_u16 && (row.index == 0x6081 || row.index == 0x6083 || row.index == 0x6084))
    row.size = 2;
  if (behaviour.position_read_only && row.index == 0x6064) row.access = ro;
  if (behaviour.mode_not_mappable && row.index == 0x6060) row.mappable = false;
  return row;
}

}  // namespace

void add_rows(simulation::CanopenDictionary& dictionary, const Behaviour& behaviour,
              const simulation::PdoSettings& pdos) {
  // 1018h prints 3 entries and lists 2: the third is there, with a revision that nobody knows.
  simulation::add_communication_rows(dictionary, {.device_type = 0x00040192, .vendor = 0x0100, .product = 3});
  for (const auto& version : {0x1009, 0x100A})  // U16 as printed, where CiA 301 has strings
    dictionary.add({.index = static_cast<std::uint16_t>(version), .default_value = 0x0100});
  simulation::add_pdo_rows(dictionary, pdos);
  auto control_word = *dictionary.find(0x1600, 1);
  control_word.default_value = 0x60400010;
  dictionary.add(control_word);
  for (const auto& row : rows) dictionary.add(as_read(row, behaviour));
}

}  // namespace axisd::yss_c
