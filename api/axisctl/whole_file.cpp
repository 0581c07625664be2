#include "api/axisctl/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdio>

namespace axisd::axisctl {
namespace {

int write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const auto written = ::write(file, text.data(), text.size());
    if (written >= 0)
      text.remove_prefix(static_cast<std::size_t>(written));
    else if (errno != EINTR)
      return errno;
  }
  return ::fsync(file) == 0 ? 0 : errno;
}

}  // namespace

int write_whole_file(const std::string& path, std::string_view text, mode_t mode) {
  const auto beside = fmt::format("{}.{}.part", path, ::getpid());
  const int file = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) return errno;
  int error = write_all(file, text);
  // Some file systems tell only here that the disk is full.
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 && std::rename(beside.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) (void)::unlink(beside.c_str());
  return error;
}

}  // namespace axisd::axisctl
