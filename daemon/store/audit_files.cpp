#include "daemon/store/audit_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "daemon/store/disk.hpp"

namespace axisd::store {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view prefix = "audit-", suffix = ".jsonl";
/// A record is far shorter.
constexpr std::size_t longest_line = std::size_t{1} << 20U;

std::string name_of(std::uint64_t first) { return fmt::format("{}{:012}{}", prefix, first, suffix); }

std::optional<std::uint64_t> first_of(std::string_view name) {
  if (!name.starts_with(prefix) || !name.ends_with(suffix)) return std::nullopt;
  const auto digits = name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
  std::uint64_t first = 0;
  const auto* end = digits.data() + digits.size();
  const auto [at, error] = std::from_chars(digits.data(), end, first);
  if (error != std::errc() || at != end || first == 0 || name != name_of(first)) return std::nullopt;
  return first;
}

/// Numbers of the first lines, ascending.
Result<std::vector<std::uint64_t>> find_files(const fs::path& directory) {
  std::vector<std::uint64_t> firsts;
  std::error_code error;
  if (!fs::exists(directory, error)) return firsts;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error))
    if (const auto first = first_of(entry->path().filename().string())) firsts.push_back(*first);
  if (error) return disk_failed("read", directory, error.value());
  std::ranges::sort(firsts);
  return firsts;
}

/// Never through a link, never waiting for a FIFO.
FileDescriptor open_regular(const fs::path& path, int flags) {
  FileDescriptor file(::open(path.c_str(), flags | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  struct stat is{};
  if (file.get() < 0 || fstat(file.get(), &is) != 0) return {};
  if (S_ISREG(is.st_mode)) return file;
  errno = EINVAL;
  return {};
}

WallTime written_at(int file) {
  struct stat is{};
  if (fstat(file, &is) != 0) return WallTime::max();
  return WallTime(std::chrono::duration_cast<WallTime::duration>(
      std::chrono::seconds(is.st_mtim.tv_sec) + std::chrono::nanoseconds(is.st_mtim.tv_nsec)));
}

/// What a file holds, line by line.
struct Lines {
  std::uint64_t whole = 0;  ///< lines, with their ends
  std::uint64_t bytes = 0;  ///< of these
};

/// Shows whole lines without their ends until `visit` returns false. Errors: an errno.
std::expected<Lines, int> for_each_line(int file, const std::function<bool(std::string_view)>& visit) {
  Lines lines;
  std::string text;
  std::array<char, 65536> chunk{};
  while (text.size() <= longest_line) {
    const auto got = ::read(file, chunk.data(), chunk.size());
    if (got == 0) break;
    if (got < 0) {
      if (errno == EINTR) continue;
      return std::unexpected(errno);
    }
    text.append(chunk.data(), static_cast<std::size_t>(got));
    std::size_t begin = 0;
    for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n', begin)) {
      ++lines.whole;
      lines.bytes += end + 1 - begin;
      if (!visit(std::string_view(text).substr(begin, end - begin))) return lines;
      begin = end + 1;
    }
    text.erase(0, begin);
  }
  return lines;
}

/// Shows records of after a cursor, and moves it.
struct Shower {
  AuditSeen seen;
  std::size_t most;
  const AuditAccess::Visit* visit;
  bool enough = false;

  /// Precondition: numbers rise. False: no more of its file is wanted.
  bool take(std::uint64_t number, std::string_view line) {
    if (number > seen.newest) return false;
    if (number <= seen.cursor) return true;
    if (most == 0 || enough) return false;
    --most;
    seen.cursor = number;
    enough = !(*visit)(line) || most == 0;
    return !enough;
  }
};

}  // namespace

AuditFiles::AuditFiles(fs::path directory, AuditBounds bounds)
    : directory_(std::move(directory)), bounds_(bounds) {}

