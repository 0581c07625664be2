// Aligned columns for people.
#pragma once

#include <cstddef>
#include <cstdint>
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

/// What becomes of a line that is wider than the terminal.
enum class TooWide : std::uint8_t {
  clip,  ///< its end is lost: a line for each row, for what is redrawn in place
  fold,  ///< it goes on below: nothing is lost
};

/// Columns are as wide as their widest cell; columns named in `right` align at the right, as numbers do.
class Table {
 public:
  explicit Table(std::vector<std::string> header, std::vector<std::size_t> right = {});
  void add(std::vector<Cell> row);
  /// Where the table is too wide, these columns go first, in this order.
  void leave_out_first(std::vector<std::size_t> columns);
  /// The lines without line ends. `columns` > 0: none is wider than that.
  [[nodiscard]] std::vector<std::string> lines(bool colour, int columns = 0,
                                               TooWide too_wide = TooWide::clip) const;
  /// To the standard output, as wide as the terminal.
  void print(bool colour) const;

 private:
  using Columns = std::vector<std::size_t>;
  [[nodiscard]] std::vector<std::size_t> widths() const;
  [[nodiscard]] std::size_t least_width(std::size_t column, const Columns& shown,
                                        const std::vector<std::size_t>& widths) const;
  [[nodiscard]] Columns fitting(const std::vector<std::size_t>& widths, std::size_t limit) const;
  [[nodiscard]] std::vector<Columns> folded(const Columns& shown, const std::vector<std::size_t>& widths,
                                            std::size_t limit) const;
  [[nodiscard]] std::string clipped_line(const std::vector<Cell>& row, const Columns& shown,
                                         const std::vector<std::size_t>& widths, bool colour,
                                         std::size_t limit) const;
  void add_folded(std::vector<std::string>& lines, const std::vector<Cell>& row,
                  const std::vector<Columns>& groups, const std::vector<std::size_t>& widths, bool colour,
                  std::size_t limit) const;
  std::string add_group(std::vector<std::string>& lines, const std::vector<Cell>& row, const Columns& group,
                        const std::vector<std::size_t>& widths, std::size_t owed, bool colour,
                        std::size_t limit) const;

  std::vector<Cell> header_;
  std::vector<bool> right_;
  Columns leave_out_;
  std::vector<std::vector<Cell>> rows_;
};

/// Columns that a UTF-8 text takes ("µm" is two).
std::size_t width(std::string_view text);

}  // namespace axisd::axisctl
