// Notices that files were replaced.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace axisd::tls {

/// Looks at what the file system says of files: another file of that name, another size, another time.
/// Thread: one at a time.
class FileWatch {
 public:
  /// Of a file that does not exist it waits for one that does.
  explicit FileWatch(std::vector<std::string> paths) : paths_(std::move(paths)) {}

  /// True, once: they are not what they were at the last time that it was true, and have not changed since
  /// the last look, so that whoever replaces several is likely to be done. To be asked again and again; first
  /// true at the second look.
  [[nodiscard]] bool settled();

 private:
  using Signature = std::vector<std::array<std::int64_t, 7>>;
  [[nodiscard]] Signature look() const;

  std::vector<std::string> paths_;
  Signature last_, told_;
};

}  // namespace axisd::tls
