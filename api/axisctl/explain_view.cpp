#include "api/axisctl/explain_view.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "api/axisctl/advice.hpp"
#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/terminal.hpp"

namespace axisd::axisctl {

bool is_blocked(const v1::ExplainResponse& response) {
  return std::ranges::any_of(response.obstacles(), &v1::Obstacle::blocking);
}

std::string explanation(const v1::ExplainResponse& response, std::string_view axis, std::string_view command,
                        bool colour) {
  const bool blocked = is_blocked(response);
  const auto what = command.empty() ? std::string_view("motion") : command;
  std::string text =
      fmt::format("{}: {}\n", axis,
                  coloured(fmt::format("{} {}", what, blocked ? "is refused now" : "is permitted now"),
                           blocked ? Colour::red : Colour::green, colour));
  for (const auto& obstacle : response.obstacles()) {
    auto what_it_is = obstacle.detail();
    what_it_is.clear_remedy();
    const auto reason = lower_word(v1::Reason_Name(obstacle.detail().reason()), "REASON_");
    text += fmt::format("  {} {}: {}\n",
                        obstacle.blocking() ? coloured("refused", Colour::red, colour)
                                            : coloured("note   ", Colour::yellow, colour),
                        reason, describe(what_it_is, axis));
    if (!obstacle.detail().remedy().empty())
      text += fmt::format("          -> {}\n", advice(obstacle.detail().remedy(), axis));
  }
  return text;
}

}  // namespace axisd::axisctl
