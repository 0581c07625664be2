#include "buses/canopen/sdo_frames.hpp"

#include <algorithm>

namespace axisd::canopen {

namespace {

// Command specifiers, bits 7..5 (CiA 301 figures 26 to 33): of the client and of the server.
constexpr unsigned ccs_download_segment = 0, ccs_download = 1, ccs_upload = 2, ccs_upload_segment = 3;
constexpr unsigned scs_upload_segment = 0, scs_download_segment = 1, scs_upload = 2, scs_download = 3;
constexpr unsigned cs_abort = 4;
constexpr unsigned expedited_bit = 0x02, size_bit = 0x01, toggle_bit = 0x10, last_bit = 0x01;
constexpr std::size_t expedited_capacity = 4, segment_capacity = 7;

SdoData with_object(unsigned command, Object object) {
  return {static_cast<std::uint8_t>(command), static_cast<std::uint8_t>(object.index),
          static_cast<std::uint8_t>(object.index >> 8U), object.sub};
}

void put_number(SdoData& data, std::uint32_t value) {
  for (unsigned i = 0; i < 4; ++i) data[4 + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

Bytes copied(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

SdoReply upload_reply(Object object, unsigned command, std::span<const std::uint8_t> data) {
  const bool sized = (command & size_bit) != 0;
  if ((command & expedited_bit) != 0) {
    const std::size_t unused = sized ? command >> 2U & 3U : 0;
    return ExpeditedUpload{object, copied(data.first(expedited_capacity - unused)), sized};
  }
  return SegmentedUpload{object,
                         sized ? std::optional(static_cast<std::uint32_t>(number_of(data))) : std::nullopt};
}

}  // namespace

SdoData upload_request(Object object) { return with_object(ccs_upload << 5U, object); }

SdoData expedited_download_request(Object object, std::span<const std::uint8_t> bytes, bool indicate_size) {
  unsigned command = ccs_download << 5U | expedited_bit;
  if (indicate_size) command |= size_bit | static_cast<unsigned>(expedited_capacity - bytes.size()) << 2U;
  auto data = with_object(command, object);
  std::ranges::copy(bytes.first(std::min(bytes.size(), expedited_capacity)), data.begin() + 4);
  return data;
}

SdoData segmented_download_request(Object object, std::optional<std::uint32_t> total_size) {
  auto data = with_object(ccs_download << 5U | (total_size ? size_bit : 0U), object);
  put_number(data, total_size.value_or(0));
  return data;
}

SdoData upload_segment_request(bool toggle) {
  return {static_cast<std::uint8_t>(ccs_upload_segment << 5U | (toggle ? toggle_bit : 0U))};
}

SdoData download_segment_request(bool toggle, std::span<const std::uint8_t> bytes, bool last) {
  const auto used = std::min(bytes.size(), segment_capacity);
  SdoData data{static_cast<std::uint8_t>(ccs_download_segment << 5U | (toggle ? toggle_bit : 0U) |
                                         static_cast<unsigned>(segment_capacity - used) << 1U |
                                         (last ? last_bit : 0U))};
  std::ranges::copy(bytes.first(used), data.begin() + 1);
  return data;
}

SdoData abort_frame(Object object, std::uint32_t code) {
  auto data = with_object(cs_abort << 5U, object);
  put_number(data, code);
  return data;
}

SdoReply parse_sdo_reply(const can::Frame& frame) {
  if (frame.rtr || frame.size != frame.data.size()) return NotAReply{};
  const std::span<const std::uint8_t> data = frame.data;
  const unsigned command = data[0];
  const bool toggle = (command & toggle_bit) != 0;
  const Object object{.index = static_cast<std::uint16_t>(number_of(data.subspan(1, 2))), .sub = data[3]};
  switch (command >> 5U) {
    case scs_upload_segment:
      return UploadSegment{toggle, copied(data.subspan(1, segment_capacity - (command >> 1U & 7U))),
                           (command & last_bit) != 0};
    case scs_download_segment:
      return DownloadSegmentAccepted{toggle};
    case scs_upload:
      return upload_reply(object, command, data.subspan(4));
    case scs_download:
      return DownloadAccepted{object};
    case cs_abort:
      return Aborted{object, static_cast<std::uint32_t>(number_of(data.subspan(4)))};
    default:
      return NotAReply{};
  }
}

}  // namespace axisd::canopen
