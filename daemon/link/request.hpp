// What axisd-link is asked, and by its own file allowed, to do. Pure but for read_links().
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "buses/error.hpp"

namespace axisd::link {

enum class Verb : std::uint8_t {
  check,  ///< would you? Changes nothing.
  cycle,  ///< down and up
};

struct Request {
  Verb verb = Verb::check;
  std::string interface;
};

/// "cycle can0" or "check can0", without the line's end. Error: something else.
Result<Request> parse_request(std::string_view line);

/// Names of interfaces, one per line; "#" begins a comment. Error: a word that cannot be such a name.
Result<std::vector<std::string>> parse_links(std::string_view text);
/// The same from a file. Errors: it cannot be read; somebody else than root or this process's own user could
/// have written it.
Result<std::vector<std::string>> read_links(const std::string& path);

/// Error: the interface is not among `links`, which are those of the file `path`.
Result<void> permitted(const std::string& interface, const std::vector<std::string>& links,
                       const std::string& path);

}  // namespace axisd::link
