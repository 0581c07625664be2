// Heads of HTTP answers. Pure.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/web/gateway/grpc_web.hpp"

namespace axisd::web {

using Header = std::pair<std::string_view, std::string>;

/// An answer whose body is known.
struct Answer {
  int status = 200;
  std::string_view type{};  ///< empty: there is no body
  std::string body{};
  std::vector<Header> headers{};
};

/// What every answer says to a browser: nothing is to be guessed, stored or shown within another page.
/// `length`: nothing: the body comes in chunks.
[[nodiscard]] std::string head_of(int status, std::string_view type, std::optional<std::size_t> length,
                                  const std::vector<Header>& headers, bool keep_alive);
[[nodiscard]] std::string to_bytes(const Answer& answer, bool keep_alive, bool with_body = true);

/// One line for people.
[[nodiscard]] Answer plain(int status, std::string text);
/// A call that was refused before it was one: the status of gRPC in the head, as a client of gRPC-Web reads
/// it.
[[nodiscard]] Answer refused_call(int status, const CallStatus& why);
/// The same of a call that is well-formed: as if the daemon had refused it.
[[nodiscard]] Answer failed_call(const CallStatus& why);
[[nodiscard]] Answer json(int status, std::string body);

/// A chunk of a body that comes in chunks. Precondition: not empty, which would be its end.
[[nodiscard]] std::string chunk(std::string_view bytes);
inline constexpr std::string_view last_chunk = "0\r\n\r\n";

}  // namespace axisd::web
