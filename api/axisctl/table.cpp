#include "api/axisctl/table.hpp"

#include <algorithm>
#include <limits>

namespace axisd::axisctl {
namespace {

bool starts_character(char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }

/// The first `columns` characters of a UTF-8 text.
std::string_view clipped(std::string_view text, std::size_t columns) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (starts_character(text[i]) && seen++ == columns) return text.substr(0, i);
  return text;
}

}  // namespace

std::size_t width(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, starts_character));
}

Table::Table(std::vector<std::string> header, std::vector<std::size_t> right) : right_(header.size()) {
  for (auto& text : header) header_.emplace_back(std::move(text), Colour::bold);
  for (const auto column : right) right_.at(column) = true;
}

void Table::add(std::vector<Cell> row) { rows_.push_back(std::move(row)); }

std::vector<std::string> Table::lines(bool colour, int columns) const {
  std::vector<std::size_t> widths(header_.size());
  const auto measure = [&](const std::vector<Cell>& row) {
    for (std::size_t i = 0; i < row.size() && i < widths.size(); ++i)
      widths[i] = std::max(widths[i], width(row[i].text));
  };
  measure(header_);
  for (const auto& row : rows_) measure(row);
  const auto limit =
      columns > 0 ? static_cast<std::size_t>(columns) : std::numeric_limits<std::size_t>::max();
  std::vector<std::string> lines{line(header_, widths, colour, limit)};
  for (const auto& row : rows_) lines.push_back(line(row, widths, colour, limit));
  return lines;
}

std::string Table::line(const std::vector<Cell>& row, const std::vector<std::size_t>& widths, bool colour,
                        std::size_t columns) const {
  std::string text;
  std::size_t used = 0;
  std::size_t owed = 0;  // padding is written only before a further cell: no blanks at the line's end
  for (std::size_t i = 0; i < row.size() && i < widths.size(); ++i) {
    const std::size_t padding = widths[i] - width(row[i].text);
    if (right_[i]) owed += padding;
    if (!row[i].text.empty()) {
      if (used + owed >= columns) break;
      text.append(owed, ' ');
      used += owed;
      owed = 0;
      const std::string_view shown = clipped(row[i].text, columns - used);
      text += coloured(shown, row[i].colour, colour);
      used += width(shown);
    }
    owed += (right_[i] ? 0 : padding) + 2;
  }
  return text;
}

void Table::print(bool colour) const {
  std::string text;
  for (const auto& line : lines(colour)) text += line + "\n";
  axisctl::print(text);
}

}  // namespace axisd::axisctl
