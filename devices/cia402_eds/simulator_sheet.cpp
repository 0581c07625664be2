// The dictionary of a simulated drive from its data sheet (CiA 306).
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "devices/cia402_eds/simulator_dictionary.hpp"
#include "devices/cia402_eds/simulator_units.hpp"

namespace axisd::cia402_eds {

namespace {

using canopen::DataType;
using canopen::EdsObject;
using canopen::Object;
using canopen::TypeInfo;
using simulation::CanopenDictionary;
using simulation::ObjectRow;

/// Numbers of RPDOs and TPDOs that are simulated.
constexpr unsigned most_pdos = 256;
constexpr std::uint16_t receive_parameters = 0x1400, receive_mapping = 0x1600, transmit_parameters = 0x1800,
                        transmit_mapping = 0x1A00, end_of_pdos = 0x1C00;
constexpr std::int64_t invalid = 0x80000000;

bool between(std::uint16_t index, std::uint16_t first, std::uint16_t end) {
  return index >= first && index < end;
}

/// Of a PDO beyond those that are simulated.
bool beyond(std::uint16_t index) {
  return between(index, receive_parameters, end_of_pdos) && (index & 0x1FFU) >= most_pdos;
}

Access access_of(canopen::Access access) {
  if (access == canopen::Access::write_only) return Access::wo;
  return canopen::writable(access) ? Access::rw : Access::ro;
}

/// The ends of the type. What does not fit into 63 bits is not checked.
void set_type_limits(ObjectRow& row, const TypeInfo& type) {
  if (type.bits >= 64) {
    row.minimum = std::numeric_limits<std::int64_t>::min();
    row.maximum = std::numeric_limits<std::int64_t>::max();
    return;
  }
  const auto values = std::int64_t{1} << (row.is_signed ? type.bits - 1 : type.bits);
  row.minimum = row.is_signed ? -values : 0;
  row.maximum = values - 1;
}

/// Texts are read only; what is no text and has no size (a domain) is one byte of 0.
std::string_view text_of(const canopen::Eds& sheet, const EdsObject& object) {
  if (info(object.type).kind != TypeInfo::Kind::text) return {"\0", 1};
  if (!object.text_initial.empty()) return object.text_initial;
  return object.object.index == 0x1008 && !sheet.product_name.empty() ? sheet.product_name
                                                                      : std::string_view("1.0");
}

std::int64_t bits_of(double value, DataType type) {
  if (type == DataType::real32) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  return std::bit_cast<std::int64_t>(value);
}

ObjectRow row_of(const canopen::Eds& sheet, const EdsObject& object, std::uint8_t node) {
  const auto type = info(object.type);
  ObjectRow row{.index = object.object.index,
                .sub = object.object.sub,
                .access = access_of(object.access),
                .mappable = object.mappable};
  if (type.bits == 0) {
    row.text = text_of(sheet, object);
    return row;
  }
  row.size = static_cast<std::uint8_t>((type.bits + 7) / 8);
  row.is_signed = type.kind == TypeInfo::Kind::integer;
  set_type_limits(row, type);
  const auto low = object.low ? object.low->resolved(node) : row.minimum;
  const auto high = object.high ? object.high->resolved(node) : row.maximum;
  if (low <= high) {
    row.minimum = low;
    row.maximum = high;
  }
  if (object.known()) row.default_value = object.known()->resolved(node);
  if (type.kind == TypeInfo::Kind::real && object.real_initial)
    row.default_value = bits_of(*object.real_initial, object.type);
  return row;
}

/// The predefined connection set (CiA 301 7.3.5); nothing: this object has none.
std::optional<std::int64_t> predefined_base(const ObjectRow& row) {
  if (row.index == 0x1014 && row.sub == 0) return 0x80;
  const auto number = row.index & 0x1FFU;
  if (row.sub != 1) return std::nullopt;
  if (between(row.index, receive_parameters, receive_mapping)) return number < 4 ? 0x200 + 0x100 * number : 0;
  if (between(row.index, transmit_parameters, transmit_mapping))
    return number < 4 ? 0x180 + 0x100 * number : 0;
  return std::nullopt;
}

/// A file that has no identifier, or the base alone, means the one of the predefined connection set. PDOs
/// beyond that set have none.
void complete_identifier(ObjectRow& row, const EdsObject& object, std::uint8_t node) {
  const auto base = predefined_base(row);
  if (!base) return;
  constexpr std::int64_t identifier = 0x7FF;
  if (*base != 0 && (row.default_value & identifier) == *base)
    row.default_value += node;
  else if (!object.known() || row.default_value == 0)
    row.default_value = *base != 0 ? *base + node : invalid;
}

bool has(const CanopenDictionary& dictionary, std::uint16_t index, std::uint8_t sub = 0) {
  return dictionary.find(index, sub) != nullptr;
}

/// Of objects whose value the file leaves open.
class Values {
 public:
  Values(CanopenDictionary& dictionary, const canopen::Eds& sheet)
      : dictionary_(&dictionary), sheet_(&sheet) {}

