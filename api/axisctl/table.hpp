// Aligned columns for people.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/axisctl/terminal.hpp"

namespace axisd::axisctl {

struct Cell {
  Cell(std::string value) : text(std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Cell(const char* value) : text(value) {}             // NOLINT(google-explicit-constructor)
  Cell(std::string value, Colour cell_colour) : text(std::move(value)), colour(cell_colour) {}
  std::string text;
  Colour colour = Colour::none;
};

/// Columns are as wide as their widest cell; columns named in `right` align at the right, as numbers do.
class Table {
 public:
  explicit Table(std::vector<std::string> header, std::vector<std::size_t> right = {});
  void add(std::vector<Cell> row);
  /// The lines without line ends. `columns` > 0 clips each line to that many columns.
  [[nodiscard]] std::vector<std::string> lines(bool colour, int columns = 0) const;
  void print(bool colour) const;

 private:
  [[nodiscard]] std::string line(const std::vector<Cell>& row, const std::vector<std::size_t>& widths,
                                 bool colour, std::size_t columns) const;

  std::vector<Cell> header_;
  std::vector<bool> right_;
  std::vector<std::vector<Cell>> rows_;
};

/// Columns that a UTF-8 text takes ("µm" is two).
std::size_t width(std::string_view text);

}  // namespace axisd::axisctl
