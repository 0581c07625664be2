#include "api/axisctl/live_view.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "api/axisctl/terminal.hpp"

namespace axisd::axisctl {

LiveView::LiveView() {
  print("\x1b[?25l");  // no cursor jumping about
}

LiveView::~LiveView() { print("\x1b[?25h"); }

void LiveView::show(std::vector<std::string> lines) {
  // What is higher than the terminal would scroll instead of being redrawn.
  lines.resize(std::min(lines.size(), static_cast<std::size_t>(std::max(1, terminal_rows() - 1))));
  std::string text = drawn_ > 0 ? fmt::format("\x1b[{}A", drawn_) : "";
  for (const auto& line : lines) text += "\r\x1b[K" + line + "\n";
  text += "\x1b[J";
  drawn_ = lines.size();
  print(text);
}

}  // namespace axisd::axisctl
