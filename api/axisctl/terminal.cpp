#include "api/axisctl/terminal.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <system_error>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

winsize window() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0) return {};
  return size;
}

}  // namespace

bool is_terminal(int file_descriptor) {
  const char* term = std::getenv("TERM");
  return isatty(file_descriptor) == 1 && (term == nullptr || std::string_view(term) != "dumb");
}

bool use_colour() {
  const char* no_color = std::getenv("NO_COLOR");
  return is_terminal(STDOUT_FILENO) && (no_color == nullptr || *no_color == '\0');
}

int terminal_columns() {
  if (const char* text = std::getenv("COLUMNS")) {
    int columns = 0;
    const std::string_view digits(text);
    const auto [end, error] = std::from_chars(digits.begin(), digits.end(), columns);
    if (error == std::errc{} && end == digits.end() && columns > 0) return columns;
  }
  const auto size = window();
  return size.ws_col > 0 ? size.ws_col : 80;
}

int output_columns() { return isatty(STDOUT_FILENO) == 1 ? terminal_columns() : 0; }

int terminal_rows() {
  const auto size = window();
  return size.ws_row > 0 ? size.ws_row : 24;
}

std::string coloured(std::string_view text, Colour colour, bool enabled) {
  if (!enabled || colour == Colour::none) return std::string(text);
  const int code = colour == Colour::red      ? 31
                   : colour == Colour::green  ? 32
                   : colour == Colour::yellow ? 33
                   : colour == Colour::dim    ? 2
                                              : 1;
  return fmt::format("\x1b[{}m{}\x1b[0m", code, text);
}

void print(std::string_view text) {
  while (!text.empty()) {
    const auto written = ::write(STDOUT_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0)
      throw Failure(ExitCode::ended_otherwise,
                    fmt::format("cannot write to standard output (errno {})", errno));
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

void print_line(std::string_view text) { print(fmt::format("{}\n", text)); }

}  // namespace axisd::axisctl
