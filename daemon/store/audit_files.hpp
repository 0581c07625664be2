// The files of the audit: lines, numbered, in files of a bounded size, of which the oldest go.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "buses/file_descriptor.hpp"
#include "devices/audit.hpp"

namespace axisd::store {

struct AuditBounds {
  std::size_t files = 16;                ///< at most so many, 2 or more
  std::uint64_t file_bytes = 8U << 20U;  ///< a file that has come to that is followed by another one
};

/// `audit-N.jsonl` in a directory: N is the number of the first line, the others count on. Lines are appended
/// and never changed. Thread: one at a time.
class AuditFiles {
 public:
  /// Touches nothing yet.
  AuditFiles(std::filesystem::path directory, AuditBounds bounds);

  /// Finds what is there, and cuts off a last line that was never written whole. Until it has been successful
  /// nothing else may be called. Errors: storage.
  [[nodiscard]] Result<void> open();

  /// Number of the last line; 0: there is none.
  [[nodiscard]] std::uint64_t newest() const { return newest_; }

  /// Appends `count` whole lines, all or none: they survive the end of the daemon. Errors: storage.
  [[nodiscard]] Result<void> append(std::string_view lines, std::uint64_t count);
  /// Makes durable what was appended. Errors: storage.
  [[nodiscard]] Result<void> sync();

  /// Shows the lines of the newest files, the oldest first: of so many that `bytes` of them are among these,
  /// if there are.
  [[nodiscard]] Result<void> show_newest(std::uint64_t bytes,
                                         const std::function<void(std::string_view line)>& visit) const;

 private:
  [[nodiscard]] Result<void> use_newest(std::uint64_t first);
  [[nodiscard]] Result<void> begin_file();
  void remove_oldest();

  std::filesystem::path directory_;
  AuditBounds bounds_;
  FileDescriptor folder_, file_;
  std::vector<std::uint64_t> firsts_;  ///< of the files, ascending
  std::uint64_t newest_ = 0;
  std::uint64_t size_ = 0;  ///< of the newest file, bytes
};

/// Shows `visit` whole lines behind number `after`, up to `newest`, the oldest first, at most `most` of them,
/// until it returns false. Files that were last written before `since` are left out. What another thread
/// removes meanwhile is left out, too. Errors: storage.
[[nodiscard]] Result<AuditSeen> look_at_audit(const std::filesystem::path& directory, std::uint64_t after,
                                              std::uint64_t newest, WallTime since, std::size_t most,
                                              const AuditAccess::Visit& visit);

}  // namespace axisd::store
