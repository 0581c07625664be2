#include "api/web/gateway/options.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>

namespace axisd::web {

Options parse_options(int argc, char** argv) {
  Options options;
  CLI::App app("axisd-web: the web page of a machine, and its way to axisd.", "axisd-web");
  app.footer(
      "Users: axisd-web user add NAME --role ROLE [--certificate], user remove NAME, user list.\n"
      "Exit status: 0 ended in order; 1 could not start (an address in use) or failed while running: trying "
      "again may "
      "help; 2 bad command line, configuration, certificates or users.");
  app.set_version_flag("--version", std::string("axisd-web ") + AXISD_VERSION);
  app.add_option("--config", options.config, "configuration file")->capture_default_str();
  app.add_flag("--check", options.check,
               "check configuration, certificates and users, print every error, and exit");
  app.add_option("--log-level", options.log_level, "trace, debug, info, warn, error")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error"}))
      ->capture_default_str();
  Options::UserCommand command;
  auto* user = app.add_subcommand("user", "who may log in")->require_subcommand(1);
  auto* add =
      user->add_subcommand("add", "adds a user, or changes role and password of one; asks for the password");
  add->add_option("NAME", command.name, "of the user, or of a client certificate")->required();
  add->add_option("--role", command.role, "viewer, operator, maintainer")
      ->required()
      ->check(CLI::IsMember({"viewer", "operator", "maintainer"}));
  add->add_flag("--certificate", command.certificate,
                "comes with a client certificate of that name, no password");
  auto* remove = user->add_subcommand("remove", "removes a user, whose sessions end");
  remove->add_option("NAME", command.name)->required();
  const auto* list = user->add_subcommand("list", "prints names and roles");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) std::exit(app.exit(error));
    std::cerr << "axisd-web: " << error.what() << "; see axisd-web --help\n";
    std::exit(2);
  }
  if (!user->parsed()) return options;
  command.kind = add->parsed()    ? Options::UserCommand::Kind::add
                 : list->parsed() ? Options::UserCommand::Kind::list
                                  : Options::UserCommand::Kind::remove;
  options.user = command;
  return options;
}

}  // namespace axisd::web