Result<void> AuditFiles::open() {
  std::error_code error;
  fs::create_directories(directory_, error);
  if (error) return disk_failed("create", directory_, error.value());
  folder_ = FileDescriptor(::open(directory_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder_.get() < 0) return disk_failed("open", directory_, errno);
  auto found = find_files(directory_);
  if (!found) return fail(found.error());
  firsts_ = *std::move(found);
  if (firsts_.empty()) return {};
  return use_newest(firsts_.back());
}

/// Goes on where an earlier run of the daemon ended.
Result<void> AuditFiles::use_newest(std::uint64_t first) {
  const auto path = directory_ / name_of(first);
  auto file = open_regular(path, O_RDWR | O_APPEND);
  if (file.get() < 0) return disk_failed("open", path, errno);
  const auto lines = for_each_line(file.get(), [](std::string_view) { return true; });
  if (!lines) return disk_failed("read", path, lines.error());
  if (ftruncate(file.get(), static_cast<off_t>(lines->bytes)) != 0) return disk_failed("write", path, errno);
  file_ = std::move(file);
  size_ = lines->bytes;
  newest_ = first - 1 + lines->whole;
  return {};
}

Result<void> AuditFiles::append(std::string_view lines, std::uint64_t count) {
  if (file_.get() < 0 || size_ >= bounds_.file_bytes)
    if (auto begun = begin_file(); !begun) return begun;
  if (const int error = write_all(file_.get(), lines); error != 0) {
    // Half a line is nobody's record. Should this fail, too, the lines go into another file.
    if (ftruncate(file_.get(), static_cast<off_t>(size_)) != 0) file_ = {};
    return disk_failed("write", directory_ / name_of(firsts_.back()), error);
  }
  size_ += lines.size();
  newest_ += count;
  return {};
}

Result<void> AuditFiles::begin_file() {
  if (file_.get() >= 0)
    if (auto synced = sync(); !synced) return synced;
  const auto first = newest_ + 1;
  const auto path = directory_ / name_of(first);
  // One of this number holds nothing that counts.
  FileDescriptor file(openat(folder_.get(), name_of(first).c_str(),
                             O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC,
                             S_IRUSR | S_IWUSR | S_IRGRP));
  if (file.get() < 0) return disk_failed("create", path, errno);
  if (fsync(folder_.get()) != 0) return disk_failed("write", directory_, errno);
  file_ = std::move(file);
  size_ = 0;
  if (firsts_.empty() || firsts_.back() != first) firsts_.push_back(first);
  remove_oldest();
  return {};
}

void AuditFiles::remove_oldest() {
  while (firsts_.size() > bounds_.files) {
    unlinkat(folder_.get(), name_of(firsts_.front()).c_str(), 0);
    firsts_.erase(firsts_.begin());
  }
}

Result<void> AuditFiles::sync() {
  if (file_.get() < 0 || fdatasync(file_.get()) == 0) return {};
  return disk_failed("write", directory_ / name_of(firsts_.back()), errno);
}

Result<void> AuditFiles::show_newest(std::uint64_t bytes,
                                     const std::function<void(std::string_view line)>& visit) const {
  auto begin = firsts_.end();
  for (std::uint64_t seen = 0; begin != firsts_.begin() && seen < bytes;) {
    std::error_code error;  // what cannot be read is told below
    const auto size = fs::file_size(directory_ / name_of(*--begin), error);
    seen += error ? 0 : size;
  }
  for (auto first = begin; first != firsts_.end(); ++first) {
    const auto path = directory_ / name_of(*first);
    const auto file = open_regular(path, O_RDONLY);
    if (file.get() < 0) return disk_failed("open", path, errno);
    const auto shown = for_each_line(file.get(), [&visit](std::string_view line) {
      visit(line);
      return true;
    });
    if (!shown) return disk_failed("read", path, shown.error());
  }
  return {};
}

Result<AuditSeen> look_at_audit(const fs::path& directory, std::uint64_t after, std::uint64_t newest,
                                WallTime since, std::size_t most, const AuditAccess::Visit& visit) {
  const auto found = find_files(directory);
  if (!found) return fail(found.error());
  Shower shower{.seen = {.cursor = std::min(after, newest),
                         .newest = newest,
                         .oldest = found->empty() ? 0 : found->front()},
                .most = most,
                .visit = &visit};
  auto& seen = shower.seen;
  for (auto first = found->begin(); first != found->end() && !shower.enough; ++first) {
    const auto next = std::next(first);
    if (next != found->end() && *next <= seen.cursor + 1) continue;
    if (*first > newest || seen.cursor >= newest) break;
    const auto path = directory / name_of(*first);
    const auto file = open_regular(path, O_RDONLY);
    if (file.get() < 0) {
      if (errno == ENOENT) continue;  // it was the oldest
      return disk_failed("open", path, errno);
    }
    if (next != found->end() && written_at(file.get()) < since) {
      seen.cursor = *next - 1;
      continue;
    }
    auto number = *first - 1;
    const auto end = next == found->end() ? std::numeric_limits<std::uint64_t>::max() : *next;
    const auto shown = for_each_line(
        file.get(), [&](std::string_view line) { return ++number < end && shower.take(number, line); });
    if (!shown) return disk_failed("read", path, shown.error());
  }
  return seen;
}

}  // namespace axisd::store
