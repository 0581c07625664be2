#include "devices/axis/known_ids.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <utility>

namespace axisd {

namespace {

/// What lies in one run was heard of within this.
constexpr auto longest_run = std::chrono::minutes(1);
static_assert(longest_run <= milliseconds(UINT16_MAX));
/// Ids of one run: what the core merges at once takes well below a millisecond.
constexpr std::size_t largest_run = std::size_t{1} << 15U;

constexpr unsigned outcome_shift = 4, cause_bit = 0x80;

struct CommandNumber {
  std::string_view instance;
  std::uint64_t number = 0;
};

/// Of "5a1b2-17" both parts.
CommandNumber number_of(std::string_view id) {
  CommandNumber whole{.instance = id};
  const auto dash = id.rfind('-');
  if (dash == std::string_view::npos) return whole;
  const auto digits = id.substr(dash + 1);
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  // Only what comes out again as it went in.
  if (error != std::errc{} || end != digits.data() + digits.size() || number == 0 || digits.starts_with('0'))
    return whole;
  return {.instance = id.substr(0, dash), .number = number};
}

std::string id_of(const IdRun& run, const IdRecord& record) {
  if (run.last_number == 0) return run.instance;
  const auto below = static_cast<std::uint32_t>(run.last_number) - record.number;
  return fmt::format("{}-{}", run.instance, run.last_number - below);
}

IdRecord record_of(const EndedId& id, std::uint64_t number, TimePoint begin) {
  const auto key = hash_of(id.request_id);
  const auto& command = *id.command;
  IdRecord record{
      .key_high = static_cast<std::uint32_t>(key >> 32U),
      .key_low = static_cast<std::uint32_t>(key),
      .content = static_cast<std::uint32_t>(hash_of(id.digest)),
      .number = static_cast<std::uint32_t>(number),
      .after_ms = static_cast<std::uint16_t>((id.heard_of - begin) / milliseconds(1)),
      .end = static_cast<std::uint8_t>(std::to_underlying(command.state)),
  };
  if (command.cause) {
    record.end = static_cast<std::uint8_t>(record.end | cause_bit |
                                           std::to_underlying(command.cause->outcome) << outcome_shift);
    record.reason = std::to_underlying(command.cause->reason);
  }
  return record;
}

bool fits(const IdRun& run, const CommandNumber& command, TimePoint heard_of) {
  const auto distance =
      command.number > run.last_number ? command.number - run.last_number : run.last_number - command.number;
  return run.instance == command.instance && (run.last_number == 0) == (command.number == 0) &&
         heard_of - run.begin <= longest_run && distance < std::uint64_t{1} << 31U;
}

}  // namespace

std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 0xCBF29CE484222325U;  // FNV-1a, and the end of MurmurHash3, which spreads it
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  hash = (hash ^ hash >> 33U) * 0xFF51AFD7ED558CCDU;
  hash = (hash ^ hash >> 33U) * 0xC4CEB9FE1A85EC53U;
  return hash ^ hash >> 33U;
}

std::vector<IdRun> runs_of(std::vector<EndedId> ids) {
  std::ranges::sort(ids, {}, &EndedId::heard_of);
  std::vector<IdRun> runs;
  for (const auto& id : ids) {
    const auto command = number_of(id.command->id);
    if (runs.empty() || !fits(runs.back(), command, id.heard_of))
      runs.push_back({.instance = std::string(command.instance),
                      .last_number = command.number,
                      .begin = id.heard_of,
                      .newest = id.heard_of,
                      .records = {}});
    auto& run = runs.back();
    run.last_number = std::max(run.last_number, command.number);
    run.newest = id.heard_of;
    run.records.push_back(record_of(id, command.number, run.begin));
  }
  for (auto& run : runs) {
    std::ranges::sort(run.records, {}, &IdRecord::key);
    run.records.shrink_to_fit();
  }
  return runs;
}

std::optional<KnownIds::Found> KnownIds::find(std::string_view request_id, std::string_view digest) const {
  const auto key = hash_of(request_id);
  for (auto run = runs_.rbegin(); run != runs_.rend(); ++run) {
    const auto record = std::ranges::lower_bound(run->records, key, {}, &IdRecord::key);
    if (record == run->records.end() || record->key() != key) continue;
    Found found{.heard_of = run->begin + milliseconds(record->after_ms),
                .same_content = record->content == static_cast<std::uint32_t>(hash_of(digest))};
    auto& command = found.command;
    command.id = id_of(*run, *record);
    command.state = static_cast<CommandState>(record->end & 0x0FU);
    if ((record->end & cause_bit) != 0) {
      const auto reason = static_cast<Reason>(record->reason);
      command.cause = Error{
          .reason = reason,
          .message = fmt::format("{} ended as {} ({}); more is not remembered of it", command.id,
                                 to_string(command.state), to_string(reason)),
          .remedy = "look into the daemon's log",
          .outcome = static_cast<Outcome>(static_cast<unsigned>(record->end & ~cause_bit) >> outcome_shift)};
    }
    return found;
  }
  return std::nullopt;
}

void KnownIds::add(IdRun run) {
  size_ += run.records.size();
  // Few large runs instead of many small ones: what is found is looked for in each.
  while (!runs_.empty()) {
    auto& before = runs_.back();
    const bool near =
        before.begin <= run.begin && before.newest <= run.newest && run.newest - before.begin <= longest_run;
    const bool same = before.instance == run.instance && (before.last_number == 0) == (run.last_number == 0);
    // Numbers are kept by their lowest bits, below the highest of the run.
    const auto [low, high] = std::minmax(before.last_number, run.last_number);
    const bool countable = high - low < std::uint64_t{1} << 30U;
    if (!near || !same || !countable || before.records.size() > 2 * run.records.size() ||
        before.records.size() + run.records.size() > largest_run)
      break;
    const auto later = static_cast<std::uint16_t>((run.begin - before.begin) / milliseconds(1));
    for (auto& record : run.records) record.after_ms = static_cast<std::uint16_t>(record.after_ms + later);
    std::vector<IdRecord> merged;
    merged.reserve(before.records.size() + run.records.size());
    // The later one of the same id first: it is the one that is found.
    std::ranges::merge(run.records, before.records, std::back_inserter(merged), {}, &IdRecord::key,
                       &IdRecord::key);
    run.records = std::move(merged);
    run.begin = before.begin;
    run.last_number = high;
    runs_.pop_back();
  }
  runs_.push_back(std::move(run));
}

std::size_t KnownIds::forget_one(TimePoint then) {
  if (runs_.empty() || runs_.front().newest >= then) return 0;
  const auto count = runs_.front().records.size();
  runs_.pop_front();
  size_ -= count;
  return count;
}

std::optional<TimePoint> KnownIds::oldest() const {
  return runs_.empty() ? std::nullopt : std::optional(runs_.front().newest);
}

}  // namespace axisd
