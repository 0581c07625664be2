#include "api/cell/kept_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <system_error>

#include "api/cell/kept.pb.h"
#include "buses/file_descriptor.hpp"

namespace axisd::cell {
namespace {

/// FNV-1a: against a torn or rotten file, not against people.
std::uint64_t checksum_of(std::string_view text) {
  std::uint64_t hash = 0xCBF29CE484222325U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  return hash;
}

std::unexpected<Error> system_error(const std::string& path, std::string_view what) {
  const auto code = errno;
  Error error{.reason = Reason::storage,
              .message = fmt::format("{}: cannot {}: {}", path, what, std::generic_category().message(code)),
              .remedy = "check the disk, and who owns the folder"};
  error.where.native_code = static_cast<std::uint32_t>(code);
  return fail(std::move(error));
}

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const auto written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

Result<std::optional<std::string>> read_kept(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    if (errno == ENOENT) return std::optional<std::string>();
    return system_error(path, "be read");
  }
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  kept::KeptFile kept;
  if (!bytes.empty() && kept.ParseFromString(bytes) && kept.checksum() == checksum_of(kept.content()))
    return std::optional(kept.content());
  const auto aside = path + ".damaged";
  (void)std::rename(path.c_str(), aside.c_str());
  return fail(Reason::storage, fmt::format("{} is damaged", path),
              fmt::format("it was put aside as {}; check the disk", aside));
}

Result<void> write_kept(const std::string& path, const std::string& content) {
  kept::KeptFile kept;
  kept.set_content(content);
  kept.set_checksum(checksum_of(content));
  const auto fresh = path + ".new";
  {
    const FileDescriptor file(::open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    if (file.get() < 0) return system_error(fresh, "be made");
    if (!write_all(file.get(), kept.SerializeAsString()) || ::fsync(file.get()) != 0)
      return system_error(fresh, "be written");
  }
  if (std::rename(fresh.c_str(), path.c_str()) != 0) return system_error(path, "be replaced");
  const FileDescriptor folder(
      ::open(path.substr(0, path.rfind('/')).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0 || ::fsync(folder.get()) != 0) return system_error(path, "be made durable");
  return {};
}

}  // namespace axisd::cell
