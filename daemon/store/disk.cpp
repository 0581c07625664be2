#include "daemon/store/disk.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <system_error>

namespace axisd::store {

std::unexpected<Error> disk_failed(std::string_view what, const std::filesystem::path& path, int error) {
  // EFBIG: of a limit for files, which is a full disk to whoever has it.
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  return fail({.reason = Reason::storage,
               .message = fmt::format("cannot {} {}: {}", what, path.string(),
                                      std::generic_category().message(error)),
               .remedy = full ? "free space on the disk" : "check the disk and the directory's permissions",
               .where = {.native_code = static_cast<std::uint32_t>(error)}});
}

int write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const auto put = ::write(file, text.data(), text.size());
    if (put >= 0)
      text.remove_prefix(static_cast<std::size_t>(put));
    else if (errno != EINTR)
      return errno;
  }
  return 0;
}

}  // namespace axisd::store
