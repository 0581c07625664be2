// What a request's head must say before anything is done for it. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace axisd::web {

/// "localhost", "127.0.0.1" or "[::1]", with any port or none.
[[nodiscard]] bool is_loopback_host(std::string_view host);
/// Whether a page of this gateway sent it: the origin's scheme and host are those that the request came to.
[[nodiscard]] bool is_same_origin(std::string_view origin, std::string_view host, bool tls);
/// The value of one cookie in a Cookie header. Nothing: it is not there, or there twice.
[[nodiscard]] std::optional<std::string_view> cookie_of(std::string_view header, std::string_view name);
/// Whether a list as of Accept-Encoding has this word, not with q=0.
[[nodiscard]] bool accepts(std::string_view list, std::string_view word);
/// In double quotes, as JSON has it. Precondition: UTF-8.
[[nodiscard]] std::string json_text(std::string_view text);

}  // namespace axisd::web
