// The files behind the persistent state.
#pragma once

#include <filesystem>
#include <string_view>
#include <utility>

#include "buses/error.hpp"
#include "buses/file_descriptor.hpp"
#include "daemon/store/found_file.hpp"
#include "devices/kept_state.hpp"

namespace axisd::store {

/// A directory that one process at a time uses. `state.v1` is the newest generation and is never absent once
/// it was written; `state.v1.previous` is the one before. Thread: one at a time.
class StateDirectory {
 public:
  /// Creates the directory if need be and locks it. Errors: storage (cannot be created, is used by another
  /// daemon).
  static Result<StateDirectory> open(const std::filesystem::path& path);

  /// `state.v1` and `state.v1.previous` as they are.
  struct Found {
    FoundFile newest{}, previous{};
  };
  /// Errors: storage (unreadable: says what to do).
  [[nodiscard]] Result<Found> find() const;

  /// Returns when `text` is durable as the newest generation. After an error either version may be on the
  /// disk.
  Result<void> save(std::string_view text);

  /// Moves a file that cannot be used aside (`state.v1.damaged`, `state.v1.previous.damaged`), so that it
  /// does not become the previous generation, and somebody can look at it. Not of the journal.
  Result<void> set_aside(KeptFile file);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  StateDirectory(std::filesystem::path path, FileDescriptor directory)
      : path_(std::move(path)), directory_(std::move(directory)) {}
  [[nodiscard]] Result<void> write(const char* name, std::string_view text) const;
  [[nodiscard]] std::unexpected<Error> failed(std::string_view what, std::string_view name, int error) const;

  std::filesystem::path path_;
  FileDescriptor directory_;
};

}  // namespace axisd::store
