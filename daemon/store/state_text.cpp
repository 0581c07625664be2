#include "daemon/store/state_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "daemon/store/line_text.hpp"

namespace axisd::store {
namespace {

constexpr std::string_view header = "axisd-state ";
constexpr std::string_view version_line = "axisd-state 1\n";
/// With `eeprom` lines, which version 1 has not. A state without them is written as version 1, so that it
/// stays readable for an axisd that knows no other.
constexpr std::string_view version_line_with_saves = "axisd-state 2\n";
constexpr std::string_view trailer = "crc32 ";
constexpr std::size_t trailer_size = trailer.size() + 8 + 1;  // eight hexadecimal digits, end of line

/// The words of the file format; independent of what the API prints.
std::string_view trust_word(PositionTrust trust) {
  switch (trust) {
    case PositionTrust::unknown:
      return "unknown";
    case PositionTrust::set:
      return "set";
    case PositionTrust::homed:
      return "homed";
    case PositionTrust::restored:
      return "restored";
  }
  return "unknown";
}

class Reader : public LineReader {
 public:
  using LineReader::LineReader;

  bool trust(PositionTrust& value) {
    for (const auto candidate :
         {PositionTrust::unknown, PositionTrust::set, PositionTrust::homed, PositionTrust::restored}) {
      value = candidate;
      if (literal(trust_word(candidate))) return true;
    }
    return false;
  }
};

bool read_inhibit(Reader& reader, InhibitRecord& inhibit) {
  std::int64_t since = 0;
  const bool ok = reader.literal("inhibit active=") && reader.flag(inhibit.active) &&
                  reader.literal(" since_ns=") && reader.number(since) && reader.literal(" by=") &&
                  reader.word(inhibit.by) && reader.literal("\n");
  inhibit.since = WallTime(std::chrono::nanoseconds(since));
  return ok;
}

bool read_offset(Reader& reader, OffsetRecord& offset) {
  if (!reader.literal(" pulses=") || !reader.number(offset.offset_pulses) || !reader.literal(" trust=") ||
      !reader.trust(offset.trust) || !reader.literal(" last=") ||
      !reader.number(offset.last_position_pulses) || !reader.literal(" per_rev=") ||
      !reader.number(offset.pulses_per_revolution) || !reader.literal(" invert=") ||
      !reader.flag(offset.invert) || !reader.literal(" canary="))
    return false;
  for (std::size_t i = 0; i < offset.canary.size(); ++i) {
    if ((i > 0 && !reader.literal(".")) || !reader.number(offset.canary[i], 16)) return false;
  }
  return reader.literal("\n");
}

std::int64_t ns_of(WallTime time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

/// After its "hold".
bool read_hold(Reader& reader, HoldRecords& holds) {
  HoldKey key;
  std::int64_t since = 0;
  if (!reader.literal(" since_ns=") || !reader.number(since) || !reader.literal(" request=") ||
      !reader.word(key.request_id) || !reader.literal(" by=") || !reader.word(key.holder) ||
      !reader.literal("\n"))
    return false;
  return holds.emplace(std::move(key), WallTime(std::chrono::nanoseconds(since))).second;
}

/// After its "eeprom".
bool read_saves(Reader& reader, EepromRecord& saves) {
  if (!reader.literal(" saves=") || !reader.number(saves.saves) || !reader.literal(" by_hour=")) return false;
  while (!reader.literal("\n")) {
    std::int64_t hour = 0;
    std::uint64_t count = 0;
    if ((!saves.by_hour.empty() && !reader.literal(",")) || !reader.number(hour) || !reader.literal(":") ||
        !reader.number(count) || !saves.by_hour.emplace(hour, count).second)
      return false;
  }
  return true;
}

bool read_axis(Reader& reader, std::map<std::string, AxisRecord>& axes) {
  std::string name;
  AxisRecord axis;
  if (!reader.word(name) || !reader.literal(" eeprom_writes=") || !reader.number(axis.eeprom_writes) ||
      !reader.literal("\n"))
    return false;
  if (reader.literal("eeprom") && !read_saves(reader, axis.eeprom)) return false;
  if (reader.literal("offset") && !read_offset(reader, axis.offset.emplace())) return false;
  while (reader.literal("hold"))
    if (!read_hold(reader, axis.holds)) return false;
  return axes.emplace(std::move(name), axis).second;
}

std::optional<Generation> read_generation(std::string_view body) {
  Reader reader(body);
  Generation generation;
  auto& state = generation.state;
  const bool known = reader.literal(version_line) || reader.literal(version_line_with_saves);
  if (!known || !reader.literal("generation ") || !reader.number(generation.number) ||
      !reader.literal("\nstart_count ") || !reader.number(state.start_count) || !reader.literal("\n") ||
      !read_inhibit(reader, state.inhibit))
    return std::nullopt;
  while (!reader.at_end()) {
    if (!reader.literal("axis ") || !read_axis(reader, state.axes)) return std::nullopt;
  }
  return generation;
}

std::string offset_line(const OffsetRecord& offset) {
  return fmt::format("offset pulses={} trust={} last={} per_rev={} invert={:d} canary={:04x}\n",
                     offset.offset_pulses, trust_word(offset.trust), offset.last_position_pulses,
                     offset.pulses_per_revolution, offset.invert, fmt::join(offset.canary, "."));
}

std::string saves_line(const EepromRecord& eeprom) {
  auto line = fmt::format("eeprom saves={} by_hour=", eeprom.saves);
  for (const auto& [hour, count] : eeprom.by_hour)
    line += fmt::format("{}{}:{}", line.ends_with('=') ? "" : ",", hour, count);
  return line + "\n";
}

std::string checksum_line(std::string_view body) { return fmt::format("{}{:08x}\n", trailer, crc32(body)); }

/// The part that the checksum covers, if the checksum is right.
std::optional<std::string_view> intact_body(std::string_view text) {
  if (text.size() < trailer_size) return std::nullopt;
  const auto body = text.substr(0, text.size() - trailer_size);
  if (text.substr(body.size()) != checksum_line(body)) return std::nullopt;
  return body;
}

}  // namespace

std::string encode(const Generation& generation) {
  const auto& [number, state] = generation;
  const bool saves =
      std::ranges::any_of(state.axes, [](const auto& axis) { return axis.second.eeprom != EepromRecord{}; });
  std::string text(saves ? version_line_with_saves : version_line);
  text += fmt::format("generation {}\nstart_count {}\ninhibit active={:d} since_ns={} by={}\n", number,
                      state.start_count, state.inhibit.active, ns_of(state.inhibit.since),
                      escape(state.inhibit.by));
  for (const auto& [name, axis] : state.axes) {
    text += fmt::format("axis {} eeprom_writes={}\n", escape(name), axis.eeprom_writes);
    if (axis.eeprom != EepromRecord{}) text += saves_line(axis.eeprom);
    if (axis.offset) text += offset_line(*axis.offset);
    for (const auto& [hold, since] : axis.holds)
      text += fmt::format("hold since_ns={} request={} by={}\n", ns_of(since), escape(hold.request_id),
                          escape(hold.holder));
  }
  return text + checksum_line(text);
}

Result<Generation> decode(std::string_view text) {
  const auto body = intact_body(text);
  if (!body) return fail(Reason::storage, fmt::format("checksum or length is wrong ({} bytes)", text.size()));
  auto generation = read_generation(*body);
  // Only the canonical form is accepted, so that nothing that was written otherwise is read as something.
  if (!generation || encode(*generation) != text)
    return fail(Reason::storage, "intact, but not in the format that this axisd writes");
  return *std::move(generation);
}

bool newer_format(std::string_view text) {
  const auto body = intact_body(text);
  return body && body->starts_with(header) && !body->starts_with(version_line) &&
         !body->starts_with(version_line_with_saves);
}

}  // namespace axisd::store
