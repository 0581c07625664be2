#include "devices/cia402_eds/simulator_dictionary.hpp"

#include <array>
#include <cstdint>
#include <utility>

#include "devices/simulation/canopen_server.hpp"

namespace axisd::cia402_eds {

namespace {

using simulation::object_key;
using simulation::ObjectRow;

constexpr bool plain = false, sign = true, maps = true, stays = false;
constexpr auto ro = Access::ro, rw = Access::rw;
constexpr std::int64_t i32_low = -2147483648LL, i32_high = 2147483647, u32_high = 4294967295LL;
constexpr std::int64_t fastest = 2'000'000;                     // inc/s
constexpr std::int64_t steepest = 1'000'000'000;                // inc/s^2
constexpr std::int64_t modes = 1U << 0U | 1U << 2U | 1U << 5U;  // 6502h: pp, pv, hm

// Index, sub, bytes, signed, access, minimum, maximum, default, may be mapped.
// clang-format off
constexpr auto rows = std::to_array<ObjectRow>({
    {0x603F, 0, 2, plain, ro, 0, 0xFFFF, 0, maps},
    {0x6040, 0, 2, plain, rw, 0, 0xFFFF, 0, maps},
    {0x6041, 0, 2, plain, ro, 0, 0xFFFF, 0, maps},
    {0x605A, 0, 2, sign, rw, 0, 6, 2, stays},
    {0x605D, 0, 2, sign, rw, 1, 2, 1, stays},
    {0x6060, 0, 1, sign, rw, 0, 6, 0, maps},
    {0x6061, 0, 1, sign, ro, 0, 6, 0, maps},
    {0x6062, 0, 4, sign, ro, i32_low, i32_high, 0, maps},
    {0x6064, 0, 4, sign, ro, i32_low, i32_high, 0, maps},
    {0x6065, 0, 4, plain, rw, 0, u32_high, 2000, stays},
    {0x6067, 0, 4, plain, rw, 0, u32_high, 10, stays},
    {0x6068, 0, 2, plain, rw, 0, 0xFFFF, 5, stays},
    {0x606C, 0, 4, sign, ro, i32_low, i32_high, 0, maps},
    {0x606F, 0, 2, plain, rw, 0, 0xFFFF, 100, stays},
    {0x607A, 0, 4, sign, rw, i32_low, i32_high, 0, maps},
    {0x607C, 0, 4, sign, rw, i32_low, i32_high, 0, stays},
    {0x607D, 0, 1, plain, ro, 0, 2, 2, stays},
    {0x607D, 1, 4, sign, rw, i32_low, i32_high, i32_low, stays},
    {0x607D, 2, 4, sign, rw, i32_low, i32_high, i32_high, stays},
    {0x6081, 0, 4, plain, rw, 0, fastest, 10'000, maps},
    {0x6083, 0, 4, plain, rw, 1, steepest, 100'000, maps},
    {0x6084, 0, 4, plain, rw, 1, steepest, 100'000, maps},
    {0x6085, 0, 4, plain, rw, 1, steepest, 1'000'000, stays},
    {0x6086, 0, 2, sign, rw, 0, 0, 0, stays},
    {0x6098, 0, 1, sign, rw, -128, 127, 0, maps},
    {0x6099, 0, 1, plain, ro, 0, 2, 2, stays},
    {0x6099, 1, 4, plain, rw, 1, fastest, 10'000, stays},
    {0x6099, 2, 4, plain, rw, 1, fastest, 1'000, stays},
    {0x609A, 0, 4, plain, rw, 1, steepest, 100'000, stays},
    {0x60F4, 0, 4, sign, ro, i32_low, i32_high, 0, maps},
    {0x60FD, 0, 4, plain, ro, 0, u32_high, 0, maps},
    {0x60FF, 0, 4, sign, rw, -fastest, fastest, 0, maps},
    {0x6502, 0, 4, plain, ro, 0, u32_high, modes, stays},
});
// clang-format on

constexpr std::array<std::uint16_t, 4> not_stored{0x6040, 0x6060, 0x607A, 0x60FF};

void add_text(simulation::CanopenDictionary& dictionary, std::uint16_t index, std::string_view text) {
  dictionary.add({.index = index, .text = text});
}

/// Store and restore (CiA 301 7.5.2.13, 7.5.2.14): all parameters at once; read, they say "on command".
void add_storage(simulation::CanopenDictionary& dictionary, std::uint16_t index) {
  dictionary.add({.index = index, .size = 1, .maximum = 1, .default_value = 1});
  dictionary.add(
      {.index = index, .sub = 1, .size = 4, .access = rw, .maximum = u32_high, .default_value = 1});
}

}  // namespace

void add_rows(simulation::CanopenDictionary& dictionary) {
  constexpr std::int64_t serial = 402'017;
  simulation::add_communication_rows(dictionary, {.device_type = 0x00020192,
                                                  .vendor = 0x00000A5A,
                                                  .product = 0x00402001,
                                                  .revision = 0x00010002,
                                                  .entries = 4});
  dictionary.add({.index = 0x1018, .sub = 4, .size = 4, .maximum = u32_high, .default_value = serial});
  add_text(dictionary, 0x1008, "Standard servo 402");
  add_text(dictionary, 0x1009, "1.2");
  add_text(dictionary, 0x100A, "2.07.1");
  add_storage(dictionary, 0x1010);
  add_storage(dictionary, 0x1011);
  simulation::add_pdo_rows(dictionary, pdo_settings);
  for (const auto& [index, mapped] : {std::pair(0x1600, 0x60400010), std::pair(0x1A00, 0x60410010)}) {
    dictionary.preset(object_key(static_cast<std::uint16_t>(index), 0), 1);
    dictionary.preset(object_key(static_cast<std::uint16_t>(index), 1), mapped);
  }
  for (const auto& row : rows) dictionary.add(row);
}

std::span<const std::uint16_t> volatile_objects() { return not_stored; }

}  // namespace axisd::cia402_eds
