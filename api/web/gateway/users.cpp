#include "api/web/gateway/users.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "api/program/whole_file.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::web {
namespace {

constexpr std::size_t largest_file = std::size_t{256} * 1024;

std::unexpected<Error> failed(const std::string& path, std::string_view what, int why = errno) {
  return fail(Reason::storage,
              fmt::format("{}: cannot be {}: {}", path, what, std::generic_category().message(why)),
              why == ENOENT                   ? "start axisd-web once, which makes the directory: systemctl "
                                                "start axisd-web; or make it yourself"
              : why == EACCES || why == EPERM ? "say it as root, or as the user of axisd-web"
                                              : "");
}

std::unexpected<Error> wrong(const std::string& path, std::size_t line, std::string_view what) {
  return fail(Reason::invalid_argument, fmt::format("{}:{}: {}", path, line, what),
              "change it with axisd-web user");
}

Result<User> parse_user(std::string_view line, const std::string& path, std::size_t number) {
  const auto first = line.find(':');
  const auto second = first == std::string_view::npos ? first : line.find(':', first + 1);
  if (second == std::string_view::npos) return wrong(path, number, "not NAME:ROLE:HASH");
  User user{.name = std::string(line.substr(0, first)),
            .role = std::string(line.substr(first + 1, second - first - 1)),
            .hash = std::string(line.substr(second + 1))};
  if (!is_user_name(user.name)) return wrong(path, number, "no usable name");
  if (!is_role(user.role)) return wrong(path, number, "no role: viewer, operator or maintainer");
  if (!user.hash.empty() && !user.hash.starts_with("$argon2id$"))
    return wrong(path, number, "no hash of argon2id");
  return user;
}

}  // namespace

bool is_user_name(std::string_view text) {
  return !text.empty() && text.size() <= longest_user_name &&
         std::ranges::all_of(text, [](char c) { return c > ' ' && c <= '~' && c != ':'; });
}

bool is_role(std::string_view text) { return text == "viewer" || text == "operator" || text == "maintainer"; }

const User* find_user(const Users& users, std::string_view name) {
  const auto found = std::ranges::find(users, name, &User::name);
  return found == users.end() ? nullptr : &*found;
}

std::string_view role_of_certificate(const Users& users, std::string_view name) {
  const auto* user = find_user(users, name);
  return user == nullptr || !user->hash.empty() ? "viewer" : std::string_view(user->role);
}

Result<Users> parse_users(std::string_view text, const std::string& path) {
  Users users;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const auto end = std::min(text.find('\n'), text.size());
    const auto line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.front() == '#') continue;
    auto user = parse_user(line, path, number);
    if (!user) return fail(std::move(user).error());
    if (find_user(users, user->name) != nullptr) return wrong(path, number, "a name for the second time");
    users.push_back(*std::move(user));
  }
  return users;
}

std::string to_text(const Users& users) {
  std::string text;
  for (const auto& user : users) text += fmt::format("{}:{}:{}\n", user.name, user.role, user.hash);
  return text;
}

Result<Users> load_users(const std::string& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) {
    if (errno == ENOENT) return Users{};
    return failed(path, "opened");
  }
  struct stat about{};
  if (::fstat(file.get(), &about) != 0) return failed(path, "read");
  if (!S_ISREG(about.st_mode) || (about.st_mode & 0077U) != 0)
    return fail(Reason::invalid_argument, fmt::format("{}: others may read it, or it is no file", path),
                fmt::format("chmod 600 {}", path));
  if (about.st_size > static_cast<off_t>(largest_file))
    return fail(Reason::invalid_argument, fmt::format("{}: larger than {} bytes", path, largest_file));
  std::string text;
  std::array<char, 4096> piece{};
  for (;;) {
    const auto count = ::read(file.get(), piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return failed(path, "read");
    if (count == 0 || text.size() > largest_file) break;
    text.append(piece.data(), static_cast<std::size_t>(count));
  }
  return parse_users(text, path);
}

Result<void> save_users(const std::string& path, const Users& users) {
  const int error = program::write_whole_file(path, to_text(users), 0600, program::FileOwner::of_folder);
  if (error != 0) return failed(path, "written", error);
  return {};
}

}  // namespace axisd::web
