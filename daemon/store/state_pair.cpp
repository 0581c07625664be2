#include "daemon/store/state_pair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/store/change.hpp"
#include "daemon/store/journal_mark.hpp"

namespace axisd::store {
namespace {

constexpr std::string_view state_header = "axisd-state ";

bool looks_like_state(const FoundFile& file) { return file.regular() && file.text.starts_with(state_header); }
bool looks_like_journal(const FoundFile& file) {
  return file.regular() && file.text.starts_with(journal_header_any);
}

/// Puts the convictions together, and what follows from them.
class Court {
 public:
  Court(FoundFiles found, WallTime now) : found_(std::move(found)), now_(now) {}

  Result<Verdict> judge(const std::string& new_pair) {
    if (auto read = read_files(); !read) return fail(read.error());
    if (first_start()) {
      verdict_.state.journal.pair = new_pair;
      return std::move(verdict_);
    }
    if (!state_ && !previous_ && !line()) return fail(nothing_left());
    look_at_state_files();
    look_at_journal();
    choose();
    if (!verdict_.fresh.empty()) go_on_by_caution(new_pair);
    // Of before there were pairs: accepted, and made one.
    if (verdict_.state.journal.pair.empty()) verdict_.state.journal = {.pair = new_pair};
    return std::move(verdict_);
  }

 private:
  Result<void> read_files() {
    if (looks_like_journal(found_.state) && looks_like_state(found_.journal)) {
      std::swap(found_.state, found_.journal);
      convict({.file = KeptFile::state, .fault = KeptFault::swapped, .detail = "with journal.v1"});
    }
    for (const auto* file : {&found_.state, &found_.previous})
      if (file->regular() && newer_format(file->text)) return fail(newer(name_of(KeptFile::state)));
    state_ = read_state(found_.state, state_trouble_);
    previous_ = read_state(found_.previous, previous_trouble_);
    if (found_.journal.regular()) journal_ = load_journal(found_.journal.text);
    if (journal_ && journal_->newer_format) return fail(newer(name_of(KeptFile::journal)));
    return {};
  }

  static std::optional<Generation> read_state(const FoundFile& file, std::string& trouble) {
    if (!file.regular()) return std::nullopt;
    auto generation = decode(file.text);
    if (generation) return *std::move(generation);
    trouble = generation.error().message;
    return std::nullopt;
  }

  [[nodiscard]] bool first_start() const {
    const auto absent = [](const FoundFile& file) { return file.kind == FoundFile::Kind::absent; };
    return absent(found_.state) && absent(found_.previous) && absent(found_.journal);
  }
  [[nodiscard]] const StateLine* line() const {
    return journal_ && journal_->model.state() ? &*journal_->model.state() : nullptr;
  }

  void convict(Conviction conviction) {
    conviction.since = now_;
    verdict_.fresh.push_back(std::move(conviction));
  }
  [[nodiscard]] bool convicted(KeptFile file) const {
    return std::ranges::find(verdict_.fresh, file, &Conviction::file) != verdict_.fresh.end();
  }

  /// What is in the place of a file that cannot be read as what it should be.
  void convict_unusable(KeptFile file, const FoundFile& found, std::string trouble, std::uint64_t expected) {
    auto conviction = Conviction{.file = file, .fault = KeptFault::damaged, .expected = expected};
    if (found.kind == FoundFile::Kind::absent)
      conviction.fault = KeptFault::missing;
    else if (found.kind == FoundFile::Kind::other)
      conviction.fault = KeptFault::not_regular, conviction.detail = "it is " + found.what;
    else if (file != KeptFile::journal && looks_like_journal(found))
      conviction.fault = KeptFault::swapped, conviction.detail = "a journal";
    else if (file == KeptFile::journal && looks_like_state(found))
      conviction.fault = KeptFault::swapped, conviction.detail = "a state";
    else
      conviction.detail = std::move(trouble);
    convict(std::move(conviction));
  }

