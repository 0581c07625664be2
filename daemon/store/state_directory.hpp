// The files behind the persistent state.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "buses/error.hpp"
#include "buses/file_descriptor.hpp"
#include "daemon/store/state_text.hpp"

namespace axisd::store {

/// A directory that one process at a time uses. `state.v1` is the newest generation and is never absent once
/// it was written; `state.v1.previous` is the one before. Thread: one at a time.
class StateDirectory {
 public:
  /// Creates the directory if need be and locks it. Errors: storage (cannot be created, is used by another
  /// daemon).
  static Result<StateDirectory> open(const std::filesystem::path& path);

  struct Loaded {
    std::optional<Generation> generation;  ///< empty: nothing was ever saved here
    std::optional<Error> damage;           ///< the newest was unusable, and `generation` is the one before
  };
  /// Errors: storage (unreadable, of a newer format, or no usable generation left: says what to do).
  [[nodiscard]] Result<Loaded> load() const;

  /// Returns when `text` is durable as the newest generation. After an error either version may be on the
  /// disk.
  Result<void> save(std::string_view text);

  /// Moves a damaged newest file aside (`state.v1.damaged`), so that it does not become the previous
  /// generation.
  Result<void> set_aside();

 private:
  StateDirectory(std::filesystem::path path, FileDescriptor directory)
      : path_(std::move(path)), directory_(std::move(directory)) {}
  [[nodiscard]] Result<std::optional<std::string>> read(const char* name) const;
  [[nodiscard]] Result<void> write(const char* name, std::string_view text) const;
  [[nodiscard]] std::unexpected<Error> failed(std::string_view what, std::string_view name, int error) const;

  std::filesystem::path path_;
  FileDescriptor directory_;
};

}  // namespace axisd::store
