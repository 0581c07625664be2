#include "api/axisctl/completion.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "api/axisctl/audit_text.hpp"
#include "api/axisctl/event_text.hpp"

namespace axisd::axisctl {
namespace {

bool visible(const CLI::Option* option) { return !option->get_group().empty(); }
bool has_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

/// The option of this command, or of one that it belongs to: options may stand behind subcommands.
const CLI::Option* find_option(const CLI::App* command, const std::string& name) {
  for (; command != nullptr; command = command->get_parent())
    if (const auto* option = command->get_option_no_throw(name)) return option;
  return nullptr;
}

const CLI::App* find_command(const CLI::App& app, std::string_view name) {
  for (const auto* command : app.get_subcommands(nullptr))
    if (command->get_name() == name) return command;
  return nullptr;
}

/// The argument that the next word is: the last one may take any number of them.
const CLI::Option* argument_at(const CLI::App& command, std::size_t index) {
  for (const auto* option : command.get_options()) {
    if (!option->get_positional()) continue;
    if (index == 0 || option->get_items_expected_max() > 1) return option;
    --index;
  }
  return nullptr;
}

/// "{a,b}" of a type "TEXT:{a,b}".
std::vector<std::string> choices_of(const CLI::Option& option) {
  std::vector<std::string> choices;
  const auto type = option.get_type_name();
  const auto from = type.find('{'), to = type.find('}');
  if (from != std::string::npos && to != std::string::npos)
    choices = CLI::detail::split(type.substr(from + 1, to - from - 1), ',');
  return choices;
}

/// Of an argument its own, of an option that of its value: "AXIS".
std::string name_of_value(const CLI::Option& option) {
  return option.get_positional() ? option.get_name() : option.get_type_name();
}

/// The words that are complete: where they lead, and what they leave open.
struct Walk {
  const CLI::App* command;
  std::vector<std::string> arguments{};
  const CLI::Option* open = nullptr;  ///< an option whose value comes next
  bool only_arguments = false;        ///< behind "--"
  std::vector<std::string> connection{};

  void step(const std::string& word) {
    if (open != nullptr) {
      note(*open, word);
      open = nullptr;
    } else if (!only_arguments && word == "--") {
      only_arguments = true;
    } else if (!only_arguments && word.starts_with('-')) {
      step_option(word);
    } else if (const auto* part =
                   only_arguments || !arguments.empty() ? nullptr : find_command(*command, word)) {
      command = part;
    } else {
      arguments.push_back(word);
    }
  }

 private:
  void step_option(const std::string& word) {
    const auto end = word.find('=');
    const auto* option = find_option(command, word.substr(0, end));
    if (option == nullptr) {
      // "-20mm" is a value, and no option.
      if (word.size() > 1 && (word[1] == '.' || (word[1] >= '0' && word[1] <= '9')))
        arguments.push_back(word);
    } else if (end != std::string::npos) {
      note(*option, word.substr(end + 1));
    } else if (has_value(*option)) {
      open = option;
    }
  }
  void note(const CLI::Option& option, const std::string& value) {
    if (option.get_envname().empty())
      return;  // all that name the daemon have one, and --lease, which does no harm
    const auto name = "--" + option.get_lnames().front();
    if (name == "--server" || name == "--cell" || name == "--machine" || name.starts_with("--tls-"))
      connection.insert(connection.end(), {name, value});
  }
};

void complete_names(const CLI::App& command, const std::string& name,
                    const std::vector<std::string>& arguments, Place& place) {
  const auto* parent = command.get_parent();
  const std::string group = parent == nullptr ? "" : parent->get_name();
  if (name == "AXIS") place.names = group == "lease" ? Names::axes_and_groups : Names::axes;
  if (name == "BUS") place.names = Names::buses;
  if (name == "GROUP") place.names = Names::groups;
  if (name == "DEVICE") place.names = Names::devices;
  if (name == "MACHINE") place.names = Names::machines;
  if (name == "FILE" || name == "PATH") place.names = Names::files;
  const bool assigns = name == "TARGET" || name == "NAME=VALUE";
  if (assigns && place.typed.find('=') != std::string::npos) return;
  if (assigns) place.behind = "=";
  if (name == "TARGET") place.names = arguments.empty() ? Names::targets : Names::axes;
  if (arguments.empty()) return;
  place.subject = arguments.front();
  if (group == "device" && name == "NAME") place.names = Names::device_values;
  if (group == "drive" && (name.starts_with("NAME") || name == "PATTERN")) place.names = Names::parameters;
}

void complete_value(const CLI::App& command, const CLI::Option& option,
                    const std::vector<std::string>& arguments, Place& place) {
  for (const auto& choice : choices_of(option)) place.words.push_back({choice, ""});
  const auto name = name_of_value(option);
  if (name == "KIND,...") {
    for (const auto& kind : command.get_name() == "audit" ? audit_kinds() : event_kinds())
      place.words.push_back({kind, ""});
    if (command.get_name() == "events") place.words.push_back({"cell", ""});
    if (const auto comma = place.typed.rfind(','); comma != std::string::npos) {
      place.before += place.typed.substr(0, comma + 1);
      place.typed.erase(0, comma + 1);
    }
  }
  complete_names(command, name, arguments, place);
}

void complete_option(const Walk& walk, Place& place) {
  if (const auto end = place.typed.find('='); end != std::string::npos) {
    const auto* option = find_option(walk.command, place.typed.substr(0, end));
    place.before = place.typed.substr(0, end + 1);
    place.typed.erase(0, end + 1);
    if (option != nullptr) complete_value(*walk.command, *option, walk.arguments, place);
    return;
  }
  for (const auto* command = walk.command; command != nullptr; command = command->get_parent())
    for (const auto* option : command->get_options()) {
      if (!visible(option)) continue;
      for (const auto& name : option->get_lnames()) {
        const auto text = "--" + name;
        if (std::ranges::find(place.words, text, &Candidate::text) == place.words.end())
          place.words.push_back({text, option->get_description()});
      }
    }
}

}  // namespace

Place place_of(const CLI::App& app, const std::vector<std::string>& words) {
  Walk walk{.command = &app};
  for (std::size_t i = 0; i + 1 < words.size(); ++i) walk.step(words[i]);
  Place place;
  if (!words.empty()) place.typed = words.back();
  if (walk.open != nullptr) {
    complete_value(*walk.command, *walk.open, walk.arguments, place);
  } else if (!walk.only_arguments && place.typed.starts_with('-')) {
    complete_option(walk, place);
  } else {
    if (walk.arguments.empty() && !walk.only_arguments)
      for (const auto* command : walk.command->get_subcommands(nullptr))
        place.words.push_back({command->get_name(), command->get_description()});
    if (const auto* argument = argument_at(*walk.command, walk.arguments.size()))
      complete_value(*walk.command, *argument, walk.arguments, place);
  }
  place.connection = std::move(walk.connection);
  return place;
}

}  // namespace axisd::axisctl
