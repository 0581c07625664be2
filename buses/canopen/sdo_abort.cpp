#include "buses/canopen/sdo_abort.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace axisd::canopen {

namespace {

using enum Reason;

constexpr std::string_view repeat =
    "repeat the request; if it comes again, look for other masters on the network";
constexpr std::string_view firmware =
    "the drive's SDO server does not follow CiA 301: check its firmware version";
constexpr std::string_view model = "check the configured model against the object dictionary of the drive";
constexpr std::string_view mapping = "map other objects, or fewer";
constexpr std::string_view size = "write the object with the size that the drive reports when it is read";
constexpr std::string_view range = "choose a value within the range of the drive's manual";
constexpr std::string_view state =
    "bring the drive into a state in which it takes this (stopped, disabled, no alarm)";
constexpr std::string_view memory = "free memory in the drive or power-cycle it";

// Sorted by code.
constexpr auto meanings = std::to_array<AbortMeaning>({
    {0x05030000, refused, "the toggle bit did not alternate", repeat},
    {0x05040000, refused, "the drive's SDO protocol timed out", repeat},
    {0x05040001, not_supported, "unknown SDO command", firmware},
    {0x05040002, not_supported, "invalid block size", firmware},
    {0x05040003, refused, "invalid sequence number", firmware},
    {0x05040004, refused, "checksum error", repeat},
    {0x05040005, refused, "out of memory", memory},
    {0x06010000, not_supported, "unsupported access to the object", model},
    {0x06010001, not_supported, "the object is write-only", "do not read it"},
    {0x06010002, not_supported, "the object is read-only", "do not write it"},
    {0x06020000, not_supported, "the object does not exist", model},
    {0x06040041, not_supported, "the object cannot be mapped to a PDO", mapping},
    {0x06040042, invalid_argument, "the mapped objects exceed the length of a PDO", mapping},
    {0x06040043, invalid_argument, "incompatible parameters", model},
    {0x06040047, refused, "internal incompatibility of the drive", firmware},
    {0x06060000, fault, "access failed by a hardware error",
     "power-cycle the drive; if it stays, replace it"},
    {0x06070010, invalid_argument, "the size of the data does not match the object", size},
    {0x06070012, invalid_argument, "the data is too long for the object", size},
    {0x06070013, invalid_argument, "the data is too short for the object", size},
    {0x06090011, not_supported, "the sub-index does not exist", model},
    {0x06090030, out_of_range, "invalid value", range},
    {0x06090031, out_of_range, "the value is too high", range},
    {0x06090032, out_of_range, "the value is too low", range},
    {0x06090036, out_of_range, "the maximum is below the minimum", range},
    {0x060A0023, refused, "a resource is not available", state},
    {0x08000000, refused, "general error", "look at the drive's alarm and state"},
    {0x08000020, refused, "the data cannot be stored or transferred", state},
    {0x08000021, refused, "refused because of local control", "release the drive's local control"},
    {0x08000022, refused, "refused in the present state of the drive", state},
    {0x08000023, refused, "the object dictionary is not there", "power-cycle the drive"},
    {0x08000024, refused, "no data available", state},
});
static_assert(std::ranges::is_sorted(meanings, {}, &AbortMeaning::code));

constexpr AbortMeaning unlisted{0, refused, "refused with a code of the drive's own",
                                "look the code up in the drive's manual"};

bool one_of(const Error& error, std::initializer_list<std::uint32_t> codes) {
  return error.outcome == Outcome::refused && error.where.native_code &&
         std::ranges::find(codes, *error.where.native_code) != codes.end();
}

}  // namespace

const AbortMeaning& abort_meaning(std::uint32_t code) {
  const auto found = std::ranges::lower_bound(meanings, code, {}, &AbortMeaning::code);
  return found != meanings.end() && found->code == code ? *found : unlisted;
}

Error abort_error(Object object, std::uint32_t code) {
  const auto& meaning = abort_meaning(code);
  Error error{.reason = meaning.reason,
              .message = fmt::format("{} (SDO abort {:08X}h)", meaning.text, code),
              .remedy = std::string(meaning.remedy),
              .outcome = Outcome::refused};
  error.where.object = object.key();
  error.where.native_code = code;
  return error;
}

bool is_missing(const Error& error) { return one_of(error, {0x06020000, 0x06090011}); }
bool is_read_only(const Error& error) { return one_of(error, {0x06010000, 0x06010002}); }
bool is_wrong_size(const Error& error) { return one_of(error, {0x06070010, 0x06070012, 0x06070013}); }

}  // namespace axisd::canopen
