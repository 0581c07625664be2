// The audit's files, as a disk may give them back: what is shown of them, and where a daemon goes on.
#include "daemon/store/audit_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "daemon/store/record_files.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

constexpr std::uint64_t any = std::uint64_t{1} << 40U;

/// A folder in memory, of this process.
const std::filesystem::path& folder() {
  struct Folder {
    std::filesystem::path path = "/dev/shm/axisd-fuzz-" + std::to_string(getpid());
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder made;
  return made.path;
}

void put(const std::filesystem::path& path, std::string_view bytes) {
  const FileDescriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, S_IRUSR | S_IWUSR));
  expect(::write(file.get(), bytes.data(), bytes.size()) == std::ssize(bytes), "there is a disk");
}

std::uint64_t lines_of(std::string_view bytes) {
  return static_cast<std::uint64_t>(std::ranges::count(bytes, '\n'));
}

}  // namespace

void run(Input input) {
  const auto after = input.byte() % 8U;
  const auto most = input.byte() % 16U;
  const auto first = text(input.take(input.byte()));
  const auto second = text(input.rest());
  const auto begin = 1 + lines_of(first);
  const auto older = folder() / fmt::format("audit-{:012}.jsonl", 1),
             newer = folder() / fmt::format("audit-{:012}.jsonl", begin);
  if (begin > 1) put(older, first);
  put(newer, second);

  std::size_t shown = 0;
  const auto seen =
      store::look_at_audit(folder(), after, any, WallTime::min(), most, [&](std::string_view line) {
        ++shown;
        expect(line.find('\n') == std::string_view::npos, "a line is one line");
        return true;
      });
  expect(seen.has_value() && shown <= most, "so many are shown at most");
  expect(seen->cursor >= after || seen->cursor == any, "a cursor does not go back");

  store::AuditFiles files(folder(), {});
  expect(files.open().has_value(), "whatever is in it, it is gone on with");
  expect(files.newest() == begin - 1 + lines_of(second), "whole lines count");
  expect(files.append("{}\n", 1).has_value(), "one more");
  std::uint64_t kept = 0;
  (void)files.show_newest(any, [&](std::string_view) { ++kept; });
  expect(kept == begin + lines_of(second), "what was written in part is gone, and all else is there");
  ::unlink(newer.c_str());
  if (begin > 1) ::unlink(older.c_str());

  FlightRecord record;
  store::describe(second, record);
}

}  // namespace axisd::fuzz
