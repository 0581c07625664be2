#include "api/axisctl/commission/operator.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <vector>

#include "api/axisctl/duration.hpp"

namespace axisd::axisctl::commission {
namespace {

using std::chrono::milliseconds;

/// How late Ctrl-C may be seen.
constexpr milliseconds glance(50);

constexpr std::string_view nobody = "nobody answered: standard input is no terminal, or has ended";

std::string plain(std::string_view line) {
  std::string word(line);
  std::erase_if(word, [](unsigned char c) { return std::isspace(c) != 0 || std::iscntrl(c) != 0; });
  std::ranges::transform(word, word.begin(), [](unsigned char c) { return std::tolower(c); });
  return word;
}

std::string trimmed(std::string text) {
  std::erase_if(text, [](unsigned char c) { return std::iscntrl(c) != 0; });
  const auto first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

void note(Step& step, std::string_view question, std::string answer) {
  auto& kept = *step.add_answers();
  kept.set_question(std::string(question));
  kept.set_answer(std::move(answer));
  *kept.mutable_at() = now();
}

bool is(const std::string& answer, std::string_view word) {
  return !answer.empty() && (answer == word || (answer.size() == 1 && answer.front() == word.front()));
}

}  // namespace

TerminalOperator::TerminalOperator(const Interrupt& interrupt, int output)
    : interrupt_(interrupt), output_(output), present_(isatty(STDIN_FILENO) == 1) {}

void TerminalOperator::write(std::string_view text) const {
  while (!text.empty()) {
    const auto written = ::write(output_, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throw Ended(false, "the terminal is gone");
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

void TerminalOperator::tell(std::string_view text) { write(fmt::format("{}\n", text)); }

std::optional<std::string> TerminalOperator::read_line(milliseconds limit) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (poll(&input, 1, static_cast<int>(limit.count())) <= 0) return std::nullopt;
  std::string line(512, '\0');
  const auto count = ::read(STDIN_FILENO, line.data(), line.size());
  if (count < 0 && (errno == EINTR || errno == EAGAIN)) return std::nullopt;
  if (count <= 0) {
    present_ = false;
    return std::string();
  }
  line.resize(static_cast<std::size_t>(count));
  return line.substr(0, line.find('\n'));
}

std::optional<std::string> TerminalOperator::ask(std::string_view question) {
  if (interrupt_.requested()) throw Ended(true, "interrupted");
  if (present_) tcflush(STDIN_FILENO, TCIFLUSH);
  write(fmt::format("{} ", question));
  while (present_) {
    const auto line = read_line(glance);
    if (interrupt_.requested()) throw Ended(true, "interrupted");
    if (line && present_) return line;
  }
  write("(no answer)\n");
  return std::nullopt;
}

std::optional<std::string> TerminalOperator::line_within(milliseconds limit) {
  if (!present_) {
    if (interrupt_.wait_for(limit)) throw Ended(true, "interrupted");
    return std::nullopt;
  }
  std::optional<std::string> line;
  do {
    line = read_line(std::min(limit, glance));
    if (interrupt_.requested()) throw Ended(true, "interrupted");
    limit -= glance;
  } while (!line && limit.count() > 0);
  return line;
}

Dialogue::Permission Dialogue::permit(std::string_view question, Step& step) {
  for (;;) {
    const auto line = operator_.ask(fmt::format("{} [yes/skip/abort]", question));
    if (!line) {
      note(step, question, "no answer");
      return {.granted = false, .reason = std::string(nobody)};
    }
    const auto answer = plain(*line);
    if (is(answer, "yes")) {
      note(step, question, "yes");
      return {.granted = true, .reason = {}};
    }
    if (is(answer, "abort")) {
      note(step, question, "abort");
      throw Ended(false, "aborted by the operator");
    }
    if (answer.empty() || is(answer, "skip") || is(answer, "no")) {
      auto reason = trimmed(operator_.ask("Why is it left out?").value_or(""));
      if (reason.empty()) reason = "no reason given";
      note(step, question, "skip: " + reason);
      return {.granted = false, .reason = reason};
    }
  }
}

std::optional<std::string> Dialogue::choose(std::string_view question, const std::vector<std::string>& words,
                                            Step& step) {
  for (;;) {
    const auto line = operator_.ask(fmt::format("{} [{}/abort]", question, fmt::join(words, "/")));
    if (!line) {
      note(step, question, "no answer");
      return std::nullopt;
    }
    const auto answer = plain(*line);
    if (is(answer, "abort")) {
      note(step, question, "abort");
      throw Ended(false, "aborted by the operator");
    }
    const auto found = std::ranges::find_if(words, [&](const std::string& word) { return is(answer, word); });
    if (found == words.end()) continue;
    note(step, question, *found);
    return *found;
  }
}

}  // namespace axisd::axisctl::commission
