#include "api/axisctl/man_page.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "api/axisctl/invocation.hpp"

namespace axisd::axisctl {
namespace {

using testing::HasSubstr;

std::string as_roff(std::string text) {
  for (std::size_t at = 0; (at = text.find('-', at)) != std::string::npos; at += 2) text.insert(at, "\\");
  return text;
}

/// Returns how many commands were looked for.
int expect_described(const std::string& page, const CLI::App& app, const std::string& path) {
  int count = 0;
  for (const auto* command : app.get_subcommands(nullptr)) {
    const std::string name = path + command->get_name();
    const auto heading = as_roff(".SS " + name);
    const auto begin = std::min(page.find(heading + " "), page.find(heading + "\n"));
    EXPECT_NE(begin, std::string::npos) << name;
    if (begin == std::string::npos) continue;
    const auto section = page.substr(begin, page.find("\n.S", begin + 1) - begin);
    EXPECT_THAT(section, HasSubstr(as_roff(command->get_description())));
    for (const auto* option : command->get_options()) {
      if (option->get_group().empty() || option == command->get_help_ptr()) continue;
      const auto names = option->get_lnames();
      EXPECT_THAT(section, HasSubstr(names.empty() ? option->get_name() : as_roff("--" + names.front())))
          << name;
      EXPECT_THAT(section, HasSubstr(as_roff(option->get_description()))) << name;
    }
    count += 1 + expect_described(page, *command, name + " ");
  }
  return count;
}

TEST(ManPage, HasEachCommandWithEachOption) {
  Invocation invocation;
  const auto app = make_app(invocation);
  const auto page = man_page(*app);
  EXPECT_GT(expect_described(page, *app, ""), 50);
  EXPECT_THAT(page, HasSubstr("\n.SH EXIT STATUS\n"));
  EXPECT_THAT(page, HasSubstr("\n.SH ENVIRONMENT\n"));
  EXPECT_THAT(page, HasSubstr("(environment: AXISD_SERVER)"));
}

TEST(ManPage, KeepsTextFromBeingTakenForRequests) {
  CLI::App app(".hidden\n'too \\n", "x");
  app.footer("");
  EXPECT_THAT(man_page(app), HasSubstr("\\&.hidden\n\\&'too \\en"));
}

}  // namespace
}  // namespace axisd::axisctl
