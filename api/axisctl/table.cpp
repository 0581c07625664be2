#include "api/axisctl/table.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace axisd::axisctl {
namespace {

constexpr std::size_t gap = 2;      ///< between columns
constexpr std::size_t indent = 4;   ///< of what goes on below
constexpr std::size_t narrow = 20;  ///< a text in the last column is wrapped to no less

bool starts_character(char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }

/// The first `columns` characters of a UTF-8 text.
std::string_view clipped(std::string_view text, std::size_t columns) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (starts_character(text[i]) && seen++ == columns) return text.substr(0, i);
  return text;
}

/// Pieces of at most `room` characters, broken between words where there are any. At least one.
std::vector<std::string_view> wrapped(std::string_view text, std::size_t room) {
  std::vector<std::string_view> pieces;
  while (width(text) > room) {
    auto piece = clipped(text, room);
    if (text[piece.size()] != ' ')
      if (const auto blank = piece.rfind(' '); blank != piece.npos && blank > 0)
        piece = piece.substr(0, blank);
    pieces.push_back(piece);
    text.remove_prefix(piece.size());
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  }
  if (!text.empty() || pieces.empty()) pieces.push_back(text);
  return pieces;
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

void Table::leave_out_first(std::vector<std::size_t> columns) { leave_out_ = std::move(columns); }

std::vector<std::size_t> Table::widths() const {
  std::vector<std::size_t> widths(header_.size());
  const auto measure = [&](const std::vector<Cell>& row) {
    for (std::size_t i = 0; i < row.size() && i < widths.size(); ++i)
      widths[i] = std::max(widths[i], width(row[i].text));
  };
  measure(header_);
  for (const auto& row : rows_) measure(row);
  return widths;
}

/// The last column is wrapped if it is text.
std::size_t Table::least_width(std::size_t column, const Columns& shown,
                               const std::vector<std::size_t>& widths) const {
  return column == shown.back() && !right_[column] ? std::min(widths[column], narrow) : widths[column];
}

Table::Columns Table::fitting(const std::vector<std::size_t>& widths, std::size_t limit) const {
  Columns shown(header_.size());
  std::iota(shown.begin(), shown.end(), std::size_t{0});
  const auto is_too_wide = [&] {
    std::size_t sum = 0;
    for (const auto column : shown) sum += least_width(column, shown, widths) + gap;
    return sum > limit + gap;
  };
  for (const auto column : leave_out_) {
    if (!is_too_wide()) break;
    std::erase(shown, column);
  }
  return shown;
}

std::vector<Table::Columns> Table::folded(const Columns& shown, const std::vector<std::size_t>& widths,
                                          std::size_t limit) const {
  std::vector<Columns> groups;
  std::size_t used = 0;
  for (const auto column : shown) {
    if (!groups.empty() && used + gap + least_width(column, shown, widths) <= limit) {
      groups.back().push_back(column);
      used += gap + widths[column];
    } else {
      used = (groups.empty() ? 0 : indent) + widths[column];
      groups.push_back({column});
    }
  }
  return groups;
}

std::vector<std::string> Table::lines(bool colour, int columns, TooWide too_wide) const {
  const auto all = widths();
  const auto limit =
      columns > 0 ? static_cast<std::size_t>(columns) : std::numeric_limits<std::size_t>::max() / 2;
  const auto shown = fitting(all, limit);
  const auto groups = folded(shown, all, limit);
  std::vector<std::string> lines;
  const auto add = [&](const std::vector<Cell>& row) {
    if (too_wide == TooWide::fold)
      add_folded(lines, row, groups, all, colour, limit);
    else
      lines.push_back(clipped_line(row, shown, all, colour, limit));
  };
  add(header_);
  for (const auto& row : rows_) add(row);
  return lines;
}

std::string Table::clipped_line(const std::vector<Cell>& row, const Columns& shown,
                                const std::vector<std::size_t>& widths, bool colour,
                                std::size_t limit) const {
  std::string text;
  std::size_t used = 0;
  std::size_t owed = 0;  // padding is written only before a further cell: no blanks at the line's end
  for (const auto i : shown) {
    if (i >= row.size()) break;
    const std::size_t padding = widths[i] - width(row[i].text);
    if (right_[i]) owed += padding;
    if (!row[i].text.empty()) {
      if (used + owed >= limit) break;
      text.append(owed, ' ');
      used += owed;
      owed = 0;
      const std::string_view part = clipped(row[i].text, limit - used);
      text += coloured(part, row[i].colour, colour);
      used += width(part);
    }
    owed += (right_[i] ? 0 : padding) + gap;
  }
  return text;
}

void Table::add_folded(std::vector<std::string>& lines, const std::vector<Cell>& row,
                       const std::vector<Columns>& groups, const std::vector<std::size_t>& widths,
                       bool colour, std::size_t limit) const {
  for (const auto& group : groups) {
    auto text = add_group(lines, row, group, widths, &group == &groups.front() ? 0 : indent, colour, limit);
    if (!text.empty() || groups.size() == 1) lines.push_back(std::move(text));
  }
}

/// Only the last cell of a group can be wider than its place. Returns the last line of it.
std::string Table::add_group(std::vector<std::string>& lines, const std::vector<Cell>& row,
                             const Columns& group, const std::vector<std::size_t>& widths, std::size_t owed,
                             bool colour, std::size_t limit) const {
  std::string text;
  std::size_t used = 0;
  for (const auto i : group) {
    if (i >= row.size()) break;
    const std::size_t padding = widths[i] - width(row[i].text);
    if (right_[i] && used + owed + widths[i] <= limit) owed += padding;
    if (!row[i].text.empty()) {
      text.append(owed, ' ');
      used += owed;
      owed = 0;
      const auto pieces = wrapped(row[i].text, limit > used ? limit - used : 1);
      text += coloured(pieces.front(), row[i].colour, colour);
      for (std::size_t k = 1; k < pieces.size(); ++k) {
        lines.push_back(std::move(text));
        text = std::string(used, ' ') + coloured(pieces[k], row[i].colour, colour);
      }
      used += width(pieces.back());
    }
    owed += (right_[i] ? 0 : padding) + gap;
  }
  return text;
}

void Table::print(bool colour) const {
  std::string text;
  for (const auto& line : lines(colour, output_columns(), TooWide::fold)) text += line + "\n";
  axisctl::print(text);
}

}  // namespace axisd::axisctl
