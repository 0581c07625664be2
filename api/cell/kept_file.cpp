#include "api/cell/kept_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <system_error>

#include "api/cell/kept.pb.h"
#include "api/program/whole_file.hpp"

namespace axisd::cell {
namespace {

/// FNV-1a: against a torn or rotten file, not against people.
std::uint64_t checksum_of(std::string_view text) {
  std::uint64_t hash = 0xCBF29CE484222325U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  return hash;
}

std::unexpected<Error> system_error(const std::string& path, std::string_view what, int code) {
  Error error{.reason = Reason::storage,
              .message = fmt::format("{}: cannot {}: {}", path, what, std::generic_category().message(code)),
              .remedy = "check the disk, and who owns the folder"};
  error.where.native_code = static_cast<std::uint32_t>(code);
  return fail(std::move(error));
}

}  // namespace

Result<std::optional<std::string>> read_kept(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    if (errno == ENOENT) return std::optional<std::string>();
    return system_error(path, "be read", errno);
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
  const int error = program::write_whole_file(path, kept.SerializeAsString(), 0600);
  if (error != 0) return system_error(path, "be written", error);
  return {};
}

}  // namespace axisd::cell
