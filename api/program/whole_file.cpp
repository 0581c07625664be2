#include "api/program/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdio>

#include "buses/file_descriptor.hpp"

namespace axisd::program {
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

std::string folder_of(const std::string& path) {
  const auto slash = path.rfind('/');
  return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

int give_to_owner_of_folder(int file, const std::string& path) {
  struct stat about{};
  if (::geteuid() != 0) return 0;
  if (::stat(folder_of(path).c_str(), &about) != 0 || ::fchown(file, about.st_uid, about.st_gid) != 0)
    return errno;
  return 0;
}

/// The name of the file is in its folder: that has to be on the disk, too.
int sync_folder_of(const std::string& path) {
  const FileDescriptor folder(::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return folder.get() >= 0 && ::fsync(folder.get()) == 0 ? 0 : errno;
}

}  // namespace

int write_whole_file(const std::string& path, std::string_view text, mode_t mode, FileOwner owner) {
  const auto beside = fmt::format("{}.{}.part", path, ::getpid());
  (void)::unlink(beside.c_str());  // of a writer that was killed
  const int file = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) return errno;
  int error = owner == FileOwner::of_folder ? give_to_owner_of_folder(file, path) : 0;
  if (error == 0) error = write_all(file, text);
  // Some file systems tell only here that the disk is full.
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 && std::rename(beside.c_str(), path.c_str()) != 0) error = errno;
  if (error == 0) return sync_folder_of(path);
  (void)::unlink(beside.c_str());
  return error;
}

}  // namespace axisd::program
