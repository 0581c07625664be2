#pragma once

#include <optional>
#include <string>

namespace axisd::web {

struct Options {
  std::string config = "/etc/axisd/web.yaml";
  bool check = false;
  std::string log_level = "info";
  /// `axisd-web user`: what to do to the users file; then exit.
  struct UserCommand {
    enum class Kind { add, remove, list } kind = Kind::list;
    std::string name, role;
    bool certificate = false;  ///< without a password
  };
  std::optional<UserCommand> user;
};

/// The command line. Ends the process for --help, --version and errors (exit status 2, one line).
[[nodiscard]] Options parse_options(int argc, char** argv);

/// Carries out `axisd-web user`; the exit status. Reads a new password from the terminal, else from the first
/// line of the standard input. `path`: of the users file.
[[nodiscard]] int run_user_command(const Options::UserCommand& command, const std::string& path);

}  // namespace axisd::web
