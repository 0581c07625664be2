#include "daemon/store/journal_text.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "daemon/store/line_text.hpp"
#include "devices/axis/names.hpp"

namespace axisd::store {
namespace {

constexpr std::size_t checksum_size = 8;  // hexadecimal digits

constexpr std::array states = {CommandState::accepted, CommandState::active, CommandState::done,
                               CommandState::aborted,  CommandState::error,  CommandState::unknown};
constexpr std::array<std::string_view, 4> outcomes = {"not_sent", "refused", "not_executed", "unknown"};

std::int64_t in_ns(WallTime time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}
WallTime from_ns(std::int64_t ns) {
  return WallTime(std::chrono::duration_cast<WallTime::duration>(std::chrono::nanoseconds(ns)));
}

std::string text_of(const std::optional<double>& value) { return value ? fmt::format("{:a}", *value) : "-"; }
std::string text_of(const std::optional<Duration>& value) {
  return value ? fmt::format("{}", value->count()) : "-";
}
std::string text_of(const std::optional<std::int32_t>& value) {
  return value ? fmt::format("{}", *value) : "-";
}
std::string text_of(const std::optional<WallTime>& value) {
  return value ? fmt::format("{}", in_ns(*value)) : "-";
}
std::string text_of(const MotionValues& v) {
  return fmt::format("{},{},{},{},{},{},{}", text_of(v.position), text_of(v.distance), text_of(v.velocity),
                     text_of(v.search_velocity), text_of(v.acceleration_time), text_of(v.deceleration_time),
                     text_of(v.hold));
}

class Reader : public LineReader {
 public:
  using LineReader::LineReader;

