#include "buses/canopen/pdo.hpp"

#include <fmt/format.h>

namespace axisd::canopen {

namespace {

constexpr unsigned most_bits = 64;

unsigned total_bits(const PdoMapping& mapping) {
  unsigned bits = 0;
  for (const auto& mapped : mapping) bits += mapped.bits;
  return bits;
}

std::string to_text(const PdoMapping& mapping) {
  std::string text;
  for (const auto& mapped : mapping) text += fmt::format("{}{:08X}h", text.empty() ? "" : " ", mapped.raw());
  return text.empty() ? "nothing" : text;
}

}  // namespace

Result<void> check_mapping(const PdoMapping& mapping) {
  for (const auto& mapped : mapping)
    if (mapped.bits == 0 || mapped.bits > most_bits)
      return fail(Reason::invalid_argument,
                  fmt::format("object {} mapped with {} bits", to_string(mapped.object), mapped.bits),
                  "map 1 to 64 bits");
  if (const auto bits = total_bits(mapping); bits > most_bits)
    return fail(Reason::invalid_argument, fmt::format("a PDO of {} bits", bits), "map 64 bits at most");
  return {};
}

std::size_t pdo_size(const PdoMapping& mapping) { return (total_bits(mapping) + 7) / 8; }

Bytes pack_pdo(const PdoMapping& mapping, std::span<const std::uint64_t> values) {
  std::uint64_t all = 0;
  unsigned at = 0;
  for (std::size_t i = 0; i < mapping.size(); ++i) {
    const unsigned bits = mapping[i].bits;
    const auto mask = bits >= most_bits ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    all |= (values[i] & mask) << at;
    at += bits;
  }
  return number_bytes(all, pdo_size(mapping));
}

Result<std::vector<std::uint64_t>> unpack_pdo(const PdoMapping& mapping,
                                              std::span<const std::uint8_t> bytes) {
  if (bytes.size() < pdo_size(mapping))
    return fail(Reason::misconfigured,
                fmt::format("a PDO came with {} bytes, its mapping has {}", bytes.size(), pdo_size(mapping)),
                "configure the node's PDOs again");
  const auto all = number_of(bytes);
  std::vector<std::uint64_t> values;
  unsigned at = 0;
  for (const auto& mapped : mapping) {
    const auto mask = mapped.bits >= most_bits ? ~std::uint64_t{0} : (std::uint64_t{1} << mapped.bits) - 1;
    values.push_back(all >> at & mask);
    at += mapped.bits;
  }
  return values;
}

std::string name_of(PdoDirection direction, std::uint16_t number) {
  return fmt::format("{} {}", direction == PdoDirection::receive ? "RPDO" : "TPDO", number);
}

std::vector<std::string> differences(const PdoState& found, const PdoSettings& wanted) {
  std::vector<std::string> texts;
  if (found.enabled() != wanted.enabled) texts.emplace_back(found.enabled() ? "it is on" : "it is off");
  if (!wanted.enabled) return texts;
  if (found.cob_id() != wanted.cob_id)
    texts.push_back(fmt::format("COB-ID {:03X}h instead of {:03X}h", found.cob_id(), wanted.cob_id));
  if (found.mapping != wanted.mapping)
    texts.push_back(fmt::format("maps {} instead of {}", to_text(found.mapping), to_text(wanted.mapping)));
  const auto compare = [&texts](const char* name, const auto& is, unsigned should) {
    if (!is)
      texts.push_back(fmt::format("has no {}", name));
    else if (*is != should)
      texts.push_back(fmt::format("{} {} instead of {}", name, *is, should));
  };
  compare("transmission type", found.transmission_type, wanted.transmission_type);
  // An entry that is not there acts as 0: no inhibition, no timer.
  if (wanted.inhibit_time && (found.inhibit_time || *wanted.inhibit_time != 0))
    compare("inhibit time", found.inhibit_time, *wanted.inhibit_time);
  if (wanted.event_timer && (found.event_timer || *wanted.event_timer != 0))
    compare("event timer", found.event_timer, *wanted.event_timer);
  return texts;
}

Object communication_object(PdoDirection direction, std::uint16_t number, std::uint8_t sub) {
  const unsigned base = direction == PdoDirection::receive ? 0x1400 : 0x1800;
  return {static_cast<std::uint16_t>(base + number - 1U), sub};
}

Object mapping_object(PdoDirection direction, std::uint16_t number, std::uint8_t sub) {
  const unsigned base = direction == PdoDirection::receive ? 0x1600 : 0x1A00;
  return {static_cast<std::uint16_t>(base + number - 1U), sub};
}

}  // namespace axisd::canopen