  void look_at_state_files() {
    const auto before = previous_ ? previous_->number : 0;
    const auto told = line() != nullptr && belongs() ? line()->generation : 0;
    const auto expected = std::max(before, told);
    newest_unknown_ = state_ && state_->number < before && before >= told;
    verdict_.seen.state = {.found = state_ ? state_->number : 0, .expected = expected};
    if (!state_)
      convict_unusable(KeptFile::state, found_.state, state_trouble_, expected);
    else if (state_->number < expected || (line() != nullptr && state_->journal.pair.empty()))
      convict({.file = KeptFile::state,
               .fault = KeptFault::rolled_back,
               .found = state_->number,
               .expected = expected});
    // The first generation of all has none before it.
    const auto count = std::max(state_ ? state_->number : 0, told);
    const auto one_before = count - std::min(count, std::uint64_t{1});
    if (!previous_ && (one_before > 0 || found_.previous.kind != FoundFile::Kind::absent))
      convict_unusable(KeptFile::previous, found_.previous, previous_trouble_, one_before);
    else if (const auto newest = state_ ? state_->number : told;
             previous_ && before + 1 < newest && !begun_anew(state_ ? &*state_ : nullptr))
      convict({.file = KeptFile::previous,
               .fault = KeptFault::rolled_back,
               .found = before,
               .expected = newest - 1});
  }

  /// The newest of the state files that can be read.
  [[nodiscard]] const Generation* newest() const {
    if (state_ && (!previous_ || previous_->number <= state_->number)) return &*state_;
    return previous_ ? &*previous_ : nullptr;
  }
  /// The journal says of itself that it is that of the state file; or of nothing, as one of before.
  [[nodiscard]] bool belongs() const {
    const auto* state = newest();
    return line() != nullptr &&
           (state == nullptr || state->journal.pair == line()->pair || state->journal.pair.empty());
  }

  /// Until there the journal was on the disk, as its mark says. 0: that is of another one, or says nothing.
  [[nodiscard]] std::uint64_t marked() const {
    const auto mark = found_.mark.regular() ? decode_mark(found_.mark.text) : std::nullopt;
    const auto* state = newest();
    const auto pair = state != nullptr    ? state->journal.pair
                      : line() != nullptr ? line()->pair
                                          : std::string();
    return mark && !pair.empty() && mark->pair == pair ? mark->line : 0;
  }

  /// By a start that convicted, and was killed before it began a journal anew: neither the journal nor the
  /// generation before is at fault.
  [[nodiscard]] static bool begun_anew(const Generation* state) {
    return state != nullptr && !state->state.convictions.empty() && state->journal.line == 0;
  }

  /// Lines that the journal had, by whatever else is known.
  [[nodiscard]] std::uint64_t expected_lines() const {
    auto expected = marked();
    const auto* state = newest();
    for (const auto* each : {state_ ? &*state_ : nullptr, previous_ ? &*previous_ : nullptr})
      if (each != nullptr && each->journal.pair == state->journal.pair)
        expected = std::max(expected, each->journal.line);
    return expected;
  }

  void look_at_journal() {
    const auto expected = expected_lines();
    verdict_.seen.journal = {.found = journal_ ? journal_->last_number : 0, .expected = expected};
    const bool anew = begun_anew(newest());
    if (anew) verdict_.doubt = "it was to be begun anew";
    if (!journal_) {
      if (found_.journal.kind != FoundFile::Kind::absent || expected > 0)
        convict_unusable(KeptFile::journal, found_.journal, {}, expected);
    } else if (!journal_->damage.empty()) {
      convict_unusable(KeptFile::journal, found_.journal, journal_->damage, expected);
    } else if (line() == nullptr ? expected > 0 : !belongs() && !anew) {
      // One without a word of the state file is of before that was recorded, and so an old copy.
      const auto fault = line() == nullptr ? KeptFault::rolled_back : KeptFault::foreign;
      convict({.file = KeptFile::journal,
               .fault = fault,
               .found = journal_->last_number,
               .expected = expected,
               .detail = fault == KeptFault::foreign ? "they are of different sets" : ""});
    } else if (line() != nullptr && journal_->last_number < expected) {
      convict({.file = KeptFile::journal,
               .fault = KeptFault::rolled_back,
               .found = journal_->last_number,
               .expected = expected});
    }
    for (const auto& conviction : verdict_.fresh)
      if (conviction.file == KeptFile::journal) verdict_.doubt = to_string(conviction);
  }