  /// An enumeration by its word.
  template <class Values, class Value, class Words>
  bool one_of(const Values& values, Value& value, Words word_of) {
    std::string text;
    if (!word(text)) return false;
    for (const auto candidate : values)
      if (word_of(candidate) == text) {
        value = candidate;
        return true;
      }
    return false;
  }
  bool reason(Reason& value) {
    std::string text;
    if (!word(text)) return false;
    for (int i = 0; i <= static_cast<int>(last_reason); ++i) {
      value = static_cast<Reason>(i);
      if (to_string(value) == text) return true;
    }
    value = Reason::internal;  // of another version: the message is what counts
    return true;
  }
  bool outcome(Outcome& value) {
    std::string text;
    if (!word(text)) return false;
    for (std::size_t i = 0; i < outcomes.size(); ++i)
      if (outcomes[i] == text) {
        value = static_cast<Outcome>(i);
        return true;
      }
    return false;
  }
  bool read(std::optional<double>& value) {
    if (literal("-,")) return true;  // a number has digits, or 0x, after its sign
    return real(value.emplace()) && literal(",");
  }
  template <class T, class Make>
  bool read(std::optional<T>& value, Make make, std::string_view end = ",") {
    if (literal(std::string("-") + std::string(end))) return true;
    std::int64_t count = 0;
    if (!number(count) || !literal(end)) return false;
    value = make(count);
    return true;
  }
  bool read(MotionValues& v) {
    const auto duration = [](std::int64_t count) { return Duration(count); };
    return read(v.position) && read(v.distance) && read(v.velocity) && read(v.search_velocity) &&
           read(v.acceleration_time, duration) && read(v.deceleration_time, duration) &&
           read(v.hold, duration, " ");
  }
  bool time(WallTime& value) {
    std::int64_t ns = 0;
    if (!number(ns)) return false;
    value = from_ns(ns);
    return true;
  }
  bool duration(Duration& value) {
    std::int64_t ns = 0;
    if (!number(ns)) return false;
    value = Duration(ns);
    return true;
  }
  bool head(Command& c) {
    return literal("id=") && word(c.id) && literal(" axis=") && word(c.axis) && literal(" kind=") &&
           kind(c.kind);
  }
  bool kind(CommandKind& value) {
    std::string text;
    if (!word(text)) return false;
    const auto found = find_command_kind(text);
    if (found) value = *found;
    return found.has_value();
  }
};

std::string head(const Command& c) {
  return fmt::format("id={} axis={} kind={}", escape(c.id), escape(c.axis), to_string(c.kind));
}

/// With a space before it; empty: there is none.
std::string cause_text(const Command& c) {
  if (!c.cause) return {};
  return fmt::format(" reason={} outcome={} message={} remedy={} bus={} node={}", to_string(c.cause->reason),
                     outcomes.at(static_cast<std::size_t>(c.cause->outcome)), escape(c.cause->message),
                     escape(c.cause->remedy), escape(c.cause->where.bus),
                     c.cause->where.node ? int{*c.cause->where.node} : 0);
}

struct Encode {
  std::string operator()(const AcceptedLine& line) const {
    const auto& c = line.command;
    return fmt::format("accepted {} at={} client={} request={} asked={} digest={}", head(c),
                       in_ns(c.accepted_at), escape(c.client), escape(c.request_id), text_of(c.asked),
                       escape(line.digest));
  }
  std::string operator()(const AttachedLine& line) const {
    return fmt::format("attached id={} client={} request={} digest={}", escape(line.command),
                       escape(line.request.client), escape(line.request.request_id),
                       escape(line.request.digest));
  }
  std::string operator()(const SendingLine& line) const {
    const auto& note = line.note;
    auto text = fmt::format("sending {} granted={} start={} target={} tolerance={}", head(line.command),
                            text_of(line.command.granted), text_of(note.start_pulses),
                            text_of(note.target_pulses), note.tolerance_pulses);
    for (const auto& mark : note.marks) text += " mark=" + mark_text(mark);
    return text;
  }
  std::string operator()(const EndedLine& line) const {
    const auto& c = line.command;
    const auto text = fmt::format("ended {} state={} awaits_reset={:d} granted={} started={} at={}", head(c),
                                  to_string(c.state), line.awaits_reset, text_of(c.granted),
                                  text_of(c.started_at), text_of(c.ended_at));
    return text + cause_text(c);
  }
  std::string operator()(const DoubtLine& line) const {
    return fmt::format("doubt until={} damage={}", in_ns(line.until), escape(line.damage));
  }
  std::string operator()(const TimeLine& line) const {
    return fmt::format("time at={} boot={} uptime={}", line.at.count(), escape(line.boot),
                       line.uptime.count());
  }
  std::string operator()(const HeardLine& line) const {
    const auto& c = line.command;
    return fmt::format("heard {} state={} client={} request={} digest={} accepted={} at={}{}", head(c),
                       to_string(c.state), escape(line.request.client), escape(line.request.request_id),
                       escape(line.request.digest), in_ns(c.accepted_at), text_of(c.ended_at), cause_text(c));
  }
  std::string operator()(const IdsLine& line) const {
    return fmt::format("ids file={} bytes={} count={} begin={} newest={}", line.file, line.bytes, line.count,
                       line.begin.count(), line.newest.count());
  }
  std::string operator()(const StateLine& line) const {
    auto text = fmt::format("state pair={} generation={} start_count={} inhibit={:d} since={} by={}",
                            escape(line.pair), line.generation, line.start_count, line.inhibit.active,
                            in_ns(line.inhibit.since), escape(line.inhibit.by));
    for (const auto& [axis, holds] : line.holds)
      for (const auto& [key, since] : holds)
        text += fmt::format(" hold={} since={} request={} by={}", escape(axis), in_ns(since),
                            escape(key.request_id), escape(key.holder));
    return text;
  }
};

bool read_accepted(Reader& reader, AcceptedLine& line) {
  auto& c = line.command;
  return reader.head(c) && reader.literal(" at=") && reader.time(c.accepted_at) &&
         reader.literal(" client=") && reader.word(c.client) && reader.literal(" request=") &&
         reader.word(c.request_id) && reader.literal(" asked=") && reader.read(c.asked) &&
         reader.literal("digest=") && reader.word(line.digest);
}

bool read_attached(Reader& reader, AttachedLine& line) {
  return reader.literal("id=") && reader.word(line.command) && reader.literal(" client=") &&
         reader.word(line.request.client) && reader.literal(" request=") &&
         reader.word(line.request.request_id) && reader.literal(" digest=") &&
         reader.word(line.request.digest);
}

bool read_sending(Reader& reader, SendingLine& line) {
  const auto pulses = [](std::int64_t value) { return static_cast<std::int32_t>(value); };
  auto& note = line.note;
  if (!reader.head(line.command) || !reader.literal(" granted=") || !reader.read(line.command.granted) ||
      !reader.literal("start=") || !reader.read(note.start_pulses, pulses, " ") ||
      !reader.literal("target=") || !reader.read(note.target_pulses, pulses, " ") ||
      !reader.literal("tolerance=") || !reader.number(note.tolerance_pulses))
    return false;
  while (reader.literal(" mark="))
    if (!reader.mark(note.marks.emplace_back())) return false;
  return true;
}

bool read_cause(Reader& reader, Error& cause) {
  int node = 0;
  const bool ok = reader.literal(" reason=") && reader.reason(cause.reason) && reader.literal(" outcome=") &&
                  reader.outcome(cause.outcome) && reader.literal(" message=") &&
                  reader.word(cause.message) && reader.literal(" remedy=") && reader.word(cause.remedy) &&
                  reader.literal(" bus=") && reader.word(cause.where.bus) && reader.literal(" node=") &&
                  reader.number(node);
  if (node != 0) cause.where.node = static_cast<std::uint8_t>(node);
  return ok;
}

bool read_ended(Reader& reader, EndedLine& line) {
  auto& c = line.command;
  if (!reader.head(c) || !reader.literal(" state=") ||
      !reader.one_of(states, c.state, [](CommandState state) { return to_string(state); }) ||
      !reader.literal(" awaits_reset=") || !reader.flag(line.awaits_reset) || !reader.literal(" granted=") ||
      !reader.read(c.granted) || !reader.literal("started=") || !reader.read(c.started_at, from_ns, " ") ||
      !reader.literal("at="))
    return false;
  if (!reader.literal("-") && !reader.time(c.ended_at.emplace())) return false;
  return reader.at_end() || read_cause(reader, c.cause.emplace());
}

bool read_doubt(Reader& reader, DoubtLine& line) {
  return reader.literal("until=") && reader.time(line.until) && reader.literal(" damage=") &&
         reader.word(line.damage);
}

bool read_time(Reader& reader, TimeLine& line) {
  return reader.literal("at=") && reader.duration(line.at) && reader.literal(" boot=") &&
         reader.word(line.boot) && reader.literal(" uptime=") && reader.duration(line.uptime);
}

bool read_heard(Reader& reader, HeardLine& line) {
  auto& c = line.command;
  auto& request = line.request;
  if (!reader.head(c) || !reader.literal(" state=") ||
      !reader.one_of(states, c.state, [](CommandState state) { return to_string(state); }) ||
      !reader.literal(" client=") || !reader.word(request.client) || !reader.literal(" request=") ||
      !reader.word(request.request_id) || !reader.literal(" digest=") || !reader.word(request.digest) ||
      !reader.literal(" accepted=") || !reader.time(c.accepted_at) || !reader.literal(" at="))
    return false;
  if (!reader.literal("-") && !reader.time(c.ended_at.emplace())) return false;
  return reader.at_end() || read_cause(reader, c.cause.emplace());
}

bool read_ids(Reader& reader, IdsLine& line) {
  return reader.literal("file=") && reader.number(line.file) && reader.literal(" bytes=") &&
         reader.number(line.bytes) && reader.literal(" count=") && reader.number(line.count) &&
         reader.literal(" begin=") && reader.duration(line.begin) && reader.literal(" newest=") &&
         reader.duration(line.newest);
}

bool read_state(Reader& reader, StateLine& line) {
  if (!reader.literal("pair=") || !reader.word(line.pair) || !reader.literal(" generation=") ||
      !reader.number(line.generation) || !reader.literal(" start_count=") ||
      !reader.number(line.start_count) || !reader.literal(" inhibit=") || !reader.flag(line.inhibit.active) ||
      !reader.literal(" since=") || !reader.time(line.inhibit.since) || !reader.literal(" by=") ||
      !reader.word(line.inhibit.by))
    return false;
  while (reader.literal(" hold=")) {
    std::string axis;
    HoldKey key;
    WallTime since{};
    if (!reader.word(axis) || !reader.literal(" since=") || !reader.time(since) ||
        !reader.literal(" request=") || !reader.word(key.request_id) || !reader.literal(" by=") ||
        !reader.word(key.holder))
      return false;
    line.holds[axis].emplace(std::move(key), since);
  }
  return true;
}

template <class Line>
std::optional<JournalLine> parsed(Reader& reader, bool (*read)(Reader&, Line&)) {
  Line line;
  if (!read(reader, line) || !reader.at_end()) return std::nullopt;
  return line;
}

std::optional<JournalLine> parse(Reader& reader) {
  if (reader.literal("accepted ")) return parsed(reader, read_accepted);
  if (reader.literal("attached ")) return parsed(reader, read_attached);
  if (reader.literal("sending ")) return parsed(reader, read_sending);
  if (reader.literal("ended ")) return parsed(reader, read_ended);
  if (reader.literal("doubt ")) return parsed(reader, read_doubt);
  if (reader.literal("time ")) return parsed(reader, read_time);
  if (reader.literal("heard ")) return parsed(reader, read_heard);
  if (reader.literal("ids ")) return parsed(reader, read_ids);
  if (reader.literal("state ")) return parsed(reader, read_state);
  return std::nullopt;
}

}  // namespace

std::string encode_line(std::uint64_t number, const JournalLine& line) {
  const auto body = fmt::format("{} {}", number, std::visit(Encode{}, line));
  return fmt::format("{:08x} {}\n", crc32(body), body);
}

std::optional<NumberedLine> decode_line(std::string_view text) {
  if (text.size() <= checksum_size) return std::nullopt;
  const auto body = text.substr(checksum_size + 1);
  if (text.substr(0, checksum_size + 1) != fmt::format("{:08x} ", crc32(body))) return std::nullopt;
  Reader reader(body);
  NumberedLine result;
  if (!reader.number(result.number) || !reader.literal(" ")) return std::nullopt;
  auto line = parse(reader);
  if (!line) return std::nullopt;
  result.line = std::move(*line);
  return result;
}

}  // namespace axisd::store
