#include "devices/cia402_eds/eds_checks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

#include "devices/cia402/objects.hpp"

namespace axisd::cia402_eds {

namespace {

using canopen::Eds;
using canopen::EdsFlaw;
using canopen::EdsPart;
using canopen::Object;

/// How a key of drive: { objects: ... } names what it stands for.
struct Key {
  EdsPart part;
  std::string_view key, placeholder;
};
constexpr auto keys = std::to_array<Key>({{EdsPart::type, "type", "TYPE"},
                                          {EdsPart::access, "access", "ACCESS"},
                                          {EdsPart::low, "minimum", "NUMBER"},
                                          {EdsPart::high, "maximum", "NUMBER"},
                                          {EdsPart::value, "default", "NUMBER"},
                                          {EdsPart::mapping, "pdo", "BOOLEAN"}});

constexpr unsigned bit(EdsPart part) { return 1U << std::to_underlying(part); }
constexpr unsigned kind = bit(EdsPart::type) | bit(EdsPart::access);
/// 607Ah, 6081h and so on: their range is that of the axis, their default tells a power-up (M6).
constexpr unsigned whole = kind | bit(EdsPart::low) | bit(EdsPart::high) | bit(EdsPart::value);

/// An object that axisd uses, and what it takes from the file of it.
struct Used {
  Object object;
  unsigned parts;
};
/// Those that a drive may lack.
constexpr auto used_if_there = std::to_array<Used>({
    {object::store_all, kind},
    {object::restore_all, kind},
    {cia402::object::emergency_id, kind},
    {cia402::object::heartbeat_time, kind},
    {object::identity_vendor, bit(EdsPart::value)},
    {object::identity_product, bit(EdsPart::value)},
    {cia402::object::error_code, kind},
    {cia402::object::halt_option, kind},
    {object::commanded_position, kind | bit(EdsPart::mapping)},
    {object::position_window, kind},
    {object::velocity_threshold, kind},
    {cia402::object::home_offset, kind},
    {cia402::object::homing_method, kind},
    {cia402::object::homing_speed, kind},
    {cia402::object::homing_search_speed, kind},
    {cia402::object::homing_acceleration, kind},
    {object::inputs_value, kind},
    {cia402::object::target_velocity, whole},
    {object::drive_modes, bit(EdsPart::value)},
});

enum class Use : std::uint8_t { read, written, written_if_possible };
struct Needed {
  Object object;
  std::string_view name;
  Use use;
  std::string_view type;  ///< as drive: { objects: ... } has it
  unsigned parts = kind;
};
/// What each start, stop and reading of the driver uses, whatever else a drive has.
constexpr auto needed = std::to_array<Needed>({
    {cia402::object::control_word, "control word", Use::written, "u16"},
    {cia402::object::status_word, "status word", Use::read, "u16"},
    {cia402::object::mode, "modes of operation", Use::written, "i8"},
    {cia402::object::mode_display, "modes of operation display", Use::read, "i8"},
    {cia402::object::position, "position actual value", Use::read, "i32"},
    {object::velocity_value, "velocity actual value: nothing else tells standstill", Use::read, "i32"},
    {cia402::object::target_position, "target position", Use::written, "i32", whole},
    {cia402::object::profile_velocity, "profile velocity", Use::written, "u32", whole},
    {cia402::object::acceleration, "profile acceleration", Use::written, "u32", whole},
    {cia402::object::deceleration, "profile deceleration", Use::written_if_possible, "u32", whole},
});
/// What profile velocity mode uses beside them.
constexpr Needed for_velocity{cia402::object::target_velocity, "target velocity", Use::written, "i32", whole};

constexpr unsigned position_bit = 0, velocity_bit = 2, homing_bit = 5;  ///< of 6502h

/// As the configuration names it: without a sub-index of 0.
std::string name_of(Object object) {
  return object.sub == 0 ? fmt::format("{:04X}h", object.index) : to_string(object);
}

std::string settled(Object object, EdsPart part) {
  const auto found = std::ranges::find(keys, part, &Key::part);
  return found == keys.end()
             ? std::string()
             : fmt::format("{}: {{ {}: {} }}", name_of(object), found->key, found->placeholder);
}

EdsFinding without_mode(std::string_view name) {
  return {0,
          fmt::format("by object {} the drive has no profile {} mode", to_string(object::drive_modes), name),
          settled(object::drive_modes, EdsPart::value)};
}

/// The object, as far as axisd uses it, that this flaw leaves open and the configuration does not settle.
std::optional<Object> left_open(const Eds& eds, const EdsFlaw& flaw, const Overrides& overrides) {
  const auto open = [&](Object object, unsigned parts) {
    const auto by = overrides.find(object);
    return flaw.concerns(object) && (parts & bit(flaw.part)) != 0 &&
           (by == overrides.end() || !by->second.has(flaw.part));
  };
  for (const auto& one : needed)
    if (open(one.object, one.parts)) return one.object;
  // Whatever 60FFh is in a drive without velocity mode.
  const auto is_used = [&](Object object) {
    return object != cia402::object::target_velocity || supports(eds, velocity_bit);
  };
  for (const auto& one : used_if_there)
    if (is_used(one.object) && open(one.object, one.parts)) return one.object;
  return std::nullopt;
}

void check_needed(const Eds& eds, const Needed& one, std::vector<EdsFinding>& found) {
  const auto& [object, name, use, type, parts] = one;
  if (use == Use::written_if_possible && !can_write(eds, object)) return;
  const auto* entry = eds.find(object);
  const auto add = [&](std::string_view what, std::string settled_by) {
    found.push_back(
        {0, fmt::format("object {} ({}) {}", to_string(object), name, what), std::move(settled_by)});
  };
  const bool written = use != Use::read;
  const std::string_view access = written ? "rw" : "ro";
  if (entry == nullptr) {
    add("is missing", fmt::format("{}: {{ type: {}, access: {} }}", name_of(object), type, access));
    return;
  }
  const auto [kind_of_type, bits] = canopen::info(entry->type);
  const bool number =
      kind_of_type == canopen::TypeInfo::Kind::integer || kind_of_type == canopen::TypeInfo::Kind::natural;
  if (!number || (bits != 8 && bits != 16 && bits != 32))
    add("is no whole number of 8, 16 or 32 bits", fmt::format("{}: {{ type: {} }}", name_of(object), type));
  else if (written ? !canopen::writable(entry->access) : !canopen::readable(entry->access))
    add(fmt::format("cannot be {}", written ? "written" : "read"),
        fmt::format("{}: {{ access: {} }}", name_of(object), access));
}

/// CiA 402: 0 is no mode. Each enable writes it where nothing else is neutral.
void check_no_mode(const Eds& eds, std::vector<EdsFinding>& found) {
  const auto* mode = eds.find(cia402::object::mode);
  if (mode == nullptr || neutral_mode_of(eds) != cia402::OperationMode::none) return;
  const bool low = mode->low && mode->low->value > 0, high = mode->high && mode->high->value < 0;
  if (!low && !high) return;
  found.push_back(
      {0,
       fmt::format("object {} cannot be 0: a drive without velocity mode and homing mode is enabled "
                   "by way of that",
                   to_string(cia402::object::mode)),
       settled(cia402::object::mode, low ? EdsPart::low : EdsPart::high)});
}

}  // namespace

bool supports(const Eds& eds, unsigned mode_bit) {
  const auto* modes = eds.find(object::drive_modes);
  const auto value = modes == nullptr || !modes->known() ? 0 : modes->known()->value;
  return value == 0 || (static_cast<std::uint64_t>(value) >> mode_bit & 1U) != 0;
}

bool can_write(const Eds& eds, Object object) {
  const auto* entry = eds.find(object);
  return entry != nullptr && canopen::writable(entry->access);
}

std::string velocity_mode_lack(const Eds& eds) {
  if (!supports(eds, velocity_bit)) return without_mode("velocity").message;
  std::vector<EdsFinding> found;
  check_needed(eds, for_velocity, found);
  return found.empty() ? std::string() : found.front().message;
}

cia402::OperationMode neutral_mode_of(const Eds& eds) {
  using cia402::OperationMode;
  if (velocity_mode_lack(eds).empty()) return OperationMode::profile_velocity;
  const bool homing = supports(eds, homing_bit) && can_write(eds, cia402::object::homing_method);
  return homing ? OperationMode::homing : OperationMode::none;
}

std::vector<EdsFinding> check_eds(const Eds& eds, const Overrides& overrides) {
  std::vector<EdsFinding> found;
  std::set<Object> doubtful;
  for (const auto& flaw : eds.flaws) {
    const auto object = left_open(eds, flaw, overrides);
    if (!object) continue;
    doubtful.insert(*object);
    found.push_back({flaw.line, fmt::format("{}, and axisd uses object {}", flaw.message, to_string(*object)),
                     settled(*object, flaw.part)});
  }
  if (!doubtful.contains(object::drive_modes) && !supports(eds, position_bit))
    found.push_back(without_mode("position"));
  for (const auto& one : needed)
    if (!doubtful.contains(one.object)) check_needed(eds, one, found);
  if (found.empty()) check_no_mode(eds, found);
  return found;
}

std::string remedy_of(const std::vector<EdsFinding>& findings) {
  constexpr std::size_t most = 4;
  std::vector<std::string_view> keys_to_write;
  bool of_the_drive = false;
  for (const auto& finding : findings) {
    of_the_drive |= finding.line == 0;
    if (!finding.settled_by.empty() && keys_to_write.size() < most &&
        std::ranges::find(keys_to_write, finding.settled_by) == keys_to_write.end())
      keys_to_write.push_back(finding.settled_by);
  }
  const auto by_key = fmt::format("say what the drive's manual says: drive: {{ objects: {{ {} }} }}",
                                  fmt::join(keys_to_write, ", "));
  if (!of_the_drive) return by_key;
  return "model cia402 needs a drive with profile position mode; where the drive has what its file lacks, " +
         by_key;
}

std::vector<std::string> warnings_of(const Eds& eds, const Overrides& overrides, const std::string& path) {
  constexpr std::size_t most = 10;
  std::vector<std::string> lines;
  std::size_t rest = 0;
  for (const auto& flaw : eds.flaws) {
    const bool settled_by_key = std::ranges::any_of(
        overrides, [&](const auto& one) { return flaw.concerns(one.first) && one.second.has(flaw.part); });
    if (settled_by_key || left_open(eds, flaw, overrides)) continue;
    if (lines.size() < most)
      lines.push_back(fmt::format("{}:{}: {}", path, flaw.line, flaw.message));
    else
      ++rest;
  }
  if (rest > 0)
    lines.push_back(fmt::format("{}: {} more lines are wrong, in what axisd does not use", path, rest));
  if (!can_write(eds, cia402::object::halt_option))
    lines.push_back(
        fmt::format("{}: object 605Dh cannot be written: the drive halts in one way, and QuickStop brakes "
                    "as Stop does",
                    path));
  return lines;
}

}  // namespace axisd::cia402_eds
