// The command journal as lines of text: pure functions, no files.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "devices/axis/command_journal.hpp"
#include "devices/persistence.hpp"

namespace axisd::store {

struct AcceptedLine {
  Command command;  ///< without what follows from its execution
  std::string digest;
};
/// A further request was taken into the command.
struct AttachedLine {
  std::string command;
  RequestKey request;
};
/// Its start may have been sent from here on.
struct SendingLine {
  Command command;  ///< id, axis, kind and what was granted
  SendingNote note;
};
struct EndedLine {
  Command command;           ///< as SendingLine, and how it ended
  bool awaits_reset = true;  ///< an unknown outcome of which the axis was not reset since
};
/// The journal was damaged: what it does not know may have been in it.
struct DoubtLine {
  WallTime until{};
  std::string damage;
};
/// What follows was last heard of then. The journal's time begins with it, and goes on over restarts.
struct TimeLine {
  Duration at{};
  std::string boot{};  ///< with it: so long after this start of the computer it was `at`
  Duration uptime{};
};
/// A command that has ended was asked for again.
struct HeardLine {
  Command command;  ///< id, axis, kind, when it was accepted, and how it ended
  RequestKey request;
};
/// Commands that have ended and are kept by their ids only: see id_files.hpp.
struct IdsLine {
  std::uint32_t file = 0;
  std::uint64_t bytes = 0;     ///< of the file; what is behind them does not count
  std::uint64_t count = 0;     ///< ids
  Duration begin{}, newest{};  ///< the first and the last time one of them was last heard of
  bool operator==(const IdsLine&) const = default;
};
/// The state file was saved: which generation of it there is, and what of it must not be lost, once more.
struct StateLine {
  std::string pair;              ///< as in the state file
  std::uint64_t generation = 0;  ///< of the state file, at least
  std::uint64_t start_count = 0;
  InhibitRecord inhibit{};
  std::map<std::string, HoldRecords> holds{};  ///< by axis
  bool operator==(const StateLine&) const = default;
};
using JournalLine = std::variant<AcceptedLine, AttachedLine, SendingLine, EndedLine, DoubtLine, TimeLine,
                                 HeardLine, IdsLine, StateLine>;

inline constexpr std::string_view journal_header = "axisd-journal 3\n";
/// Of before it vouched for the state file, and of before there were times and ids: this build reads them,
/// too.
inline constexpr std::string_view journal_header_2 = "axisd-journal 2\n";
inline constexpr std::string_view journal_header_1 = "axisd-journal 1\n";
inline constexpr std::string_view journal_header_any = "axisd-journal ";

/// With its end of line. Lines are numbered without a gap, so that a lost one shows.
std::string encode_line(std::uint64_t number, const JournalLine& line);

struct NumberedLine {
  std::uint64_t number = 0;
  JournalLine line{};
};
/// Without its end of line. Nothing: damaged.
std::optional<NumberedLine> decode_line(std::string_view text);

}  // namespace axisd::store
