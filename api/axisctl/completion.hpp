// Completion of a command line that is being typed, from its own definition, so that it cannot fall behind.
// The scripts of the shells only pass words on: `axisctl complete-words WORD ...` answers them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace axisd::axisctl {

/// What the daemon, or the shell, has to be asked for.
enum class Names : std::uint8_t {
  none,
  axes,
  axes_and_groups,
  targets,  ///< groups, and axes with `behind`
  buses,
  groups,
  devices,
  machines,
  device_values,  ///< of the device `subject`
  parameters,     ///< of the axis `subject`
  files           ///< by the shell
};

struct Candidate {
  std::string text, description;
};

/// What may stand where a command line is being typed.
struct Place {
  std::vector<Candidate> words;  ///< subcommands, options, choices
  Names names = Names::none;     ///< and these
  std::string subject;
  std::string before, typed;            ///< what is typed already: kept as it is, and what is completed
  std::string behind;                   ///< what follows a name: "=" of NAME=VALUE
  std::vector<std::string> connection;  ///< the options that say where the daemon is, as they were given
};

/// `words`: those behind the program's name, of which the last is being typed. Pure.
Place place_of(const CLI::App& app, const std::vector<std::string>& words);
/// What begins as it is typed, with `before` and `behind`. Asks the daemon for names, and takes none where it
/// does not answer within 3 s. Nothing: the shell completes files.
std::optional<std::vector<Candidate>> candidates(const Place& place);
/// Prints them for the shells: a line for each, with a description behind a tab, or ":files".
void complete(const std::vector<std::string>& words);

/// "bash", "zsh" and "fish".
const std::vector<std::string>& completion_shells();
/// A script to be evaluated by bash 4.4, zsh 5.8 or fish 3.1, or later ones. Precondition: `shell` is one of
/// them.
std::string completion_script(std::string_view shell);

}  // namespace axisd::axisctl
