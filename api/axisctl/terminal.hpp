// What kind of place the output goes to, and how to write there.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace axisd::axisctl {

enum class Colour : std::uint8_t { none, red, green, yellow, dim, bold };

/// Standard output or standard error is a terminal that understands control sequences.
bool is_terminal(int file_descriptor);
/// Colours are wanted: standard output is a terminal and NO_COLOR is not set.
bool use_colour();
/// Width of the terminal: that of COLUMNS if it is exported, else its own; 80 if unknown.
int terminal_columns();
/// The same if the standard output is a terminal, else 0: as wide as it takes.
int output_columns();
int terminal_rows();

std::string coloured(std::string_view text, Colour colour, bool enabled);

/// Writes to standard output at once, so that a pipe's reader sees each line when it is made.
/// Ends the program quietly when nobody reads any more.
void print(std::string_view text);
void print_line(std::string_view text);

}  // namespace axisd::axisctl