  void set(std::uint16_t index, std::uint8_t sub, double value) {
    if (const auto* object = sheet_->find(Object{index, sub}); object != nullptr && !object->known())
      replace(index, sub, value);
  }
  /// No shaft stays within a window of 0: nobody has set that one.
  void set_window(std::uint16_t index, double value) {
    const auto* object = sheet_->find(Object{index, 0});
    if (object != nullptr && (!object->known() || object->known()->value == 0)) replace(index, 0, value);
  }

 private:
  void replace(std::uint16_t index, std::uint8_t sub, double value) {
    const auto* row = dictionary_->find(index, sub);
    if (row == nullptr || !row->text.empty()) return;
    auto changed = *row;
    const auto low = static_cast<double>(row->minimum), high = static_cast<double>(row->maximum);
    changed.default_value = static_cast<std::int64_t>(std::clamp(std::round(value), low, high));
    dictionary_->add(changed);
  }

  CanopenDictionary* dictionary_;
  const canopen::Eds* sheet_;
};

/// Of 6502h: what the drive has the objects for.
std::uint32_t modes_of(const CanopenDictionary& dictionary) {
  const bool position = has(dictionary, 0x607A) && has(dictionary, 0x6081);
  return (position ? 1U << 0U : 0U) | (has(dictionary, 0x60FF) ? 1U << 2U : 0U) |
         (has(dictionary, 0x6098) ? 1U << 5U : 0U);
}

void set_communication_values(Values& values, const CanopenDictionary& dictionary, const canopen::Eds& sheet,
                              std::uint8_t node) {
  constexpr int first_serial = 402'000;
  values.set(0x1000, 0, 0x00020192);  // a servo drive
  values.set(0x1005, 0, 0x80);
  values.set(0x1018, 0, 4);
  values.set(0x1018, 1, sheet.vendor.value_or(0));
  values.set(0x1018, 2, sheet.product.value_or(0));
  values.set(0x1018, 3, sheet.revision.value_or(0));
  values.set(0x1018, 4, first_serial + node);
  for (const std::uint16_t index : {0x1010, 0x1011})
    for (std::uint8_t sub = 0; sub < 128; ++sub) values.set(index, sub, 1);  // on command
  for (unsigned number = 0; number < most_pdos; ++number) {
    for (const unsigned parameters : {receive_parameters, transmit_parameters}) {
      values.set(static_cast<std::uint16_t>(parameters + number), 0, 2);
      values.set(static_cast<std::uint16_t>(parameters + number), 2, 255);
    }
    for (const unsigned mapping : {receive_mapping, transmit_mapping}) {
      const auto index = static_cast<std::uint16_t>(mapping + number);
      std::uint8_t count = 0;
      while (count < 64 && dictionary.get(index, static_cast<std::uint8_t>(count + 1)) != 0) ++count;
      values.set(index, 0, count);
    }
  }
}

/// One revolution per second, within a tenth of one; limits that nothing meets.
void set_profile_values(Values& values, const CanopenDictionary& dictionary,
                        const simulation::UnitSettings& settings) {
  values.set(0x608F, 1, settings.counts_per_revolution);
  values.set(0x608F, 2, 1);
  const auto units = units_of(dictionary, settings);
  const auto speed = std::max(1.0, 1 / units.velocity), ramp = std::max(1.0, 10 / units.acceleration);
  values.set(0x605A, 0, 2);
  values.set(0x605D, 0, 1);
  values.set_window(0x6065, 2 / units.position);
  values.set_window(0x6067, 10);
  values.set(0x6068, 0, 5);
  values.set(0x607D, 1, std::numeric_limits<std::int32_t>::min());
  values.set(0x607D, 2, std::numeric_limits<std::int32_t>::max());
  values.set(0x607F, 0, 1000 * speed);
  values.set(0x6081, 0, speed);
  for (const std::uint16_t index : {0x6083, 0x6084, 0x6085, 0x609A}) values.set(index, 0, ramp);
  values.set(0x6099, 1, speed);
  values.set(0x6099, 2, std::max(1.0, speed / 10));
  values.set(0x6502, 0, modes_of(dictionary));
}

}  // namespace

void add_rows_of_sheet(CanopenDictionary& dictionary, const simulation::SimulatedNodeSettings& settings) {
  const auto& sheet = *settings.sheet;
  for (const auto& [key, object] : sheet.objects) {
    if (beyond(key.index)) continue;
    auto row = row_of(sheet, object, settings.address);
    if (row.text.empty()) complete_identifier(row, object, settings.address);
    dictionary.add(row);
  }
  Values values(dictionary, sheet);
  set_communication_values(values, dictionary, sheet, settings.address);
  set_profile_values(values, dictionary, settings.units);
}

simulation::PdoSettings pdo_settings_of(const canopen::Eds& sheet) {
  simulation::PdoSettings pdos{.rpdos = 0, .tpdos = 0, .entries = 64, .from_dictionary = true};
  for (const auto& [key, object] : sheet.objects) {
    if (!between(key.index, receive_parameters, end_of_pdos) || beyond(key.index)) continue;
    auto& count = key.index < transmit_parameters ? pdos.rpdos : pdos.tpdos;
    count = std::max(count, static_cast<int>(key.index & 0x1FFU) + 1);
  }
  return pdos;
}

}  // namespace axisd::cia402_eds
