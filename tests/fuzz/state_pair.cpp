// The files of a state directory together, as anybody may have left them: what a start makes of them.
#include "daemon/store/state_pair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

#include "daemon/store/line_text.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

constexpr WallTime now{std::chrono::hours(1)};

/// With its checksums right, so that its content is looked at.
std::string with_checksum(std::string_view state) {
  const auto begin = state.rfind("crc32 ");
  if (begin != std::string_view::npos) state = state.substr(0, begin);
  return fmt::format("{}crc32 {:08x}\n", state, store::crc32(state));
}
std::string with_checksums(std::string_view journal) {
  constexpr std::size_t checksum = 9;  // digits and a blank
  std::string all;
  for (bool first = true; !journal.empty(); first = false) {
    auto line = journal.substr(0, journal.find('\n'));
    journal.remove_prefix(std::min(line.size() + 1, journal.size()));
    if (!first) {
      line.remove_prefix(std::min(checksum, line.size()));
      all += fmt::format("{:08x} ", store::crc32(line));
    }
    all.append(line) += '\n';
  }
  return all;
}

std::string mark(std::string_view text) {
  text = text.substr(0, text.find(" crc32="));
  return fmt::format("{} crc32={:08x}\n", text, store::crc32(text));
}

store::FoundFile found(std::string bytes, unsigned how) {
  using Kind = store::FoundFile::Kind;
  if (how == 1) return {.kind = Kind::absent};
  if (how == 2) return {.kind = Kind::other, .what = "a FIFO"};
  return {.kind = Kind::regular, .text = std::move(bytes)};
}

void expect_verdict(const store::Verdict& verdict) {
  const auto& state = verdict.state.state;
  expect(!verdict.state.journal.pair.empty(), "from now on there is a pair");
  if (verdict.fresh.empty()) return;
  expect(verdict.state.journal.pair == "new", "no older copy fits any more");
  expect(state.start_count >= store::start_count_jump, "no id is given out twice");
  expect(!state.convictions.empty(), "motion waits");
  expect(std::ranges::none_of(state.axes,
                              [](const auto& axis) {
                                return axis.second.offset &&
                                       axis.second.offset->trust != PositionTrust::unknown;
                              }),
         "no position is trusted");
  const bool journal = std::ranges::count(verdict.fresh, KeptFile::journal, &Conviction::file) > 0;
  expect(!journal || (state.inhibit.active && !verdict.doubt.empty()), "what the journal knew may be lost");
}

}  // namespace

void run(Input input) {
  const auto how = input.byte();
  const bool sound = input.byte() % 4 != 0;
  std::array<std::string_view, 4> files;
  auto rest = text(input.rest());
  // Files are apart by a byte that none of them has.
  for (auto& file : files) {
    file = rest.substr(0, rest.find('\0'));
    rest.remove_prefix(std::min(file.size() + 1, rest.size()));
  }
  const auto state = [&](std::size_t i) {
    return sound ? with_checksum(files.at(i)) : std::string(files.at(i));
  };
  auto verdict = store::judge(
      {.state = found(state(0), how % 4U),
       .previous = found(state(1), how / 4U % 4U),
       .journal = found(sound ? with_checksums(files[2]) : std::string(files[2]), how / 16U % 4U),
       .mark = found(sound ? mark(files[3]) : std::string(files[3]), how / 64U)},
      "new", now);
  if (verdict) return expect_verdict(*verdict);
  expect(!verdict.error().remedy.empty(), "a start that is refused says what to do");
  expect(to_string(verdict.error()).find('\n') == std::string::npos, "in one line");
}

}  // namespace axisd::fuzz