  /// The newest of what there is, with every latch and every hold that any file knows: a release that only
  /// one of them knows was never answered.
  void choose() {
    if (const auto* state = newest()) {
      verdict_.state = *state;
    } else {
      verdict_.state.number = line()->generation;
      verdict_.state.journal.pair = line()->pair;
    }
    if (convicted(KeptFile::state) || convicted(KeptFile::previous))
      for (const auto* each : {state_ ? &*state_ : nullptr, previous_ ? &*previous_ : nullptr})
        if (each != nullptr) add(line_of(*each));
    if (line() != nullptr) add(*line());
    verdict_.journal = std::move(journal_);
  }

  void add(const StateLine& other) {
    auto& state = verdict_.state.state;
    verdict_.state.number = std::max(verdict_.state.number, other.generation);
    state.start_count = std::max(state.start_count, other.start_count);
    if (other.inhibit.active && !state.inhibit.active) state.inhibit = other.inhibit;
    for (const auto& [axis, holds] : other.holds) state.axes[axis].holds.insert(holds.begin(), holds.end());
  }

  void go_on_by_caution(const std::string& new_pair) {
    auto& state = verdict_.state.state;
    // Where the journal is not what it was, nobody vouches that the state files are not both old copies.
    distrust_offsets(state);
    // Two that agree may be old copies, both of them: the third has to tell.
    const bool alone = !state_ || !previous_ || newest_unknown_;
    if (alone || convicted(KeptFile::journal)) latch_by_caution(state, now_);
    if (alone && verdict_.doubt.empty()) verdict_.doubt = to_string(verdict_.fresh);
    state.start_count += start_count_jump;
    // No copy of what there was before fits what there is from now on.
    verdict_.state.journal = {.pair = new_pair};
    for (const auto file : {KeptFile::state, KeptFile::previous})
      if (convicted(file)) verdict_.aside.push_back(file);
    for (const auto& conviction : verdict_.fresh) {
      const auto same = [&](const Conviction& known) {
        return known.file == conviction.file && known.fault == conviction.fault;
      };
      if (std::ranges::none_of(state.convictions, same)) state.convictions.push_back(conviction);
    }
  }

  [[nodiscard]] static Error newer(std::string_view file) {
    return {.reason = Reason::storage,
            .message = fmt::format("{} was written by a newer axisd", file),
            .remedy =
                "run that version, or move the state directory's files away (every axis then needs homing)"};
  }
  [[nodiscard]] Error nothing_left() const {
    const auto why = [](const FoundFile& file, const std::string& trouble) -> std::string {
      if (file.kind == FoundFile::Kind::absent) return "missing";
      return file.kind == FoundFile::Kind::other ? file.what : trouble;
    };
    return {
        .reason = Reason::storage,
        .message = fmt::format("state.v1 cannot be used ({}), nor the generation before it ({}), and "
                               "journal.v1 does not tell how often the daemon was started",
                               why(found_.state, state_trouble_), why(found_.previous, previous_trouble_)),
        .remedy =
            "check the disk; moving state.v1, state.v1.previous and journal.v1 away starts anew: "
            "every axis then needs homing, and a latched StopAll is forgotten"};
  }

  FoundFiles found_;
  WallTime now_;
  std::optional<Generation> state_, previous_;
  std::string state_trouble_, previous_trouble_;
  std::optional<JournalLoad> journal_;
  /// The state file is an old copy, and the journal does not tell of the newest: its end may be gone, too.
  bool newest_unknown_ = false;
  Verdict verdict_;
};

}  // namespace

StateLine line_of(const Generation& generation) {
  const auto& state = generation.state;
  StateLine line{.pair = generation.journal.pair,
                 .generation = generation.number,
                 .start_count = state.start_count,
                 .inhibit = state.inhibit};
  for (const auto& [axis, record] : state.axes)
    if (!record.holds.empty()) line.holds.emplace(axis, record.holds);
  return line;
}

Result<Verdict> judge(FoundFiles found, const std::string& new_pair, WallTime now) {
  return Court(std::move(found), now).judge(new_pair);
}

}  // namespace axisd::store
