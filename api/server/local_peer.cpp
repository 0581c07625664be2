#include "api/server/local_peer.hpp"

#include <fmt/format.h>
#include <pwd.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "api/server/user_names.hpp"

namespace axisd::server {
namespace {

using File = std::unique_ptr<std::FILE, decltype([](std::FILE* file) { std::fclose(file); })>;

bool is_of_a_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-' || c == '+';
}

/// A name that looks like a number would be somebody else's.
bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= 32 && std::isdigit(static_cast<unsigned char>(text.front())) == 0 &&
         std::ranges::all_of(text, is_of_a_name);
}

std::string look_up(uid_t user) {
  const File users(std::fopen("/etc/passwd", "re"));
  passwd entry{}, *found = nullptr;
  std::array<char, 4096> text{};
  while (users && fgetpwent_r(users.get(), &entry, text.data(), text.size(), &found) == 0)
    if (entry.pw_uid == user) return is_name(entry.pw_name) ? entry.pw_name : fmt::format("{}", user);
  return fmt::format("{}", user);
}

std::string user_name(uid_t user) {
  static UserNames names(look_up);
  return names.of(user, monotonic_now());
}

std::string program_name(pid_t process) {
  std::array<char, 32> text{};
  const File file(std::fopen(fmt::format("/proc/{}/comm", process).c_str(), "re"));
  if (!file || std::fgets(text.data(), text.size(), file.get()) == nullptr) return {};
  std::string name(text.data());
  if (name.ends_with('\n')) name.pop_back();
  std::ranges::replace_if(name, [](char c) { return !is_of_a_name(c); }, '_');
  return name;
}

}  // namespace

Peer local_peer(int connection) {
  ucred who{};
  socklen_t size = sizeof who;
  if (getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &who, &size) != 0) return {.name = "unix:unknown"};
  auto program = program_name(who.pid);
  auto address = "unix:" + program;
  return {.name = "unix:" + user_name(who.uid), .program = std::move(program), .address = std::move(address)};
}

}  // namespace axisd::server
