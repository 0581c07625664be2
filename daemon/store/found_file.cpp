#include "daemon/store/found_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "buses/file_descriptor.hpp"

namespace axisd::store {
namespace {

std::string kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISLNK(mode)) return "a symbolic link";
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISSOCK(mode)) return "a socket";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  return "not a file";
}

FoundFile failed(int error) {
  if (error == ENOENT) return {};
  return {
      .kind = FoundFile::Kind::unreadable, .what = std::generic_category().message(error), .error = error};
}

}  // namespace

FoundFile find_file(int directory, const char* name, std::size_t most) {
  struct stat is{};
  // Asked before it is opened: to open a device may do something.
  if (fstatat(directory, name, &is, AT_SYMLINK_NOFOLLOW) != 0) return failed(errno);
  if (!S_ISREG(is.st_mode)) return {.kind = FoundFile::Kind::other, .what = kind_of(is.st_mode)};
  const FileDescriptor file(
      openat(directory, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (file.get() < 0) return failed(errno);
  if (fstat(file.get(), &is) != 0) return failed(errno);
  if (!S_ISREG(is.st_mode)) return {.kind = FoundFile::Kind::other, .what = kind_of(is.st_mode)};
  FoundFile found{.kind = FoundFile::Kind::regular};
  found.text.reserve(
      std::min(static_cast<std::size_t>(is.st_size), most + 1));  // grown, it would be there twice
  std::array<char, 65536> chunk{};
  while (found.text.size() <= most) {
    const auto got = ::read(file.get(), chunk.data(), std::min(chunk.size(), most + 1 - found.text.size()));
    if (got == 0) break;
    if (got > 0)
      found.text.append(chunk.data(), static_cast<std::size_t>(got));
    else if (errno != EINTR)
      return failed(errno);
  }
  return found;
}

int create_anew(int directory, const char* name, int flags) {
  if (unlinkat(directory, name, 0) != 0 && errno != ENOENT) return -1;
  return openat(directory, name, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC | flags, 0640);
}

std::string name_aside(int directory, const std::string& name) {
  constexpr int most = 100;
  struct stat is{};
  if (fstatat(directory, name.c_str(), &is, AT_SYMLINK_NOFOLLOW) != 0 && errno == ENOENT) return {};
  auto aside = name + ".damaged";
  for (int number = 2; number <= most; ++number) {
    // A directory does not take a file's place, nor the other way round.
    if (unlinkat(directory, aside.c_str(), 0) == 0 || unlinkat(directory, aside.c_str(), AT_REMOVEDIR) == 0)
      break;
    if (errno != ENOTEMPTY && errno != EEXIST) break;
    aside = fmt::format("{}.damaged.{}", name, number);
  }
  return aside;
}

int move_aside(int directory, const std::string& name) {
  const auto aside = name_aside(directory, name);
  if (aside.empty()) return 0;
  return renameat(directory, name.c_str(), directory, aside.c_str()) == 0 || errno == ENOENT ? 0 : errno;
}

}  // namespace axisd::store
