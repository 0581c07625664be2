#include "api/axisctl/man_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <sstream>
#include <vector>

#include "config/roff.hpp"

namespace axisd::axisctl {
namespace {

bool visible(const CLI::Option* option) { return !option->get_group().empty(); }

/// "--velocity VALUE", "-h, --help", or the name of an argument.
std::string syntax(const CLI::Option& option) {
  if (option.get_positional()) return fmt::format("\\fI{}\\fR", config::roff(option.get_name()));
  std::vector<std::string> names;
  for (const auto& name : option.get_snames()) names.push_back("\\fB\\-" + config::roff(name) + "\\fR");
  for (const auto& name : option.get_lnames()) names.push_back("\\fB\\-\\-" + config::roff(name) + "\\fR");
  std::string text = fmt::format("{}", fmt::join(names, ", "));
  if (option.get_items_expected_max() > 0)
    text += fmt::format(" \\fI{}\\fR", config::roff(option.get_type_name()));
  return text;
}

std::string entry(const CLI::Option& option) {
  std::string text = fmt::format(".TP\n{}\n{}", syntax(option), config::roff(option.get_description()));
  if (!option.get_default_str().empty())
    text += fmt::format(" (default: {})", config::roff(option.get_default_str()));
  if (!option.get_envname().empty())
    text += fmt::format(" (environment: {})", config::roff(option.get_envname()));
  return text + "\n";
}

/// Text that is laid out already.
std::string verbatim(const std::string& text) {
  return fmt::format(".PP\n.nf\n{}\n.fi\n", config::roff(text));
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of('\n');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of('\n') - first + 1);
}

/// A command with what stands behind it: "move AXIS VALUE [OPTIONS]". Those of a group follow it.
std::string section(const CLI::App& command, const std::string& path) {
  std::string synopsis = config::roff(path);
  std::string arguments;
  std::string options;
  for (const auto* option : command.get_options()) {
    if (!visible(option) || option == command.get_help_ptr()) continue;
    (option->get_positional() ? arguments : options) += entry(*option);
    if (!option->get_positional()) continue;
    const auto name = config::roff(option->get_name()) + (option->get_items_expected_max() > 1 ? " ..." : "");
    synopsis += option->get_required() ? " " + name : " [" + name + "]";
  }
  const auto parts = command.get_subcommands(nullptr);
  if (!options.empty()) synopsis += " [OPTIONS]";
  if (!parts.empty()) synopsis += " COMMAND";
  std::string text =
      fmt::format(".SS {}\n{}\n{}{}", synopsis, config::roff(command.get_description()), arguments, options);
  // CLI11 lets commands inherit the footer of what they belong to.
  if (const auto footer = trimmed(command.get_footer());
      footer != trimmed(command.get_parent()->get_footer()))
    text += verbatim(footer);
  for (const auto* part : parts) text += section(*part, path + " " + part->get_name());
  return text;
}

/// The program's footer: a line that ends with ":" begins a section of its own, and so does "Word: text".
std::string sections_of_footer(const std::string& footer) {
  std::string text;
  std::string body;
  const auto close = [&] {
    if (const auto rest = trimmed(body); !rest.empty()) text += verbatim(rest);
    body.clear();
  };
  std::istringstream lines(footer);
  for (std::string line; std::getline(lines, line);) {
    const auto colon = line.find(':');
    const bool heading = !line.empty() && std::isupper(static_cast<unsigned char>(line.front())) != 0 &&
                         colon != std::string::npos &&
                         std::ranges::all_of(line.substr(0, colon), [](unsigned char c) {
                           return std::isalpha(c) != 0 || c == ' ';
                         });
    if (heading) {
      close();
      std::string name = line.substr(0, colon);
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::toupper(c); });
      text += fmt::format(".SH {}\n", name);
      line = line.substr(std::min(line.size(), colon + 2));
    }
    body += line + "\n";
  }
  close();
  return text;
}

}  // namespace

std::string man_page(const CLI::App& app) {
  std::string text = fmt::format(
      ".TH AXISCTL 1 \"\" \"axisd {}\" \"axisd\"\n.SH NAME\naxisctl \\- {}\n"
      ".SH SYNOPSIS\n\\fBaxisctl\\fR [OPTIONS] COMMAND ...\n.SH OPTIONS\n",
      AXISD_VERSION, config::roff(app.get_description()));
  for (const auto* option : app.get_options())
    if (visible(option)) text += entry(*option);
  text += ".SH COMMANDS\nThe options above may also stand behind a command.\n";
  for (const auto* command : app.get_subcommands(nullptr)) text += section(*command, command->get_name());
  text += ".SH NOTES\n" + sections_of_footer(app.get_footer());
  return text + ".SH SEE ALSO\n.BR axisd (8),\n.BR axisd.yaml (5),\n.I /usr/share/doc/axisd/api.html\n";
}

}  // namespace axisd::axisctl
