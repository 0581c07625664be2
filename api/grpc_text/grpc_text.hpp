// What gRPC writes into header fields, for those who speak it without gRPC's library. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "buses/clock.hpp"

namespace axisd::grpc_text {

/// "grpc-timeout": 1 to 8 digits and one of H M S m u n. Hours: a year of them at most, as more would not
/// fit. Nothing: it is none.
[[nodiscard]] std::optional<Duration> timeout_of(std::string_view text);

/// As grpc-message has it: printable ASCII without '%'; every other byte is %XX.
[[nodiscard]] std::string percent_encoded(std::string_view text);

}  // namespace axisd::grpc_text
