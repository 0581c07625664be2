#include "buses/regular_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "buses/file_descriptor.hpp"

namespace axisd {

namespace {

std::unexpected<Error> refused(const std::string& path, std::string_view why, std::string remedy) {
  return fail(Reason::invalid_argument, fmt::format("{}: {}", path, why), std::move(remedy));
}

std::unexpected<Error> unreadable(const std::string& path) {
  return refused(path, "cannot be read", "check the path and its permissions");
}

}  // namespace

Result<std::string> read_regular_file(const std::string& path, std::size_t most) {
  // Without waiting for the other end of a pipe, and without taking over a terminal.
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (file.get() < 0) return unreadable(path);
  struct stat about{};
  if (fstat(file.get(), &about) != 0) return unreadable(path);
  if (!S_ISREG(about.st_mode)) return refused(path, "cannot be read: it is no regular file", "name a file");
  std::string text(most + 1, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const auto count = ::read(file.get(), text.data() + size, text.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return unreadable(path);
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  if (size > most)
    return refused(path, fmt::format("has more than {} KiB", most / 1024), "check that it is the right file");
  text.resize(size);
  return text;
}

}  // namespace axisd
