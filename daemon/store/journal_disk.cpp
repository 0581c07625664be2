#include "daemon/store/journal_disk.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <set>
#include <system_error>
#include <utility>

#include "daemon/store/disk.hpp"

namespace axisd::store {
namespace {

constexpr auto newest = "journal.v1";
constexpr auto unfinished = "journal.v1.new";
constexpr auto mark_name = "journal-mark.v1";
constexpr std::size_t largest_mark = 256;
/// Many times what any journal comes to (id_files.hpp); anything longer is not ours.
constexpr std::size_t largest_journal = std::size_t{256} << 20U;

constexpr std::string_view ids_prefix = "journal-ids-", ids_suffix = ".v1";

std::string ids_name(std::uint32_t file) { return fmt::format("{}{}{}", ids_prefix, file, ids_suffix); }

class FileDisk final : public JournalDisk {
 public:
  FileDisk(std::filesystem::path path, FileDescriptor directory)
      : path_(std::move(path)), directory_(std::move(directory)) {}

  Result<FoundFile> read() override {
    auto found = find_file(directory_.get(), newest, largest_journal);
    if (found.kind == FoundFile::Kind::unreadable) return failed("read", newest, found.error);
    return found;
  }

  Result<void> append(std::string_view text) override {
    const auto before = lseek(file_.get(), 0, SEEK_END);
    const int error = write_all(file_.get(), text);
    if (error == 0) return {};
    // Half a line would be taken for damage. Should this fail, too, it is.
    if (before >= 0) (void)!ftruncate(file_.get(), before);
    return failed("write", newest, error);
  }

  Result<void> sync() override {
    if (fdatasync(file_.get()) != 0) return failed("write", newest, errno);
    return {};
  }

  Result<void> replace(std::string_view text) override {
    const int at = directory_.get();
    FileDescriptor file(create_anew(at, unfinished, O_APPEND));
    if (file.get() < 0) return failed("create", unfinished, errno);
    if (const int error = write_all(file.get(), text); error != 0) return failed("write", unfinished, error);
    if (fsync(file.get()) != 0) return failed("write", unfinished, errno);
    if (renameat(at, unfinished, at, newest) != 0) return failed("replace", newest, errno);
    if (fsync(at) != 0) return failed("write", ".", errno);
    file_ = std::move(file);
    return {};
  }

  Result<void> keep_damaged() override {
    const int at = directory_.get();
    const auto aside = name_aside(at, newest);
    // At no moment there is no journal, unless a directory has its name: that has no second one.
    if (aside.empty() || linkat(at, newest, at, aside.c_str(), 0) == 0) return {};
    if (const int error = move_aside(at, newest); error != 0) return failed("keep", newest, error);
    return {};
  }

  Result<FoundFile> read_mark() override {
    auto found = find_file(directory_.get(), mark_name, largest_mark);
    if (found.kind == FoundFile::Kind::unreadable) return failed("read", mark_name, found.error);
    return found;
  }

  Result<void> mark(std::string_view text) override {
    if (mark_.get() < 0) mark_ = FileDescriptor(create_anew(directory_.get(), mark_name, 0));
    if (mark_.get() < 0) return failed("create", mark_name, errno);
    if (pwrite(mark_.get(), text.data(), text.size(), 0) != std::ssize(text))
      return failed("write", mark_name, errno);
    return {};
  }

  Result<void> append_ids(std::uint32_t number, std::uint64_t offset, std::string_view bytes) override {
    const auto name = ids_name(number);
    const int at = directory_.get();
    const FileDescriptor file(offset == 0
                                  ? create_anew(at, name.c_str(), 0)
                                  : openat(at, name.c_str(), O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (file.get() < 0) return failed("create", name, errno);
    const auto begin = static_cast<off_t>(offset);
    if (ftruncate(file.get(), begin) != 0 || lseek(file.get(), begin, SEEK_SET) != begin)
      return failed("write", name, errno);
    if (const int error = write_all(file.get(), bytes); error != 0) return failed("write", name, error);
    if (fdatasync(file.get()) != 0) return failed("write", name, errno);
    // Of a new one the name has to be durable, too.
    if (offset == 0 && fsync(at) != 0) return failed("write", ".", errno);
    return {};
  }

  Result<std::string> read_ids(std::uint32_t number, std::uint64_t most) override {
    const auto name = ids_name(number);
    auto found = find_file(directory_.get(), name.c_str(), most);
    if (found.kind == FoundFile::Kind::unreadable) return failed("read", name, found.error);
    found.text.resize(std::min<std::uint64_t>(found.text.size(), most));
    return std::move(found.text);
  }

  void keep_ids(const std::vector<std::uint32_t>& files) override {
    std::set<std::string> names;
    for (const auto file : files) names.insert(ids_name(file));
    std::error_code error;
    for (std::filesystem::directory_iterator entry(path_, error), end; !error && entry != end;
         entry.increment(error)) {
      const auto name = entry->path().filename().string();
      if (name.starts_with(ids_prefix) && name.ends_with(ids_suffix) && !names.contains(name))
        unlinkat(directory_.get(), name.c_str(), 0);
    }
  }

 private:
  [[nodiscard]] std::unexpected<Error> failed(std::string_view what, std::string_view name, int error) const {
    return disk_failed(what, path_ / name, error);
  }

  std::filesystem::path path_;
  FileDescriptor directory_, file_, mark_;
};

}  // namespace

Result<std::unique_ptr<JournalDisk>> open_journal_disk(const std::filesystem::path& directory) {
  FileDescriptor opened(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.get() < 0)
    return fail(Reason::storage,
                fmt::format("cannot use state directory {}: {}", directory.string(),
                            std::generic_category().message(errno)),
                "create it for the daemon's user, or name another one with --state-directory");
  return std::make_unique<FileDisk>(directory, std::move(opened));
}

}  // namespace axisd::store
