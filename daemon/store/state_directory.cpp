#include "daemon/store/state_directory.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "daemon/store/disk.hpp"

namespace axisd::store {
namespace {

constexpr auto newest = "state.v1";
constexpr auto previous = "state.v1.previous";
constexpr auto newest_unfinished = "state.v1.new";
constexpr auto previous_unfinished = "state.v1.previous.new";
constexpr std::size_t largest_file = 16U << 20U;  // thousands of axes; anything longer is not ours

std::string text_of(int error) { return std::generic_category().message(error); }

}  // namespace

std::unexpected<Error> StateDirectory::failed(std::string_view what, std::string_view name, int error) const {
  return disk_failed(what, path_ / name, error);
}

Result<StateDirectory> StateDirectory::open(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  FileDescriptor directory(error ? -1 : ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() < 0) {
    const int code = error ? error.value() : errno;
    return fail(Reason::storage,
                fmt::format("cannot use state directory {}: {}", path.string(), text_of(code)),
                "create it for the daemon's user, or name another one with --state-directory");
  }
  if (flock(directory.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK)
      return fail(Reason::storage, fmt::format("cannot lock {}: {}", path.string(), text_of(errno)),
                  "put the state directory on a local file system");
    return fail(Reason::storage, fmt::format("state directory {} is used by another axisd", path.string()),
                "stop that one, or give this one a --state-directory of its own");
  }
  return StateDirectory(path, std::move(directory));
}

Result<StateDirectory::Found> StateDirectory::find() const {
  Found found{.newest = find_file(directory_.get(), newest, largest_file),
              .previous = find_file(directory_.get(), previous, largest_file)};
  if (found.newest.kind == FoundFile::Kind::unreadable) return failed("read", newest, found.newest.error);
  if (found.previous.kind == FoundFile::Kind::unreadable)
    return failed("read", previous, found.previous.error);
  return found;
}

Result<void> StateDirectory::write(const char* name, std::string_view text) const {
  FileDescriptor file(create_anew(directory_.get(), name, 0));
  if (file.get() < 0) return failed("create", name, errno);
  if (const int error = write_all(file.get(), text); error != 0) return failed("write", name, error);
  if (fsync(file.get()) != 0) return failed("write", name, errno);
  if (const int error = file.close(); error != 0) return failed("write", name, error);
  return {};
}

Result<void> StateDirectory::save(std::string_view text) {
  if (auto written = write(newest_unfinished, text); !written) return written;
  // The previous generation becomes a second name of the newest before that is replaced: at no moment is
  // there no complete `state.v1`, which a plain chain of renames would allow.
  const int at = directory_.get();
  if (unlinkat(at, previous_unfinished, 0) != 0 && errno != ENOENT)
    return failed("remove", previous_unfinished, errno);
  if (linkat(at, newest, at, previous_unfinished, 0) == 0) {
    if (renameat(at, previous_unfinished, at, previous) != 0) return failed("replace", previous, errno);
  } else if (errno != ENOENT) {
    return failed("keep", previous, errno);
  }
  if (renameat(at, newest_unfinished, at, newest) != 0) return failed("replace", newest, errno);
  if (fsync(at) != 0) return failed("write", ".", errno);
  return {};
}

Result<void> StateDirectory::set_aside(KeptFile file) {
  const auto* name = file == KeptFile::state ? newest : previous;
  if (const int error = move_aside(directory_.get(), name); error != 0)
    return failed("move aside", name, error);
  return {};
}

}  // namespace axisd::store
