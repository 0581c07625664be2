#include <fmt/format.h>
#include <termios.h>
#include <unistd.h>

#include <iostream>
#include <optional>
#include <utility>

#include "api/web/gateway/options.hpp"
#include "api/web/gateway/passwords.hpp"
#include "api/web/gateway/users.hpp"

namespace axisd::web {
namespace {

/// What is typed is not shown while this lives.
class Hidden {
 public:
  Hidden() {
    shown_ = ::isatty(STDIN_FILENO) != 0 && ::tcgetattr(STDIN_FILENO, &before_) == 0;
    if (!shown_) return;
    auto quiet = before_;
    quiet.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &quiet);
  }
  Hidden(const Hidden&) = delete;
  ~Hidden() {
    if (shown_) ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
  }
  [[nodiscard]] bool terminal() const { return shown_; }

 private:
  termios before_{};
  bool shown_ = false;
};

std::optional<std::string> asked(bool terminal, std::string_view question) {
  if (terminal) std::cerr << question;
  std::string line;
  const bool is_read = static_cast<bool>(std::getline(std::cin, line));
  if (terminal) std::cerr << '\n';
  if (!is_read) return std::nullopt;
  return line;
}

int complain(std::string_view what) {
  std::cerr << "axisd-web: " << what << '\n';
  return 2;
}

std::optional<std::string> new_password() {
  const Hidden hidden;
  auto password = asked(hidden.terminal(), "Password: ");
  if (!password)
    complain("no password was given: type it, or write it as the first line of the standard input");
  if (!password || !hidden.terminal()) return password;
  if (asked(true, "Once more: ") != password) {
    complain("that was not the same");
    return std::nullopt;
  }
  return password;
}

/// Empty: it was said why not.
std::string new_hash() {
  const auto password = new_password();
  if (!password) return {};
  if (password->size() < shortest_password || password->size() > longest_password) {
    complain(fmt::format("a password has {} to {} bytes", shortest_password, longest_password));
    return {};
  }
  auto hash = hash_of_password(*password);
  if (hash.empty()) complain("not enough memory for a hash");
  return hash;
}

std::string line_of(const User& user) {
  return fmt::format("{}  {}{}\n", user.name, user.role, user.hash.empty() ? "  by certificate" : "");
}

int save(const std::string& path, const Users& users) {
  if (const auto saved = save_users(path, users); !saved) return complain(axisd::to_string(saved.error()));
  return 0;
}

}  // namespace

int run_user_command(const Options::UserCommand& command, const std::string& path) {
  if (!start_passwords()) return complain("no random numbers");
  auto users = load_users(path);
  if (!users) return complain(axisd::to_string(users.error()));
  if (command.kind == Options::UserCommand::Kind::list) {
    for (const auto& user : *users) std::cout << line_of(user);
    return 0;
  }
  const auto gone = std::erase_if(*users, [&](const User& user) { return user.name == command.name; });
  if (command.kind == Options::UserCommand::Kind::remove)
    return gone == 0 ? complain(fmt::format("there is no user '{}'", command.name)) : save(path, *users);
  if (!is_user_name(command.name))
    return complain("a name has 1 to 64 printable ASCII characters without spaces and ':'");
  User user{
      .name = command.name, .role = command.role, .hash = command.certificate ? std::string() : new_hash()};
  if (!command.certificate && user.hash.empty()) return 2;
  users->push_back(std::move(user));
  if (const int failed = save(path, *users); failed != 0) return failed;
  std::cout << line_of(users->back());
  return 0;
}

}  // namespace axisd::web
