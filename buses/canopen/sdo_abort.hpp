// What SDO abort codes mean and what to do about them (CiA 301 7.2.4.3.17, table 22).
#pragma once

#include <cstdint>
#include <string_view>

#include "buses/canopen/object.hpp"
#include "buses/error.hpp"

namespace axisd::canopen {

struct AbortMeaning {
  std::uint32_t code = 0;
  Reason reason = Reason::refused;
  std::string_view text;
  std::string_view remedy;
};
/// Codes that are not in the table are `refused`, with their own number in the error.
const AbortMeaning& abort_meaning(std::uint32_t code);

/// The error of a request that the node ended by an abort; it was not executed.
Error abort_error(Object object, std::uint32_t code);

/// The node has no such object or sub-index (06020000h, 06090011h).
bool is_missing(const Error& error);
/// The object cannot be written: read-only or constant (06010000h, 06010002h).
bool is_read_only(const Error& error);
/// The data has another size than the object (06070010h, 06070012h, 06070013h).
bool is_wrong_size(const Error& error);

}  // namespace axisd::canopen
