// Reads a file of the state directory as it is found, whatever somebody has put in its place.
#pragma once

#include <cstddef>
#include <string>

namespace axisd::store {

struct FoundFile {
  enum class Kind {
    absent,
    regular,
    other,       ///< `what` tells: it was not opened for reading
    unreadable,  ///< `what` tells, `error` is the errno
  };
  Kind kind = Kind::absent;
  std::string text{};  ///< of a regular one; one byte more than `most` where it is longer
  std::string what{};
  int error = 0;
  [[nodiscard]] bool regular() const { return kind == Kind::regular; }
};

/// Never follows a link, never waits for the other end of a FIFO, reads no more than `most` bytes and one.
FoundFile find_file(int directory, const char* name, std::size_t most);

/// A new file of this name; whatever had it is removed. Below 0: errno says why not (a directory has it).
int create_anew(int directory, const char* name, int flags);

/// The name under which what has this one can be kept: "NAME.damaged", or "NAME.damaged.2" and so on where a
/// directory that is not empty has that. What was kept under it before is removed. Empty: nothing has `name`.
std::string name_aside(int directory, const std::string& name);

/// Gives what has this name that of name_aside(). 0, or an errno; that there is nothing is no error.
int move_aside(int directory, const std::string& name);

}  // namespace axisd::store
