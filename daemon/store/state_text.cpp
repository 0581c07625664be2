#include "daemon/store/state_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "daemon/store/line_text.hpp"

namespace axisd::store {
namespace {

constexpr std::string_view header = "axisd-state ";
constexpr std::string_view version_line = "axisd-state 2\n";
/// Of before the journal vouched for it and saves to the EEPROM were counted: this build reads it, too.
constexpr std::string_view version_line_1 = "axisd-state 1\n";
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

constexpr auto files = std::to_array<std::string_view>({"state", "previous", "journal"});
constexpr auto faults = std::to_array<std::string_view>(
    {"missing", "rolled_back", "damaged", "not_regular", "swapped", "foreign"});
static_assert(files.size() == std::to_underlying(KeptFile::journal) + 1U);
static_assert(faults.size() == std::to_underlying(KeptFault::foreign) + 1U);

class Reader : public LineReader {
 public:
  using LineReader::LineReader;

  /// An enumeration by its word.
  template <class Value, std::size_t size>
  bool one_of(const std::array<std::string_view, size>& words, Value& value) {
    std::string text;
    const auto found = word(text) ? std::ranges::find(words, text) : words.end();
    value = static_cast<Value>(found - words.begin());
    return found != words.end();
  }

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
      !reader.flag(offset.invert) || !reader.literal(" canary=") || !reader.mark(offset.canary))
    return false;
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

/// After its "convicted".
bool read_conviction(Reader& reader, Conviction& conviction) {
  std::int64_t since = 0;
  const bool ok = reader.literal(" file=") && reader.one_of(files, conviction.file) &&
                  reader.literal(" fault=") && reader.one_of(faults, conviction.fault) &&
                  reader.literal(" found=") && reader.number(conviction.found) &&
                  reader.literal(" expected=") && reader.number(conviction.expected) &&
                  reader.literal(" since_ns=") && reader.number(since) && reader.literal(" detail=") &&
                  reader.word(conviction.detail) && reader.literal("\n");
  conviction.since = WallTime(std::chrono::nanoseconds(since));
  return ok;
}

bool read_mark(Reader& reader, JournalMark& mark) {
  return reader.literal("pair ") && reader.word(mark.pair) && reader.literal(" journal_line=") &&
         reader.number(mark.line) && reader.literal("\n");
}

std::optional<Generation> read_generation(std::string_view body) {
  Reader reader(body);
  Generation generation;
  auto& state = generation.state;
  const bool before = reader.literal(version_line_1);
  if ((!before && !reader.literal(version_line)) || !reader.literal("generation ") ||
      !reader.number(generation.number) || !reader.literal("\n") ||
      (!before && !read_mark(reader, generation.journal)) || !reader.literal("start_count ") ||
      !reader.number(state.start_count) || !reader.literal("\n") || !read_inhibit(reader, state.inhibit))
    return std::nullopt;
  while (!before && reader.literal("convicted"))
    if (!read_conviction(reader, state.convictions.emplace_back())) return std::nullopt;
  while (!reader.at_end()) {
    if (!reader.literal("axis ") || !read_axis(reader, state.axes)) return std::nullopt;
  }
  return generation;
}

std::string offset_line(const OffsetRecord& offset) {
  return fmt::format("offset pulses={} trust={} last={} per_rev={} invert={:d} canary={}\n",
                     offset.offset_pulses, trust_word(offset.trust), offset.last_position_pulses,
                     offset.pulses_per_revolution, offset.invert, mark_text(offset.canary));
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
  const auto& [number, mark, state] = generation;
  const bool before =
      mark == JournalMark{} && state.convictions.empty() &&
      std::ranges::all_of(state.axes, [](const auto& axis) { return axis.second.eeprom == EepromRecord{}; });
  std::string text(before ? version_line_1 : version_line);
  text += fmt::format("generation {}\n", number);
  if (!before) text += fmt::format("pair {} journal_line={}\n", escape(mark.pair), mark.line);
  text += fmt::format("start_count {}\ninhibit active={:d} since_ns={} by={}\n", state.start_count,
                      state.inhibit.active, ns_of(state.inhibit.since), escape(state.inhibit.by));
  for (const auto& conviction : state.convictions)
    text += fmt::format("convicted file={} fault={} found={} expected={} since_ns={} detail={}\n",
                        files.at(std::to_underlying(conviction.file)),
                        faults.at(std::to_underlying(conviction.fault)), conviction.found,
                        conviction.expected, ns_of(conviction.since), escape(conviction.detail));
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
         !body->starts_with(version_line_1);
}

}  // namespace axisd::store
