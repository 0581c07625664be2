// How much of a request is taken.
#pragma once

#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstdint>

namespace axisd::web {

inline constexpr std::uint32_t most_header_bytes = 16 * 1024;

using RequestParser = boost::beast::http::request_parser<boost::beast::http::string_body>;

/// `most_body`: bytes. Before the first byte of a request.
inline void limit_request(RequestParser& parser, std::uint64_t most_body) {
  parser.header_limit(most_header_bytes);
  parser.body_limit(most_body);
}

}  // namespace axisd::web
